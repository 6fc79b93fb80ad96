"""Plans of experiments: knots for the board, a description, and checks of the rig.

Every plan begins with the joints at 0, where they are referenced.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx
from flexura import signals
from flexura.errors import InputError
from flexura.io import read_toml

from ..board.protocol.player import VOLT_UNIT_V, Knots, drives, setpoints
from ..rig import Check, RigSetup, check_capability
from ..rig.board_axes import BoardAxis, board_axes
from ..rig.checks import STEP_RATE_MAX_1_S, scale_of
from .lead_in import AT_REST, LEAD_IN_S, with_lead_in

LONGEST_S = 600.0  # of an experiment
STEP = {"m": 0.005, "rad": 0.1}  # of a joint, where none is asked
PERIOD_LOG2 = 3  # knots are 8 ms apart
# checks of the rig that do not depend on the motion
STATIC_CHECKS = ("current", "supply", "at rest")


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


def inverse(
    setup: RigSetup,
    settings: dict[str, float],
    manoeuvre: fx.Manoeuvre | None = None,
    shape: Callable[[fx.Manoeuvre], fx.Manoeuvre] | None = None,
) -> Plan:
    """Plan of the inverse experiment: the firmware's controllers track a manoeuvre's motions.

    A lead-in and lead-out are added if the motions do not start or end at rest. All of that, from
    rest to rest, is shaped.

    Args:
        setup: the rig.
        settings: the board's settings, by name.
        manoeuvre: by default that of the rig file.
        shape: makes a shaped manoeuvre of one.

    Raises:
        InputError: a joint has no motion.
    """
    asked = manoeuvre or setup.manoeuvre
    asked.refuse_loads("a rig has nothing that pushes its links")
    asked.refuse_payloads("a rig has nothing that takes up a payload or lets it go")
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
    led = [with_lead_in(motion, asked.duration_s, lead_s, out_s) for motion in motions]
    whole = _manoeuvre_of(asked.name, led, lead_s + asked.duration_s + out_s)
    whole = shape(whole) if shape else whole
    parts = (
        (0.0, "lead in", lead_s),
        (lead_s, "manoeuvre", True),
        (lead_s + asked.duration_s, "lead out", out_s),
    )
    phases = [{"t": t, "name": name} for t, name, there in parts if there]
    plan = _tracking_plan("inverse", setup, settings, whole)
    return dataclasses.replace(
        plan,
        asked=asked.spec()
        | {"lead_s": lead_s, "out_s": out_s}
        | ({"shaped": True} if shape else {}),
        phases=phases,
    )


def step(
    setup: RigSetup,
    settings: dict[str, float],
    heights: Sequence[float | None] = (),
    duration_s: float = 4.0,
    apart_s: float | None = None,
) -> Plan:
    """Plan of a step of each joint's set-point, the first joint's first.

    Args:
        setup: the rig.
        settings: the board's settings, by name.
        heights: of the joints' steps [m, rad]; None or missing: 5 mm, 0.1 rad.
        duration_s: total duration [s].
        apart_s: time between the steps [s], by default half the duration.

    Raises:
        InputError: a time is out of range.
    """
    _check_duration(duration_s, 0.8)
    axes = board_axes(settings)
    given = [*heights, *[None] * len(axes)]
    wanted = [
        STEP[axis.unit] if height is None else height
        for axis, height in zip(axes, given, strict=False)
    ]
    for axis, height in zip(axes, wanted, strict=True):
        if not math.isfinite(height):
            key = f"--step-{axis.number}-{axis.unit}"
            raise InputError("expected a finite number", key=key, value=height)
    apart_s = duration_s / 2 if apart_s is None else apart_s
    if not 0 <= apart_s < duration_s - 0.4:
        raise InputError(
            "expected 0 or more, and 0.4 s less than the duration", key="--apart-s", value=apart_s
        )
    starts = [0.2 + k * apart_s for k in range(len(axes))]
    motions = [signals.step(height, at) for height, at in zip(wanted, starts, strict=True)]
    settings = settings | {  # a step is an error of its whole height, and no fault
        axis.names["following"]: max(settings[axis.names["following"]], 1.5 * abs(height))
        for axis, height in zip(axes, wanted, strict=True)
    }
    plan = _tracking_plan(
        "step", setup, settings, _manoeuvre_of("step of each set-point", motions, duration_s)
    )
    steps = [
        {"joint": axis.number, "at_s": at, "height": height}
        for axis, at, height in zip(axes, starts, wanted, strict=True)
    ]
    # the speed of a step is not finite
    kept = (*STATIC_CHECKS, "range")
    checks = [check for check in plan.checks if check.what.endswith(kept)]
    return dataclasses.replace(plan, checks=checks, asked=plan.asked | {"steps": steps})


def free_vibration(
    setup: RigSetup, settings: dict[str, float], turn_rad: float = 0.1, duration_s: float = 6.0
) -> Plan:
    """Plan of a free vibration: the last joint turns fast, stops and holds.

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
    turn = signals.trapezoidal(turn_rad, move_s, rise_s, at_s=rest_s)
    motions = [signals.constant(0.0)] * (setup.rig.joints - 1) + [turn]
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
    """Plan of the forward experiment: voltages and pulse rate, open loop.

    Args:
        setup: the rig.
        settings: the board's settings, by name.
        profile: a file or its tables; by default one that makes the strip vibrate.

    Raises:
        InputError: names file, key and value.
    """
    axes = board_axes(settings)
    spec = (
        default_profile(axes)
        if profile is None
        else profile
        if isinstance(profile, dict)
        else read_toml(profile)
    )
    where = str(profile) if isinstance(profile, Path) else ""
    try:
        name, duration, courses = _profile(spec, axes)
    except InputError as error:
        raise error.in_file(where) from None
    value = lambda s, factor: lambda t: factor * s(t)[0]
    scaled = {
        _COLUMNS[key]: value(signal, axes[-1].setpoints if key == "rate_rad_s" else 1.0)
        for key, signal in courses.items()
    }
    knots = drives(scaled, duration, PERIOD_LOG2)
    return Plan(
        "forward",
        knots,
        duration,
        settings,
        _open_loop(setup, knots, settings),
        spec | {"name": name},
    )


