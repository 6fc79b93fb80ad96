"""The time between a command and its response, estimated from both below a sample, and how sure
that is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Delay:
    """By how much the response lags [s], the standard deviation of that [s], and the correlation
    that is left there (1 = the same shape)."""

    seconds: float
    std: float
    correlation: float


def delay(
    t: np.ndarray, command: np.ndarray, response: np.ndarray, most_s: float = 0.5
) -> Delay | None:
    """Lag of `response` (T,) behind `command` (T,), both at (nearly) even times; None where nothing
    moves.

    The peak of the normalised cross-correlation gives the lag to a sample, a parabola through it
    and its neighbours a start, Gauss-Newton on  response(t) = a + b command(t - lag)  the rest. The
    residual's variance over the slope's energy is the lag's variance; residuals that hang together
    over n samples count as one.
    """
    there = np.isfinite(command) & np.isfinite(response)
    if there.sum() < 32:
        return None
    first, last = np.flatnonzero(there)[[0, -1]]
    part = slice(first, last + 1)
    t, there = t[part], there[part]
    x, y = (
        np.interp(t, t[there], values[part][there]) for values in (command, response)
    )  # only to correlate, never stored
    spacing = float(t[-1] - t[0]) / (len(t) - 1)
    if x.std() < 1e-12 or y.std() < 1e-12:
        return None
    most = min(round(most_s / spacing), len(t) // 2)
    lags = np.arange(-most, most + 1)
    c = np.array([_correlation(x, y, int(k)) for k in lags])
    k = int(np.argmax(c))
    start = float(lags[k])
    if 0 < k < len(c) - 1 and (bend := c[k - 1] - 2 * c[k] + c[k + 1]) < 0:
        start += 0.5 * (c[k - 1] - c[k + 1]) / bend
    return _refined(t, x, y, there, start * spacing)


def _correlation(x: np.ndarray, y: np.ndarray, k: int) -> float:
    a, b = (x[: len(x) - k], y[k:]) if k >= 0 else (x[-k:], y[:k])
    a, b = a - a.mean(), b - b.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / size if size > 0 else 0.0


def _refined(
    t: np.ndarray, x: np.ndarray, y: np.ndarray, there: np.ndarray, lag: float
) -> Delay | None:
    from scipy.interpolate import CubicSpline

    course = CubicSpline(t, x)
    spacing = float(t[-1] - t[0]) / (len(t) - 1)
    for _ in range(20):
        use = there & (t - lag >= t[0]) & (t - lag <= t[-1])
        if use.sum() < 16:
            return None
        shifted, slope = course(t[use] - lag), course(t[use] - lag, 1)
        ones = np.ones(int(use.sum()))
        gain = np.polyfit(shifted, y[use], 1)[0]
        A = np.stack([ones, shifted, -gain * slope], axis=1)
        solved, *_ = np.linalg.lstsq(A, y[use], rcond=None)
        lag += float(np.clip(solved[2], -spacing, spacing))
        if abs(solved[2]) < 1e-3 * spacing:
            break
    residual = y[use] - A @ solved
    count = len(residual)
    free = max(count / _memory(residual) - 3, 1.0)
    try:
        spread = np.linalg.inv(A.T @ A / count)
    except np.linalg.LinAlgError:
        return None
    variance = float(residual @ residual) / count * spread[2, 2] / free
    fit = float(np.corrcoef(course(t[use] - lag), y[use])[0, 1])
    return Delay(lag, float(np.sqrt(max(variance, 0.0))), fit)


def _memory(residual: np.ndarray) -> float:
    """Over how many samples the residual hangs together: 1 + 2 x its autocorrelation, summed to the
    first change of sign."""
    e = residual - residual.mean()
    power = float(e @ e)
    if power == 0.0:
        return 1.0
    total = 1.0
    for k in range(1, len(e) // 2):
        r = float(e[:-k] @ e[k:]) / power
        if r <= 0:
            break
        total += 2 * r
    return total
