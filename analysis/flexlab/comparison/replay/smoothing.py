"""Measured positions as motions that a joint can be made to follow: twice differentiable, without
lag, as smooth as they may be.

A natural cubic smoothing spline s minimises sum (y - s(t))^2 + lambda int s''^2 dt (Reinsch 1967).
It is C2 and symmetric in time (no phase), and one number decides: lambda is the largest for which
the residual is what quantisation leaves, RMS = q / sqrt(12) with q the step between the values that
were measured (Morozov's discrepancy principle).
"""

from __future__ import annotations

import numpy as np

from flexura import signals
from flexura.errors import InputError
from flexura.signals import Signal

LEAST = 8  # samples of a motion
REST_S = 0.25  # how long before its start a motion is continued at rest


def known(t: np.ndarray, y: np.ndarray, channel: str) -> tuple[np.ndarray, np.ndarray]:
    """The samples that are there (not NaN). Raises InputError when they are too few to drive a
    joint by."""
    there = np.isfinite(y)
    if there.sum() < LEAST:
        raise InputError(
            f"expected at least {LEAST} samples that are not dropouts",
            key=channel,
            value=int(there.sum()),
        )
    return t[there], y[there]


def rest(t: np.ndarray) -> np.ndarray:
    """Times of the rest before t (k,), at the same rate [s]."""
    step = float(np.median(np.diff(t)))
    return t[0] - step * np.arange(round(REST_S / step), 0, -1)


def from_rest(t: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A motion with the rest before it."""
    earlier = rest(t)
    return np.concatenate([earlier, t]), np.concatenate([np.full(len(earlier), y[0]), y])


def resolution(y: np.ndarray) -> float:
    """The step between the values that occur: their smallest difference, 0 where all are the same
    or none occurs twice."""
    values = np.unique(y)
    if len(values) < 2 or len(values) > 0.9 * len(y):
        return 0.0
    steps = np.diff(values)
    return (
        float(steps[steps > 1e-9 * np.abs(values).max()].min(initial=np.inf)) if len(steps) else 0.0
    )


def onward(t: np.ndarray, y: np.ndarray) -> Signal:
    """The natural cubic spline through (t, y), which goes on after its end instead of stopping dead
    there."""
    through = signals.table(t, y)
    return Signal(through.segments[:-1], through.spec)


def smoothed(t: np.ndarray, y: np.ndarray, step: float | None = None) -> Signal:
    """The smoothing spline of y (k,) at ascending t (k,) [s]; `step`: of the quantisation, by
    default `resolution(y)`.

    Without quantisation the spline goes through every sample. Dropouts must have been left out: the
    spline spans them.
    """
    from scipy.interpolate import make_smoothing_spline

    step = resolution(y) if step is None else step
    noise = step / np.sqrt(12)
    if noise == 0.0 or np.ptp(y) <= 2 * step:
        return onward(t, y) if noise == 0.0 else signals.constant(float(np.mean(y)))
    scale = (t[-1] - t[0]) / (
        len(t) - 1
    )  # lambda in units of the sample time: the same range for every rate
    changes = np.diff(y) != 0.0
    moving = np.append(changes, False) | np.insert(
        changes, 0, False
    )  # at rest the error is a constant, not a noise
    low, high = -6.0, 12.0  # log10
    for _ in range(24):
        middle = (low + high) / 2
        fit = make_smoothing_spline(t, y, lam=10**middle * scale**3)(t)
        low, high = (
            (middle, high) if np.sqrt(np.mean((y - fit)[moving] ** 2)) < noise else (low, middle)
        )
    return onward(t, make_smoothing_spline(t, y, lam=10**low * scale**3)(t))
