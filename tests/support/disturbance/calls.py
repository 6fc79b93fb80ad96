"""Every command of `flexura`: a small call of it, what it makes, and what it needs.

A test holds that no command is missing here.
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .inputs import CALLED, LAW, MADE, VARY, cut_off
from .programs import Ended, Program

TUNE = ["tune", "rig", "rig-step", "--controller", "rig", "--rig", "rig", "--jobs", "1"]
TUNE += ["--free", "kp_1_V_m=100:10000", "--population", "4", "--generations", "2"]
STUDY = ["study", "payload", "type-1-rr", "type-1-bang-bang", "--values", "0:0.2:3", "--jobs", "1"]
INVERT = ["invert", "single-r", "--angle", "0", "0.2", "--duration", "0.3", "--step", "0.01"]


@dataclass(frozen=True)
class Command:
    """A call of `flexura`.

    Attributes:
        arguments: after `flexura`.
        out: what it makes, below the working folder; empty: it keeps nothing.
        needs: its inputs, by name (disturbance/inputs.py).
        own: which of them it changes, so that it gets a copy.
        force: whether it can replace what is there.
        resumes: the same call goes on with what was kept.
        other: arguments that change every number of the result.
        firmware: it takes a built firmware.
        dear: it takes seconds, and is disturbed in the long tier alone.
    """

    arguments: list[Any]
    out: str = ""
    needs: tuple[str, ...] = ()
    own: tuple[str, ...] = ()
    force: bool = True
    resumes: bool = False
    other: tuple[str, ...] = ()
    firmware: bool = False
    dear: bool = False

    def call(self, firmware: Path | None = None) -> list[Any]:
        return [*self.arguments, *(("--firmware", firmware) if self.firmware else ())]


def export(run: str, to: str) -> Command:
    """A run or a population in another program's format."""
    out = f"out.{to}"
    return Command(["export", run, "--to", to, "--out", out], out, (run,))


FINER = ("--rtol", "1e-4")
COMMANDS = {
    "simulate": Command(["simulate", *LAW, "--out", "out"], "out", other=FINER),
    "simulate --vary": Command([*VARY, "--out", "out"], "out", force=False, resumes=True),
    "inverse": Command(["inverse", *LAW, "--out", "out"], "out"),
    "invert": Command([*INVERT, "--out", "out"], "out"),
    "frequencies": Command(["frequencies", "rig"]),
    "crosscheck": Command(["crosscheck", *LAW, "--out", "out"], "out", other=FINER),
    "study": Command([*STUDY, "--out", "out"], "out", other=FINER),
    "study measured": Command(
        ["study", "measured", "--data", "measured", "--out", "out"], "out", ("measured",), dear=True
    ),
    "tune": Command([*TUNE, "--out", "out"], "out", force=False, resumes=True),
    "identify": Command(["identify", "e", "--out", "out.toml"], "out.toml", ("e",), dear=True),
    "vibration": Command(["vibration", "v", "--out", "out"], "out", ("v",)),
    "compare": Command(["compare", "a", "b", "--out", "out"], "out", ("a", "b"), dear=True),
    "review": Command(["review", "a", "--save", "out.rrd"], "out.rrd", ("a",)),
    "plot": Command(["plot", "a", "--out", "out.png"], "out.png", ("a",)),
    "animate": Command(["animate", "a", "--out", "out.gif"], "out.gif", ("a",)),
    "import": Command(["import", "log.csv", "--out", "out"], "out", ("log.csv",)),
    **{f"export {to}": export("a", to) for to in ("csv", "mat", "tdms", "mcap", "parquet")},
    "export population": export("p", "csv"),
    "migrate": Command(
        ["migrate", "out.toml", "second.toml"], "out.toml", own=("out.toml", "second.toml")
    ),
    "new": Command(["new", "out.toml"], "out.toml"),
    "robots": Command(["robots"]),
    "doctor": Command(["doctor"]),
    "bench step": Command(
        ["bench", "step", "--duration-s", "0.9", "--emulated", "--out", "out"],
        "out",
        force=False,
        firmware=True,
    ),
    "bench calibrate": Command(
        ["bench", "calibrate", "--emulated", "--out", "out", "--tips-mm=-20,-12,-4,4,12,20"],
        "out",
        force=False,
        firmware=True,
    ),
    "bench recover": Command(["bench", "recover", "r"], "r", own=("r",)),
}

# Of the words of a command, why it is not among these.
LEFT_OUT = {
    **{
        ("bench", name): "an experiment as `bench step`, by the same function from files to table"
        for name in ("forward", "inverse", "free-vibration", "excite")
    },
    ("demo",): "simulate, crosscheck, bench and review, one after the other, into one draft",
    ("learn",): "minutes of trials, each an experiment as `bench` makes it and keeps it",
    ("flash",): "keeps nothing but PlatformIO's own build, and what is in the board",
}


class Place:
    """A working folder with inputs; each is made when the first command needs it."""

    def __init__(self, program: Program, folder: Path, firmware: Path | None = None) -> None:
        self.program, self.folder, self._firmware = program, folder, firmware
        self.kept = folder / "kept"
        self.kept.mkdir(parents=True)

    @property
    def firmware(self) -> Path:
        """The emulated board's program, built when it is first needed."""
        if self._firmware is None:
            from boards import elf

            self._firmware = elf()
        return self._firmware

    def _input(self, name: str) -> Path:
        path = self.kept / name
        if path.exists():
            return path
        if name in MADE:
            MADE[name](path)
            return path
        call = CALLED[name]
        if call[0] == "bench":
            call = [*call, "--firmware", self.firmware]
        ended = self.program.run(call, self.kept)
        assert ended.status == 0, ended.err
        if name == "r":
            cut_off(path)
        return path

    def fresh(self, command: Command | None = None) -> Path:
        """A working folder with the inputs of a command alone."""
        work = self.folder / "work"
        shutil.rmtree(work, ignore_errors=True)
        work.mkdir()
        for name in command.needs if command else ():
            (work / name).symlink_to(self._input(name))
        for name in command.own if command else ():
            kept = self._input(name)
            (shutil.copytree if kept.is_dir() else shutil.copyfile)(kept, work / name)
        return work

    def run(self, command: Command, work: Path, *more: str, **disturbance: Any) -> Ended:
        """Run a command in a working folder."""
        firmware = self.firmware if command.firmware else None
        return self.program.run([*command.call(firmware), *more], work, **disturbance)


def files(folder: Path) -> dict[str, bytes]:
    """The files below a folder, those behind links left out."""
    return {
        str(p.relative_to(folder)): p.read_bytes()
        for p in sorted(folder.rglob("*"))
        if p.is_file() and not p.is_symlink()
    }