# keys of a profile, and the knots' columns that they give
_COLUMNS = {"voltage_V": "voltage", "voltage_2_V": "voltage_2", "rate_rad_s": "rate"}


def profile_keys(axes: Sequence[BoardAxis]) -> list[str]:
    """The keys of a profile that drive these joints, in the joints' order."""
    second = {"motor": "voltage_2_V", "stepper": "rate_rad_s"}
    return ["voltage_V", *(second[axis.kind] for axis in axes[1:])]


def default_profile(axes: Sequence[BoardAxis]) -> dict[str, Any]:
    """A profile that makes the strip vibrate.

    Each change of the stepper's speed makes the rig's strip ring by some 10 mm at 5 Hz, which takes
    half of its holding torque at most.
    """
    swing = {"kind": "harmonic", "amplitude": 5.0, "frequency_Hz": 0.6, "phase_rad": -math.pi / 2}
    strokes = {
        "rate_rad_s": [0.0, 0.8, -0.8, 0.8, -0.8, 0.0],
        "voltage_2_V": [0.0, 3.0, -3.0, 3.0, -3.0, 0.0],
    }
    out: dict[str, Any] = {
        "name": "carriage forth and back three times, joint 2 in three strokes"
        if axes[0].unit == "m"
        else "each joint forth and back",
        "duration_s": 5.0,
        "voltage_V": swing if axes[0].unit == "m" else swing | {"amplitude": 3.0},
    }
    for key in profile_keys(axes)[1:]:
        at = [0.0, 0.2, 0.5, 1.1, 1.7, 2.0]
        out[key] = {"kind": "piecewise", "at_s": at, "value": strokes[key]}
    return out


