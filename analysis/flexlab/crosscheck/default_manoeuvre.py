"""A manoeuvre for a robot that was given none: every free joint back and forth, small enough for
the links to stay in their range."""

from __future__ import annotations

import numpy as np

import flexura as fx
from flexura.signals import JointDrive, Manoeuvre, bang_bang

DURATION_S = 1.0  # of the motion; as long again at rest
DEFLECTION = 0.01  # of a link's length
TRIALS = 8
REACH = {"R": 0.3, "Pa": 0.05, "Pb": 0.05}  # rad, m: how far a joint goes at most


def modest(system: fx.System, duration_s: float = DURATION_S) -> Manoeuvre:
    """Smoothed bang-bang forces that deflect the links by about 1 % of their length, or move a
    joint by 0.3 rad or 0.05 m, in `duration_s`, and let the robot alone for as long again.

    Forces are proportional to the joints' inertias at the start; trial runs give the scale, from
    what they have beyond a run without these forces where there is gravity. Joints with limits, and
    those that slide on a link, use at most 80 % of the way to the nearer end. Constant forces hold
    the robot in its static equilibrium.
    """
    if system.robot.nodal:  # its mass matrix is that of no single q
        system = fx.assemble(system.robot.replace({"sliding": "continuous"}))
    robot, rows = system.robot, system.joint_rows
    start, zero, unit = system.start(), np.zeros(system.n), np.eye(system.n)
    weight = system.forces(start, zero, zero)
    inertia = np.array([(system.forces(start, zero, unit[row]) - weight)[row] for row in rows])
    inertia[system.locked] = 0.0
    hold = system.forces(fx.static(system), zero, zero)[rows]
    reach = _reach(system)
    whole = inertia * 4 * reach / duration_s**2  # a rigid joint alone goes as far as its reach
    asked = lambda scale: _manoeuvre(hold, scale * whole, duration_s)
    run = lambda scale: fx.simulate(
        system, np.linspace(0, 2 * duration_s, 401), asked(scale).drive, rtol=1e-5
    )
    still = run(0.0) if np.any(robot.gravity_m_s2) else None

    def size(moved: fx.Run) -> float:
        """How far the robot went, of what it may; beyond all where it ran into a limit."""
        if not moved.complete:
            return np.inf
        change = lambda name: moved[name] - (still[name] if still and still.complete else 0.0)
        bent = [
            (f"link/{i}/tip_deflection", DEFLECTION * k.length_m)
            for i, k in enumerate(robot.links, 1)
            if k.flexible
        ]
        return max(
            [np.ptp(change(f"joint/{i}/position")) / r for i, r in enumerate(reach, 1)]
            + [np.abs(change(name)).max() / most for name, most in bent]
        )

    scale = 0.01 / max(size(run(0.01)), 1e-6)
    for _ in range(
        TRIALS
    ):  # what grows faster than the forces: sleeves and sliders that a rotation drives outwards
        found = size(run(scale))
        if found <= 1.1:
            break
        scale *= max(0.9 / found, 0.6)
    return asked(scale)


def _manoeuvre(hold: np.ndarray, amplitude: np.ndarray, duration_s: float) -> Manoeuvre:
    joints = []
    for h, a in zip(hold, amplitude, strict=True):
        pulse = bang_bang(a, duration_s, 0.05 * duration_s)
        segments = pulse.segments.copy()
        segments[:, 1] += h
        joints.append(JointDrive(force=fx.Signal(segments, pulse.spec | {"offset": float(h)})))
    return Manoeuvre(
        "a modest back and forth of every joint",
        2 * duration_s,
        0.01 * duration_s,
        fx.Drive(tuple(joints)),
    )


def _reach(system: fx.System) -> np.ndarray:
    """How far each joint goes at most, (N,) [m or rad]."""
    links, start, limits = system.robot.links, system.robot.start, system.limits
    room = np.minimum(limits[:, 1] - start, start - limits[:, 0])
    for i in range(1, len(links)):
        if (
            links[i].joint.type == "Pa" and links[i - 1].joint.type == "Pb"
        ):  # two joints share the way to the sleeve
            ahead = start[i] - (links[i - 1].length_m - start[i - 1])
            room[i - 1 : i + 1] = np.minimum(room[i - 1 : i + 1], ahead / 2)
    with np.errstate(invalid="ignore"):
        least = np.where(np.isfinite(limits).all(axis=1), 0.05 * (limits[:, 1] - limits[:, 0]), 0.0)
    return np.minimum([REACH[link.joint.type] for link in links], 0.8 * np.maximum(room, least))
