"""Identification of a robot and its rig from one experiment.

1. Joint 1: friction, from voltage and motor speed (`carriage`).
2. Start values: the first 2 s are simulated for a grid of stiffnesses; the best fit is taken. A
   mode's phase over 10 s has many local minima, over 2 s one.
3. All parameters: stiffness, damping, payload, gain of the sensor, backlash, holding torque of the
   stepper, delay of the sensor.

The intervals account for noise and add the uncertainty of fixed model parameters: one element less;
0.5 % of the strip's mass (leads and glue of the sensor are in no file); and a payload radius of
gyration of 5.6 mm, that of a cube of 20 g of steel. The latter lowers the second mode by 0.3 %, and
the second mode distinguishes payload from stiffness.

Only channels, robot file and rig file are used. An emulated plant's true parameters are not read.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

import flexura as fx
from flexura.errors import InputError

from ..rig.description import Rig, rig_of_recording
from ..rig.emulation import Emulated
from ..rig.plant.motor import JointLine, joint_line_of
from ..rig.plant.stepper import MagneticSpring
from . import carriage
from .estimate import Estimate, Parameter, estimate
from .strip import StripModel, with_parameters

REQUIRED_CHANNELS = (
    "joint/1/position",
    "joint/1/voltage",
    "joint/2/position",
    "joint/2/pulses",
    "link/2/flex_voltage",
)
FIRST_PART_S = 2.0
# 5 % of stiffness are 2 % of frequency, a sixth of a period in 2 s
STIFFNESS_GRID = np.exp(np.linspace(np.log(0.7), np.log(1.4), 15))
MASS_UNCERTAINTY, GYRATION_UNCERTAINTY_M, NUT_COMPLIANCE_UNCERTAINTY = 0.005, 5.6e-3, 0.5
CORRELATION_S = 0.4  # two periods of the first mode


@dataclass(frozen=True)
class Nominal:
    """The robot, the rig, and joint 1 by these files."""

    robot: fx.Robot
    rig: Rig
    line: JointLine

    @property
    def emulated(self) -> Emulated:
        """The rig file's [emulated]; its true parameters are not used."""
        assert self.rig.emulated is not None
        return self.rig.emulated


@dataclass(frozen=True)
class Identified:
    """Estimates of joint 1 and of the strip, and the nominal values."""

    nominal: Nominal
    carriage: Estimate
    strip: Estimate
    data: StripModel


def read_nominal(experiment: fx.Run) -> Nominal:
    """The files in the experiment's metadata.

    Raises:
        InputError: a channel or a value is missing or wrong.
    """
    missing = [name for name in REQUIRED_CHANNELS if name not in experiment]
    if missing:
        raise InputError(
            f"expected an experiment with {missing[0]}; it has: {', '.join(experiment)}", key="RUN"
        )
    tables, robot = experiment.meta.get("rig"), experiment.meta.get("robot")
    for key, value in (("rig", tables), ("robot", robot)):
        if not isinstance(value, dict):
            raise InputError(f"missing: the run has no {key} file in its metadata", key=key)
    rig = rig_of_recording(tables)
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
    return Nominal(made, rig, joint_line_of(rig, rig.emulated))


def identify(
    experiment: fx.Run, progress: Callable[[str, float], None] | None = None
) -> Identified:
    """Identify robot and rig from an experiment that begins at rest.

    Args:
        experiment: the run.
        progress: called with the name of a stage and its finished fraction.

    Raises:
        InputError: the experiment lacks data, or its joints do not move.
    """
    report = progress or (lambda name, part: None)
    nominal = read_nominal(experiment)
    _require_motion(experiment)
    found = carriage.fit(
        experiment, nominal.robot, nominal.line, nominal.emulated.driver.dead_zone_V
    )
    report("joint 1", 1.0)
    friction = found.values["coulomb_N"] / nominal.line.coulomb_N
    values = _start_values(experiment, nominal, lambda part: report("strip", 0.3 * part))
    data = StripModel(experiment, nominal.rig, nominal.emulated, nominal.robot, friction)
    correlation_samples = round(CORRELATION_S / float(np.median(np.diff(data.t))))
    strip = estimate(
        data.residuals,
        parameters(values),
        correlation_samples,
        _same_frequency_direction(nominal, values),
    )
    report("strip", 1.0)
    elements = nominal.robot.links[1].elements
    variations: tuple[tuple[dict[str, float], int], ...] = (
        ({}, elements - 1),
        ({"mass": 1 + MASS_UNCERTAINTY}, elements),
        ({"gyration_m": GYRATION_UNCERTAINTY_M}, elements),
        ({"give": 1 + NUT_COMPLIANCE_UNCERTAINTY}, elements),
    )
    for more, mesh in variations:
        strip = strip.with_model_uncertainty(
            data.residuals(strip.values | more, mesh) - strip.residuals
        )
    return Identified(nominal, found, strip, data)


