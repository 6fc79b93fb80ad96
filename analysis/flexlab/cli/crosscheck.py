"""The command `flexura crosscheck`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from flexura.errors import InputError
from flexura.optional import need

from ..crosscheck import crosscheck as cross
from ..crosscheck import nine_structures
from . import tables
from .options import Json, ManoeuvreFile, Out, Rtol
from .output import default_folder, events, interrupted, prepare, progress_bars, say, show


def crosscheck(
    robot: Annotated[
        Path | None, typer.Argument(metavar="ROBOT", help="robot file (TOML); or --all")
    ] = None,
    manoeuvre: ManoeuvreFile = None,
    out: Out = None,
    rtol: Rtol = 1e-7,
    beam: Annotated[
        str, typer.Option(help="ancf (Euler-Bernoulli) or ge (geometrically exact, with shear)")
    ] = "ancf",
    tolerance: Annotated[
        float,
        typer.Option(min=0.0, help="largest deviation allowed, relative to each channel's peak"),
    ] = 0.01,
    all_: Annotated[
        bool,
        typer.Option("--all", help="the dissertation's nine structures: one table, one review"),
    ] = False,
    json: Json = False,
) -> None:
    """Simulate a robot natively and in Exudyn, and compare; exit status 1 when a channel deviates
    by more than the tolerance.

    \b Example: flexura crosscheck model/robots/rig.toml model/manoeuvres/rig-inverse-law.toml
    --tolerance 0.005
    """
    need("exudyn", "rerun")
    if all_ or robot is None:
        if not all_ or robot is not None:
            raise InputError(
                "expected a robot file, or --all without one",
                key="ROBOT",
                value=robot and str(robot),
            )
        _crosscheck_all(out or Path("logs/crosscheck-all"), json)
        return
    system, asked = prepare(robot, manoeuvre)
    with progress_bars("native", "twin") as report:
        check = cross.crosscheck(
            system.robot, asked, beam=beam, rtol=rtol, tolerance=tolerance, progress=report
        )
    folder = out or default_folder("crosscheck", robot)
    review = cross.save(check, folder)
    show(
        json,
        lambda: tables.check_table(check),
        lambda: tables.check_json(check) | {"review": str(review)},
    )
    for run in (check.simulation, check.twin):
        events(run)
    say(
        json,
        f"stored {folder}",
        f"look at it: flexura review {folder / 'simulation'} {folder / 'twin'}",
    )
    if not check.passed:
        if check.failed:
            typer.echo(
                f"beyond the tolerance of {100 * tolerance:g} %: {', '.join(check.failed)}",
                err=True,
            )
        raise typer.Exit(130 if interrupted(check.simulation) or interrupted(check.twin) else 1)


def _crosscheck_all(folder: Path, json: bool) -> None:
    with progress_bars("all nine") as report:
        rows = nine_structures.crosscheck_nine(progress=lambda f: report("all nine", f))
    recording = nine_structures.save(rows, folder)
    show(
        json,
        lambda: nine_structures.table(rows),
        lambda: nine_structures.numbers(rows) | {"review": str(recording)},
    )
    say(json, f"stored {folder}", f"look at it: flexura review {recording}")
    if not all(row.passed for row in rows):
        raise typer.Exit(1)
