"""From one experiment to the figures of its robot and rig.

1. Joint 1: friction, from voltage and motor speed (`carriage`).
2. The strip near the beginning, from every stiffness of a grid: which of them rings as the sensor
  does. A mode's phase over ten seconds has many minima, two seconds have one.
3. All of it: stiffness, damping, payload, gain of the sensor, play, holding torque of the stepper,
  delay of the sensor.

To the intervals by noise is added what the model takes for granted: what one element less would
change, a strip heavier by 0.5 % (the sensor's leads and glue are in no file), and a payload with a
radius of gyration of 5.6 mm more, that of a cube of 20 g of steel: it lowers the second mode by
some 0.3 %, and it is the second mode that tells payload from stiffness.

Only what a rig's owner has is looked at: channels, robot file, rig file. What an emulated plant
says of itself is left alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

import flexura as fx
from flexura.errors import InputError

from ..rig.description import Rig, recorded
from ..rig.emulation import Emulated
from ..rig.plant.motor import JointLine, line
from ..rig.plant.stepper import MagneticSpring
from . import carriage
from .estimate import Found, Unknown, estimate
from .strip import Strip, changed

NEEDS = (
    "joint/1/position",
    "joint/1/voltage",
    "joint/2/position",
    "joint/2/pulses",
    "link/2/flex_voltage",
)
BEGINNING_S = 2.0
GRID = np.exp(
    np.linspace(np.log(0.7), np.log(1.4), 15)
)  # 5 % of stiffness are 2 % of frequency, a sixth of a turn in 2 s
MASS_DOUBT, GYRATION_DOUBT_M, GIVE_DOUBT = 0.005, 5.6e-3, 0.5
MEMORY_S = 0.4  # two periods of the first mode


@dataclass(frozen=True)
class Described:
    """What the files say: robot, rig, and joint 1 as they make it."""

    robot: fx.Robot
    rig: Rig
    line: JointLine

    @property
    def more(self) -> Emulated:
        """The rig file's [emulated]; what follows from it is nominal, its truth is not looked
        at."""
        assert self.rig.emulated is not None
        return self.rig.emulated


@dataclass(frozen=True)
class Identified:
    """What was found of joint 1 and of the strip, and the nominal figures."""

    nominal: Described
    carriage: Found
    strip: Found
    data: Strip


def described(experiment: fx.Run) -> Described:
    """The files as the experiment's metadata have them. Raises InputError where something is
    missing or wrong."""
    lacking = [name for name in NEEDS if name not in experiment]
    if lacking:
        raise InputError(
            f"expected an experiment with {lacking[0]}; it has: {', '.join(experiment)}", key="RUN"
        )
    tables, robot = experiment.meta.get("rig"), experiment.meta.get("robot")
    for key, value in (("rig", tables), ("robot", robot)):
        if not isinstance(value, dict):
            raise InputError(f"missing: the run has no {key} file in its metadata", key=key)
    rig = recorded(tables)
    if rig.emulated is None:
        raise InputError(
            "missing: the rotor's inertia, the rig's friction and play to begin with",
            key="rig.emulated",
        )
    assert isinstance(robot, dict)
    made = fx.Robot.from_dict(robot)
    for key, value in (
        ("link[2].damping.beta_s", made.links[1].damping.beta_s),
        ("payload.mass_kg", made.payload.mass_kg),
    ):
        if value == 0.0:
            raise InputError(
                "expected a value above 0 to begin with", key=f"robot.{key}", value=value
            )
    return Described(made, rig, line(rig, rig.emulated))


def identify(
    experiment: fx.Run, progress: Callable[[str, float], None] | None = None
) -> Identified:
    """Identify robot and rig from an experiment that begins at rest. Raises InputError for one that
    cannot tell."""
    report = progress or (lambda name, part: None)
    nominal = described(experiment)
    _moves(experiment)
    found = carriage.fit(experiment, nominal.robot, nominal.line, nominal.more.driver.dead_zone_V)
    report("joint 1", 1.0)
    friction = found.values["coulomb_N"] / nominal.line.coulomb_N
    values = _beginning(experiment, nominal, lambda part: report("strip", 0.3 * part))
    data = Strip(experiment, nominal.rig, nominal.more, nominal.robot, friction)
    memory = round(MEMORY_S / float(np.median(np.diff(data.t))))
    strip = estimate(data.residuals, unknowns(values), memory, _same_tone(nominal, values))
    report("strip", 1.0)
    elements = nominal.robot.links[1].elements
    doubts: tuple[tuple[dict[str, float], int], ...] = (
        ({}, elements - 1),
        ({"mass": 1 + MASS_DOUBT}, elements),
        ({"gyration_m": GYRATION_DOUBT_M}, elements),
        ({"give": 1 + GIVE_DOUBT}, elements),
    )
    for more, mesh in doubts:
        strip = strip.doubted(data.residuals(strip.values | more, mesh) - strip.residuals)
    return Identified(nominal, found, strip, data)


def _beginning(
    experiment: fx.Run, nominal: Described, report: Callable[[float], None]
) -> dict[str, float]:
    """Values that are near enough for the whole experiment."""
    data = Strip(experiment, nominal.rig, nominal.more, nominal.robot, until_s=BEGINNING_S)
    values = {
        "stiffness": 1.0,
        "damping": 1.0,
        "payload": 1.0,
        "flex_gain": 1.0,
        "backlash_m": nominal.more.carriage.backlash_m,
        "holding": 1.0,
        "delay_s": 1e-3,
    }
    misfits = []
    for k, factor in enumerate(GRID):
        misfits.append(float((data.residuals(values | {"stiffness": factor})[0] ** 2).sum()))
        report((k + 1) / (len(GRID) + 1))
    values["stiffness"] = float(GRID[np.argmin(misfits)])
    some = [
        u
        for u in unknowns(values)
        if u.name in ("stiffness", "payload", "flex_gain", "damping", "delay_s")
    ]
    rest = {name: value for name, value in values.items() if name not in {u.name for u in some}}
    found = estimate(lambda v: data.residuals(rest | v), some, 1, _same_tone(nominal, values))
    return rest | found.values


def _same_tone(nominal: Described, values: dict[str, float]) -> dict[str, dict[str, float]]:
    """How the stiffness goes with the payload for the first frequency to stay, joint 2 in the
    stepper's field (not clamped)."""
    field_N_m = MagneticSpring(nominal.rig.stepper, nominal.more.stepper).on_N_m

    def tone(more: dict[str, float]) -> float:
        system = fx.assemble(changed(nominal.robot, values | more))
        K, M = system.stiffness(), system.mass(system.start())
        K[system.joint_rows[1], system.joint_rows[1]] += field_N_m
        rows = np.arange(system.joint_rows[1], system.n)  # the motor holds the carriage
        return float(
            np.log(eigh(K[np.ix_(rows, rows)], M[np.ix_(rows, rows)], eigvals_only=True)[0])
        )

    base = tone({})
    payload, stiffness = (
        tone({name: 1.01 * values[name]}) - base for name in ("payload", "stiffness")
    )
    return {"payload": {"stiffness": -payload / stiffness}}


def unknowns(values: dict[str, float]) -> list[Unknown]:
    """What is sought about the strip, from `values` on; steps small against what turns a mode's
    phase over the experiment."""
    steps = {
        "stiffness": (3e-4, (0.3, 3.0)),
        "damping": (0.03, (0.02, 50.0)),
        "payload": (1e-2, (0.1, 10.0)),
        "flex_gain": (0.01, (0.1, 10.0)),
        "backlash_m": (0.05, (1e-6, 2e-3)),
        "holding": (2e-3, (0.2, 5.0)),
        "delay_s": (1e-4, (-5e-3, 0.02)),
    }
    return [
        Unknown(name, values[name], step, bounds, name != "delay_s")
        for name, (step, bounds) in steps.items()
    ]


def _moves(experiment: fx.Run) -> None:
    """Refuse what says nothing: joints at rest."""
    for name, least, unit in (("joint/1/position", 1e-3, "m"), ("joint/2/pulses", 0.05, "rad")):
        y = experiment[name][np.isfinite(experiment[name])]
        moved = float(np.ptp(y)) if len(y) else 0.0
        if moved < least:
            raise InputError(
                f"expected an experiment in which it moves by at least {least:g} {unit}",
                key=name,
                value=moved,
            )