def _profile(
    spec: dict[str, Any], axes: Sequence[BoardAxis]
) -> tuple[str, float, dict[str, fx.Signal]]:
    keys = profile_keys(axes)
    known = ["name", "duration_s", *keys]
    for key, value in spec.items():
        if key not in known:
            raise InputError(
                f"an unknown key; known for this rig: {', '.join(known)}", key=key, value=value
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
    courses = {key: signals.from_spec(spec.get(key, zero), key=key) for key in keys}
    return name, float(duration), courses


def _check_duration(duration_s: float, above_s: float) -> None:
    """Refuse a duration before its knots are made."""
    if not above_s < duration_s <= LONGEST_S:
        raise InputError(
            f"expected more than {above_s:g} s and at most {LONGEST_S:g} s",
            key="--duration-s",
            value=duration_s,
        )


def _manoeuvre_of(name: str, motions: Sequence[fx.Signal], duration_s: float) -> fx.Manoeuvre:
    off = [0.0] * len(motions)
    return fx.Manoeuvre(name, duration_s, duration_s / 1000, fx.Drive.pd(motions, off, off))


def _tracking_plan(
    experiment: str, setup: RigSetup, settings: dict[str, float], asked: fx.Manoeuvre
) -> Plan:
    motions = [drive.motion for drive in asked.drive.joints if drive.motion is not None]
    assert len(motions) == setup.rig.joints
    if asked.duration_s > LONGEST_S:
        raise InputError(
            f"expected at most {LONGEST_S:g} s", key="duration_s", value=asked.duration_s
        )
    scales = [axis.setpoints for axis in board_axes(settings)]
    knots = setpoints(motions, asked.duration_s, scales, PERIOD_LOG2)
    return Plan(
        experiment, knots, asked.duration_s, settings, check_capability(setup, asked), asked.spec()
    )


def _open_loop(setup: RigSetup, knots: Knots, settings: dict[str, float]) -> list[Check]:
    """Checks of an open-loop plan.

    A motor goes no farther than on its line without load; a stepper follows its pulses.
    """
    checks = []
    for axis in board_axes(settings):
        number, what = axis.number, axis.what
        factor, unit, speed_unit = scale_of(axis)
        if axis.kind == "motor":
            voltage = "voltage" if number == 1 else "voltage_2"
            volts = knots.columns[voltage] * VOLT_UNIT_V
            speed = _free_speed_for_V(setup, number) * volts
            peak_V = float(np.abs(volts).max())
            name = "motor voltage" if number == 1 else "motor 2 voltage"
            limit = settings["voltage_max_V"]
            checks.append(_at_most(name, peak_V, limit, 1.0, "V", "a lower voltage"))
            lower, free = "a lower voltage", " without load"
        else:
            steps = knots.columns["rate"]
            speed = steps / axis.setpoints
            lower, free = "a lower rate", ""
            peak, limit = float(np.abs(speed).max()), settings["rate_max_2_rad_s"]
            checks.append(_at_most(f"{what} rate", peak, limit, 1.0, "rad/s", lower))
            peak_steps = float(np.abs(steps).max())
            checks.append(
                _at_most("step rate", peak_steps, STEP_RATE_MAX_1_S, 1.0, "microsteps/s", lower)
            )
        fastest, limit = float(np.abs(speed).max()), settings[axis.names["speed"]]
        checks.append(
            _at_most(f"{what} speed", fastest, limit, factor, f"{speed_unit}{free}", lower)
        )
        travel = np.concatenate([[0.0], np.cumsum(speed) * knots.period_s])
        low, high = setup.limits[number - 1]
        found = f"{factor * travel.min():.4g} to {factor * travel.max():.4g} {unit}{free}"
        checks.append(
            Check(
                f"{what} range",
                bool(low <= travel.min() and travel.max() <= high),
                found,
                f"{factor * low:.4g} to {factor * high:.4g}",
                "a smaller profile",
            )
        )
    always = [check for check in check_capability(setup) if check.what.endswith(STATIC_CHECKS)]
    return checks + always


def _free_speed_for_V(setup: RigSetup, number: int) -> float:
    """Speed of a joint for a volt at its motor, without load [m/s or rad/s]."""
    rig = setup.rig
    motor = rig.motor if number == 1 else rig.motor_2
    assert motor is not None
    travel = rig.screw.lead_m if number == 1 and rig.screw else 2 * math.pi
    return travel * motor.no_load_speed_rpm / 60 / motor.rated_voltage_V


def _at_most(what: str, found: float, limit: float, factor: float, unit: str, advice: str) -> Check:
    return Check(
        what,
        found <= limit,
        f"{factor * found:.4g} {unit}",
        f"at most {factor * limit:.4g}",
        advice,
    )
