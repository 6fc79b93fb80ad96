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
from flexura.signals import Signal, evaluate_many, trapezoidal, zv, zvd

from .following import following, following_run
from .learning import PAYLOAD, STIFFNESS, trials
from .tasks import DERIVATIVE_HZ, RATE_HZ, Task

INTEGRAL = 0.2  # ki over kp and the pole of the joints' loops
# LQR: what counts the same, in shares of the ways, of the last link's length, of the drives' limits
NEAR, BENT, EFFORT = 0.005, 0.02, 0.3
MODES, LQR_HZ = 2, 2000.0  # modes of each link that feedback is designed on, and its rate
NMPC_HZ, NMPC_INTERVALS = 500.0, 20
HOLDS = 400  # of the drives in a bang-bang motion
LEFT = 0.2  # of the drives' limits, that bang-bang and the shortest motions leave to the PD
BAND = 0.1  # of frequencies, of the robust shortest motion


@dataclass(frozen=True)
class Motion:
    """What a method does: its drive from 0 s on, and when its motion is over [s].

    `wanted(t)`: where the tip should be (2,) [m]; None if the method follows no path. `about`: a
    sentence for the table.
    """

    drive: Any
    end_s: float
    wanted: Callable[[float], np.ndarray] | None
    about: str = ""


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
        """The joints, the instants of the drives (HOLDS,), and the drives (2, HOLDS)."""
        ends = zip(task.start, task.end, strict=True)
        joints = tuple(trapezoidal(b, duration, duration / 2, a) for a, b in ends)
        t = duration * (np.arange(HOLDS) + 0.5) / HOLDS
        run = fx.inverse(task.rigid, t, list(joints)).uninterrupted()
        return joints, t, np.array([run[f"joint/{i}/drive"] for i in (1, 2)])

    most = (1 - LEFT) * task.limits
    over = lambda T: float(np.max(np.abs(motion(T)[2]) / most[:, None])) - 1.0
    duration = brentq(over, task.duration_s / 4, 4 * task.duration_s, xtol=1e-6)
    joints, at, drives = motion(duration)
    t = np.linspace(0.0, duration, HOLDS + 1)
    drive = following(
        task,
        t,
        np.column_stack([evaluate_many(joint.segments, t)[0] for joint in joints]),
        lambda s: np.array([np.where(s < duration, np.interp(s, at, u), 0.0) for u in drives]),
    )
    return _on_set_points(task, joints, drive)


def shaped(shaper: Callable[..., Signal]) -> Callable[[Task], Motion]:
    """The same PIDs follow shaped set-points (78)."""

    def motion(task: Task) -> Motion:
        joints = tuple(shaper(signal, *task.mode) for signal in task.set_points)
        return _on_set_points(task, joints, _controller(task, joints))

    return motion


def _design(task: Task) -> fx.Robot:
    """The robot that feedback is designed on: some modes of each link."""
    data = task.robot.to_dict()
    for link, entry in zip(task.robot.links, data["link"], strict=True):
        if link.flexible:
            entry["modes"] = MODES
    return fx.Robot.from_dict(data)


def _weights(task: Task) -> dict[str, Any]:
    """What counts the same, for LQR, LQG and NMPC."""
    return {
        "position": NEAR * np.abs(np.subtract(task.end, task.start)),
        "deflection": BENT * task.robot.links[-1].length_m,
        "disturbance": 0.1 * task.limits,
    }


def regulator(task: Task) -> Motion:
    """An LQR with an estimator (74) to (76) follows the set-points."""
    pids = replace(_controller(task, task.set_points), rate_Hz=LQR_HZ)
    controller, _ = lqr(_design(task), pids, EFFORT * task.limits, **_weights(task))
    return _on_set_points(task, task.set_points, controller)


def gaussian(task: Task) -> Motion:
    """An LQG (127), whose tip follows the set-points."""
    controller, _ = fx.lqg(
        _design(task),
        task.set_points,
        EFFORT * task.limits,
        LQR_HZ,
        limit=task.limits,
        follow="tips",
        **_weights(task),
    )
    return _on_set_points(task, task.set_points, controller)


def predictive(task: Task) -> Motion:
    """An NMPC (131), (132), whose tip follows the set-points that it knows ahead."""
    controller = fx.nmpc(
        _design(task),
        task.set_points,
        task.limits,
        NMPC_HZ,
        intervals=NMPC_INTERVALS,
        limit=task.limits,
        **_weights(task),
    )
    return _on_set_points(task, task.set_points, controller)


def inversion(task: Task) -> Motion:
    """Feedforward by stable inversion (116): the tip is on the rigid robot's path."""
    t = np.linspace(0.0, task.duration_s, 301)
    path = tuple((lambda s, k=k: float(task.tip(task.set_points, float(s))[k])) for k in range(2))
    run = fx.invert(task.robot, t, path)
    before = -float(run.t[0])
    wanted = lambda s: task.tip(task.set_points, s - before)
    return Motion(following_run(task, run), before + task.duration_s, wanted)


def learned(task: Task) -> Motion:
    """The best of some trials, each of which learns from the one before."""
    tried = trials(task)
    best = min(tried, key=lambda trial: trial.error_m)
    wanted = lambda s: task.tip(task.set_points, s - best.begin_s)
    errors = ", ".join(f"{1e3 * trial.error_m:.3g}" for trial in tried)
    about = (
        f"learning: by a model with {STIFFNESS:g} of the stiffness and {PAYLOAD:g} of the payload; "
        f"tip errors of its {len(tried)} trials: {errors} mm"
    )
    return Motion(best.drive, best.begin_s + task.duration_s, wanted, about)


def shortest(robust: float) -> Callable[[Task], Motion]:
    """Feedforward by the shortest motion (122)."""

    def motion(task: Task) -> Motion:
        limits = {"drive": (1 - LEFT) * task.limits}
        run = fx.time_optimal(task.robot, task.start, task.end, limits, robust)
        return Motion(following_run(task, run), float(run.t[-1]), None)

    return motion


METHODS = (
    Method("PID", pid),
    Method("PID, ZV", shaped(zv)),
    Method("PID, ZVD", shaped(zvd)),
    Method("bang-bang", bang_bang),
    Method("LQR", regulator),
    Method("LQG", gaussian),
    Method("NMPC", predictive),
    Method("inversion", inversion),
    Method("learning", learned),
    Method("least time", shortest(0.0)),
    Method("least time, robust", shortest(BAND)),
)
