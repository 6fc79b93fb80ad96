"""What is known of the rig: the identified model, how sure it is, what a reference does to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import flexura as fx
from flexura.control import (
    JointLoop,
    JointSpring,
    LearningFilter,
    filter_length,
    learning_filter,
    reference_response,
    transform_points,
)
from flexura.errors import InputError

from ..identification.identify import Identified
from ..identification.strip import with_parameters
from ..rig import RigSetup
from ..rig.axes import motor_axes
from ..rig.nominal_robot import with_drives
from ..rig.plant.motor import joint_line
from ..rig.plant.stepper import MagneticSpring
from .task import STEP_S, Task

HIGHEST_HZ = 12.0  # of what is learned; the board's knots are 8 ms apart
SURELY = 2.0  # standard deviations
MODEL = 0.02  # of the stiffness: what no interval has, the model's own error
NAMES = ("stiffness", "damping", "payload")
POSTURES = 3  # along the manoeuvre, where the robot is linearised
WORST, SINGULAR = 20.0, 1e4  # condition of the joints' slopes there


@dataclass(frozen=True)
class Knowledge:
    """Parameters of the strip, as factors on the file's, and the robots that may be meant.

    Attributes:
        values: factors, by name.
        others: the corners of the uncertainty: factors `stiffness`, `damping`, `payload`.
    """

    values: dict[str, float]
    others: tuple[dict[str, float], ...]

    @classmethod
    def of(cls, found: Identified) -> Knowledge:
        """From an identification's estimates and their covariance.

        Along each principal axis of the covariance there are two robots, two standard deviations
        away. Stiffness and payload that keep the first frequency are thus seen together.
        """
        strip = found.strip
        rows = [[u.name for u in strip.parameters].index(name) for name in NAMES]
        covariance = strip.covariance[np.ix_(rows, rows)] + np.diag([MODEL**2, 0.0, 0.0])
        spread, axes = np.linalg.eigh(covariance)
        centre = np.log([strip.values[name] for name in NAMES])
        others = []
        for size, axis in zip(np.sqrt(np.maximum(spread, 0.0)), axes.T, strict=True):
            for sign in (-1, 1):
                factors = np.exp(centre + sign * SURELY * size * axis)
                others.append(dict(zip(NAMES, map(float, factors), strict=True)))
        return cls(dict(strip.values), tuple(others))


def loops(
    setup: RigSetup, settings: dict[str, float], holding: float = 1.0
) -> list[JointLoop | JointSpring]:
    """What moves the joints: the board's controllers of motors, and a stepper's magnetic spring.

    Args:
        setup: the rig.
        settings: the board's settings, by name.
        holding: factor on the stepper's holding torque.
    """
    out: list[JointLoop | JointSpring] = []
    for axis in motor_axes(setup.rig):
        n, unit = axis.number, axis.unit
        gain = lambda name, n=n: settings.get(f"{name[:2]}_{n}_{name[3:]}", 0.0)
        out.append(
            JointLoop(
                joint_line(axis).force_per_V,
                gain(f"kp V_{unit}"),
                gain(f"ki V_{unit}_s"),
                gain(f"kd V_s_{unit}"),
                gain(f"kv V_s_{unit}"),
            )
        )
    if setup.rig.stepper:
        out.append(JointSpring(holding * MagneticSpring(setup.rig.stepper).on_N_m))
    return out


def filter_of(task: Task, knowledge: Knowledge) -> LearningFilter:
    """The learning filter of a task: from an error at the joints to their references.

    Args:
        task: what is learned.
        knowledge: the model and its uncertainty.

    Raises:
        InputError: the joints cannot move the tip in every direction, anywhere on the way.
    """
    points = transform_points(filter_length(len(task.t)), STEP_S)
    controllers = loops(task.setup, task.settings, knowledge.values.get("holding", 1.0))
    lines = [(axis, joint_line(axis)) for axis in motor_axes(task.setup.rig)]
    postures = _postures(task)
    slopes, across = task.slopes(postures), task.across(postures)
    responses, motions = [], []
    for factors in (knowledge.values, *knowledge.others):
        robot = with_parameters(task.setup.robot, knowledge.values | factors)
        system = fx.assemble(with_drives(robot, task.setup.rig, lines))
        for posture, by_joints, normal in zip(postures, slopes, across, strict=True):
            q = fx.static(system, joints=posture)
            tip, joints = reference_response(system, q, points, controllers)
            responses.append(np.linalg.pinv(by_joints) @ tip)
            bent = normal @ (tip - by_joints @ joints)
            motions.append(np.concatenate([joints, bent[:, None]], axis=1))
    return learning_filter(np.array(responses), STEP_S, HIGHEST_HZ, np.array(motions))


def _postures(task: Task) -> np.ndarray:
    """Some postures on the way (k, J) in which the joints move the tip in every direction.

    They are those in which the last joint is farthest to one side, in the middle, and to the other.
    """
    begin = min(first for first, _ in task.moving)
    end = max(last for _, last in task.moving)
    way = task.joints(np.linspace(begin, end, 8 * POSTURES + 1))
    conditions = np.linalg.cond(task.slopes(way))
    good = way[conditions < max(WORST, 3 * conditions.min())]
    if conditions.min() > SINGULAR:
        raise InputError(
            "expected a manoeuvre on which the joints can move the tip in every direction",
            key="manoeuvre",
            value=task.manoeuvre.name,
        )
    good = good[np.argsort(good[:, -1], kind="stable")]
    some = good[np.linspace(0, len(good) - 1, POSTURES).round().astype(int)]
    return np.unique(np.round(some, 6), axis=0)
