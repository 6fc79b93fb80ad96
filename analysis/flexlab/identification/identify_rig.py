"""Identification of a robot and its rig from one experiment.

1. A joint with a motor on a lead screw: friction, from voltage and speed (`motor_friction`).
2. Start values: the first 2 s are simulated for a grid of stiffnesses; the best fit is taken. A
   mode's phase over 10 s has many local minima, over 2 s one.
3. All parameters: stiffness, damping, payload, gain of the sensor, backlash, contact stiffness of
   gears, friction of the bearings before gears, holding torque of the stepper, delay of the
   sensor.
4. Joints that motors turn: the motor's friction, from voltage, speed and the torque on its gear.

The intervals account for noise and add the uncertainty of fixed model parameters: one element less;
0.5 % of the strip's mass (leads and glue of the sensor are in no file); and a payload radius of
gyration of 5.6 mm, that of a cube of 20 g of steel. The latter lowers the second mode by 0.3 %, and
the second mode distinguishes payload from stiffness. The bearing before a gear gives way before it
slides, the model's does not: half of that is an uncertainty of the play.

Only channels, robot file and rig file are used. An emulated plant's true parameters are not read.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

import flexura as fx
from flexura.errors import InputError

from ..recordings.unit_conversion import voltage_channel
from ..rig.axes import Friction, MotorAxis, motor_axes
from ..rig.description import Rig, rig_of_recording, strip_of
from ..rig.plant.motor import JointLine, joint_line
from ..rig.plant.stepper import MagneticSpring
from . import motor_friction
from .estimate import Estimate, Parameter, estimate
from .strip import BEARING, StripModel, with_parameters

FIRST_PART_S = 2.0
# 5 % of stiffness are 2 % of frequency, a sixth of a period in 2 s
STIFFNESS_GRID = np.exp(np.linspace(np.log(0.7), np.log(1.4), 15))
MASS_UNCERTAINTY, GYRATION_UNCERTAINTY_M, NUT_COMPLIANCE_UNCERTAINTY = 0.005, 5.6e-3, 0.5
PRESLIDING_UNCERTAINTY = 0.5  # of what a bearing gives way before it slides
CONTACT = "contact"  # sought last: it moves the first frequency as stiffness and payload do
CORRELATION_S = 0.4  # two periods of the first mode


@dataclass(frozen=True)
class Nominal:
    """The robot, the rig, and its joints with motors by these files."""

    robot: fx.Robot
    rig: Rig
    axes: tuple[MotorAxis, ...]

    @property
    def lines(self) -> dict[int, JointLine]:
        """The joints with motors as linear motors, by their numbers.

        The strip shows the friction of a bearing that a gear turns: it is not in these.
        """
        return {
            axis.number: joint_line(axis, own=0.0 if axis.turns else None, delayed=True)
            for axis in self.axes
        }


@dataclass(frozen=True)
class Identified:
    """Estimates of the joints with motors (by number) and of the strip; the nominal values."""

    nominal: Nominal
    joints: dict[int, Estimate]
    strip: Estimate
    data: StripModel

    @property
    def friction(self) -> dict[int, Friction]:
        """Factors on the friction of the joints with motors."""
        own, lines = self.strip.values.get(BEARING), self.nominal.lines
        return {
            n: Friction(motor, motor if own is None else own)
            for n, found in self.joints.items()
            for motor in [found.values["coulomb"] / lines[n].coulomb]
        }


def required_channels(rig: Rig, strip: int) -> list[str]:
    """The channels that an experiment must have."""
    out = [f"joint/{n}/position" for n in range(1, rig.joints + 1)]
    out += ["joint/1/voltage"] + ["joint/2/voltage"] * bool(rig.motor_2)
    out += ["joint/2/pulses"] * bool(rig.stepper)
    return [*out, voltage_channel(strip, "strain_gauge" if rig.strain_gauge else "flex")]


def read_nominal(experiment: fx.Run) -> Nominal:
    """The files in the experiment's metadata.

    Raises:
        InputError: a channel or a value is missing or wrong.
    """
    tables, robot = experiment.meta.get("rig"), experiment.meta.get("robot")
    for key, value in (("rig", tables), ("robot", robot)):
        if not isinstance(value, dict):
            raise InputError(f"missing: the run has no {key} file in its metadata", key=key)
    rig = rig_of_recording(tables)
    assert isinstance(robot, dict)
    made = fx.Robot.from_dict(robot)
    missing = [n for n in required_channels(rig, strip_of(made)) if n not in experiment]
    if missing:
        raise InputError(
            f"expected an experiment with {missing[0]}; it has: {', '.join(experiment)}", key="RUN"
        )
    strip = strip_of(made)
    for key, value in (
        (f"link[{strip}].damping.beta_s", made.links[strip - 1].damping.beta_s),
        ("payload.mass_kg", made.payload.mass_kg),
    ):
        if value == 0.0:
            raise InputError(
                "expected a value above 0 to begin with", key=f"robot.{key}", value=value
            )
    try:
        return Nominal(made, rig, motor_axes(rig))
    except InputError as error:
        raise InputError(error.expected, key=f"rig.{error.key}", value=error.value) from None


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
    robot, rig, lines = nominal.robot, nominal.rig, nominal.lines
    _require_motion(experiment, nominal)
    joints = {}
    for axis in nominal.axes:
        if not axis.turns:
            joints[axis.number] = _joint(experiment, nominal, axis)
    report("joints", len(joints) / len(nominal.axes))
    friction = {
        n: Friction(*2 * [found.values["coulomb"] / lines[n].coulomb])
        for n, found in joints.items()
    }
    values = _start_values(experiment, nominal, lambda part: report("strip", 0.3 * part))
    data = StripModel(experiment, rig, robot, friction)
    correlation_samples = round(CORRELATION_S / float(np.median(np.diff(data.t))))
    strip = _strip(data, nominal, values, correlation_samples, CONTACT)
    if all(axis.turns for axis in nominal.axes):
        strip = _strip(data, nominal, strip.values, correlation_samples)
    report("strip", 1.0)
    variations: list[tuple[dict[str, float], int]] = [
        ({}, -1),
        ({"mass": 1 + MASS_UNCERTAINTY}, 0),
        ({"gyration_m": GYRATION_UNCERTAINTY_M}, 0),
    ]
    if not all(axis.turns for axis in nominal.axes):
        variations.append(({"give": 1 + NUT_COMPLIANCE_UNCERTAINTY}, 0))
    elif guides := [axis.guide for axis in nominal.axes if axis.guide.backlash]:
        give = max(guide.presliding / guide.backlash for guide in guides)
        play = strip.values["backlash"] + PRESLIDING_UNCERTAINTY * give
        variations.append(({"backlash": play}, 0))
    for more, elements in variations:
        strip = strip.with_model_uncertainty(
            data.residuals(strip.values | more, elements) - strip.residuals
        )
    run = data.simulate(strip.values)
    for axis in nominal.axes:
        if axis.turns:  # under the links' torque
            torque = run[f"joint/{axis.number}/drive"]
            own = strip.values[BEARING] * strip.deviation(BEARING) * axis.guide.coulomb
            joints[axis.number] = _joint(experiment, nominal, axis, torque, own)
            report("joints", len(joints) / len(nominal.axes))
    return Identified(nominal, joints, strip, data)


def _strip(
    data: StripModel,
    nominal: Nominal,
    values: dict[str, float],
    correlation_samples: int,
    known: str = "",
) -> Estimate:
    """All parameters of the strip but a `known` one, from start `values`."""
    return estimate(
        data.residuals,
        [u for u in parameters(nominal, values) if u.name != known],
        correlation_samples,
        _same_frequency_direction(nominal, values, known),
        values,
    )


def _joint(
    experiment: fx.Run,
    nominal: Nominal,
    axis: MotorAxis,
    torque: np.ndarray | None = None,
    own_deviation: float = 0.0,
) -> Estimate:
    """A motor's friction, `torque` (T,) [N m] being what its gear gives to the joint."""
    line, dead_zone_V = nominal.lines[axis.number], nominal.rig.driver.dead_zone_V
    robot = nominal.robot
    return motor_friction.fit(experiment, robot, axis, line, dead_zone_V, torque, own_deviation)


