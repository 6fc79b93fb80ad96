"""Feedforward and a PD in each joint, once a tick, within the drives' limits."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from flexura import Run, Sampled
from flexura.signals import evaluate_many, table

from .tasks import DERIVATIVE_HZ, RATE_HZ, Task

FINE = 8  # instants in a tick, in which a feedforward is averaged


def following(
    task: Task, t: np.ndarray, positions: np.ndarray, drive: Callable[[np.ndarray], np.ndarray]
) -> Sampled:
    """Drives that are given ahead, and a PD in each joint towards its motion; the sum is limited.

    Args:
        task: the task: its gains and limits.
        t: times (T,) [s], from 0 on.
        positions: of the joints at these times (T, 2) [m or rad]; then they stay.
        drive: the drives (2, N) [N or N m] at instants (N,).

    Returns:
        The drive of a run.
    """
    ticks = int(np.ceil(t[-1] * RATE_HZ)) + 1
    at = (np.arange(ticks * FINE) + 0.5) / (FINE * RATE_HZ)
    mean = drive(at).reshape(2, ticks, FINE).mean(axis=2).T
    now = np.arange(ticks) / RATE_HZ
    wanted = np.column_stack([evaluate_many(table(t, x).segments, now)[0] for x in positions.T])
    return Sampled(_Law(task, mean, wanted), RATE_HZ)


def following_run(task: Task, run: Run) -> Sampled:
    """A run's drives, linear between its rows, and a PD in each joint towards its positions.

    Args:
        task: the task: its gains and limits.
        run: the run; its first row becomes 0 s.

    Returns:
        The drive of a run.
    """
    t = run.t - run.t[0]
    drives = [run[f"joint/{i}/drive"] for i in (1, 2)]
    positions = np.column_stack([run[f"joint/{i}/position"] for i in (1, 2)])
    ahead = lambda s: np.array([np.interp(s, t, u) for u in drives])
    return following(task, t, positions, ahead)


class _Law:
    """The law of `following`: u = f + kp e + kd e', with e' through the filter of the PIDs."""

    def __init__(self, task: Task, drives: np.ndarray, wanted: np.ndarray) -> None:
        self.drives, self.wanted, self.limits = drives, wanted, task.limits
        self.kp, self.kd = task.gains
        self.share = 1 - math.exp(-2 * math.pi * DERIVATIVE_HZ / RATE_HZ)
        self.error, self.rate = np.zeros(2), np.zeros(2)

    def __call__(
        self, t: float, position: np.ndarray, velocity: np.ndarray, tip_deflection: float
    ) -> np.ndarray:
        """The forces (2,) at a tick [N or N m]."""
        k = min(round(t * RATE_HZ), len(self.drives) - 1)
        error = self.wanted[k] - position
        if t == 0.0:  # a run begins
            self.error, self.rate = error, np.zeros(2)
        self.rate = self.rate + self.share * ((error - self.error) * RATE_HZ - self.rate)
        self.error = error
        asked = self.drives[k] + self.kp * error + self.kd * self.rate
        return np.clip(asked, -self.limits, self.limits)
