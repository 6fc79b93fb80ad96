"""Processor load of the firmware, measured on the emulated board.

Both joints follow a fast trajectory: 20 000 encoder edges and 4000 steps a second at its peak,
set-points stream in, telemetry goes out. Times are exact in cycles of the simulated processor;
simavr takes each instruction's cycles from the data sheet. Tests hold the load to its limits.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from flexura.signals import Signal, harmonic

from ...board.commissioning import commission
from ...board.emulator.emulated import EmulatedBoard
from ...board.emulator.simulator import CLOCK_HZ
from ...board.protocol.declaration import CONTROL_HZ
from ...board.protocol.player import Knots, Player, setpoints
from ...board.protocol.session import Link
from ...rig import RigSetup, configuration
from ...rig.board_axes import board_axes
from ...rig.plant.plant import rig_plant
from ...rig.plant.rigid_plant import RigidPlant

FLASH_BYTES, RAM_BYTES, RAM_BEGIN, RAM_END = 256 * 1024, 8192, 0x200, 0x2200
CONTROL_VECTOR = 47  # TIMER5_COMPA
PAINT = 0xA5
IDLE_S = 1.0
HARD = {  # settings for the fast trajectory: 16 000 + 4000 edges/s, 4000 steps/s at the peaks
    "motor_counts_per_m": 128e3,
    "stepper_counts_per_rad": 4000 / 7.85,
    "position_max_2_rad": 3.0,
    "speed_max_1_m_s": 0.2,
    "speed_max_2_rad_s": 10.0,
    "rate_max_2_rad_s": 7.8539,
}
# of both controllers, both set-point filters and an observer, as small as they may be: what the
# processor can be asked at most
EVERY_TERM = {
    "kd_1_V_s_m": -0.5,
    "kf_1_V_m": 1.0,
    "kg_1_V_s_m": 0.05,
    "ki_2_1_s2": 1.0,
    "kd_2": -0.01,
    "kf_2_rad_s_m": 0.5,
    "kg_2_rad_m": 0.02,
    "feedback_2": 1.0,
    "observer_1_Hz": 10.0,
    "jo_1_V_s2_m": 0.01,
    "bo_1_V_s_m": 0.5,
    "setpoint_1_Hz": 100.0,
    "setpoint_2_Hz": 100.0,
}


@dataclass(frozen=True)
class Load:
    """The measured load; times in cycles of 1/16 us, memory in bytes."""

    seconds: float  # of emulated time, without the start
    period_least: int
    period_most: int  # of the control tick
    control_longest: int  # with what interrupted it
    control_own: int  # without
    control_mean: float
    interrupts_share: float  # of all cycles
    steps_most_per_s: float
    edges_most_per_s: float
    missed: int
    flash: int
    ram_static: int
    stack_most: int
    times_real_time: float  # emulated / processor time, plant and link included
    times_real_time_alone: (
        float  # the same of the simulator without plant and link, the firmware in Idle
    )

    @property
    def control_share(self) -> float:
        """The longest control interrupt as a fraction of its period."""
        return self.control_longest / (CLOCK_HZ / CONTROL_HZ)

    @property
    def ram_share(self) -> float:
        """Static memory and deepest stack as a fraction of the RAM."""
        return (self.ram_static + self.stack_most) / RAM_BYTES


def measure(elf: Path, setup: RigSetup, seconds: float = 2.0, every_term: bool = False) -> Load:
    """Run the fast trajectory on an emulated board that is configured for it.

    Args:
        elf: the firmware.
        setup: the rig.
        seconds: emulated time [s].
        every_term: whether every term of both controllers is on.
    """
    settings = configuration(setup) | HARD | (EVERY_TERM if every_term else {})
    board = EmulatedBoard(elf, RigidPlant(setup, settings=settings))
    simulator = board.simulator
    static = simulator.symbol("_end") - RAM_BEGIN
    for address in range(RAM_BEGIN + static, RAM_END):
        simulator.data[address] = PAINT
    link = _ready(board, settings)
    carriage, joint = (harmonic(way / 2, 1.0, math.pi, way / 2) for way in (0.0398, 2.498))
    player = Player(link, _setpoints((carriage, joint), seconds + 1.0, settings))
    player.start()
    before, begin, wall = simulator.interrupts(), simulator.cycle, time.process_time()
    simulator.trace(board.lines["busy"], True)
    player.run(seconds)
    wall = time.process_time() - wall
    span = simulator.cycle - begin
    after = simulator.interrupts()
    starts = [cycle for cycle, _, level in simulator.edges() if level]
    periods = [b - a for a, b in pairwise(starts)]
    table = link.telemetry()
    window = 25  # reports, some 50 ms
    took = (table["tick"][window:].astype(float) - table["tick"][:-window]) / CONTROL_HZ
    rates = [
        float((abs(table[name][window:].astype(float) - table[name][:-window]) / took).max())
        for name in ("position_1", "position_2", "steps")
    ]
    ticks = after[CONTROL_VECTOR][0] - before[CONTROL_VECTOR][0]
    link.stop()
    link.run(0.02)
    stack = RAM_END - next(
        a for a in range(RAM_BEGIN + static, RAM_END) if simulator.data[a] != PAINT
    )
    flash = simulator.symbol("__data_load_end")
    alone = _alone(board)
    board.close()
    return Load(
        span / CLOCK_HZ,
        min(periods),
        max(periods),
        after[CONTROL_VECTOR][2],
        after[CONTROL_VECTOR][3],
        (after[CONTROL_VECTOR][1] - before[CONTROL_VECTOR][1]) / ticks,
        (after[0][1] - before[0][1]) / span,
        rates[2],
        rates[0] + rates[1],
        int(table["missed"][-1]),
        flash,
        static,
        stack,
        span / CLOCK_HZ / wall,
        IDLE_S / alone,
    )


def experiment(elf: Path, setup: RigSetup, seconds: float = 4.0) -> tuple[float, float]:
    """Speed of an emulated experiment, and of the firmware alone.

    Both joints move back and forth as fast as in the dissertation's inverse experiment, with the
    rig's plant, streamed set-points and telemetry.

    Args:
        elf: the firmware.
        setup: the rig.
        seconds: emulated time [s].

    Returns:
        Emulated over processor time: of the experiment, and of the firmware alone in Idle.
    """
    settings, plant = configuration(setup), rig_plant(setup)
    board = EmulatedBoard(elf, plant)
    link = _ready(board, settings)
    carriage, joint = (
        harmonic(amplitude, 1.0, math.pi, amplitude) for amplitude in (0.012, math.pi / 6)
    )
    player = Player(link, _setpoints((carriage, joint), seconds + 1.0, settings))
    player.start()
    wall = time.process_time()
    player.run(seconds)
    wall = time.process_time() - wall
    link.stop()
    link.run(0.02)
    alone = _alone(board)
    board.close()
    return seconds / wall, IDLE_S / alone


def _setpoints(motions: Sequence[Signal], duration_s: float, settings: dict[str, float]) -> Knots:
    return setpoints(motions, duration_s, [axis.setpoints for axis in board_axes(settings)])


def _ready(board: EmulatedBoard, settings: dict[str, float]) -> Link:
    """A session with a board that is configured, has proven its stop and stands at zero."""
    link = Link(board)
    link.connect()
    link.write_configuration(settings)
    link.command("clear", fault=link.newest["fault"])
    commission(link)
    link.command("reference", position_1=0, position_2=0, steps=0)
    return link


def _alone(board: EmulatedBoard) -> float:
    """Processor time of the simulator without plant and link, for IDLE_S of the firmware."""
    simulator, begun = board.simulator, time.process_time()
    simulator.run(simulator.cycle + round(IDLE_S * CLOCK_HZ))
    return time.process_time() - begun
