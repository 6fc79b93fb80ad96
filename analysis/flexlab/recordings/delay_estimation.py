"""The delay between a command and its response, to a fraction of a sample, with its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Delay:
    """Lag of the response [s], its standard deviation [s], and the correlation at that lag."""

    seconds: float
    std: float
    correlation: float


def estimate_delay(
    t: np.ndarray, command: np.ndarray, response: np.ndarray, max_lag_s: float = 0.5
) -> Delay | None:
    """Lag of a response behind its command.

    The peak of the normalised cross-correlation gives the lag to a sample. A parabola through the
    peak and its neighbours is the start of Gauss-Newton on response(t) = a + b command(t - lag).
    The variance of the lag is the residual's variance over the slope's energy; n correlated
    residuals count as one.

    Args:
        t: nearly even times (T,) [s].
        command: values (T,), NaN if missing.
        response: values (T,), NaN if missing.
        max_lag_s: the largest lag [s].

    Returns:
        The delay, or None if nothing moves.
    """
    recorded = np.isfinite(command) & np.isfinite(response)
    if recorded.sum() < 32:
        return None
    first, last = np.flatnonzero(recorded)[[0, -1]]
    part = slice(first, last + 1)
    t, recorded = t[part], recorded[part]
    # only to correlate, never stored
    x, y = (np.interp(t, t[recorded], values[part][recorded]) for values in (command, response))
    spacing = float(t[-1] - t[0]) / (len(t) - 1)
    if x.std() < 1e-12 or y.std() < 1e-12:
        return None
    max_lag = min(round(max_lag_s / spacing), len(t) // 2)
    lags = np.arange(-max_lag, max_lag + 1)
    c = np.array([_correlation(x, y, int(k)) for k in lags])
    k = int(np.argmax(c))
    start = float(lags[k])
    if 0 < k < len(c) - 1 and (bend := c[k - 1] - 2 * c[k] + c[k + 1]) < 0:
        start += 0.5 * (c[k - 1] - c[k + 1]) / bend
    return _refine(t, x, y, recorded, start * spacing)


def _correlation(x: np.ndarray, y: np.ndarray, k: int) -> float:
    a, b = (x[: len(x) - k], y[k:]) if k >= 0 else (x[-k:], y[:k])
    a, b = a - a.mean(), b - b.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / size if size > 0 else 0.0


def _refine(
    t: np.ndarray, x: np.ndarray, y: np.ndarray, recorded: np.ndarray, lag: float
) -> Delay | None:
    from scipy.interpolate import CubicSpline

    command_spline = CubicSpline(t, x)
    spacing = float(t[-1] - t[0]) / (len(t) - 1)
    for _ in range(20):
        overlap = recorded & (t - lag >= t[0]) & (t - lag <= t[-1])
        if overlap.sum() < 16:
            return None
        shifted, slope = command_spline(t[overlap] - lag), command_spline(t[overlap] - lag, 1)
        ones = np.ones(int(overlap.sum()))
        gain = np.polyfit(shifted, y[overlap], 1)[0]
        A = np.stack([ones, shifted, -gain * slope], axis=1)
        solved, *_ = np.linalg.lstsq(A, y[overlap], rcond=None)
        lag += float(np.clip(solved[2], -spacing, spacing))
        if abs(solved[2]) < 1e-3 * spacing:
            break
    residual = y[overlap] - A @ solved
    count = len(residual)
    degrees_of_freedom = max(count / _correlated_samples(residual) - 3, 1.0)
    try:
        inverse_normal = np.linalg.inv(A.T @ A / count)
    except np.linalg.LinAlgError:
        return None
    variance = float(residual @ residual) / count * inverse_normal[2, 2] / degrees_of_freedom
    fit = float(np.corrcoef(command_spline(t[overlap] - lag), y[overlap])[0, 1])
    return Delay(lag, float(np.sqrt(max(variance, 0.0))), fit)


def _correlated_samples(residual: np.ndarray) -> float:
    """Number of samples over which the residual is correlated.

    1 + 2 x its autocorrelation, summed to the first change of sign.
    """
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
