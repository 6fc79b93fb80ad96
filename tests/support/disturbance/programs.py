"""Commands that are disturbed: the shim, the process that forks them, and what came of each."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[2]
PATHS = [ROOT / "model", ROOT / "analysis"]


@dataclass(frozen=True)
class Ended:
    """How a command ended; `operations`: how many of the disturbed kind there were; `disturbed`:
    whether one failed; `sent`: whether it got the signal; `cpu_s`: its processor time."""

    status: int
    out: str
    err: str
    seconds: float
    operations: int
    disturbed: bool
    sent: bool
    cpu_s: float


@cache
def shim(folder: Path) -> Path:
    """The library that makes operations fail, compiled into a folder."""
    made = folder / "shim.so"
    command = ["c++", "-std=c++17", "-O1", "-fPIC", "-shared", "-fno-builtin"]
    subprocess.run([*command, "-o", str(made), str(HERE / "shim.cpp"), "-ldl"], check=True)
    return made


class Program:
    """The command in forked children; `folder` keeps what it needs for itself."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        self._start()

    def _start(self) -> None:
        folder = self.folder
        surroundings = os.environ | {
            "LD_PRELOAD": str(shim(folder)),
            "PYTHONPATH": os.pathsep.join(map(str, PATHS)),
            "MPLCONFIGDIR": str(folder / "matplotlib"),
            "OPENBLAS_NUM_THREADS": "1",
            "COLUMNS": "160",
            "PYTHONFAULTHANDLER": "1",
        }
        self.process = subprocess.Popen(
            [sys.executable, str(HERE / "server.py")],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=surroundings,
            start_new_session=True,
        )
        assert self.process.stdout is not None
        assert self.process.stdout.readline() == "ready\n"

    def __enter__(self) -> Program:
        return self

    def __exit__(self, *_: object) -> None:
        self._stop()

    def _stop(self) -> None:
        """End it; a command that still runs is ended too."""
        assert self.process.stdin is not None
        self.process.stdin.close()
        try:
            self.process.wait(5)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()

    def run(self, arguments: list[Any], cwd: Path, **disturbance: Any) -> Ended:
        """Run the command in a folder.

        Args:
            arguments: after `flexura`.
            cwd: the working folder; operations on files below it are disturbed.
            disturbance: `kind` ("write", "sync", "rename", "create") and `n`: the n-th fails;
                `log`: a file for all operations; `kind` "allocation" or "array", `n`, `library`,
                `bytes`; `memory`: bytes of address space above what there is; `signal`, `after_s`.
        """
        files = {name: str(self.folder / name) for name in ("out", "err", "counts")}
        Path(files["counts"]).unlink(missing_ok=True)
        asked = {"arguments": list(map(str, arguments)), "cwd": str(cwd.resolve())}
        assert self.process.stdin is not None and self.process.stdout is not None
        try:
            print(json.dumps(asked | files | disturbance), file=self.process.stdin, flush=True)
            done = json.loads(self.process.stdout.readline())
        except BaseException:  # its answer would be taken for that of the next command
            self._stop()
            self._start()
            raise
        out, err = (Path(files[name]).read_text(errors="replace") for name in ("out", "err"))
        counts = Path(files["counts"])
        many, fired = json.loads(counts.read_text() or "[0, 0]") if counts.exists() else (0, 0)
        seen = (done["s"], many, bool(fired), done["sent"], done["cpu_s"])
        return Ended(done["status"], out, err, *seen)
