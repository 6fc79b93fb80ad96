"""What can break on the rig, how the tests break it on the emulated board, and what is measured
then."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, field

import pytest

from boards import TICK, Rigged
from flexlab.board.emulator.emulated import Outputs, Sensors
from flexlab.board.protocol.declaration import Fault, Result, State
from flexlab.board.protocol.session import Refused

Act = Callable[["Rigged"], None]


def position(r: Rigged) -> None:
    r.go(r.back_and_forth())


def open_loop(voltage: float, rate: float) -> Act:
    return lambda r: r.go(r.open_loop(voltage, rate))


def nothing(r: Rigged) -> None:
    pass


@dataclass(frozen=True)
class Case:
    """`within_s` is the time that the fault's own definition allows from the cause to its detection
    (settings, distance and speed, readings in a row); one control tick more is allowed to the
    outputs."""

    fault: Fault
    what: str  # is broken, and how
    inject: Act
    within_s: float
    mend: Act = nothing
    begin: Act = position
    settings: dict[str, float] = field(default_factory=dict)
    persists: bool = False  # `clear` is refused until it is mended
    feed: bool = True  # the host goes on with its trajectory


def plant(**values: object) -> Act:
    def act(r: Rigged) -> None:
        for name, value in values.items():
            setattr(r.plant, name, value)

    return act


def at_zero(joint: int) -> Act:
    def act(r: Rigged) -> None:
        r.plant.positions[joint] = 0.0

    return act


def cut(*pins: str) -> Act:
    return lambda r: [r.board.cut(pin) for pin in pins] and None


def mend(*pins: str) -> Act:
    return lambda r: [r.board.mend(pin) for pin in pins] and None


def noise(edges_1_s: float) -> Act:
    """The motor's encoder sees so many edges a second, back and forth on the spot, besides its
    own."""

    def act(r: Rigged) -> None:
        advance, sign = r.plant.advance, 1

        def disturbed(seconds: float, outputs: Outputs) -> Sensors:
            nonlocal sign
            sensors, sign = advance(seconds, outputs), -sign
            sensors.encoder_1 += sign * edges_1_s * seconds / 2
            return sensors

        r.plant.advance = disturbed

    return act


def quiet(r: Rigged) -> None:
    del r.plant.advance


def slow_tick(r: Rigged) -> None:
    """The control interrupt takes three milliseconds: its controller becomes an endless loop (in
    simavr's flash) for so long."""
    simulator = r.board.simulator
    at = simulator.symbol(
        "_ZN7flexura5PidOfINS_12BoardNumbersEE6updateERKNS_7GainsOfIS1_EERKNS_9SignalsOfIS1_EE"
    )
    before = simulator.flash[at] | simulator.flash[at + 1] << 8
    simulator.patch(at, [0xCFFF])  # rjmp to itself
    r.board.wait(0.003)
    simulator.patch(at, [before])


def swap(number: int, swapped: bool = True) -> Act:
    return lambda r: r.board.wire_encoder(number, swapped)


def supply(volts: float) -> Act:
    return plant(supply_V=volts)


FAST = open_loop(12.0, 1.0)  # the carriage at the motor's full speed, 133 mm/s
WIDE = {"speed_max_1_m_s": 1.0}  # so that the speed itself is no fault
SLOW_TURN = open_loop(4.0, 1.0)

CASES = {
    "emergency stop": Case(
        Fault.emergency_stop,
        "emergency stop pressed at speed",
        plant(emergency_stop=True),
        0.001,
        plant(emergency_stop=False),
        persists=True,
    ),
    "emergency wire": Case(
        Fault.emergency_stop,
        "wire of the emergency stop cut",
        cut("emergency_stop"),
        0.001,
        mend("emergency_stop"),
        persists=True,
    ),
    "limit high": Case(
        Fault.limit_high,
        "high switch hit at full speed",
        plant(ends=(-0.05, 0.0)),
        0.001,
        plant(ends=(-0.05, 0.15)),
        FAST,
        WIDE,
        persists=True,
    ),
    "limit low": Case(
        Fault.limit_low,
        "low switch hit at full speed",
        plant(ends=(0.0, 0.15)),
        0.001,
        plant(ends=(-0.05, 0.15)),
        open_loop(-12.0, 1.0),
        WIDE | {"position_min_1_m": -1.0},
        persists=True,
    ),
    "travel 1": Case(
        Fault.travel_1,
        "carriage driven beyond its range, no switch there",
        plant(ends=(-9.0, 9.0)),
        1.2,
        at_zero(0),
        FAST,
        WIDE,
    ),
    "travel 2": Case(
        Fault.travel_2,
        "joint 2 driven beyond its range",
        nothing,
        2.0,
        at_zero(1),
        open_loop(0.0, 1.0),
    ),
    "speed 1": Case(
        Fault.speed_1,
        "motor at full voltage, faster than allowed",
        nothing,
        0.5,
        begin=lambda r: r.go(r.open_loop(12.0, 0.0), 0.01),
        settings={"speed_max_1_m_s": 0.1},
    ),
    "speed 2": Case(
        Fault.speed_2,
        "joint 2 faster than allowed",
        nothing,
        0.5,
        begin=lambda r: r.go(r.open_loop(0.0, 5.0), 0.01),
        settings={"speed_max_2_rad_s": 3.0},
    ),
    "blocked motor": Case(
        Fault.stall_1, "carriage held", plant(blocked={1}), 0.45, plant(blocked=set()), FAST, WIDE
    ),
    "unplugged encoder": Case(
        Fault.stall_1,
        "both wires of the motor's encoder cut",
        cut("encoder_1_a", "encoder_1_b"),
        0.45,
        mend("encoder_1_a", "encoder_1_b"),
        FAST,
        WIDE,
    ),
    "blocked joint": Case(
        Fault.stall_2,
        "joint 2 held: steps are lost",
        plant(blocked={2}),
        0.2,
        plant(blocked=set()),
        SLOW_TURN,
    ),
    "swapped encoder": Case(
        Fault.runaway_1,
        "A and B of the motor's encoder swapped",
        swap(1),
        0.2,
        swap(1, False),
        SLOW_TURN,
    ),
    "swapped coil": Case(
        Fault.runaway_2,
        "coil of the stepper swapped: it turns backwards",
        plant(joint_reversed=True),
        0.2,
        plant(joint_reversed=False),
        SLOW_TURN,
    ),
    "swapped encoder 2": Case(
        Fault.runaway_2,
        "A and B of joint 2's encoder swapped",
        swap(2),
        0.2,
        swap(2, False),
        SLOW_TURN,
    ),
    "cut A": Case(
        Fault.encoder_1,
        "wire A of the motor's encoder cut",
        cut("encoder_1_a"),
        0.1,
        mend("encoder_1_a"),
        FAST,
        WIDE,
    ),
    "cut B": Case(
        Fault.encoder_1,
        "wire B of the motor's encoder cut",
        cut("encoder_1_b"),
        0.1,
        mend("encoder_1_b"),
        FAST,
        WIDE,
    ),
    "cut A 2": Case(
        Fault.encoder_2,
        "wire A of joint 2's encoder cut",
        cut("encoder_2_a"),
        0.2,
        mend("encoder_2_a"),
        SLOW_TURN,
    ),
    "cut B 2": Case(
        Fault.encoder_2,
        "wire B of joint 2's encoder cut",
        cut("encoder_2_b"),
        0.2,
        mend("encoder_2_b"),
        SLOW_TURN,
    ),
    "noise 100": Case(
        Fault.encoder_1,
        "noise of 100 kHz on the motor's encoder",
        noise(100e3),
        0.004,
        quiet,
        SLOW_TURN,
    ),
    "noise 300": Case(
        Fault.encoder_1,
        "noise of 300 kHz on the motor's encoder",
        noise(300e3),
        0.004,
        quiet,
        SLOW_TURN,
    ),
    "following 1": Case(
        Fault.following_1,
        "supply of the motor sags to what the board still takes",
        supply(10.1),
        1.0,
        supply(12.0),
        lambda r: r.go(r.back_and_forth(0.03, 0.2), 0.02),
        {"following_max_1_m": 0.0005, "kp_1_V_m": 100.0, "ki_1_V_m_s": 0.0},
    ),
    "following 2": Case(
        Fault.following_2,
        "a trajectory faster than joint 2's rate limit",
        nothing,
        1.0,
        begin=lambda r: r.go(r.back_and_forth(0.0, 1.0), 0.02),
        settings={"rate_max_2_rad_s": 1.5},
    ),
    "flex open": Case(
        Fault.flex_low,
        "flex sensor's wire cut: ADC at 0",
        plant(flex_V=0.0),
        0.006,
        plant(flex_V=3.05),
        persists=True,
    ),
    "flex shorted": Case(
        Fault.flex_high,
        "flex sensor shorted: ADC at 5 V",
        plant(flex_V=5.0),
        0.006,
        plant(flex_V=3.05),
        persists=True,
    ),
    "underrun": Case(
        Fault.underrun,
        "host alive, but sends no more set-points",
        lambda r: setattr(r, "player", None),
        0.6,
        feed=False,
    ),
    "slow tick": Case(Fault.overrun, "control interrupt takes 3 ms", slow_tick, 0.0025),
    "supply low": Case(
        Fault.supply_low,
        "motor supply drops to 8 V",
        supply(8.0),
        0.01,
        supply(12.0),
        persists=True,
    ),
    "supply high": Case(
        Fault.supply_high,
        "motor supply rises to 16 V",
        supply(16.0),
        0.01,
        supply(12.0),
        persists=True,
    ),
}


@dataclass(frozen=True)
class Row:
    """What was measured [cycles]: outputs off after the cause, and after the start of the tick that
    detected it."""

    fault: Fault
    after_cause: int
    after_detection: int | None  # None: no control tick did


def begins(edges: list[tuple[int, int, int]]) -> list[int]:
    """Cycles at which control ticks began."""
    return [cycle for cycle, _, level in edges if level]


@functools.cache
def measure(name: str, compiler: str) -> Row:
    """Break it, see the outputs go off and the host told; then see that nothing but `clear` brings
    the board back."""
    case = CASES[name]
    with Rigged(compiler, trace=("busy",), **case.settings) as r:
        simulator = r.board.simulator
        case.begin(r)
        assert r.state is State.running and r.driven and r.fault is Fault.none
        caused = r.cycle
        case.inject(r)
        r.until(lambda: r.fault is not Fault.none, case.within_s + 0.1, case.feed)
        assert r.fault is case.fault, f"{r.fault.name} instead of {case.fault.name}"
        assert r.state is State.fault and not r.driven
        ticks = begins(simulator.edges())  # the trace began with the reset: its n-th edge is tick n
        detected = ticks[r.link.newest["fault_tick"] - 1]
        if case.fault is Fault.overrun:
            detected += TICK  # by the next one, when it comes while this one is still under way
        row = Row(case.fault, r.last_driven - caused, r.last_driven - detected)
        r.player = None
        only_by_hand(r, case)
        return row


def only_by_hand(r: Rigged, case: Case) -> None:
    """What was refused: to arm, to clear something else, to clear it while it lasts. After `clear`:
    Idle, outputs off."""
    off_since = r.last_driven
    for command, values in (
        ("arm", {"mode": 1}),
        ("clear", {"fault": 0}),
        ("clear", {"fault": case.fault % 25 + 1}),
    ):
        with pytest.raises(Refused):
            r.link.command(command, **values)
    if case.persists:
        with pytest.raises(Refused) as refused:
            r.link.command("clear", fault=case.fault)
        assert refused.value.result is Result.fault_persists
    case.mend(r)
    r.link.run(0.02)
    assert r.state is State.fault and r.fault is case.fault, (
        "the first reason stays until it is cleared"
    )
    r.link.command("clear", fault=case.fault)
    r.link.run(0.05)
    assert r.state is State.idle and r.fault is Fault.none
    assert not r.driven and r.last_driven == off_since
    r.link.command("reference", position_1=0, position_2=0, steps=0)
    r.link.command("arm", mode=1)
    r.link.run(0.01)
    assert r.state is State.armed and r.driven
    r.link.command("stop")
