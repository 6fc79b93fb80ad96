"""The methods of `flexura study control`. A method is a function from a Task to a Motion; it is
added to METHODS."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import brentq

import flexura as fx
from flexura.control import lqr
from flexura.signals import Drive, JointDrive, Signal, piecewise, trapezoidal, zv, zvd

from .tasks import DERIVATIVE_HZ, RATE_HZ, Task

INTEGRAL = 0.2  # ki over kp and the pole of the joints' loops
# LQR: what counts the same, in shares of the ways, of the last link's length, of the drives' limits
NEAR, BENT, EFFORT = 0.005, 0.02, 0.3
MODES, LQR_HZ = 2, 2000.0  # modes of each link that an LQR is designed on, and its rate
HOLDS = 400  # of the drives in a bang-bang motion
BAND = 0.1  # of frequencies, of the robust shortest motion


@dataclass(frozen=True)
class Motion:
    """What a method does: its drive from 0 s on, and when its motion is over [s].

    `wanted(t)`: where the tip should be (2,) [m]; None if the method follows no path.
    """

    drive: Any
    end_s: float
    wanted: Callable[[float], np.ndarray] | None


@dataclass(frozen=True)
class Method:
    """A method by its name in table and figure."""

    name: str
    motion: Callable[[Task], Motion]


def _on_set_points(task: Task, joints: tuple[Signal, ...], drive: Any) -> Motion:
    end = max(float(joint.breaks.max()) for joint in joints)
    return Motion(drive, end, lambda t: task.tip(joints, t))


def _controller(task: Task, joints: tuple[Signal, ...]) -> fx.Controller:
    kp, kd = task.gains
    pole = 2 * kp / kd
    rows = zip(joints, kp, INTEGRAL * kp * pole, kd, task.limits, strict=True)
    pids = (
        fx.PID(
            r,
            fx.Force(),
            kp=float(p),
            ki=float(i),
            kd=float(d),
            limit=float(most),
            derivative_Hz=DERIVATIVE_HZ,
        )
        for r, p, i, d, most in rows
    )
    return fx.Controller(tuple(pids), rate_Hz=RATE_HZ)


def pid(task: Task) -> Motion:
    """A PID in each joint follows the set-points."""
    return _on_set_points(task, task.set_points, _controller(task, task.set_points))


def bang_bang(task: Task) -> Motion:
    """The rigid robot's drives for constant accelerations of the joints and then the opposite ones,
    as short as the limits of the drives allow, and a PD in each joint."""

    def motion(duration: float) -> tuple[tuple[Signal, ...], np.ndarray, np.ndarray]:
        """The joints, the instants at which the drives change, and the drives (HOLDS, 2)."""
        ends = zip(task.start, task.end, strict=True)
        joints = tuple(trapezoidal(b, duration, duration / 2, a) for a, b in ends)
        t = np.linspace(0.0, duration, HOLDS + 1)
        run = fx.inverse(task.rigid, (t[:-1] + t[1:]) / 2, list(joints))
        return joints, t, np.column_stack([run[f"joint/{i}/drive"] for i in (1, 2)])

    over = lambda duration: float(np.max(np.abs(motion(duration)[2]) / task.limits)) - 1.0
    joints, t, drives = motion(brentq(over, task.duration_s / 4, 4 * task.duration_s, xtol=1e-6))
    rows = zip(drives.T, joints, *task.gains, strict=True)
    drive = Drive(
        tuple(
            JointDrive(piecewise(t, np.append(u, 0.0)), joint, kp=float(kp), kd=float(kd))
            for u, joint, kp, kd in rows
        )
    )
    return _on_set_points(task, joints, drive)


def shaped(shaper: Callable[..., Signal]) -> Callable[[Task], Motion]:
    """The same PIDs follow shaped set-points (78)."""

    def motion(task: Task) -> Motion:
        joints = tuple(shaper(signal, *task.mode) for signal in task.set_points)
        return _on_set_points(task, joints, _controller(task, joints))

    return motion


def regulator(task: Task) -> Motion:
    """An LQR with an estimator (74) to (76) follows the set-points."""
    data = task.robot.to_dict()
    for link, entry in zip(task.robot.links, data["link"], strict=True):
        if link.flexible:
            entry["modes"] = MODES
    controller, _ = lqr(
        fx.Robot.from_dict(data),
        replace(_controller(task, task.set_points), rate_Hz=LQR_HZ),
        EFFORT * task.limits,
        position=NEAR * np.abs(np.subtract(task.end, task.start)),
        deflection=BENT * task.robot.links[-1].length_m,
        disturbance=0.1 * task.limits,
    )
    return _on_set_points(task, task.set_points, controller)


def _feedforward(task: Task, run: fx.Run, wanted: Any, end_s: float) -> Motion:
    """A run's drives, and a PD in each joint towards its positions."""
    kp, kd = task.gains
    return Motion(fx.feedforward(run, kp=kp, kd=kd).drive, end_s, wanted)


def inversion(task: Task) -> Motion:
    """Feedforward by stable inversion (114): the tip is on the rigid robot's path."""
    t = np.linspace(0.0, task.duration_s, 301)
    path = tuple((lambda s, k=k: float(task.tip(task.set_points, float(s))[k])) for k in range(2))
    run = fx.invert(task.robot, t, path)
    before = -float(run.t[0])
    wanted = lambda s: task.tip(task.set_points, s - before)
    return _feedforward(task, run, wanted, before + task.duration_s)


def shortest(robust: float) -> Callable[[Task], Motion]:
    """Feedforward by the shortest motion (120)."""

    def motion(task: Task) -> Motion:
        limits = {"drive": task.limits}
        run = fx.time_optimal(task.robot, task.start, task.end, limits, robust)
        return _feedforward(task, run, None, float(run.t[-1]))

    return motion


METHODS = (
    Method("PID", pid),
    Method("PID, ZV", shaped(zv)),
    Method("PID, ZVD", shaped(zvd)),
    Method("bang-bang", bang_bang),
    Method("LQR", regulator),
    Method("inversion", inversion),
    Method("least time", shortest(0.0)),
    Method("least time, robust", shortest(BAND)),
)
