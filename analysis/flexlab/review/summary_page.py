"""The about page of a review, in markdown: how to read it, deviations, the robot, how the runs were
made."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from flexura.errors import InputError
from flexura.io.drawing import MAX_SAMPLES
from flexura.robot import Link, Robot

from ..comparison import table
from ..comparison.measures import Comparison, compare
from ..runs.deviation import deviations
from ..runs.formatting import markdown, number, percent, printable
from .sources import Source, against_experiment, tip_meaning

MAX_ROWS = 40  # of one table: a robot of 200 links is not read link by link
NONE = "–"  # in place of a number that there is none of
HANDLED = {"robot", "name", "structure", "events", "phases", "source", "complete", "emulated"}
FIRST = (
    "program",
    "version",
    "method",
    "rtol",
    "atol",
    "steps",
    "rejected",
    "energy_error",
    "wall_s",
)


def summary(shown: list[Source], *, thinned_to: int | None = None) -> str:
    """The page; `thinned_to` is the number of samples that each curve was reduced to, if it was."""
    robot = Robot.from_dict(shown[0].run.meta["robot"]) if shown[0].run.meta.get("robot") else None
    parts = [
        f"## {markdown(robot.name) or 'robot without a name'}"
        if robot
        else "## run without a robot file",
        *_notes(shown),
    ]
    for other in shown[1:]:
        parts += _deviations([shown[0], other])
    if robot:
        parts += _robot(robot)
        for other in shown[1:]:
            if other.run.meta.get("robot") not in (None, shown[0].run.meta["robot"]):
                parts.append(
                    f"**The robot of {other.label} differs** from that of {shown[0].label}, which "
                    f"is described here."
                )
    parts += _runs(shown)
    parts += _reading(shown, thinned_to)
    return "\n\n".join(parts) + "\n"


def _notes(shown: list[Source]) -> list[str]:
    notes = []
    for s in shown:
        if s.run.meta.get("emulated"):
            notes.append(
                f"**{s.label}: emulated.** The board and the rig ran as programs; nothing here was "
                f"measured on a physical rig."
            )
        if not s.run.complete:
            notes.append(
                f"**{s.label}: incomplete.** The run was interrupted or failed: its channels end "
                f"at {s.run.t[-1]:.4g} s."
            )
    return notes


def _deviations(shown: list[Source]) -> list[str]:
    first, second = shown
    if against_experiment(shown):
        try:
            return _experiment(compare(first.run, second.run))
        except InputError:  # nothing that the dissertation compares
            pass
    head = (
        f"### Deviation\n\n{second.label} minus {first.label}; in brackets: of the channel's "
        f"largest magnitude in {first.label}."
    )
    rows = [
        (
            f"{d.channel} [{d.unit}]",
            f"{number(d.max, 2, NONE)} ({percent(d.max_relative, missing=NONE)})",
            f"{number(d.rms, 2, NONE)} ({percent(d.rms_relative, missing=NONE)})",
        )
        for d in deviations(first.run, second.run)
    ]
    return (
        [head, _table(("channel", "max", "RMS"), rows)]
        if rows
        else ["### Deviation\n\nThe runs have no channel in common to compare."]
    )


def _experiment(found: Comparison) -> list[str]:
    """The table of `flexura compare`, and its notes."""
    lines = "\n".join(f"- {note}" for note in table.notes(found))
    head = "### Simulation against experiment" + (
        f", {found.experiment_kind}" if found.experiment_kind else ""
    )
    heads = ("", *table.HEADS[1:])
    return [head, _table(heads, table.rows(found)), lines]


def _robot(robot: Robot) -> list[str]:
    gravity = robot.gravity_m_s2
    facts = [
        f"structure **{robot.structure}**, {len(robot.links)} links",
        f"payload {robot.payload.mass_kg:g} kg"
        + (f", {robot.payload.inertia_kg_m2:g} kg m²" if robot.payload.inertia_kg_m2 else ""),
        f"gravity ({gravity[0]:g}, {gravity[1]:g}) m/s²"
        if any(gravity)
        else "no gravity in the plane of motion",
        "geometric stiffening on" if robot.stiffening else "geometric stiffening off",
    ]
    if {"Pa", "Pb"} & {link.joint.type for link in robot.links}:
        facts.append(f"sliding {robot.sliding}")
    head = ("link", "joint", "length [m]", "kind", "mass", "EI [N m²]")
    rows = [
        (f"{i} {link.name}".strip(), _joint(link), f"{link.length_m:g}", _kind(link), *_beam(link))
        for i, link in enumerate(robot.links, 1)
    ]
    return ["### Robot\n\n" + "; ".join(facts) + ".", _table(head, rows)]


def _joint(link: Link) -> str:
    angle = link.joint.angle_rad
    return link.joint.type + (f", {angle:.4g} rad" if angle else "")


def _kind(link: Link) -> str:
    if not link.flexible:
        return "rigid"
    return f"flexible, {link.elements} elements" + (f", {link.modes} modes" if link.modes else "")


def _beam(link: Link) -> tuple[str, str]:
    """Mass per length (or the mass of a rigid link) and bending stiffness, as a range where they
    vary."""
    x = np.linspace(0.0, link.length_m, 33)
    if not link.flexible:
        return (
            (f"{link.mass_kg:g} kg", "–")
            if link.mass_kg is not None
            else (f"{_range(link.mass_per_length(x))} kg/m", "–")
        )
    return f"{_range(link.mass_per_length(x))} kg/m", _range(link.bending_stiffness(x))


def _range(values: np.ndarray) -> str:
    low, high = float(values.min()), float(values.max())
    return f"{low:.4g}" if math.isclose(low, high, rel_tol=1e-9) else f"{low:.4g} to {high:.4g}"


def _runs(shown: list[Source]) -> list[str]:
    """What the runs say about themselves, side by side: program, tolerances, steps, time taken,
    energy error and the rest."""
    settings = [dict(_flat(s.run.meta)) for s in shown]
    keys = sorted(
        {key for each in settings for key in each},
        key=lambda k: (FIRST.index(k) if k in FIRST else len(FIRST), k),
    )
    rows = [
        ("complete", *("yes" if s.run.complete else "**no**" for s in shown)),
        ("time [s]", *(f"{s.run.t[0]:g} to {s.run.t[-1]:g}" for s in shown)),
        ("samples", *(str(len(s.run)) for s in shown)),
        *((key.replace("_", " "), *(each.get(key, "–") for each in settings)) for key in keys),
    ]
    return ["### Runs", _table(("", *(s.label for s in shown)), rows)]


def _flat(meta: dict[str, Any], before: str = "") -> Iterable[tuple[str, str]]:
    for key, value in meta.items():
        if not before and key in HANDLED:
            continue
        if isinstance(value, dict):
            yield from _flat(value, f"{before}{key} ")
        elif isinstance(value, bool):
            yield before + key, "yes" if value else "no"
        elif isinstance(value, int | float):
            yield before + key, str(value) if isinstance(value, int) else number(value, 3, NONE)
        elif value is not None:
            text = str(value)
            yield before + key, text if len(text) <= 160 else text[:157] + "..."


def _reading(shown: list[Source], thinned_to: int | None) -> list[str]:
    lines = [
        "- y is up; all lengths are true, deflections are not exaggerated. The bar shows the "
        "scale, the grid has its spacing.",
        "- Coloured line: flexible link. Pale, thick line: rigid link. Grey line: the flexible "
        "link if it were straight.",
        "- Ring: rotary joint. Rectangle: prismatic joint. Thin curve: the path of the tip over "
        "the whole run.",
        f"- Dot: the tip, {tip_meaning(shown[0].run)}.",
        "- Move the time cursor to see the arms at another time. `time` is in seconds, `step` "
        "counts the samples of a run.",
    ]
    for other in shown[1:]:
        lines.append(
            f"- {other.label} is interpolated onto the times of {shown[0].label} before it is "
            f"subtracted."
        )
    for s in shown:
        if s.computed:
            lines.append(
                f"- {s.label} has no poses of its links: they are computed from its joints and tip "
                f"deflections;"
                " between hub and tip the line is that of a cantilever loaded at its tip."
            )
    if thinned_to is not None:
        lines.append(
            f"- The runs have more than {MAX_SAMPLES:,} samples: each curve is thinned to about "
            f"{thinned_to:,}, keeping the"
            " smallest and the largest value of every block. Deviations and this page are from all "
            "samples."
        )
    return ["### How to read this", "\n".join(lines)]


def _table(head: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> str:
    cut = rows[:MAX_ROWS]
    lines = [head, ("---",) * len(head), *cut]
    more = f"\n\n({len(rows) - MAX_ROWS} more rows are left out.)" if len(rows) > MAX_ROWS else ""
    return (
        "\n".join(
            "| "
            + " | ".join(printable(cell.replace("|", "/").replace("\n", " ")) for cell in line)
            + " |"
            for line in lines
        )
        + more
    )