def _start_values(
    experiment: fx.Run, nominal: Nominal, report: Callable[[float], None]
) -> dict[str, float]:
    """Start values that are close enough for the whole experiment."""
    data = StripModel(
        experiment, nominal.rig, nominal.emulated, nominal.robot, until_s=FIRST_PART_S
    )
    values = {
        "stiffness": 1.0,
        "damping": 1.0,
        "payload": 1.0,
        "flex_gain": 1.0,
        "backlash_m": nominal.emulated.carriage.backlash_m,
        "holding": 1.0,
        "delay_s": 1e-3,
    }
    misfits = []
    for k, factor in enumerate(STIFFNESS_GRID):
        misfits.append(float((data.residuals(values | {"stiffness": factor})[0] ** 2).sum()))
        report((k + 1) / (len(STIFFNESS_GRID) + 1))
    values["stiffness"] = float(STIFFNESS_GRID[np.argmin(misfits)])
    some = [
        u
        for u in parameters(values)
        if u.name in ("stiffness", "payload", "flex_gain", "damping", "delay_s")
    ]
    rest = {name: value for name, value in values.items() if name not in {u.name for u in some}}
    found = estimate(
        lambda v: data.residuals(rest | v), some, 1, _same_frequency_direction(nominal, values)
    )
    return rest | found.values


def _same_frequency_direction(
    nominal: Nominal, values: dict[str, float]
) -> dict[str, dict[str, float]]:
    """Change of the stiffness with the payload that keeps the first frequency.

    Joint 2 is on the stepper's magnetic spring, not clamped.
    """
    stepper_stiffness_N_m = MagneticSpring(nominal.rig.stepper, nominal.emulated.stepper).on_N_m

    def log_first_frequency(more: dict[str, float]) -> float:
        system = fx.assemble(with_parameters(nominal.robot, values | more))
        K, M = system.stiffness(), system.mass(system.start())
        K[system.joint_rows[1], system.joint_rows[1]] += stepper_stiffness_N_m
        rows = np.arange(system.joint_rows[1], system.n)  # the motor holds the carriage
        return float(
            np.log(eigh(K[np.ix_(rows, rows)], M[np.ix_(rows, rows)], eigvals_only=True)[0])
        )

    base = log_first_frequency({})
    payload, stiffness = (
        log_first_frequency({name: 1.01 * values[name]}) - base for name in ("payload", "stiffness")
    )
    return {"payload": {"stiffness": -payload / stiffness}}


def parameters(values: dict[str, float]) -> list[Parameter]:
    """The strip's parameters, with start `values`.

    Steps are small against what changes a mode's phase over the experiment.
    """
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
        Parameter(name, values[name], step, bounds, name != "delay_s")
        for name, (step, bounds) in steps.items()
    ]


def _require_motion(experiment: fx.Run) -> None:
    """Raise InputError if a joint does not move."""
    for name, least, unit in (("joint/1/position", 1e-3, "m"), ("joint/2/pulses", 0.05, "rad")):
        y = experiment[name][np.isfinite(experiment[name])]
        moved = float(np.ptp(y)) if len(y) else 0.0
        if moved < least:
            raise InputError(
                f"expected an experiment in which it moves by at least {least:g} {unit}",
                key=name,
                value=moved,
            )
