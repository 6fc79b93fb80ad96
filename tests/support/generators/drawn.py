"""A random generator whose numbers Hypothesis draws, so that what the generators make is shrunk."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from hypothesis import strategies as st

PARTS = 1000


class Drawn:
    """What the generators call of numpy.random.Generator; small numbers and first choices are
    simplest."""

    def __init__(self, data: Any) -> None:
        self.data = data

    def random(self) -> float:
        """Between 0 and 1; the simplest is nearly 1, at which no option is taken."""
        return 1.0 - (self.data.draw(st.integers(0, PARTS - 1)) + 1) / (PARTS + 1)

    def uniform(self, low: float = 0.0, high: float = 1.0, size: int | None = None) -> Any:
        """Between low and high; the simplest is the middle."""
        one = lambda: low + (high - low) * (0.5 + self.data.draw(_part()) / (2 * PARTS))
        return one() if size is None else np.array([one() for _ in range(size)])

    def integers(self, low: int, high: int | None = None) -> int:
        """A whole number below high."""
        low, high = (0, low) if high is None else (low, high)
        return int(self.data.draw(st.integers(int(low), int(high) - 1)))

    def choice(self, items: Sequence[Any]) -> Any:
        """One of the items."""
        return self.data.draw(st.sampled_from(list(items)))

    def normal(self, size: int | None = None) -> Any:
        """Between -3 and 3."""
        return self.uniform(-3.0, 3.0, size)


def _part() -> st.SearchStrategy[int]:
    return st.integers(-PARTS, PARTS)
