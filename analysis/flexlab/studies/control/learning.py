"""Iterative learning of a motion on a robot that is not the model: inversion, trial by trial."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import flexura as fx

from .following import following_run
from .tasks import Task

TRIALS = 8
STIFFNESS, PAYLOAD = 0.9, 1.1  # the model's, over the robot's
AFTER = 0.5  # of the set-points' duration: how long after it the tip's path is learned too
KNOT_S = 0.02  # between knots of the splines that a change is made of
ROW_S = 1e-3
RTOL = 1e-7


@dataclass(frozen=True)
class Trial:
    """A trial: its drive, when the path begins in it [s], and the tip's largest error [m]."""

    drive: fx.Sampled
    begin_s: float
    error_m: float


def model(robot: fx.Robot) -> fx.Robot:
    """The robot as a model has it that was not measured well: other stiffness and payload.

    Args:
        robot: the robot.

    Returns:
        The model.
    """
    data = robot.to_dict()
    for link in data["link"]:
        for key in ("young_modulus_Pa", "bending_stiffness_N_m2"):
            if key in link:
                link[key] *= STIFFNESS
    data["payload"]["mass_kg"] *= PAYLOAD
    return fx.Robot.from_dict(data)


def trials(task: Task, count: int = TRIALS) -> list[Trial]:
    """Trials of a motion, whose drives are the model's inverse of a path of the tip.

    The first path is the wanted one. To the path of each further trial the error of the trial
    before is added: the wanted place of the tip less the one that was reached.

    Args:
        task: the task, whose robot does the trials.
        count: how many.

    Returns:
        The trials.
    """
    t = np.arange(0.0, (1 + AFTER) * task.duration_s, ROW_S)
    wanted = np.array([task.tip(task.set_points, s) for s in np.minimum(t, task.duration_s)])
    asked, described, out = wanted.copy(), model(task.robot), []
    basis = _splines(t)
    for _ in range(count):
        run = fx.invert(described, t, (asked[:, 0], asked[:, 1]))
        before, drive = -float(run.t[0]), following_run(task, run)
        rows = np.append(0.0, before + t) if before > 0 else t
        did = fx.simulate(task.robot, rows, drive, rtol=RTOL).uninterrupted()
        lacks = wanted - np.column_stack([did["tip/x"], did["tip/y"]])[-len(t) :]
        out.append(Trial(drive, before, float(np.hypot(*lacks.T).max())))
        asked = asked + basis @ np.linalg.lstsq(basis, lacks, rcond=None)[0]
    return out


def _splines(t: np.ndarray) -> np.ndarray:
    """Cubic B-splines (T, n) that begin and end at 0, with their first two derivatives."""
    from scipy.interpolate import BSpline

    knots = np.linspace(t[0], t[-1], max(int((t[-1] - t[0]) / KNOT_S), 5) + 1)
    return np.column_stack(
        [
            np.nan_to_num(BSpline.basis_element(knots[k : k + 5], extrapolate=False)(t))
            for k in range(len(knots) - 4)
        ]
    )
