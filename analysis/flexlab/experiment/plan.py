"""What an experiment asks of the rig: knots for the board, in words and numbers, and whether the
rig can do it.

Every plan begins with both joints at 0, where they are referenced.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx
from flexura import signals
from flexura.control import BOARD, load_gains
from flexura.errors import InputError
from flexura.io import read_toml

from ..board.protocol.declaration import CONFIG
from ..board.protocol.player import Knots, drives, setpoints
from ..rig import Bench, Check, examine
from ..rig.checks import STEP_RATE_MAX_1_S
from .lead_in import AT_REST, LEAD_S, led

PERIOD_LOG2 = 3  # knots are 8 ms apart
ALWAYS = (
    "motor current",
    "supply",
    "flex sensor at rest",
)  # checks of the bench, whatever it is to do
GAINS = tuple(name for name in CONFIG if name[:2] in ("kp", "ki", "kd", "kf", "kg", "kv", "kc")) + (
    "derivative_Hz",
    "deflection_Hz",
    "setpoint_1_Hz",
    "setpoint_2_Hz",
    "feedback_2",
)
# The law of a gains file that says nothing, as `flexura.Controller` has it.
LAW = dict.fromkeys(GAINS, 0.0) | {"derivative_Hz": 50.0, "deflection_Hz": 50.0}


@dataclass(frozen=True)
class Plan:
    """One experiment: `asked` is its description for the metadata, `settings` what the board must
    be configured to, `phases` what begins when."""

    experiment: str
    knots: Knots
    duration_s: float
    settings: dict[str, float]
    checks: list[Check]
    asked: dict[str, Any] = field(default_factory=dict)
    phases: list[dict[str, Any]] = field(default_factory=list)

    @property
    def failed(self) -> list[Check]:
        return [check for check in self.checks if not check.passed]


def gains(path: Path) -> dict[str, float]:
    """Controller settings by the firmware's names, from a TOML file. Raises InputError, naming
    file, key and value.

    A gains file of the model and of `flexura tune`, with a table [controller], is the whole law:
    what it doesn't name is off.
    """
    data, known = read_toml(path), GAINS
    if "controller" in data:
        data, known = LAW | load_gains(path).board(), BOARD
    for name, value in data.items():
        if name not in known:
            raise InputError(
                f"expected a setting of the controllers: {', '.join(GAINS)}",
                key=name,
                value=value,
                file=str(path),
            )
        item = CONFIG[name]
        if not signals.finite(value) or not item.least <= value <= item.greatest:
            expected = (
                f"expected a number between {item.least:g} and {item.greatest:g} ({item.text})"
            )
            raise InputError(expected, key=name, value=value, file=str(path))
    return {name: float(value) for name, value in data.items()}


def inverse(
    bench: Bench, settings: dict[str, float], manoeuvre: fx.Manoeuvre | None = None
) -> Plan:
    """The joint motions of a manoeuvre, tracked by the firmware's controllers, led into and out of
    where they are not at rest.

    Raises InputError unless both joints have a motion.
    """
    asked = manoeuvre or bench.manoeuvre
    motions = []
    for number, joint in enumerate(asked.drive.joints, 1):
        if joint.motion is None:
            raise InputError(
                "missing: expected a motion of every joint", key=f"joint[{number}].motion"
            )
        motions.append(joint.motion)
    lead_s = LEAD_S if max(abs(v) for motion in motions for v in motion(0.0)[:2]) > AT_REST else 0.0
    out_s = LEAD_S if any(abs(motion(asked.duration_s)[1]) > AT_REST for motion in motions) else 0.0
    one, two = (led(motion, asked.duration_s, lead_s, out_s) for motion in motions)
    whole = _following(asked.name, (one, two), lead_s + asked.duration_s + out_s)
    parts = (
        (0.0, "lead in", lead_s),
        (lead_s, "manoeuvre", True),
        (lead_s + asked.duration_s, "lead out", out_s),
    )
    phases = [{"t": t, "name": name} for t, name, there in parts if there]
    plan = _tracked("inverse", bench, settings, whole)
    return dataclasses.replace(
        plan, asked=asked.spec() | {"lead_s": lead_s, "out_s": out_s}, phases=phases
    )


def step(
    bench: Bench,
    settings: dict[str, float],
    step_1_m: float = 0.005,
    step_2_rad: float = 0.1,
    duration_s: float = 4.0,
    apart_s: float | None = None,
) -> Plan:
    """A step of each joint's set-point, the carriage's first, joint 2's `apart_s` (half the
    duration) later; each within one knot period."""
    if not duration_s > 0.8:
        raise InputError("expected more than 0.8 s", key="--duration_s", value=duration_s)
    apart_s = duration_s / 2 if apart_s is None else apart_s
    if not 0 <= apart_s < duration_s - 0.4:
        raise InputError(
            "expected 0 or more, and 0.4 s less than the duration", key="--apart-s", value=apart_s
        )
    first, second = 0.2, 0.2 + apart_s
    motions = signals.step(step_1_m, first), signals.step(step_2_rad, second)
    settings = settings | {  # a step is an error of its whole height, and no fault
        "following_max_1_m": max(settings["following_max_1_m"], 1.5 * abs(step_1_m)),
        "following_max_2_rad": max(settings["following_max_2_rad"], 1.5 * abs(step_2_rad)),
    }
    plan = _tracked(
        "step", bench, settings, _following("step of each set-point", motions, duration_s)
    )
    steps = [
        {"joint": 1, "at_s": first, "height": step_1_m},
        {"joint": 2, "at_s": second, "height": step_2_rad},
    ]
    able = [
        check for check in plan.checks if check.what in (*ALWAYS, "carriage range", "joint 2 range")
    ]  # its speed is no number
    return dataclasses.replace(plan, checks=able, asked=plan.asked | {"steps": steps})


def free_vibration(
    bench: Bench, settings: dict[str, float], turn_rad: float = 0.1, duration_s: float = 6.0
) -> Plan:
    """Joint 2 turns fast, stops and holds: the strip rings."""
    move_s, rise_s, rest_s = 0.18, 0.08, 0.1
    if not duration_s > 1.0:
        raise InputError("expected more than 1 s", key="--duration_s", value=duration_s)
    motions = signals.constant(0.0), signals.trapezoidal(turn_rad, move_s, rise_s, at_s=rest_s)
    plan = _tracked(
        "free-vibration", bench, settings, _following("move, stop, let ring", motions, duration_s)
    )
    return dataclasses.replace(plan, asked=plan.asked | {"rings_from_s": rest_s + move_s})


def forward(
    bench: Bench, settings: dict[str, float], profile: Path | dict[str, Any] | None = None
) -> Plan:
    """Voltage and pulse profiles, open loop: of a file or its tables, or ones that make the strip
    ring."""
    spec = (
        DEFAULT_PROFILE
        if profile is None
        else profile
        if isinstance(profile, dict)
        else read_toml(profile)
    )
    where = str(profile) if isinstance(profile, Path) else ""
    try:
        name, duration, (voltage, rate) = _profile(spec)
    except InputError as error:
        raise error.in_file(where) from None
    value = lambda s: lambda t: s(t)[0]
    knots = drives(value(voltage), value(rate), duration, settings, PERIOD_LOG2)
    return Plan(
        "forward",
        knots,
        duration,
        settings,
        _open_loop(bench, knots, settings),
        spec | {"name": name},
    )


DEFAULT_PROFILE: dict[str, Any] = {
    "name": "carriage forth and back three times, joint 2 in three strokes",
    "duration_s": 5.0,
    "voltage_V": {
        "kind": "harmonic",
        "amplitude": 5.0,
        "frequency_Hz": 0.6,
        "phase_rad": -math.pi / 2,
    },
    # Each change of speed makes the strip ring by some 10 mm at 5 Hz, which takes half of the
    # stepper's holding torque at most.
    "rate_rad_s": {
        "kind": "piecewise",
        "at_s": [0.0, 0.2, 0.5, 1.1, 1.7, 2.0],
        "value": [0.0, 0.8, -0.8, 0.8, -0.8, 0.0],
    },
}


def _profile(spec: dict[str, Any]) -> tuple[str, float, list[fx.Signal]]:
    for key, value in spec.items():
        if key not in DEFAULT_PROFILE:
            raise InputError(
                f"an unknown key; known here: {', '.join(DEFAULT_PROFILE)}", key=key, value=value
            )
    duration = spec.get("duration_s")
    if duration is None or not signals.finite(duration) or not 0 < duration <= 600:
        raise InputError(
            "expected a duration above 0 and at most 600 s", key="duration_s", value=duration
        )
    name = spec.get("name", "")
    if not isinstance(name, str):
        raise InputError("expected a text", key="name", value=name)
    zero = {"kind": "constant", "value": 0.0}
    return (
        name,
        float(duration),
        [signals.from_spec(spec.get(key, zero), key=key) for key in ("voltage_V", "rate_rad_s")],
    )


def _following(name: str, motions: tuple[fx.Signal, fx.Signal], duration_s: float) -> fx.Manoeuvre:
    return fx.Manoeuvre(
        name, duration_s, duration_s / 1000, fx.Drive.pd(motions, [0.0, 0.0], [0.0, 0.0])
    )


def _tracked(
    experiment: str, bench: Bench, settings: dict[str, float], asked: fx.Manoeuvre
) -> Plan:
    carriage, joint = (drive.motion for drive in asked.drive.joints)
    assert carriage is not None and joint is not None
    knots = setpoints(carriage, joint, asked.duration_s, settings, PERIOD_LOG2)
    return Plan(experiment, knots, asked.duration_s, settings, examine(bench, asked), asked.spec())


def _open_loop(bench: Bench, knots: Knots, settings: dict[str, float]) -> list[Check]:
    """The carriage goes nowhere farther than on the motor's line without load; joint 2 where its
    pulses say."""
    volts, steps = knots.columns["voltage"] / 1000, knots.columns["rate"]
    motor = bench.rig.motor
    free = bench.rig.screw.lead_m * motor.no_load_speed_rpm / 60 / motor.rated_voltage_V
    way = lambda speed: np.concatenate([[0.0], np.cumsum(speed) * knots.period_s])
    carriage, joint = way(free * volts), way(steps / settings["stepper_steps_per_rad"])
    most_V, most_steps = float(np.abs(volts).max()), float(np.abs(steps).max())
    most_m_s, most_rad_s = free * most_V, most_steps / settings["stepper_steps_per_rad"]
    about = [
        _least("motor voltage", most_V, settings["voltage_max_V"], 1.0, "V", "a lower voltage"),
        _least(
            "carriage speed",
            most_m_s,
            settings["speed_max_1_m_s"],
            1e3,
            "mm/s without load",
            "a lower voltage",
        ),
        _least(
            "joint 2 rate", most_rad_s, settings["rate_max_2_rad_s"], 1.0, "rad/s", "a lower rate"
        ),
        _least(
            "joint 2 speed", most_rad_s, settings["speed_max_2_rad_s"], 1.0, "rad/s", "a lower rate"
        ),
        _least("step rate", most_steps, STEP_RATE_MAX_1_S, 1.0, "microsteps/s", "a lower rate"),
    ]
    for what, gone, (low, high), factor, unit in (
        ("carriage range", carriage, bench.limits[0], 1e3, "mm without load"),
        ("joint 2 range", joint, bench.limits[1], 1.0, "rad"),
    ):
        inside = bool(low <= gone.min() and gone.max() <= high)
        needed = f"{factor * gone.min():.4g} to {factor * gone.max():.4g} {unit}"
        about.append(
            Check(
                what,
                inside,
                needed,
                f"{factor * low:.4g} to {factor * high:.4g}",
                "a smaller profile",
            )
        )
    return about + [check for check in examine(bench) if check.what in ALWAYS]


def _least(what: str, needed: float, limit: float, factor: float, unit: str, advice: str) -> Check:
    return Check(
        what,
        needed <= limit,
        f"{factor * needed:.4g} {unit}",
        f"at most {factor * limit:.4g}",
        advice,
    )
