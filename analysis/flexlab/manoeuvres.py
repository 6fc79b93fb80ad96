"""A manoeuvre for a robot that was given none: every free joint back and forth, small enough for the links to stay in their
range."""

from __future__ import annotations

import numpy as np

import flexura as fx
from flexura.drive import JointDrive, Manoeuvre
from flexura.signal import bang_bang

DURATION_S = 1.0  # of the motion; as long again at rest
DEFLECTION = 0.01  # of a link's length
REACH = {"R": 0.3, "Pa": 0.05, "Pb": 0.05}  # rad, m: how far a joint goes at most


def modest(system: fx.System) -> Manoeuvre:
    """Smoothed bang-bang forces that deflect the links by about 1 % of their length, or move a joint by 0.3 rad or 0.05 m.

    Forces are proportional to the joints' inertias at the start; a trial run at a small scale gives the scale. Joints with
    limits use at most 80 % of the way to the nearer one. Gravity at the start is held by a constant force.
    """
    robot, rows = system.robot, system.joint_rows
    start = system.start()
    inertia = np.diag(system.mass(start))[rows] * ~system.chain.locked.astype(bool)
    hold = system.gravity(start)[rows]
    reach = np.array([_reach(link.joint) for link in robot.links])
    unit = inertia * 4 * reach / DURATION_S**2  # a rigid joint alone goes as far as its reach
    trial = 0.01
    run = fx.simulate(system, np.linspace(0, 2 * DURATION_S, 401), _drive(hold, unit * trial).drive, rtol=1e-5)
    largest = max(
        [np.ptp(run[f"joint/{i}/position"]) / r for i, r in enumerate(reach, 1)]
        + [
            np.abs(run[f"link/{i}/tip_deflection"]).max() / (DEFLECTION * k.length_m)
            for i, k in enumerate(robot.links, 1)
            if k.flexible
        ]
    )
    return _drive(hold, unit * trial / max(largest, 1e-6))


def _drive(hold: np.ndarray, amplitude: np.ndarray) -> Manoeuvre:
    joints = []
    for h, a in zip(hold, amplitude, strict=True):
        pulse = bang_bang(a, DURATION_S, 0.05)
        segments = pulse.segments.copy()
        segments[:, 1] += h
        joints.append(JointDrive(force=fx.Signal(segments, pulse.spec | {"offset": float(h)})))
    return Manoeuvre("a modest back and forth of every joint", 2 * DURATION_S, 0.01, fx.Drive(tuple(joints)))


def _reach(joint: object) -> float:
    reach = REACH[joint.type]  # type: ignore[attr-defined]
    limits, start = joint.limits, joint.start  # type: ignore[attr-defined]
    return (
        reach
        if limits is None
        else min(reach, 0.8 * max(min(limits[1] - start, start - limits[0]), 0.05 * (limits[1] - limits[0])))
    )
