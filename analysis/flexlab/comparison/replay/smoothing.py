"""Measured positions as motions that a joint can follow: smooth and without lag.

A natural cubic smoothing spline s minimises sum (y - s(t))^2 + lambda int s''^2 dt (Reinsch, Numer.
Math. 10 (1967) 177). It is twice continuously differentiable and has no phase lag. Morozov's
discrepancy principle gives lambda: the largest for which the RMS residual is that of quantisation,
q / sqrt(12), with q the step between measured values.
"""

from __future__ import annotations

import numpy as np

from flexura import signals
from flexura.errors import InputError
from flexura.signals import COLUMNS, Signal

MIN_SAMPLES = 8  # samples of a motion
REST_S = 0.25  # how long before its start a motion is continued at rest


def recorded_samples(t: np.ndarray, y: np.ndarray, channel: str) -> tuple[np.ndarray, np.ndarray]:
    """The samples that are not dropouts (NaN).

    Args:
        t: times (T,) [s].
        y: values (T,).
        channel: named in the error.

    Returns:
        Times and values (k,).

    Raises:
        InputError: fewer than MIN_SAMPLES are left.
    """
    there = np.isfinite(y)
    if there.sum() < MIN_SAMPLES:
        raise InputError(
            f"expected at least {MIN_SAMPLES} samples that are not dropouts",
            key=channel,
            value=int(there.sum()),
        )
    return t[there], y[there]


def initial_rest(t: np.ndarray) -> np.ndarray:
    """Times of a rest of REST_S before t (k,), at the same rate [s]."""
    step = float(np.median(np.diff(t)))
    return t[0] - step * np.arange(round(REST_S / step), 0, -1)


def with_initial_rest(t: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times and positions (k,) with a rest before them."""
    earlier = initial_rest(t)
    return np.concatenate([earlier, t]), np.concatenate([np.full(len(earlier), y[0]), y])


def resolution(y: np.ndarray) -> float:
    """The smallest difference between measured values; 0 if all are equal or none repeats."""
    values = np.unique(y)
    if len(values) < 2 or len(values) > 0.9 * len(y):
        return 0.0
    steps = np.diff(values)
    return (
        float(steps[steps > 1e-9 * np.abs(values).max()].min(initial=np.inf)) if len(steps) else 0.0
    )


def continue_past_end(t: np.ndarray, y: np.ndarray) -> Signal:
    """The natural cubic spline through (t, y), which continues past its end."""
    through = signals.table(t, y)
    return Signal(through.segments[:-1], through.spec)


def hermite(t: np.ndarray, y: np.ndarray, rates: np.ndarray) -> Signal:
    """The cubic polynomials through positions with their rates (k,); the last one goes on."""
    from scipy.interpolate import CubicHermiteSpline

    rows = np.zeros((len(t) - 1, COLUMNS))
    rows[:, 0] = t[:-1]
    rows[:, 1:5] = CubicHermiteSpline(t, y, rates).c[::-1].T
    return Signal(rows, {"kind": "hermite", "t_s": t.tolist(), "y": y.tolist()})


def from_rest(motion: Signal) -> Signal:
    """A motion that begins at rest: its first polynomial gets the rate within its own length."""
    rows = motion.segments.copy()
    if len(rows) < 2:
        return motion
    t = rows[:2, 0]
    (begin, _, _), (end, rate, _) = motion(t[0]), motion(t[1])
    rows[0] = hermite(t, np.array([begin, end]), np.array([0.0, rate])).segments[0]
    return Signal(rows, motion.spec)


def smoothed(t: np.ndarray, y: np.ndarray) -> Signal:
    """The smoothing spline of positions with a noise of unknown size: lambda by generalised
    cross-validation (Craven and Wahba, Numer. Math. 31 (1979) 377).

    Args:
        t: ascending times (k,) [s].
        y: positions (k,).
    """
    from scipy.interpolate import make_smoothing_spline

    if np.ptp(y) == 0.0:
        return signals.constant(float(y[0]))
    return continue_past_end(t, make_smoothing_spline(t, y)(t))


def smoothing_spline(t: np.ndarray, y: np.ndarray, step: float | None = None) -> Signal:
    """The smoothing spline of measured positions.

    Without quantisation the spline goes through every sample. Dropouts must have been removed; the
    spline spans them.

    Args:
        t: ascending times (k,) [s].
        y: positions (k,).
        step: step of the quantisation, by default `resolution(y)`.
    """
    from scipy.interpolate import make_smoothing_spline

    step = resolution(y) if step is None else step
    noise = step / np.sqrt(12)
    if noise == 0.0 or np.ptp(y) <= 2 * step:
        return continue_past_end(t, y) if noise == 0.0 else signals.constant(float(np.mean(y)))
    # lambda in units of the sample time: the same range for every rate
    scale = (t[-1] - t[0]) / (len(t) - 1)
    changes = np.diff(y) != 0.0
    # at rest the error is a constant, not a noise
    moving = np.append(changes, False) | np.insert(changes, 0, False)
    low, high = -6.0, 12.0  # log10
    for _ in range(24):
        middle = (low + high) / 2
        fit = make_smoothing_spline(t, y, lam=10**middle * scale**3)(t)
        low, high = (
            (middle, high) if np.sqrt(np.mean((y - fit)[moving] ** 2)) < noise else (low, middle)
        )
    return continue_past_end(t, make_smoothing_spline(t, y, lam=10**low * scale**3)(t))
