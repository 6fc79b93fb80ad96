"""The figure of `flexura study control`: one row of axes a robot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from flexura.optional import load

from .judgement import PAYLOADS, Judged, from_end
from .tasks import Task

# Okabe and Ito: told apart by colour-blind readers too, and by their dashes in print
STYLES = (
    ("#000000", "-", "o"),
    ("#E69F00", "--", "s"),
    ("#D55E00", ":", "D"),
    ("#7F7F7F", "-.", "<"),
    ("#009E73", "-", "^"),
    ("#0072B2", "-", "v"),
    ("#CC79A7", "--", "P"),
    ("#56B4E9", "-", "X"),
)
FONT = {"font.size": 7, "axes.linewidth": 0.6, "svg.hashsalt": "flexura", "pdf.fonttype": 42}
LEAST_MM = 1.2e-3  # what the axes show


def figure(study: Mapping[str, tuple[Task, list[Judged]]]) -> Any:
    """The study's figure, a matplotlib Figure.

    Args:
        study: by robot, its task and methods.

    Returns:
        A row a robot: the tip's distance from its end over time; what is left after the motion with
        three payloads; time against the largest share of the drives.
    """
    matplotlib = load("matplotlib")
    Figure = load("matplotlib.figure").Figure
    with matplotlib.rc_context(FONT):
        drawing = Figure(figsize=(7.2, 2.5 * len(study) + 0.3), layout="constrained")
        rows = drawing.subplots(
            len(study), 3, squeeze=False, gridspec_kw={"width_ratios": [1.5, 1.15, 1.0]}
        )
        for axes, (task, judged) in zip(rows, study.values(), strict=True):
            _over_time(axes[0], task, judged)
            _left(axes[1], judged)
            _cost(axes[2], task, judged)
            axes[0].set_title(task.robot.name, loc="left", fontweight="bold", fontsize=8)
        for k, axis in enumerate(rows.flat):
            axis.set_title(f"({chr(97 + k)})", loc="right", fontsize=8)
            axis.grid(alpha=0.25, linewidth=0.5)
            axis.tick_params(width=0.6, length=2.5)
        handles, labels = rows[0][0].get_legend_handles_labels()
        drawing.legend(
            handles, labels, loc="outside lower center", ncols=8, columnspacing=1.2, frameon=False
        )
        drawing.canvas.draw()
    return drawing


def _over_time(axis: Any, task: Task, judged: list[Judged]) -> None:
    for row, (colour, dashes, _) in zip(judged, _styles(judged), strict=True):
        t = row.run.t - row.begin_s
        away = np.maximum(1e3 * from_end(task, row.run), 1e-9)
        shown = t >= 0
        axis.semilogy(t[shown], away[shown], dashes, color=colour, linewidth=1.1, label=row.method)
    longest = max(float(row.run.t[-1]) - row.begin_s for row in judged)
    axis.set_xlim(0, min(longest, 2.2 * task.duration_s))
    axis.set_ylim(bottom=1e-3)
    axis.set_xlabel("time since the first drive [s]")
    axis.set_ylabel("tip from its end [mm]")


def _left(axis: Any, judged: list[Judged]) -> None:
    for k, (row, (colour, _, mark)) in enumerate(zip(judged, _styles(judged), strict=True)):
        for values, height, filled in (
            ([1e3 * f.residual_m for f in row.figures], -0.15, True),
            ([1e3 * f.error_m for f in row.figures], 0.2, False),
        ):
            if not np.isfinite(values).all():
                continue
            values = [max(value, LEAST_MM) for value in values]
            at = k + height
            axis.plot([min(values), max(values)], [at, at], "-", color=colour, linewidth=1.0)
            face = colour if filled else "white"
            axis.plot(values[0], at, mark, color=colour, markerfacecolor=face, markersize=4.5)
    axis.set_xscale("log")
    axis.set_xlim(1e-3, 1e2)
    axis.set_yticks(range(len(judged)), [row.method for row in judged])
    axis.set_ylim(len(judged) - 0.5, -0.5)
    most = 100 * (max(PAYLOADS) - 1)
    axis.set_xlabel(f"left (filled), tip error (open) [mm]\nlines: payload ±{most:.0f} %")


def _cost(axis: Any, task: Task, judged: list[Judged]) -> None:
    for row, (colour, _, mark) in zip(judged, _styles(judged), strict=True):
        share = float(np.max(np.divide(row.nominal.peak, task.limits)))
        if np.isfinite(row.nominal.time_s):
            axis.plot(row.nominal.time_s, share, mark, color=colour, markersize=5)
    axis.axhline(1.0, color="0.5", linewidth=0.7, linestyle="--")
    axis.set_ylim(bottom=0)
    axis.set_xlabel("time to 1 % of the way [s]")
    axis.set_ylabel("largest drive / limit")


def _styles(judged: list[Judged]) -> list[tuple[str, str, str]]:
    return [STYLES[k % len(STYLES)] for k in range(len(judged))]
