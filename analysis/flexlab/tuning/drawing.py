"""The picture of a search: its progress or its front, and what the best gains do."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

import flexura as fx
from flexura.io.drawing import COLOURS, STYLE
from flexura.optional import load

from .history import History
from .task import Task

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SETTLED = 0.02  # of the way: the band of the settling time
TRIED = "#b4b9c1"


def figure(task: Task, history: History, run: fx.Run) -> Figure:
    """Left: the objective over the evaluations, or the front of two goals. Right: the joints' ways
    and the tip deflection under the best gains.

    Args:
        task: what was tuned.
        history: all that was tried.
        run: of the best gains, with references.

    Raises:
        Missing: matplotlib is not installed.
    """
    matplotlib = load("matplotlib")
    with matplotlib.rc_context(STYLE):
        drawing = load("matplotlib.figure").Figure(figsize=(9.6, 4.4), layout="constrained")
        bent = [name for name in run if name.endswith("/tip_deflection")]
        left, right = drawing.subfigures(1, 2, wspace=0.04)
        search = left.subplots()
        (_front if task.pareto else _progress)(search, history)
        ways, *below = right.subplots(2 if bent else 1, 1, sharex=True, squeeze=False)[:, 0]
        _ways(ways, run)
        for axes in below:
            axes.plot(run.t, 1e3 * run[bent[-1]], color=COLOURS[1], linewidth=1.2)
            axes.set_ylabel("tip deflection [mm]")
        (below[-1] if below else ways).set_xlabel("time [s]")
        for axes in (search, ways):
            if axes.get_legend_handles_labels()[0]:
                _legend(axes)
    return drawing


def _progress(axes: Any, history: History) -> None:
    """The best objective so far, and the middle one of each generation."""
    objectives, starts = history.all("goals")[:, 0], [0, *history.ends[:-1]]
    middle = [np.median(objectives[a:b]) for a, b in zip(starts, history.ends, strict=True)]
    best = [objectives[:end].min() for end in history.ends]
    axes.plot(history.ends, middle, color=TRIED, linewidth=1.4, label="median of a generation")
    axes.plot(history.ends, best, color=COLOURS[0], linewidth=1.6, label="best so far")
    axes.set(xlabel="evaluations", ylabel="objective J [1]", yscale="log")
    ticker = load("matplotlib.ticker")
    shown = ticker.FuncFormatter(lambda value, _: f"{value:.3g}")
    axes.yaxis.set_major_locator(ticker.LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(shown)
    axes.yaxis.set_minor_formatter(ticker.NullFormatter())
    low, high = min(best), max(middle)
    if np.isfinite([low, high]).all() and high < 10 * low:  # too few numbers to read off
        axes.set_yscale("linear")
        axes.yaxis.set_major_formatter(shown)


def _front(axes: Any, history: History) -> None:
    """All gains that were tried by their two goals, the front, and the balanced ones."""
    objectives, front = history.all("goals"), history.pareto_front()
    axes.plot(objectives[:, 0], objectives[:, 1], ".", color=TRIED, markersize=3, label="all tried")
    axes.plot(
        objectives[front, 0],
        objectives[front, 1],
        "o-",
        color=COLOURS[0],
        markersize=3,
        label="front",
    )
    axes.plot(*objectives[history.best], "D", color=COLOURS[1], label="balanced")
    far = objectives[front].max(axis=0)
    axes.set(xlabel="settling time [s]", ylabel="rms of the tip deflection [mm]")
    axes.set(xlim=(0, 1.5 * far[0]), ylim=(0, 2 * far[1]))


def _ways(axes: Any, run: fx.Run) -> None:
    """What each joint has covered of its way; a joint that has none is left out."""
    axes.axhspan(1 - SETTLED, 1 + SETTLED, color="#e3e6ea", zorder=0)
    number = 1
    while f"joint/{number}/position" in run:
        y, reference = (
            run[f"joint/{number}/position"],
            run.channels.get(f"joint/{number}/reference"),
        )
        way = 0.0 if reference is None else float(reference[-1] - y[0])
        if abs(way) > 1e-12:
            colour = COLOURS[(number - 1) % len(COLOURS)]
            axes.plot(run.t, (y - y[0]) / way, color=colour, linewidth=1.3, label=f"joint {number}")
        number += 1
    axes.set_ylabel("covered of the way [1]")


def _legend(axes: Any) -> None:
    """Above the axes, where it covers no curve."""
    axes.legend(
        frameon=False,
        loc="lower left",
        bbox_to_anchor=(-0.02, 1.0),
        ncols=3,
        fontsize=8.5,
        borderaxespad=0.2,
        handlelength=1.6,
    )
