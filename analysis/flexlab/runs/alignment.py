"""Two runs whose clocks began at different times: one is moved in time."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexura.errors import InputError
from flexura.io import Run

from .deviation import compared, interpolate

Pair = tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
COARSE = 20_000  # samples a run in the search over all shifts
FEWEST = 8


@dataclass(frozen=True)
class Shift:
    """Seconds that are added to the second run's times, and the correlation that is left."""

    seconds: float
    correlation: float


def shifted(run: Run, seconds: float) -> Run:
    """The run with later times, its events and phases too; `meta["shift_s"]` says by how much.

    Args:
        run: any run.
        seconds: may be negative.

    Raises:
        InputError: it is not finite.
    """
    if not np.isfinite(seconds):
        raise InputError("expected a finite time in seconds", key="shift", value=seconds)
    meta = dict(run.meta)
    meta["shift_s"] = seconds + float(meta.get("shift_s", 0.0))
    for key in ("events", "phases"):
        if key in meta:
            meta[key] = [{**entry, "t": entry["t"] + seconds} for entry in meta[key]]
    return dataclasses.replace(run, t=run.t + seconds, meta=meta)


def best_shift(first: Run, second: Run, channels: Sequence[str] | None = None) -> Shift:
    """The shift of the second run by which both agree best.

    Args:
        first: any run.
        second: any run.
        channels: by default those that `compared` names.

    The sum of squared differences of all channels that are compared, each by its range, is least.
    A run counts as at rest before its first and after its last sample. All shifts are tried first,
    on a coarse grid; then the least one is refined where both have samples.

    Raises:
        InputError: the runs have no channel in common that moves in both.
    """
    from scipy.signal import correlate

    names = compared(first, second) if channels is None else channels
    pairs = [pair for name in names if (pair := _pair(first, second, name))]
    if not pairs:
        raise InputError(
            "expected two runs with a channel in common, in one unit, that moves in both",
            key="--align",
        )
    long1, long2 = (max(float(np.ptp(t)) for t in ts) for ts in _times(pairs))
    begin1, begin2 = (min(float(t[0]) for t in ts) for ts in _times(pairs))
    step = max(long1, long2) / COARSE
    grid = np.arange(-long2, long1 + long2 + step, step)  # from the first run's begin on
    lags = np.arange(-long2, long1 + step, step) + (begin1 - begin2)
    lead = len(lags) - 1
    later = begin2 + step * np.arange(-lead, len(grid))
    costs = np.zeros(len(lags))
    for (t1, y1), (t2, y2) in pairs:  # held at both ends
        a, b = np.interp(begin1 + grid, t1, y1), np.interp(later, t2, y2)
        squares = np.concatenate([[0.0], np.cumsum(b**2)])
        own = squares[len(grid) :] - squares[: -len(grid)]
        costs += (own - 2 * correlate(b, a, "valid", "fft"))[::-1]
    near = float(lags[int(np.argmin(costs))])
    found = _refined(pairs, near, step)
    return Shift(found, _correlation(pairs, found))


def _pair(first: Run, second: Run, name: str) -> Pair | None:
    """Times and values of a channel in both runs, of range 1; None if it does not move in both."""
    if name not in first or name not in second:  # as the distance of the tips
        return None
    scale = 0.0
    out = []
    for run in (first, second):
        there = np.isfinite(run[name])
        if there.sum() < FEWEST:
            return None
        t, y = run.t[there], run[name][there]
        scale = max(scale, float(np.ptp(y)))
        out.append((t, y))
    if min(float(np.ptp(y)) for _, y in out) < 1e-6 * scale or scale == 0.0:
        return None
    (t1, y1), (t2, y2) = out
    return (t1, y1 / scale), (t2, y2 / scale)


def _times(pairs: list[Pair]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    return [first[0] for first, _ in pairs], [second[0] for _, second in pairs]


def _refined(pairs: list[Pair], near: float, step: float) -> float:
    from scipy.optimize import minimize_scalar

    def cost(lag: float) -> float:
        total = 0.0
        for (t1, y1), (t2, y2) in pairs:
            inside = (t1 >= t2[0] + lag) & (t1 <= t2[-1] + lag)
            if inside.sum() >= FEWEST:
                apart = y1[inside] - interpolate(t1[inside] - lag, t2, y2)
            else:
                apart = y1 - np.interp(t1 - lag, t2, y2)
            total += float(np.mean(apart**2))
        return total

    trial = near + step * np.linspace(-2, 2, 41)
    best = float(trial[int(np.argmin([cost(lag) for lag in trial]))])
    width = step / 10
    found = minimize_scalar(
        cost, bounds=(best - width, best + width), method="bounded", options={"xatol": 1e-9}
    )
    return float(found.x if found.fun <= cost(best) else best)


def _correlation(pairs: list[Pair], lag: float) -> float:
    """The least correlation of a channel where both runs have samples; NaN without any."""
    found = []
    for (t1, y1), (t2, y2) in pairs:
        inside = (t1 >= t2[0] + lag) & (t1 <= t2[-1] + lag)
        if inside.sum() < FEWEST:
            continue
        a, b = y1[inside], interpolate(t1[inside] - lag, t2, y2)
        a, b = a - a.mean(), b - b.mean()
        size = float(np.sqrt((a @ a) * (b @ b)))
        if size > 0:
            found.append(float(a @ b) / size)
    return min(found, default=float("nan"))
