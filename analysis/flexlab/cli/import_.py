"""The command `flexura import`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

import flexura as fx
from flexura.errors import InputError
from flexura.io import FILE, Tables
from flexura.io.logs import Map, Understood, read_log, read_map, understood

from ..runs.formatting import number
from ..runs.of_robot import check_own
from ..runs.table import Table
from .import_robot import import_robot
from .options import Force, Json
from .output import message, print_results
from .results import results


def import_(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="a log, the folder of a bag of ROS 2, or a URDF"),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="RUN",
            help="new folder for the run; default logs/import-FILE-1, ...; of a URDF the new robot "
            "file; default NAME.toml beside it",
        ),
    ] = None,
    map_: Annotated[
        Path | None,
        typer.Option("--map", metavar="map.toml", help="which column is which channel"),
    ] = None,
    robot: Annotated[
        Path | None,
        typer.Option(metavar="ROBOT", help="the robot that was measured: it is drawn in reviews"),
    ] = None,
    sections: Annotated[
        Path | None,
        typer.Option(metavar="table.toml", help="of a URDF: which links bend, and how"),
    ] = None,
    every: Annotated[
        bool, typer.Option("--all", help="take the other columns too, as sensor/NAME")
    ] = False,
    look: Annotated[
        bool, typer.Option("--look", help="only show what is understood; write nothing")
    ] = False,
    force: Force = False,
    json: Json = False,
) -> None:
    """Read a log of another program as a run, or a URDF as a robot.

    It reads CSV, LVM, TDMS, MAT (all versions), HDF5, MCAP, Parquet, bags of ROS, accelerometer
    logs of Klipper, and its own exports. Columns are converted to SI units.

    Without --map it takes columns whose heads are channels with units, as joint/1/position [deg];
    the first column in a unit of time is the clock.

    A URDF is a serial planar chain; what is not is refused with the joint and the reason.

    \b
    Example: flexura import log.csv --map map.toml --out logs/measured
    """
    if file.suffix.lower() == ".urdf":
        for option, given in (("--map", map_), ("--robot", robot), ("--all", every or None)):
            if given is not None:
                raise InputError(
                    "expected a log: a URDF is read without this option",
                    key=option,
                    value=str(given),
                )
        import_robot(file, sections, out, look=look, force=force, json=json)
        return
    if sections is not None:
        raise InputError(
            "expected a URDF: a log is read without this option",
            key="--sections",
            value=str(sections),
        )
    asked = None if map_ is None else read_map(map_)
    tables = None if robot is None else fx.load(robot).to_dict()
    if look:
        found = _read(file, asked, tables, every)
        print_results(json, lambda: table(found, file), lambda: data(found))
        return
    with results(out, "import", file.stem, force=force) as draft:
        found = _read(file, asked, tables, every)
        if not json:
            print_results(False, lambda: table(found, file), dict)
        found.run.save(draft.folder)
        folder = draft.keep()
    if json:
        print_results(True, lambda: None, lambda: data(found) | {"run": str(folder / FILE)})
    message(json, f"stored {folder / FILE}", f"look at it: flexura review {folder}")


def _read(file: Path, asked: Map | None, robot: Tables | None, every: bool) -> Understood:
    """What is understood of a log, if it can be one of the robot."""
    found = understood(read_log(file), asked, robot=robot, every=every)
    if robot is not None:
        check_own(found.run, str(file))
    return found


def table(found: Understood, file: Path) -> Table:
    """What was understood of a log."""
    run = found.run
    heads = ("channel", "column", "unit", "lowest", "highest", "gaps")
    out = Table(f"{file.name}: {found.form}, {len(run)} rows", heads, ("channel", "column", "unit"))
    for row in found.taken:
        values = run[row.channel][np.isfinite(run[row.channel])]
        low, high = (float(values.min()), float(values.max())) if len(values) else (np.nan, np.nan)
        out.add(
            f"{row.channel} [{row.si}]",
            row.head,
            row.unit,
            number(low, 5),
            number(high, 5),
            str(row.gaps) if row.gaps else "",
        )
    start = run.meta.get("clock_start_s")
    counted = f", counted from its first time, {start:.6f} s" if start else ""
    out.notes.append(
        f"clock: {found.clock}{counted}; {run.t[0]:.6g} to {run.t[-1]:.6g} s, "
        f"{(len(run) - 1) / (run.t[-1] - run.t[0]):.5g} samples a second"
    )
    out.notes += found.notes
    out.notes += _left(found)
    return out


def _left(found: Understood) -> list[str]:
    """What was left out: what an option takes, and why the rest is not taken."""
    reasons: dict[str, list[str]] = {}
    for head in found.left:
        reasons.setdefault(found.why.get(head, "--map or --all takes other columns"), []).append(
            head
        )
    notes = []
    for reason, heads in list(reasons.items())[:8]:
        more = f" and {len(heads) - 8} more" if len(heads) > 8 else ""
        notes.append(f"left out: {', '.join(heads[:8])}{more}; {reason}")
    if len(reasons) > 8:
        notes.append(f"left out: {len(reasons) - 8} more, each for a reason of its own")
    return notes


def data(found: Understood) -> dict[str, Any]:
    """The same for JSON."""
    run = found.run
    return {
        "format": found.form,
        "rows": len(run),
        "clock": found.clock,
        "start_s": float(run.t[0]),
        "end_s": float(run.t[-1]),
        "clock_start_s": run.meta.get("clock_start_s"),
        "channels": {
            row.channel: {"column": row.head, "unit": row.unit, "si": row.si, "gaps": row.gaps}
            for row in found.taken
        },
        "left_out": found.left,
        "left_out_because": {head: found.why[head] for head in found.left if head in found.why},
        "notes": found.notes,
    }
