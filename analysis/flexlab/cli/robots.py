"""The command `flexura robots`."""

from __future__ import annotations

from typing import Any

import numpy as np

import flexura as fx
from flexura.io import shipped_files

from ..runs.formatting import number
from ..runs.table import Table
from .options import Json
from .output import message, print_results


def robots(json: Json = False) -> None:
    """List the robots that come with flexura.

    A command takes their names in place of a file.

    \b
    Example: flexura robots
    """
    rows = [_row(name) for name in shipped_files("robots")]
    print_results(json, lambda: _table(rows), lambda: rows)
    message(json, "use one: flexura frequencies rig; begin your own: flexura new my-arm.toml")


def _row(name: str) -> dict[str, Any]:
    """A robot's figures: its first frequency is the lowest with all joints locked."""
    robot = fx.load(name)
    system = fx.assemble(robot)
    found = fx.frequencies(system, joints="locked")
    vibrating = found[np.asarray(found) > 0]
    return {
        "name": name,
        "structure": robot.structure,
        "links": len(robot.links),
        "unknowns": system.n,
        "first_frequency_Hz": float(vibrating[0]) if len(vibrating) else None,
        "about": robot.name,
    }


def _table(rows: list[dict[str, Any]]) -> Table:
    heads = ("name", "structure", "links", "unknowns", "first [Hz]")
    out = Table("robots that come with flexura", heads, ("name", "structure"))
    for row in rows:
        first = row["first_frequency_Hz"]
        out.add(
            row["name"],
            row["structure"],
            str(row["links"]),
            str(row["unknowns"]),
            "" if first is None else number(first, 5),
        )
    out.notes.append("first: the lowest frequency at the start, joints locked")
    return out
