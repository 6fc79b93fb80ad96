"""Emulated boards for the tests: the real firmware, built once for each compiler, with the bench's
drives behind its wires."""

from __future__ import annotations

import atexit
import functools
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

from flexlab import rig
from flexlab.board.base import BoardError
from flexlab.board.commissioning import commission
from flexlab.board.emulator.emulated import EmulatedBoard
from flexlab.board.emulator.simulator import CLOCK_HZ
from flexlab.board.protocol.declaration import Fault, State
from flexlab.board.protocol.player import Knots, Player, drives, setpoints
from flexlab.board.protocol.session import Link
from flexlab.experiment.flash import RIG, build
from flexlab.rig.board_axes import board_axes
from flexlab.rig.plant.rigid_plant import RigidPlant
from flexura.signals import harmonic

COMPILERS = ["debian", "7.3"]
TICK = CLOCK_HZ // 1000  # cycles
BENCH = rig.load(RIG)
PI = 3.141592653589793


@functools.cache
def elf(compiler: str = "debian") -> Path:
    """The firmware, built by PlatformIO; a copy with its .hex beside it, so that a later build does
    not take it away."""
    folder = Path(tempfile.mkdtemp(prefix="flexura-firmware-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    for built in build("--compiler", compiler).parent.glob("firmware.*"):
        shutil.copy(built, folder)
    return folder / "firmware.elf"


@functools.cache
def configured(compiler: str, settings: tuple[tuple[str, float], ...]) -> bytes:
    """The EEPROM of a board that was configured through its own commands, the rig's settings with
    some changed."""
    board = EmulatedBoard(elf(compiler), RigidPlant(BENCH))
    link = Link(board, sequence=7)
    link.connect()
    link.write_configuration(rig.configuration(BENCH) | dict(settings))
    link.command("clear", fault=Fault.bad_configuration)
    assert commission(link).may_move
    image = board.simulator.read_eeprom(0, 4096)
    finish(board)
    return image


def finish(board: EmulatedBoard) -> None:
    """The end of every emulated test: the simulator had nothing to complain about."""
    said = board.simulator.log()
    board.close()
    assert said == ""


class Rigged:
    """A configured board with its drives, its link open; use as a context manager, which ends by
    `finish`."""

    def __init__(
        self,
        compiler: str = "debian",
        blank: bool = False,
        eeprom: bytes = b"",
        trace: tuple[str, ...] = (),
        slice_cycles: int = 1000,
        **settings: float,
    ) -> None:
        self.settings = rig.configuration(BENCH) | settings
        self.plant = RigidPlant(BENCH, settings=self.settings)
        self.board = EmulatedBoard(elf(compiler), self.plant, slice_cycles=slice_cycles)
        if not blank:
            eeprom = configured(compiler, tuple(sorted(settings.items())))
        if eeprom:
            self.board.simulator.write_eeprom(0, eeprom)
        for name in trace:
            self.board.simulator.trace(self.board.lines[name], True)
        self.link = Link(self.board, sequence=100)
        self.player: Player | None = None

    def __enter__(self) -> Rigged:
        self.link.connect()
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        if kind is None:
            finish(self.board)
        else:
            self.board.close()

    # ---- motion

    def back_and_forth(
        self, travel_m: float = 0.02, turn_rad: float = 0.8, duration_s: float = 20.0
    ) -> Knots:
        """Both joints from rest at 0 and back, once a second."""
        carriage, joint = (harmonic(way / 2, 1.0, PI, way / 2) for way in (travel_m, turn_rad))
        scales = [axis.setpoints for axis in board_axes(self.settings)]
        return setpoints((carriage, joint), duration_s, scales)

    def open_loop(self, voltage: float, rate: float, duration_s: float = 20.0) -> Knots:
        steps = rate * self.settings["stepper_steps_per_rad"]
        return drives({"voltage": lambda t: voltage, "rate": lambda t: steps}, duration_s)

    def go(self, knots: Knots, seconds: float = 0.3) -> None:
        """Reference, arm, start, and move for so long."""
        self.link.command("reference", position_1=0, position_2=0, steps=0)
        self.player = Player(self.link, knots)
        self.player.start()
        self.run(seconds)

    def run(self, seconds: float) -> None:
        if self.player is None:
            self.link.run(seconds)
        else:
            self.player.run(seconds)

    # ---- what the outputs do

    @property
    def cycle(self) -> int:
        return self.board.simulator.cycle

    @property
    def driven(self) -> bool:
        """A driver is enabled."""
        window = self.board.simulator.window
        return any(window.motor_on) or window.stepper_on != 0

    @property
    def last_driven(self) -> int:
        """The last cycle at which a driver was enabled."""
        window = self.board.simulator.window
        return int(max(window.driven_cycle, window.step_cycle))

    @property
    def state(self) -> State:
        return State(self.link.newest["state"])

    @property
    def fault(self) -> Fault:
        return Fault(self.link.newest["fault"])

    def until(self, condition: Callable[[], bool], seconds: float, feed: bool = True) -> None:
        """Let time pass, the trajectory fed if asked, until the condition holds; fails after so
        many seconds."""
        end = self.board.now() + seconds
        while not condition():
            assert self.board.now() < end, (
                f"not within {seconds} s; state {self.state.name}, fault {self.fault.name}"
            )
            try:
                self.run(0.001) if feed else self.link.run(0.001)
            except BoardError:
                self.player = None  # the board takes no more of the trajectory
