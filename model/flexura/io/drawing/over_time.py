"""Figures of runs over time, for a screen and for print."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase
from re import sub
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import InputError
from ...optional import load
from ..quantities import channel
from ..quantities.labels import called
from .pictures import LETTERS, plain
from .sampling import thinned

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..run import Run

# Okabe and Ito's colours, told apart by all kinds of colour vision; the light ones last.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#30343b")
DASHES = ("-", "--", "-.", ":")
SAMPLES = 20_000  # of one curve: more than any paper shows
WIDTH_IN, PANEL_IN = 7.2, 1.9  # a page's text width; the height of a panel
LEGEND_LINES = 9  # of one column
INK, AXES, GRID = "#30343b", "#9aa0a8", "#e3e6ea"
STYLE: dict[str, Any] = LETTERS | {
    "font.size": 9,
    "figure.facecolor": "white",
    "axes.facecolor": "white",
    "axes.edgecolor": AXES,
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.8,
    "grid.color": GRID,
    "grid.linewidth": 0.7,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.use_mathtext": True,
    "axes.formatter.limits": (-3, 4),
}
# what a figure shows that was asked for nothing in particular: a panel each, of each unit
USUAL = (
    ("joint/*/position", "joint/*/reference"),
    ("link/*/tip_deflection",),
    ("joint/*/drive", "joint/*/voltage"),
    ("energy/kinetic", "energy/strain", "energy/potential", "energy/work", "energy/loss"),
)


def figure(
    runs: Sequence[Run],
    patterns: Sequence[str] = (),
    *,
    names: Sequence[str] = (),
    title: str = "",
    interactive: bool = False,
) -> Figure:
    """The channels of one run, or of several over each other, with one panel a unit.

    Args:
        runs: with samples; more than one are told apart by their dashes.
        patterns: channels, with `*` and `?` as in file names; none: joint positions, tip
            deflections, drives and energies, as far as they are not always 0.
        names: of the runs in the legend; by default what each is called.
        title: above the figure; by default the robot and what the runs are called.
        interactive: a figure of pyplot, which `matplotlib.pyplot.show()` shows.

    Returns:
        The figure.

    Raises:
        InputError: a pattern fits no channel, or a run has no samples.
        Missing: matplotlib is not installed.
    """
    matplotlib = load("matplotlib")
    if not runs or not all(len(run) for run in runs):
        raise InputError("expected a run with samples; this one is empty", key="run")
    panels = chosen(runs, patterns)
    names = tuple(names) or tuple(map(called, runs))
    with matplotlib.rc_context(STYLE):
        size = (WIDTH_IN, 0.7 + PANEL_IN * len(panels))
        if interactive:
            drawing = load("matplotlib.pyplot").figure(figsize=size, layout="constrained")
        else:
            drawing = load("matplotlib.figure").Figure(figsize=size, layout="constrained")
        every = drawing.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
        for axes, channels in zip(every, panels, strict=True):
            _panel(axes, runs, channels, names)
        every[-1].set_xlabel("time [s]")
        ends = min(run.t[0] for run in runs), max(run.t[-1] for run in runs)
        if ends[0] < ends[1]:
            every[-1].set_xlim(*ends)
        drawing.suptitle(plain(title or heading(runs)), fontsize=9.5, x=0.01, ha="left")
        drawing.align_ylabels()
    return drawing


def chosen(runs: Sequence[Run], patterns: Sequence[str]) -> list[list[str]]:
    """The channels of each panel, by pattern. Raises InputError."""
    known = list(dict.fromkeys(name for run in runs for name in run))
    unit = {name: run.units[name] for run in reversed(runs) for name in run}
    if patterns:
        wanted: list[str] = []
        for pattern in patterns:
            if not isinstance(pattern, str):
                raise InputError("expected a name or a pattern", key="channel", value=pattern)
            fitting = [name for name in known if fnmatchcase(name, pattern)]
            if not fitting:
                short = dict.fromkeys(sub(r"/\d+$", "/*", name) for name in known)
                raise InputError(
                    f"expected one of {', '.join(short)}", key="channel", value=pattern
                )
            wanted += fitting
        groups = [list(dict.fromkeys(wanted))]
    else:
        groups = [
            [n for n in known if any(fnmatchcase(n, p) for p in some) and _moves(runs, n)]
            for some in USUAL
        ]
        if not any(groups):
            groups = [known]
    panels: list[list[str]] = []
    for group in groups:
        for one in dict.fromkeys(unit[name] for name in group):
            panels.append([name for name in group if unit[name] == one])
    if not panels:
        raise InputError("expected a run with channels; this one has none", key="run")
    return panels


def heading(runs: Sequence[Run]) -> str:
    """The title of a picture: the robot, and what the runs are called.

    Args:
        runs: the runs.

    Returns:
        The title; nothing emulated goes without the word.
    """
    robots = dict.fromkeys(
        str(name) for run in runs if (name := (run.meta.get("robot") or {}).get("name"))
    )
    what = dict.fromkeys(map(called, runs))
    return ": ".join(part for part in (", ".join(robots), ", ".join(what)) if part)


def _moves(runs: Sequence[Run], name: str) -> bool:
    """Whether a channel is anywhere else than 0."""
    return any(bool(np.nan_to_num(run[name]).any()) for run in runs if name in run)


def _panel(axes: Any, runs: Sequence[Run], channels: Sequence[str], names: Sequence[str]) -> None:
    """The curves of one unit, with a legend beside them."""
    unit = next(run.units[channels[0]] for run in runs if channels[0] in run)
    quantities = list(dict.fromkeys(channel(name).quantity for name in channels))
    hues = _hues(channels) if len(quantities) == 1 else list(range(len(channels)))
    for j, (run, whose) in enumerate(zip(runs, names, strict=True)):
        for k, name in enumerate(channels):
            if name not in run or run.units[name] != unit:
                continue
            keep = thinned(run[name], SAMPLES)
            text = label(name, len(quantities) == 1)
            hue = hues[k]
            turn = hue // len(COLOURS) if len(runs) == 1 else j
            axes.plot(
                run.t[keep],
                run[name][keep],
                color=COLOURS[hue % len(COLOURS)],
                linestyle=DASHES[turn % len(DASHES)],
                linewidth=max(1.7 - 0.15 * k, 0.9),  # seen where curves lie on each other
                label=plain(f"{text}, {whose}" if len(runs) > 1 else text),
            )
    said = quantities[0] if len(quantities) == 1 else _common(quantities)
    axes.set_ylabel(plain(f"{said} [{unit}]".strip()))
    columns = -(-len(axes.lines) // LEGEND_LINES)
    axes.legend(
        frameon=False,
        loc="upper left",
        bbox_to_anchor=(1.01, 1.0),
        borderaxespad=0.0,
        ncols=columns,
        fontsize=8,
        handlelength=1.8,
    )


def _hues(channels: Sequence[str]) -> list[int]:
    """The colours of one quantity's channels: a joint's or link's is the same in all panels."""
    parts = [name.split("/") for name in channels]
    own = [int(p[1]) - 1 for p in parts if len(p) == 3 and p[1].isdigit()]
    return own if len(set(own)) == len(channels) else list(range(len(channels)))


def label(name: str, alone: bool) -> str:
    """A channel in a legend: `alone`, the axis says the quantity already."""
    kind, *rest = name.split("/")
    if kind in ("joint", "link") and rest:
        more = " ".join(rest[1:]).replace("_", " ")
        return f"{kind} {rest[0]}" if alone and len(rest) == 2 else f"{kind} {rest[0]} {more}"
    if kind == "sensor":
        return "/".join(rest)
    return channel(name).quantity


def _common(quantities: Sequence[str]) -> str:
    """A word that all quantities of a panel share, such as "energy"; else the first two."""
    shared = [w for w in quantities[0].split() if all(w in q.split() for q in quantities)]
    if shared:
        return " ".join(shared)
    if all("energy" in q or q in ("work of the drives", "numerical loss") for q in quantities):
        return "energy"
    return ", ".join(quantities) if len(quantities) == 2 else ""
