"""A process that has imported the command, and runs it in forked children that are disturbed.

One line of JSON in, one out; see `programs.Program`.
"""

from __future__ import annotations

import ctypes
import importlib
import json
import os
import resource
import signal
import subprocess
import sys
import time
import traceback
from functools import cache
from typing import Any

import typer

SIGNALS = {signal.SIGINT, signal.SIGTERM}
KINDS = {"write": 1, "sync": 2, "rename": 3, "create": 4, "allocation": 5, "array": 6}
LIGHT = ("simulate", "new")  # commands of the quick tests
HEAVY = ("matplotlib.backends.backend_agg", "matplotlib.backends.backend_svg")
HEAVY += ("matplotlib.pyplot", "rerun", "pymoo.algorithms.soo.nonconvex.ga", "scipy.io", "PIL")


def main() -> None:
    shim = ctypes.CDLL(None)
    cli = importlib.import_module("flexlab.cli.app")
    importlib.import_module("flexlab.cli.simulate")
    importlib.import_module("pyarrow.parquet")
    print("ready", flush=True)
    light = True
    for line in sys.stdin:
        asked = json.loads(line)
        if light and asked["arguments"][0] not in LIGHT:
            light = False
            group = typer.main.get_command(cli.app)
            for name in HEAVY:
                importlib.import_module(name)
            for name in cli.COMMANDS:
                group.get_command(None, name)
        spared = iterator_buffers() if asked.get("kind") == "array" else (0, 0)
        # a command gets no signal before it begins
        signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
        child = os.fork()
        if child:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
        else:
            _run(cli, shim, asked, spared)
        print(json.dumps(_watched(child, asked)), flush=True)


@cache
def iterator_buffers() -> tuple[int, int]:
    """Place and size of NumPy's function that takes the buffers of iterators: where one is refused,
    NumPy 2.4 raises MemoryError without the interpreter's lock, and the process ends."""
    library = importlib.import_module("numpy._core._multiarray_umath").__file__
    assert library is not None
    listed = subprocess.run(["nm", "-S", library], capture_output=True, text=True, check=True)
    rows = [row.split() for row in listed.stdout.splitlines() if "npyiter_allocate_buffers" in row]
    return int(rows[0][0], 16), int(rows[0][1], 16)


def _watched(child: int, asked: dict[str, Any]) -> dict[str, Any]:
    """Wait for the child; send it a signal at the time that is asked for, stop it at the limit."""
    began = time.monotonic()
    sent = False
    while True:
        done, status, used = os.wait4(child, os.WNOHANG)
        if done:
            break
        now = time.monotonic() - began
        if asked.get("signal") and not sent and now >= asked["after_s"]:
            os.kill(child, asked["signal"])
            sent = True
        if now > asked.get("limit_s", 300):
            os.kill(child, signal.SIGKILL)
        time.sleep(0.002)
    return {
        "status": os.waitstatus_to_exitcode(status),
        "s": time.monotonic() - began,
        "cpu_s": used.ru_utime + used.ru_stime,
        "sent": sent,
    }


def _run(cli: Any, shim: Any, asked: dict[str, Any], spared: tuple[int, int]) -> None:
    """The command, in the child, which ends with its status."""
    os.chdir(asked["cwd"])
    for handle, name in ((1, "out"), (2, "err")):
        file = os.open(asked[name], os.O_CREAT | os.O_WRONLY | os.O_TRUNC, 0o644)
        os.dup2(file, handle)
        os.close(file)
    null = os.open(os.devnull, os.O_RDONLY)
    os.dup2(null, 0)
    sys.stdin = open(0)
    status = 1
    try:
        sys.argv = ["flexura", *asked["arguments"]]
        kind, n = KINDS.get(asked.get("kind", ""), 0), asked.get("n", 0)
        if kind in (5, 6):
            sizes = map(ctypes.c_size_t, (asked.get("bytes", 0), *spared))
            assert shim.disturb_memory(asked["library"].encode(), kind, ctypes.c_long(n), *sizes)
        else:
            log = asked.get("log", "").encode()
            shim.disturb_files(asked["cwd"].encode(), kind, ctypes.c_long(n), log)
        if "memory" in asked:
            used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
            resource.setrlimit(resource.RLIMIT_AS, (used + asked["memory"],) * 2)
        try:
            if signal.sigpending() & SIGNALS:
                print("interrupted before it began", file=sys.stderr)
                sys.exit(130)
            signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
            cli.main()
            status = 0
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:  # what Python itself would print
        traceback.print_exc()
    finally:
        try:
            sys.stdout.flush()
            sys.stderr.flush()
        finally:
            shim.disturb_files.argtypes = None
            with open(asked["counts"], "w") as stream:
                json.dump([shim.operations(), shim.disturbed()], stream)
            os._exit(status)


if __name__ == "__main__":
    main()
