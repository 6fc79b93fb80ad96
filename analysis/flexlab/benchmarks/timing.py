"""Programs timed side by side, in processor time.

Every round times each program in turn, so that whatever else the machine does hits all alike; a
quick one runs several times in a round, of which the shortest counts. Ratios are formed round by
round.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

ROUND_S, MOST = 0.05, 15  # a quick program runs as often in a round as fits here


@dataclass(frozen=True)
class Ratio:
    """The median of a ratio over the rounds, and its quartiles."""

    low: float
    median: float
    high: float


def walls(programs: list[Callable[[], float]], rounds: int) -> np.ndarray:
    """Seconds (rounds, programs), the shortest of a round's runs; `programs` give the seconds of
    one run."""
    repeats = [int(np.clip(ROUND_S / max(run(), 1e-9), 1, MOST)) for run in programs]
    once = lambda run, count: min(run() for _ in range(count))
    return np.array(
        [
            [once(run, count) for run, count in zip(programs, repeats, strict=True)]
            for _ in range(rounds)
        ]
    )


def ratio(slow: np.ndarray, fast: np.ndarray) -> Ratio:
    """How many times as fast, from the seconds (rounds,) of two programs."""
    low, median, high = (float(x) for x in np.percentile(slow / fast, (25, 50, 75)))
    return Ratio(low, median, high)


def geometric_mean(values: list[float]) -> float:
    return float(np.exp(np.mean(np.log(values)))) if values else float("nan")
