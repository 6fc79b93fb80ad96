"""The dissertation's nine two-link structures, each natively and in Exudyn: one table, one
review."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx

from ..review import write_gallery
from ..runs.formatting import duration, percent
from ..runs.table import Cell, Styled, Table
from .crosscheck import Check, crosscheck
from .default_manoeuvre import modest

FILES = {
    "RR": "type-1-rr",
    "RPa": "type-2-rpa",
    "RPb": "type-3-rpb",
    "PaR": "rig",
    "PaPa": "type-5-papa",
    "PaPb": "type-6-papb",
    "PbR": "type-7-pbr",
    "PbPa": "type-8-pbpa",
    "PbPb": "type-9-pbpb",
}
NUMERALS = dict(zip(FILES, ("I", "II", "III", "IV", "V", "VI", "VII", "VIII", "IX"), strict=True))
ELEMENTS = 8  # a flexible link, natively; the twin takes twice as many
DURATION_S = 0.4  # of the motion: bends the links by up to 1 % of their length
STEP_S = {"none": 1.25e-4, "slider": 2.5e-4, "sleeve": 2.5e-4}  # Exudyn's
# what may differ, of each channel's largest magnitude: positions that slide, angles, tip
# deflections
ALLOWED = {"none": (1e-4, 1e-4, 2e-3), "slider": (5e-4, 2e-3, 1e-2), "sleeve": (2e-3, 2e-3, 2e-2)}


@dataclass(frozen=True)
class Row:
    """One structure: the check, the largest tip deflection over its link's length, and what slides
    on a flexible link."""

    structure: str
    check: Check
    bent: float
    sliding: str

    @property
    def name(self) -> str:
        """The dissertation's number of the structure, and its joints."""
        return f"{NUMERALS[self.structure]} {self.structure}"

    def worst(self, kind: int) -> float:
        """The largest deviation relative to its channel of kind 0 (positions that slide), 1
        (angles), 2 (tip deflections)."""
        rows = [
            row
            for row in self.check.rows
            if _kind(row.channel, row.unit) == kind and row.max > 1e-9
        ]
        return max((row.max_relative for row in rows), default=0.0)

    @property
    def passed(self) -> bool:
        """Whether both runs are complete and all deviations are small enough."""
        return self.check.complete and all(
            self.worst(k) <= most for k, most in enumerate(ALLOWED[self.sliding])
        )


def crosscheck_nine(
    robots: Path | None = None, progress: Callable[[float], None] = lambda f: None
) -> list[Row]:
    """The rows of all nine, in the dissertation's order, on all cores.

    Args:
        robots: the folder of their robot files, by default those that come with flexura.
        progress: called with the finished fraction.

    Raises:
        InputError: a robot file is not there, or has another structure.
    """
    described = {
        name: fx.load(robots / f"{file}.toml" if robots else file) for name, file in FILES.items()
    }
    for name, robot in described.items():
        if robot.structure != name:
            raise fx.InputError(
                f"expected a robot of structure {name}",
                key="link",
                value=robot.structure,
                file=FILES[name],
            )
    done: dict[str, Row] = {}
    pool = ProcessPoolExecutor(min(len(FILES), os.cpu_count() or 1))
    try:
        work = {
            pool.submit(_one, name, robot)
            for name, robot in sorted(described.items(), key=lambda k: -k[0].count("Pb"))
        }
        for finished in as_completed(work):
            row = finished.result()
            done[row.structure] = row
            progress(len(done) / len(FILES))
    finally:
        pool.shutdown(cancel_futures=True)
    return [done[name] for name in FILES]


def _one(name: str, described: fx.Robot) -> Row:
    flexible = [i for i, link in enumerate(described.links, 1) if link.flexible]
    robot = described.replace({f"link.{i}.elements": ELEMENTS for i in flexible})
    sliding = (
        "sleeve"
        if "Pb" in name
        else "slider"
        if name.endswith("Pa") and robot.links[0].flexible
        else "none"
    )
    asked = modest(fx.assemble(robot), DURATION_S)
    check = crosscheck(robot, asked, step_s=STEP_S[sliding], own_error=False)
    bent = max(
        np.abs(check.simulation[f"link/{i}/tip_deflection"]).max() / robot.links[i - 1].length_m
        for i in flexible
    )
    return Row(name, check, float(bent), sliding)


def _kind(channel: str, unit: str) -> int:
    if channel.endswith("tip_deflection"):
        return 2
    if channel.endswith("position"):
        return 1 if unit == "rad" else 0
    return -1


def save(rows: list[Row], folder: Path) -> Path:
    """Store all runs, and one review with all structures, in `folder`; returns the review's
    path."""
    for row in rows:
        row.check.simulation.save(folder / row.structure / "simulation")
        row.check.twin.save(folder / row.structure / "twin")
    return write_gallery(
        folder / "review.rrd", {row.name: [row.check.simulation, row.check.twin] for row in rows}
    )


def table(rows: list[Row]) -> Table:
    """One row a structure: what deviates by how much, and what is allowed."""
    out = Table(
        f"nine structures: native against {rows[0].check.twin.meta['program']}",
        ("structure", "largest bend", "positions", "angles", "deflections", "native", "twin", "ok"),
        ("structure",),
    )
    for row in rows:
        cells: list[Cell] = []
        for kind, most in enumerate(ALLOWED[row.sliding]):
            worst = row.worst(kind)
            colour = "green" if worst <= most else "red"
            cells.append(Styled(f"{worst:.0e} of {most:.0e}", colour) if worst else "")
        native, twin = row.check.simulation.meta["wall_s"], row.check.twin.meta["wall_s"]
        out.add(
            row.name,
            percent(row.bent, 3),
            *cells,
            duration(native),
            duration(twin),
            Styled("yes", "green") if row.passed else Styled("no", "red"),
        )
    out.notes.append(
        "Positions, angles, deflections: largest deviation, of what is allowed, relative to the "
        "channel's largest magnitude. Largest bend: of the link's length."
    )
    return out


def numbers(rows: list[Row]) -> dict[str, Any]:
    """For JSON."""
    keys = ("positions", "angles", "tip_deflections")
    return {
        row.structure: {
            "passed": row.passed,
            "deflection_over_length": row.bent,
            "worst": {key: row.worst(k) for k, key in enumerate(keys)},
            "allowed": dict(zip(keys, ALLOWED[row.sliding], strict=True)),
            "native_s": row.check.simulation.meta["wall_s"],
            "twin_s": row.check.twin.meta["wall_s"],
        }
        for row in rows
    }
