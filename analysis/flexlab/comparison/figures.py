"""Figures in the manner of the dissertation's Figs 4.16 to 4.21: simulation and experiment as two
lines, and their difference."""

from __future__ import annotations

from typing import Any

import numpy as np

from flexura.io import emulated
from flexura.io.drawing import STYLE, plain
from flexura.optional import load

from ..runs.deviation import deviation
from .measures import Comparison, Difference

# simulation, experiment, deviation, as in the review
BLUE, GREEN, PINK, INK = "#1f6fc4", "#1d9a50", "#c43a80", "#30343b"
RATIO = [2.3, 1]


def figure(c: Comparison, entry: Difference) -> Any:
    """One quantity's figure, a matplotlib Figure: both runs above, their difference below."""
    matplotlib = load("matplotlib")
    with matplotlib.rc_context(STYLE):
        drawing = load("matplotlib.figure").Figure(figsize=(7.4, 3.9), layout="constrained")
        draw(c, entry, *drawing.subplots(2, 1, height_ratios=RATIO))
        drawing.align_ylabels()
    return drawing


def draw(c: Comparison, entry: Difference, upper: Any, lower: Any) -> None:
    """The two runs and their difference into two axes."""
    scale, unit = (1e3, "mm") if entry.unit == "m" else (1.0, entry.unit)
    name = symbol(entry)
    first, second = c.simulation, c.experiment
    upper.plot(
        second.t,
        scale * second[entry.channel],
        color=GREEN,
        linewidth=2.6,
        alpha=0.75,
        label=plain(c.names[1]),
    )
    upper.plot(
        first.t, scale * first[entry.channel], color=BLUE, linewidth=1.1, label=plain(c.names[0])
    )
    t, values = deviation(first, second, entry.channel)
    lower.plot(t, scale * values, color=PINK, linewidth=0.9)
    lower.axhline(0.0, color="#9aa0a8", linewidth=0.7)
    if np.isfinite(entry.at_s):
        size = scale * values[np.nanargmax(np.abs(values))]
        lower.plot([entry.at_s], [size], "o", color=PINK, markersize=4)
        text = f"largest {abs(size):.3g} {unit}".removesuffix(" 1") + (
            f" = {100 * entry.max_relative:.3g} % of the peak" if entry.peak else ""
        )
        lower.set_title(plain(text), fontsize=8, loc="right", pad=2, color=PINK)
    upper.yaxis.set_offset_position("right")  # beside the legend
    upper.set_ylabel(f"{name} [{plain(unit)}]")
    lower.set_ylabel(plain(f"difference\n[{unit}]"))
    lower.set_xlabel("time [s]")
    ends = min(first.t[0], second.t[0]), max(first.t[-1], second.t[-1])
    for axes in (upper, lower):
        axes.set_xlim(*ends)
    upper.tick_params(labelbottom=False)
    upper.set_title(plain(heading(c, entry)), loc="left", fontsize=9.5, fontweight="bold", pad=17)
    upper.legend(
        frameon=False,
        loc="lower left",
        bbox_to_anchor=(-0.008, 0.99),
        ncols=2,
        borderaxespad=0.2,
        handlelength=1.6,
    )


def symbol(entry: Difference) -> str:
    """The symbol of a quantity in a figure.

    Args:
        entry: of the comparison.

    Returns:
        Mathematical text, for example $q_{2}$; of a channel without a symbol the last part of its
        name.
    """
    *_, number, name = ("", *entry.channel.split("/"))
    if not number.isdigit():
        return plain(name.replace("_", " "))
    if name == "tip_deflection":
        return f"$w_{{{number}}}$"
    if name == "position":
        return f"${'q' if entry.unit == 'rad' else 'd'}_{{{number}}}$"
    return plain(name.replace("_", " "))


def heading(c: Comparison, entry: Difference) -> str:
    """The heading of a quantity's figure.

    Args:
        c: the comparison.
        entry: the quantity.

    Returns:
        The text; nothing emulated goes without the word.
    """
    named = entry.quantity != entry.channel
    text = entry.quantity[0].upper() + entry.quantity[1:] if named else entry.channel
    return (
        text
        + (f", {c.experiment_kind}" if c.experiment_kind else "")
        + (" (emulated)" if is_emulated(c) else "")
    )


def is_emulated(c: Comparison) -> bool:
    """Whether one of the two runs is emulated.

    Args:
        c: the comparison.

    Returns:
        True if one is.
    """
    return emulated(c.simulation) or emulated(c.experiment)


def together(c: Comparison, size: tuple[float, float] | None = None) -> Any:
    """All quantities in one figure, one below the other."""
    size = size or (8.3, max(10.2, 3.4 * len(c.differences)))
    matplotlib = load("matplotlib")
    count = len(c.differences)
    with matplotlib.rc_context(STYLE):
        drawing = load("matplotlib.figure").Figure(figsize=size, layout="constrained")
        axes = drawing.subplots(2 * count, 1, height_ratios=RATIO * count)
        for k, entry in enumerate(c.differences):
            draw(c, entry, *axes[2 * k : 2 * k + 2])
        drawing.align_ylabels()
    return drawing