def _start_values(
    experiment: fx.Run, nominal: Nominal, report: Callable[[float], None]
) -> dict[str, float]:
    """Start values that are close enough for the whole experiment."""
    data = StripModel(experiment, nominal.rig, nominal.robot, until_s=FIRST_PART_S)
    values = {
        "stiffness": 1.0,
        "damping": 1.0,
        "payload": 1.0,
        "sensor_gain": 1.0,
        "backlash": 1.0,
        CONTACT: 1.0,
        "holding": 1.0,
        "delay_s": 1e-3,
    }
    if all(axis.turns for axis in nominal.axes):
        values[BEARING] = 1.0
    misfits = []
    for k, factor in enumerate(STIFFNESS_GRID):
        misfits.append(float((data.residuals(values | {"stiffness": factor})[0] ** 2).sum()))
        report((k + 1) / (len(STIFFNESS_GRID) + 1))
    values["stiffness"] = float(STIFFNESS_GRID[np.argmin(misfits)])
    some = [
        u
        for u in parameters(nominal, values)
        if u.name in ("stiffness", "payload", "sensor_gain", "damping", "delay_s")
    ]
    rest = {name: value for name, value in values.items() if name not in {u.name for u in some}}
    directions = _same_frequency_direction(nominal, values, CONTACT)
    found = estimate(data.residuals, some, 1, directions, rest)
    return rest | found.values


