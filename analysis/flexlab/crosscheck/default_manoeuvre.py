"""A manoeuvre for a robot that was given none: every free joint a little way along a smooth motion,
computed from the robot without simulating it."""

from __future__ import annotations

import numpy as np

import flexura as fx
from flexura.signals import JointDrive, Manoeuvre, constant, polynomial

DURATION_S = 1.0  # of the motion at least; as long again at rest
PERIODS = 2.0  # of the lowest mode in the motion at least
DEFLECTION = 0.01  # of a link's length: what the motion may bend it by
PEAK = 10 / np.sqrt(3)  # acceleration of `polynomial` in units of way / duration^2
SWING = 2.0  # a link under a load that begins suddenly bends twice as far as at rest under it
REACH = {"R": 0.3, "Pa": 0.05, "Pb": 0.05}  # rad, m: how far a joint goes at most
TURNS = 4.0  # periods of the controlled joint in the duration
DAMPING = 0.7  # ratio of it


def modest(system: fx.System, duration_s: float | None = None) -> Manoeuvre:
    """Motions that deflect the links by about 1 % of their length at most, under PD control.

    Each joint goes up to 0.3 rad or 0.05 m along a polynomial in `duration_s`, or 80 % of the way
    to its nearer limit, and stays there as long again. The way is shortened until the links, bent
    by the inertia of the peak acceleration about their static equilibrium, keep the bound. Gains
    make the joint an oscillator of its own inertia, TURNS periods in the duration, and no faster
    than the lowest natural frequency with the joints locked. A constant force carries the weight.

    Args:
        system: the robot.
        duration_s: of the motion [s]; None: 1 s, or two periods of the lowest natural frequency.

    Returns:
        The manoeuvre, whose tables a manoeuvre file can hold.
    """
    if system.robot.nodal:  # its mass matrix is that of no single q
        system = fx.assemble(system.robot.replace({"sliding": "continuous"}))
    robot, rows = system.robot, system.joint_rows
    rest = fx.static(system)
    M = system.mass(rest)
    lowest = fx.frequencies(system, rest, count=1)
    lowest = lowest[lowest > 0]
    if duration_s is None:
        duration_s = float(f"{max([DURATION_S, *(PERIODS / lowest)]):.2g}")
    reach = np.where(system.locked, 0.0, _reach(system))
    reach = reach * _share(system, M, rest, reach * PEAK / duration_s**2)
    hold = fx.holding(system, rest)
    turns_Hz = min([TURNS / duration_s, *lowest])
    w = 2 * np.pi * turns_Hz
    joints = []
    for i, row in enumerate(rows):
        if system.locked[i]:
            joints.append(JointDrive())
            continue
        start = float(robot.start[i])
        way = polynomial(start + float(reach[i]), duration_s, start)
        weight = constant(float(hold[i])) if any(robot.gravity_m_s2) else None
        inertia = float(M[row, row])
        joints.append(JointDrive(weight, way, inertia * w * w, 2 * DAMPING * inertia * w))
    name = "a modest motion of every joint"
    return Manoeuvre(name, 2 * duration_s, 0.01 * duration_s, fx.Drive(tuple(joints)))


def described(asked: Manoeuvre, robot: fx.Robot) -> str:
    """The manoeuvre of a robot in one sentence."""
    ways, duration = [], 0.0
    for i, (joint, link) in enumerate(zip(asked.drive.joints, robot.links, strict=True), 1):
        if joint.motion is not None:
            spec, unit = joint.motion.spec, "rad" if link.joint.type == "R" else "m"
            ways.append(f"joint {i} goes {spec['end'] - spec['start']:.3g} {unit}")
            duration = spec["duration_s"]
    if not ways:
        return "no manoeuvre was given, and no joint can move"
    return f"no manoeuvre was given: {', '.join(ways)} in {duration:g} s, then all rests"


def _share(system: fx.System, M: np.ndarray, rest: np.ndarray, peaks: np.ndarray) -> float:
    """What part of accelerations (N,) of the joints bends no link beyond the bound: at most 1."""
    rows, elastic = system.joint_rows, system.elastic_rows
    if len(elastic) == 0 or not peaks.any():
        return 1.0
    bent = rest.copy()
    K = system.stiffness(rest)[np.ix_(elastic, elastic)]
    bent[elastic] -= SWING * np.linalg.solve(K, M[np.ix_(elastic, rows)] @ peaks)
    change = np.abs(system.places(bent)[0] - system.places(rest)[0])
    bound = DEFLECTION * np.array([k.length_m for k in system.robot.links if k.flexible])
    return float(min(1.0, *(bound / np.maximum(change, 1e-300))))


def _reach(system: fx.System) -> np.ndarray:
    """How far each joint goes at most, (N,) [m or rad]: below 0 towards its nearer end."""
    links, start, limits = system.robot.links, system.robot.start, system.limits
    room = np.column_stack([start - limits[:, 0], limits[:, 1] - start])
    for i in range(1, len(links)):
        if links[i].joint.type == "Pa" and links[i - 1].joint.type == "Pb":
            # two joints share the way to the sleeve
            ahead = start[i] - (links[i - 1].length_m - start[i - 1])
            room[i - 1 : i + 1, 0] = np.minimum(room[i - 1 : i + 1, 0], ahead / 2)
    most = np.array([REACH[link.joint.type] for link in links])
    upwards = room[:, 1] >= np.minimum(room[:, 0], most)
    return np.where(
        upwards, np.minimum(most, 0.8 * room[:, 1]), -np.minimum(most, 0.8 * room[:, 0])
    )
