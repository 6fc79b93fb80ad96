"""The command `flexura export`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

import flexura as fx
from flexura.errors import InputError
from flexura.io import FILE, Run, called, shipped_files, write_bytes
from flexura.population import is_population

from ..runs.export import as_csv, as_mat, as_mcap, as_tdms, population
from .export_robot import ROBOT_FORMS, export_robot
from .options import ForceFile, Json
from .output import message, print_results
from .results import file_result
from .runs import RobotNumber, one_run


def export(
    run: Annotated[
        Path,
        typer.Argument(
            metavar="RUN",
            help="folder of a run or population, a run.parquet, or a robot (--to mat, fmu, urdf)",
        ),
    ],
    to: Annotated[
        str,
        typer.Option(
            "--to",
            help="csv, parquet, mat (MATLAB), tdms (LabVIEW) or mcap (ROS 2); a robot: fmu, urdf, "
            "or mat, its state space",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="a new file; default: run.FORMAT beside RUN"),
    ] = None,
    fmi: Annotated[
        int | None, typer.Option("--fmi", metavar="2|3", help="version of an FMU; default 2")
    ] = None,
    robot: RobotNumber = None,
    force: ForceFile = False,
    json: Json = False,
) -> None:
    """Write a run, or a robot, in another program's format.

    The file has all numbers, units and metadata.

    Of a population a table, one row a robot: what was varied, how it ended, peaks and last values.

    Of a robot an FMU for co-simulation, which runs without flexura, or a URDF.

    \b
    Example: flexura export logs/first --to csv
    """
    if fmi is not None and to != "fmu":
        raise InputError("none: only an FMU has a version of FMI", key="--fmi", value=fmi)
    shipped = not run.exists() and str(run) in shipped_files("robots")
    if shipped or run.suffix == ".toml" or to in ROBOT_FORMS:
        export_robot(run, to, out, fmi or 2, force=force, json=json)
        return
    table = is_population(run) and robot is None
    writers: dict[str, Callable[[Any], bytes]] = dict(tables() if table else forms())
    if to not in writers:
        raise InputError(f"expected one of {', '.join(writers)}", key="--to", value=to)
    name = "population" if table else "run" if robot is None else f"robot-{robot}"
    target = out or (run if run.is_dir() else run.parent) / f"{name}.{to}"
    read = fx.Population.read(run) if table else one_run(run, robot)
    source = run / FILE if run.is_dir() else run
    if target.exists() and source.exists() and target.samefile(source):
        raise InputError("the run itself: expected another file", key="--out", value=str(target))
    with file_result(target, force=force) as draft:
        write_bytes(draft, writers[to](read))
    about: dict[str, Any] = {"file": str(target)}
    if isinstance(read, Run):
        emulated = bool(read.meta.get("emulated"))
        about |= {"called": called(read), "emulated": emulated, "rows": len(read)}
        line = f"{called(read)}: {len(read)} rows, {len(read.channels)} channels"
    else:
        about |= {"called": "population", "emulated": False, "rows": len(read.robots)}
        line = f"population: {about['rows']} of {read.count} robots"
    if json:
        print_results(True, lambda: None, lambda: about)
    message(json, line, f"stored {target}")


def forms() -> dict[str, Callable[[Run], bytes]]:
    """What writes each format of a run."""
    return {
        "csv": as_csv.write,
        "parquet": lambda run: run.parquet(),
        "mat": as_mat.write,
        "tdms": as_tdms.write,
        "mcap": as_mcap.write,
    }


def tables() -> dict[str, Callable[[fx.Population], bytes]]:
    """What writes each format of a population."""
    return {
        "csv": population.as_csv,
        "parquet": population.as_parquet,
        "mat": population.as_mat,
    }