def _same_frequency_direction(
    nominal: Nominal, values: dict[str, float], known: str = ""
) -> dict[str, dict[str, float]]:
    """Changes of the stiffness with the payload, and with the contact stiffness of gears, that keep
    the first frequency.

    A lead screw holds its joint; other joints are on their gears' contacts or on the stepper's
    magnetic spring.
    """
    stepper = nominal.rig.stepper
    field_N_m = MagneticSpring(stepper).on_N_m if stepper else 0.0

    def log_first_frequency(more: dict[str, float]) -> float:
        system = fx.assemble(with_parameters(nominal.robot, values | more))
        K, M = system.stiffness(), system.mass(system.start())
        held = []
        for axis in nominal.axes:
            row = system.joint_rows[axis.number - 1]
            if axis.turns:
                K[row, row] += (values | more)[CONTACT] * axis.guide.contact_stiffness
            else:
                held.append(row)
        if stepper:
            K[system.joint_rows[1], system.joint_rows[1]] += field_N_m
        rows = np.setdiff1d(np.arange(system.n), held)
        return float(
            np.log(eigh(K[np.ix_(rows, rows)], M[np.ix_(rows, rows)], eigvals_only=True)[0])
        )

    names = ["payload", "stiffness"]
    if all(axis.turns for axis in nominal.axes) and known != CONTACT:
        names.append(CONTACT)
    base = log_first_frequency({})
    slopes = {name: log_first_frequency({name: 1.01 * values[name]}) - base for name in names}
    return {
        name: {"stiffness": -slopes[name] / slopes["stiffness"]}
        for name in names
        if name != "stiffness"
    }


def parameters(nominal: Nominal, values: dict[str, float]) -> list[Parameter]:
    """The strip's parameters, with start `values`.

    Steps are small against what changes a mode's phase over the experiment. A rig without stepper
    has no holding torque, one without backlash none to find. A gear's contact bends under the
    links' torque, a nut's hardly.
    """
    steps = {
        "stiffness": (3e-4, (0.3, 3.0)),
        "damping": (0.03, (0.02, 50.0)),
        "payload": (1e-2, (0.1, 10.0)),
        "sensor_gain": (0.01, (0.1, 10.0)),
        "backlash": (0.05, (0.01, 15.0)),
        CONTACT: (0.02, (0.1, 10.0)),
        BEARING: (0.05, (0.01, 20.0)),
        "holding": (2e-3, (0.2, 5.0)),
        "delay_s": (1e-4, (-5e-3, 0.02)),
    }
    if not nominal.rig.stepper:
        del steps["holding"]
    if not any(axis.guide.backlash for axis in nominal.axes):
        del steps["backlash"]
    if not all(axis.turns for axis in nominal.axes):
        del steps[CONTACT]
        del steps[BEARING]
    return [
        Parameter(name, values[name], step, bounds, name != "delay_s")
        for name, (step, bounds) in steps.items()
    ]


def _require_motion(experiment: fx.Run, nominal: Nominal) -> None:
    """Raise InputError if a joint does not move."""
    least = {"m": 1e-3, "rad": 0.05}
    channels = [(f"joint/{axis.number}/position", axis.unit) for axis in nominal.axes]
    if nominal.rig.stepper:
        channels.append(("joint/2/pulses", "rad"))
    for name, unit in channels:
        y = experiment[name][np.isfinite(experiment[name])]
        moved = float(np.ptp(y)) if len(y) else 0.0
        if moved < least[unit]:
            raise InputError(
                f"expected an experiment in which it moves by at least {least[unit]:g} {unit}",
                key=name,
                value=moved,
            )
