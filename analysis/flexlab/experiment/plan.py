"""Plans of experiments: knots for the board, a description, and checks of the rig.

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
from ..rig import Check, RigSetup, check_capability
from ..rig.checks import STEP_RATE_MAX_1_S
from .lead_in import AT_REST, LEAD_IN_S, with_lead_in

LONGEST_S = 600.0  # of an experiment
PERIOD_LOG2 = 3  # knots are 8 ms apart
# checks of the rig that do not depend on the motion
STATIC_CHECKS = ("motor current", "supply", "flex sensor at rest")
GAINS = tuple(name for name in CONFIG if name[:2] in ("kp", "ki", "kd", "kf", "kg", "kv", "kc")) + (
    "derivative_Hz",
    "deflection_Hz",
    "setpoint_1_Hz",
    "setpoint_2_Hz",
    "feedback_2",
)
# The controller of an empty gains file, as in `flexura.Controller`.
ALL_TERMS_OFF = dict.fromkeys(GAINS, 0.0) | {"derivative_Hz": 50.0, "deflection_Hz": 50.0}


@dataclass(frozen=True)
class Plan:
    """One experiment.

    `asked`: its description for the metadata. `settings`: the board's settings. `phases`: what
    begins when.
    """

    experiment: str
    knots: Knots
    duration_s: float
    settings: dict[str, float]
    checks: list[Check]
    asked: dict[str, Any] = field(default_factory=dict)
    phases: list[dict[str, Any]] = field(default_factory=list)

    @property
    def failed(self) -> list[Check]:
        """The checks that failed."""
        return [check for check in self.checks if not check.passed]


def gains(path: Path) -> dict[str, float]:
    """Controller settings by the firmware's names, from a TOML file.

    A gains file of the model or of `flexura tune` has a table [controller] and is complete: terms
    that it does not name are off.

    Args:
        path: the file.

    Raises:
        InputError: names file, key and value.
    """
    data, known = read_toml(path), GAINS
    if "controller" in data:
        data, known = ALL_TERMS_OFF | load_gains(path).board(), BOARD
    for name, value in data.items():
        if name not in known:
            raise InputError(
                f"expected a setting of the controllers: {', '.join(GAINS)}",
                key=name,
                value=value,
                file=str(path),
            )
        item = CONFIG[name]
        if not signals.is_finite(value) or not item.least <= value <= item.greatest:
            expected = (
                f"expected a number between {item.least:g} and {item.greatest:g} ({item.text})"
            )
            raise InputError(expected, key=name, value=value, file=str(path))
    return {name: float(value) for name, value in data.items()}


def inverse(
    setup: RigSetup, settings: dict[str, float], manoeuvre: fx.Manoeuvre | None = None
) -> Plan:
    """Plan of the inverse experiment: the firmware's controllers track a manoeuvre's motions.

    A lead-in and lead-out are added if the motions do not start or end at rest.

    Args:
        setup: the rig.
        settings: the board's settings, by name.
        manoeuvre: by default that of the rig file.

    Raises:
        InputError: a joint has no motion.
    """
    asked = manoeuvre or setup.manoeuvre
    motions = []
    for number, joint in enumerate(asked.drive.joints, 1):
        if joint.motion is None:
            raise InputError(
                "missing: expected a motion of every joint", key=f"joint[{number}].motion"
            )
        motions.append(joint.motion)
    lead_s = (
        LEAD_IN_S if max(abs(v) for motion in motions for v in motion(0.0)[:2]) > AT_REST else 0.0
    )
    out_s = (
        LEAD_IN_S if any(abs(motion(asked.duration_s)[1]) > AT_REST for motion in motions) else 0.0
    )
    one, two = (with_lead_in(motion, asked.duration_s, lead_s, out_s) for motion in motions)
    whole = _manoeuvre_of(asked.name, (one, two), lead_s + asked.duration_s + out_s)
    parts = (
        (0.0, "lead in", lead_s),
        (lead_s, "manoeuvre", True),
        (lead_s + asked.duration_s, "lead out", out_s),
    )
    phases = [{"t": t, "name": name} for t, name, there in parts if there]
    plan = _tracking_plan("inverse", setup, settings, whole)
    return dataclasses.replace(
        plan, asked=asked.spec() | {"lead_s": lead_s, "out_s": out_s}, phases=phases
    )


def step(
    setup: RigSetup,
    settings: dict[str, float],
    step_1_m: float = 0.005,
    step_2_rad: float = 0.1,
    duration_s: float = 4.0,
    apart_s: float | None = None,
) -> Plan:
    """Plan of a step of each joint's set-point, the carriage's first.

    Args:
        setup: the rig.
        settings: the board's settings, by name.
        step_1_m: step of joint 1 [m].
        step_2_rad: step of joint 2 [rad].
        duration_s: total duration [s].
        apart_s: time between the steps [s], by default half the duration.

    Raises:
        InputError: a time is out of range.
    """
    _check_duration(duration_s, 0.8)
    for key, value in (("--step-1-m", step_1_m), ("--step-2-rad", step_2_rad)):
        if not math.isfinite(value):
            raise InputError("expected a finite number", key=key, value=value)
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
    plan = _tracking_plan(
        "step", setup, settings, _manoeuvre_of("step of each set-point", motions, duration_s)
    )
    steps = [
        {"joint": 1, "at_s": first, "height": step_1_m},
        {"joint": 2, "at_s": second, "height": step_2_rad},
    ]
    # the speed of a step is not finite
    checks = [
        check
        for check in plan.checks
        if check.what in (*STATIC_CHECKS, "carriage range", "joint 2 range")
    ]
    return dataclasses.replace(plan, checks=checks, asked=plan.asked | {"steps": steps})


def free_vibration(
    setup: RigSetup, settings: dict[str, float], turn_rad: float = 0.1, duration_s: float = 6.0
) -> Plan:
    """Plan of a free vibration: joint 2 turns fast, stops and holds.

    Args:
        setup: the rig.
        settings: the board's settings, by name.
        turn_rad: angle of the turn [rad].
        duration_s: total duration [s].

    Raises:
        InputError: the duration is too short.
    """
    move_s, rise_s, rest_s = 0.18, 0.08, 0.1
    _check_duration(duration_s, 1.0)
    if not math.isfinite(turn_rad):
        raise InputError("expected a finite number", key="--turn-rad", value=turn_rad)
    motions = signals.constant(0.0), signals.trapezoidal(turn_rad, move_s, rise_s, at_s=rest_s)
    plan = _tracking_plan(
        "free-vibration",
        setup,
        settings,
        _manoeuvre_of("move, stop, let ring", motions, duration_s),
    )
    return dataclasses.replace(plan, asked=plan.asked | {"rings_from_s": rest_s + move_s})


def forward(
    setup: RigSetup, settings: dict[str, float], profile: Path | dict[str, Any] | None = None
) -> Plan:
    """Plan of the forward experiment: voltage and pulse rate, open loop.

    Args:
        setup: the rig.
        settings: the board's settings, by name.
        profile: a file or its tables; by default one that makes the strip vibrate.

    Raises:
        InputError: names file, key and value.
    """
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
        _open_loop(setup, knots, settings),
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
    if duration is None or not signals.is_finite(duration) or not 0 < duration <= LONGEST_S:
        raise InputError(
            f"expected a duration above 0 and at most {LONGEST_S:g} s",
            key="duration_s",
            value=duration,
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


def _check_duration(duration_s: float, above_s: float) -> None:
    """Refuse a duration before its knots are made."""
    if not above_s < duration_s <= LONGEST_S:
        raise InputError(
            f"expected more than {above_s:g} s and at most {LONGEST_S:g} s",
            key="--duration-s",
            value=duration_s,
        )


def _manoeuvre_of(
    name: str, motions: tuple[fx.Signal, fx.Signal], duration_s: float
) -> fx.Manoeuvre:
    return fx.Manoeuvre(
        name, duration_s, duration_s / 1000, fx.Drive.pd(motions, [0.0, 0.0], [0.0, 0.0])
    )


def _tracking_plan(
    experiment: str, setup: RigSetup, settings: dict[str, float], asked: fx.Manoeuvre
) -> Plan:
    carriage, joint = (drive.motion for drive in asked.drive.joints)
    assert carriage is not None and joint is not None
    if asked.duration_s > LONGEST_S:
        raise InputError(
            f"expected at most {LONGEST_S:g} s", key="duration_s", value=asked.duration_s
        )
    knots = setpoints(carriage, joint, asked.duration_s, settings, PERIOD_LOG2)
    return Plan(
        experiment, knots, asked.duration_s, settings, check_capability(setup, asked), asked.spec()
    )


def _open_loop(setup: RigSetup, knots: Knots, settings: dict[str, float]) -> list[Check]:
    """Checks of an open-loop plan.

    The carriage goes no farther than on the motor's line without load; joint 2 follows its pulses.
    """
    volts, steps = knots.columns["voltage"] / 1000, knots.columns["rate"]
    motor = setup.rig.motor
    free = setup.rig.screw.lead_m * motor.no_load_speed_rpm / 60 / motor.rated_voltage_V
    integrate = lambda speed: np.concatenate([[0.0], np.cumsum(speed) * knots.period_s])
    carriage, joint = integrate(free * volts), integrate(steps / settings["stepper_steps_per_rad"])
    peak_V, peak_steps = float(np.abs(volts).max()), float(np.abs(steps).max())
    peak_m_s, peak_rad_s = free * peak_V, peak_steps / settings["stepper_steps_per_rad"]
    checks = [
        _at_most("motor voltage", peak_V, settings["voltage_max_V"], 1.0, "V", "a lower voltage"),
        _at_most(
            "carriage speed",
            peak_m_s,
            settings["speed_max_1_m_s"],
            1e3,
            "mm/s without load",
            "a lower voltage",
        ),
        _at_most(
            "joint 2 rate", peak_rad_s, settings["rate_max_2_rad_s"], 1.0, "rad/s", "a lower rate"
        ),
        _at_most(
            "joint 2 speed", peak_rad_s, settings["speed_max_2_rad_s"], 1.0, "rad/s", "a lower rate"
        ),
        _at_most("step rate", peak_steps, STEP_RATE_MAX_1_S, 1.0, "microsteps/s", "a lower rate"),
    ]
    for what, travel, (low, high), factor, unit in (
        ("carriage range", carriage, setup.limits[0], 1e3, "mm without load"),
        ("joint 2 range", joint, setup.limits[1], 1.0, "rad"),
    ):
        inside = bool(low <= travel.min() and travel.max() <= high)
        found = f"{factor * travel.min():.4g} to {factor * travel.max():.4g} {unit}"
        checks.append(
            Check(
                what,
                inside,
                found,
                f"{factor * low:.4g} to {factor * high:.4g}",
                "a smaller profile",
            )
        )
    return checks + [check for check in check_capability(setup) if check.what in STATIC_CHECKS]


def _at_most(what: str, found: float, limit: float, factor: float, unit: str, advice: str) -> Check:
    return Check(
        what,
        found <= limit,
        f"{factor * found:.4g} {unit}",
        f"at most {factor * limit:.4g}",
        advice,
    )
