"""The vertical axis of a plot in the viewer: room for the legend, and numbers to read off."""

from __future__ import annotations

import math
from dataclasses import dataclass

# the height of a plot, of one below another, and of a legend's line in a window of 900 pixels
PLOT_PX, LOW_PX, LINE_PX, LINE_CHARS = 265, 140, 23, 36
LABEL_PX = 26  # the viewer numbers the powers of ten that are at least so far apart


@dataclass(frozen=True)
class Signal:
    """One curve over time: its unit, its name in the legend, its smallest and largest value."""

    unit: str
    label: str
    low: float
    high: float


Signals = dict[str, Signal]  # by entity path


def value_range(signals: Signals, height: int = PLOT_PX) -> tuple[float, float]:
    """The range of a plot's vertical axis: all values, room for the legend above them, and at least
    two numbers to read off, three where the curves do not get too flat for it.

    The viewer numbers the multiples of a power of ten only: of the smallest whose multiples are
    LABEL_PX apart. The range grows until enough of them lie in it.
    """
    low, high = min(s.low for s in signals.values()), max(s.high for s in signals.values())
    if high - low <= 1e-9 * max(abs(low), abs(high)):
        spare = 0.1 * max(abs(low), abs(high)) or 1.0
        low, high = low - spare, high + spare
    lines = sum(-(-len(s.label) // LINE_CHARS) for s in signals.values())
    share = min((LINE_PX * lines + 14) / height, 0.6)
    tall = high - low
    low, high = low - 0.05 * tall, high + tall * share / (1 - share)
    for wanted, least in ((3, 0.6), (2, 0.0)):
        found = _numbered(low, high, height, wanted)
        if high - low >= least * (found[1] - found[0]):
            return found
    return low, high


def _numbered(low: float, high: float, height: int, wanted: int) -> tuple[float, float]:
    """The smallest range around low and high in which the viewer numbers `wanted` values."""
    edge = 8 / height * (high - low)  # a number at the very edge is cut
    step = 10.0 ** math.ceil(math.log10((high - low) * LABEL_PX / height))
    first, last = math.ceil((low + edge) / step), math.floor((high - edge) / step)
    while last - first + 1 < wanted:
        down, up = low - (first - 1) * step, (last + 1) * step - high
        if up <= down:
            last += 1
            high = last * step + edge
        else:
            first -= 1
            low = first * step - edge
    return low, high
