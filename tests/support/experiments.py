"""Experiments for the tests: on the emulated board in this process, and by the command in another,
over a pseudo-terminal."""

from __future__ import annotations

import subprocess
import threading
import time
from collections.abc import Callable
from contextlib import contextmanager
from pathlib import Path

from boards import BENCH, configured, elf
from flexlab import rig
from flexlab.board.emulator.emulated import EmulatedBoard
from flexlab.board.pty import Pty
from flexlab.experiment import run_experiment as steps
from flexlab.experiment.plan import Plan
from flexlab.experiment.run_experiment import ExperimentResult, Hooks, OpenBoard, conduct
from flexlab.recordings.strip_sensor import sensor_of
from flexlab.rig.plant.rigid_plant import RigidPlant
from processes import command_line, environment

SETTINGS = rig.configuration(BENCH)


def board() -> EmulatedBoard:
    """A board with the rig's settings stored, and the bench's drives behind its wires."""
    made = EmulatedBoard(elf(), RigidPlant(BENCH))
    made.simulator.write_eeprom(0, configured("debian", ()))
    return made


def experiment(
    plan: Plan, folder: Path, watch: Hooks | None = None, opened: OpenBoard | None = None
) -> ExperimentResult:
    """One experiment in this process."""
    opened = opened or OpenBoard(board(), 0, {}, None)
    try:
        return conduct(BENCH, plan, opened, folder, sensor_of(BENCH), watch or Hooks())
    finally:
        opened.board.close()


class Line:
    """An emulated board behind a pseudo-terminal, at the wall clock's pace, in a thread of its
    own."""

    def __init__(self) -> None:
        self.board = board()
        self.pty = Pty(self.board)
        self.device = self.pty.device
        self._over = threading.Event()
        self._todo: list[Callable[[], None]] = []
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self.failure: BaseException | None = None

    def __enter__(self) -> Line:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.unplug()
        self.board.close()
        assert self.failure is None

    def _serve(self) -> None:
        try:
            self.pty.serve(self._look)
        except OSError as error:
            self.failure = error

    def _look(self) -> bool:
        while self._todo:
            self._todo.pop()()
        return self._over.is_set()

    def do(self, act: Callable[[], None]) -> None:
        """Have something done between two windows of the board's time."""
        done = threading.Event()
        self._todo.append(lambda: (act(), done.set())[0])
        assert done.wait(20)

    def unplug(self) -> None:
        """The line is gone; the board goes no further."""
        if not self._over.is_set():
            self._over.set()
            self._thread.join(20)
            self.pty.__exit__()

    @property
    def driven(self) -> bool:
        window = self.board.simulator.window
        return any(window.motor_on) or window.stepper_on != 0

    def wait(self, condition: Callable[[], bool], seconds: float = 30.0) -> None:
        end = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < end, "not in time"
            time.sleep(0.01)


def command(*arguments: object, cwd: Path, **more: object) -> subprocess.Popen[str]:
    """`flexura bench ...` as a process."""
    line = command_line("bench", *arguments)
    pipe, surroundings = subprocess.PIPE, {"stdin": subprocess.DEVNULL} | more
    return subprocess.Popen(
        line, cwd=cwd, env=environment(160), stdout=pipe, stderr=pipe, text=True, **surroundings
    )


@contextmanager
def running(line: Line, *arguments: object, cwd: Path, **more: object):
    """The command on a line, once the motors are on; killed at the end if it is still there."""
    process = command(
        *arguments, "--port", line.device, "--yes", "--countdown-s", 0, cwd=cwd, **more
    )
    try:
        line.wait(lambda: line.driven or process.poll() is not None)
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate(timeout=20)


__all__ = ["BENCH", "SETTINGS", "Line", "board", "command", "experiment", "running", "steps"]
