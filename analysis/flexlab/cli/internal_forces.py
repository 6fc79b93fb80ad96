"""The largest internal forces of a run, for those who size links and bearings."""

from __future__ import annotations

import re

import numpy as np

import flexura as fx
from flexura.io import STATIONS

from ..runs.formatting import number
from ..runs.table import Table

_REACTION = re.compile(r"joint/\d+/reaction_\w+")
_ALONG = re.compile(r"link/(\d+)/(bending_moment|shear_force|axial_force|stress)/0")


def force_tables(run: fx.Run) -> list[Table]:
    """Where and when reactions and the forces along links are largest; none if the run has no such
    channels."""
    heads = ("largest of", "value", "place", "at")
    table = Table("internal forces", heads, heads[:1])
    for name in filter(_REACTION.fullmatch, run):
        late = int(np.argmax(np.abs(run[name])))
        table.add(f"{name} [{run.units[name]}]", number(run[name][late], 5), "", _time(run, late))
    sleeved = [link["joint"]["type"] == "Pb" for link in run.meta["robot"]["link"]]
    for link, kind in (found.groups() for found in map(_ALONG.fullmatch, run) if found):
        names = [f"link/{link}/{kind}/{k}" for k in range(STATIONS)]
        values = np.array([run[name] for name in names])
        place, row = np.unravel_index(np.argmax(np.abs(values)), values.shape)
        of = "free length" if sleeved[int(link) - 1] else "length"
        table.add(
            f"link/{link}/{kind} [{run.units[names[0]]}]",
            number(values[place, row], 5),
            f"{place}/{STATIONS - 1} of the {of}",
            _time(run, int(row)),
        )
    return [table] if len(table.rows) else []


def _time(run: fx.Run, row: int) -> str:
    return f"{run.t[row]:.4g} s"
