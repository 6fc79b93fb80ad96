"""Which samples of a run are drawn: shapes at frame rate, long signals thinned without losing their
extremes."""

from __future__ import annotations

import numpy as np

FRAME_RATE = 60.0  # shapes a second of data: more than a screen shows
MAX_FRAMES = 6000  # of one run: a long run gets fewer shapes a second
MAX_SAMPLES = 1_000_000  # scalars of one review: beyond, the viewer needs seconds a frame


def frames(t: np.ndarray) -> np.ndarray:
    """The samples whose shape is drawn: at most FRAME_RATE a second and MAX_FRAMES in all.

    Args:
        t: times (T,) [s].

    Returns:
        Indices (F,), both ends included.
    """
    t = np.asarray(t, dtype=float)
    if len(t) == 0:
        return np.zeros(0, dtype=np.int64)
    rate = min(FRAME_RATE, (MAX_FRAMES - 2) / max(t[-1] - t[0], 1e-9))
    bins = np.floor((t - t[0]) * rate + 1e-6)
    first = np.flatnonzero(np.diff(bins, prepend=-1.0) > 0)
    return np.union1d(first, [len(t) - 1]).astype(np.int64)


def thinned(y: np.ndarray, budget: int) -> np.ndarray:
    """The samples that keep the smallest and largest value and one gap (NaN) of each equal block.

    Args:
        y: values (T,).
        budget: number of samples to keep.

    Returns:
        Ascending indices (K,), K <= budget + 2.
    """
    y = np.asarray(y, dtype=float)
    if len(y) <= budget:
        return np.arange(len(y), dtype=np.int64)
    blocks = max(budget // 3, 1)
    per = -(-len(y) // blocks)
    # repeating the end adds no new value
    padded = np.append(y, np.full(blocks * per - len(y), y[-1])).reshape(blocks, per)
    gap = np.isnan(padded)
    places = [
        np.where(gap, np.inf, padded).argmin(axis=1),
        np.where(gap, -np.inf, padded).argmax(axis=1),
        gap.argmax(axis=1),
    ]
    keep = np.concatenate([np.arange(blocks) * per + place for place in places] + [[0, len(y) - 1]])
    return np.unique(np.minimum(keep, len(y) - 1)).astype(np.int64)
