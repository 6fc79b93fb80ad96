"""Programs timed side by side, in processor time.

Every round times each program in turn, so that other loads of the machine hit all alike. A quick
program runs several times in a round, of which the shortest counts. Ratios are formed round by
round.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

ROUND_S, MAX_REPEATS = 0.05, 15  # a quick program runs as often in a round as fits here


@dataclass(frozen=True)
class Ratio:
    """The median of a ratio over the rounds, and its quartiles."""

    low: float
    median: float
    high: float


def run_times(programs: list[Callable[[], float]], rounds: int) -> np.ndarray:
    """Time programs side by side.

    Args:
        programs: each returns the processor time of one run [s].
        rounds: number of rounds.

    Returns:
        Seconds (rounds, programs), the shortest of each round.
    """
    repeats = [int(np.clip(ROUND_S / max(run(), 1e-9), 1, MAX_REPEATS)) for run in programs]
    once = lambda run, count: min(run() for _ in range(count))
    return np.array(
        [
            [once(run, count) for run, count in zip(programs, repeats, strict=True)]
            for _ in range(rounds)
        ]
    )


def ratio(slow: np.ndarray, fast: np.ndarray) -> Ratio:
    """Ratio of two programs' times (rounds,), slow over fast."""
    low, median, high = (float(x) for x in np.percentile(slow / fast, (25, 50, 75)))
    return Ratio(low, median, high)


def geometric_mean(values: list[float]) -> float:
    """The geometric mean of positive values; NaN if there are none."""
    return float(np.exp(np.mean(np.log(values)))) if values else float("nan")
