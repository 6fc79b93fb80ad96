"""The figure of `flexura study control`, as wide as one column of a paper: a column a robot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from flexura.io.drawing import LETTERS, plain
from flexura.optional import load

from .judgement import PAYLOADS, SETTLED, Judged, from_end
from .tasks import Task

# Okabe and Ito: told apart by colour-blind readers too; markers and dashes tell them in print
FAMILIES = {
    "PID": ("#000000", "o"),
    "bang": ("#E69F00", "D"),
    "L": ("#0072B2", "s"),
    "NMPC": ("#0072B2", "s"),
    "least": ("#D55E00", "^"),
}
OTHERS = ("#009E73", "v")
CURVES = {
    "PID": ("#000000", "-"),
    "PID, ZVD": ("#7F7F7F", (0, (1, 1))),
    "NMPC": ("#0072B2", (0, (5, 1.5))),
    "inversion": ("#009E73", "-"),
    "least time": ("#D55E00", (0, (4, 1, 1, 1))),
}
FONT = LETTERS | {
    "font.size": 6.5,
    "axes.linewidth": 0.5,
}
WIDTH_IN, ROW_IN = 3.5, 0.115  # of a column, of a method in a panel
LEAST_MM, MOST_MM = 5e-4, 2e2  # what the axes of lengths show


def figure(study: Mapping[str, tuple[Task, list[Judged]]]) -> Any:
    """The study's figure, a matplotlib Figure.

    Args:
        study: by robot, its task and methods.

    Returns:
        A column a robot: the tip's distance from its end over time, for some methods; tip error and
        residual, the time, and the largest share of the drives, for all, with three payloads.
    """
    matplotlib = load("matplotlib")
    Figure = load("matplotlib.figure").Figure
    methods = max(len(judged) for _, judged in study.values())
    heights = [1.15, *[ROW_IN * methods] * 3]
    with matplotlib.rc_context(FONT):
        drawing = Figure(figsize=(WIDTH_IN, sum(heights) + 2.0), layout="constrained")
        drawing.get_layout_engine().set(w_pad=0.02, h_pad=0.03, hspace=0.01, wspace=0.02)
        axes = drawing.subplots(
            4, len(study), squeeze=False, gridspec_kw={"height_ratios": heights}
        )
        for k, (task, judged) in enumerate(study.values()):
            _over_time(axes[0, k], task, judged)
            _lengths(axes[1, k], judged)
            _times(axes[2, k], judged)
            _drives(axes[3, k], task, judged)
            axes[0, k].set_title(plain(task.robot.name), fontweight="bold", fontsize=7, pad=10)
        for k, axis in enumerate(axes.flat):
            axis.annotate(
                f"({chr(97 + k)})",
                (0, 1),
                xytext=(1, 2),
                xycoords="axes fraction",
                textcoords="offset points",
            )
            axis.grid(alpha=0.3, linewidth=0.4)
            axis.set_axisbelow(True)
            axis.tick_params(width=0.5, length=2, pad=1.5)
            axis.minorticks_off()
            if k % len(study) and axis.get_yticks().size:
                axis.tick_params(labelleft=False)
                axis.set_ylabel("")
        handles, labels = axes[0, 0].get_legend_handles_labels()
        drawing.legend(
            handles,
            labels,
            loc="outside upper center",
            ncols=3,
            columnspacing=1.2,
            handlelength=2.6,
            frameon=False,
            title="top row",
        )
        drawing.canvas.draw()
    return drawing


def _over_time(axis: Any, task: Task, judged: list[Judged]) -> None:
    for row in judged:
        if row.method not in CURVES:
            continue
        colour, dashes = CURVES[row.method]
        t = row.run.t - row.begin_s
        away = np.maximum(1e3 * from_end(task, row.run), 1e-9)
        shown = t >= 0
        axis.semilogy(
            t[shown], away[shown], linestyle=dashes, color=colour, linewidth=0.9, label=row.method
        )
    axis.set_xlim(0, 2 * task.duration_s)
    axis.set_ylim(1e-3, 1e3)
    axis.set_yticks([1e-3, 1e-1, 1e1, 1e3])
    axis.set_xlabel("time [s]", labelpad=1)
    axis.set_ylabel("tip from its end [mm]", labelpad=1)


def _lengths(axis: Any, judged: list[Judged]) -> None:
    for name, height, filled in (("error_m", -0.2, False), ("residual_m", 0.2, True)):
        rows = [[1e3 * getattr(f, name) for f in row.figures] for row in judged]
        _marks(axis, judged, np.maximum(rows, 1.2 * LEAST_MM), height, filled)
    axis.set_xscale("log")
    axis.set_xlim(LEAST_MM, MOST_MM)
    axis.set_xticks([1e-3, 1e-1, 1e1])
    axis.set_xlabel("tip error (open),\nresidual (filled) [mm]", labelpad=1)
    _names(axis, judged)


def _times(axis: Any, judged: list[Judged]) -> None:
    _marks(axis, judged, np.array([[f.time_s for f in row.figures] for row in judged]))
    axis.set_xlim(left=0)
    axis.set_xlabel(f"time to {100 * SETTLED:.0f} % [s]", labelpad=1)
    _names(axis, judged)


def _drives(axis: Any, task: Task, judged: list[Judged]) -> None:
    shares = [[np.max(np.divide(f.peak, task.limits)) for f in row.figures] for row in judged]
    _marks(axis, judged, np.array(shares))
    axis.axvline(1.0, color="0.4", linewidth=0.7, linestyle="--")
    axis.set_xlim(0, 1.1)
    axis.set_xticks([0, 0.5, 1])
    most = 100 * (max(PAYLOADS) - 1)
    axis.set_xlabel(f"largest drive / limit\n(bars: payload ±{most:.0f} %)", labelpad=1)
    _names(axis, judged)


def _marks(
    axis: Any, judged: list[Judged], values: np.ndarray, height: float = 0.0, filled: bool = True
) -> None:
    """A mark of the payload as it is, and a bar over all payloads; none where there is no value."""
    for k, (row, three) in enumerate(zip(judged, values, strict=True)):
        colour, mark = _style(row.method)
        there = three[np.isfinite(three)]
        if not len(there):
            continue
        at = k + height
        axis.plot([there.min(), there.max()], [at, at], "-", color=colour, linewidth=0.9)
        if np.isfinite(three[0]):
            face = colour if filled else "white"
            axis.plot(
                three[0],
                at,
                mark,
                color=colour,
                markerfacecolor=face,
                markersize=3,
                markeredgewidth=0.7,
            )


def _names(axis: Any, judged: list[Judged]) -> None:
    axis.set_yticks(range(len(judged)), [row.method for row in judged])
    axis.set_ylim(len(judged) - 0.5, -0.5)


def _style(method: str) -> tuple[str, str]:
    return next((style for key, style in FAMILIES.items() if method.startswith(key)), OTHERS)
