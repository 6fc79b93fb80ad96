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
from .options import Force, InternalForces, Json, ManoeuvreFile, Out, Prescribed, Rtol, Start, stem
from .output import (
    check_followed,
    events,
    load_request,
    message,
    print_results,
    progress_bars,
    warn,
)
from .results import results


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
    prescribed: Prescribed = False,
    start: Start = None,
    all_: Annotated[
        bool,
        typer.Option("--all", help="check the dissertation's nine structures instead of a ROBOT"),
    ] = False,
    step_s: Annotated[
        float | None,
        typer.Option(help="Exudyn's step [s]; default: from the robot's frequencies"),
    ] = None,
    internal_forces: InternalForces = False,
    force: Force = False,
    json: Json = False,
) -> None:
    """Simulate a robot here and in Exudyn, its twin, and compare both.

    The exit status is 1 if a channel deviates by more than the tolerance. "open" in the table: the
    deviation may be the twin's own error, so that it says nothing about the native solver.

    \b
    Example: flexura crosscheck rig rig-inverse-law
    """
    need("exudyn", "rerun")
    if all_ or robot is None:
        if not all_ or robot is not None:
            raise InputError(
                "expected a robot file, or --all without one",
                key="ROBOT",
                value=robot and str(robot),
            )
        options = (("--step-s", step_s), ("MANOEUVRE", manoeuvre))
        for key, given in (*options, ("--internal-forces", internal_forces or None)):
            if given is not None:
                raise InputError("expected without --all", key=key, value=str(given))
        _crosscheck_all(out, force, json)
        return
    system, asked = load_request(robot, manoeuvre, prescribed, start)
    check_followed(asked, manoeuvre, "call with --prescribed")
    with results(out, "crosscheck", robot.stem, *stem(manoeuvre), force=force) as draft:
        with progress_bars("native", "twin") as report:
            check = cross.crosscheck(
                system.robot,
                asked,
                beam=beam,
                rtol=rtol,
                tolerance=tolerance,
                step_s=step_s,
                internal_forces=internal_forces,
                progress=report,
            )
        review = cross.save(check, draft.folder).name
        folder = draft.keep(interrupted=check.interrupted)
    print_results(
        json,
        lambda: tables.check_table(check),
        lambda: tables.check_json(check) | {"review": str(folder / review)},
    )
    for run in (check.simulation, check.twin):
        events(run)
    message(
        json,
        f"stored {folder}",
        f"look at it: flexura review {folder / 'simulation'} {folder / 'twin'}",
    )
    _advise(check, tolerance)
    if check.interrupted:
        if check.complete:
            warn("interrupted before the twin's own error was known")
        raise typer.Exit(130)
    if not check.passed:
        raise typer.Exit(1)


def _advise(check: cross.Check, tolerance: float) -> None:
    """Say which channels are too far apart, and what may bring them together."""
    if check.failed:
        warn(f"beyond the tolerance of {100 * tolerance:g} %: {', '.join(check.failed)}")
        own = [link.get("elements", 0) for link in check.simulation.meta["robot"]["link"]]
        if any(
            0 < mesh < twin for mesh, twin in zip(own, check.twin.meta["elements"], strict=True)
        ):
            warn("the twin's mesh is finer: more elements in the robot file may bring both closer")
    if check.open:
        warn(
            f"open: {', '.join(check.open)}; the twin's own error may explain the deviation; "
            f"give it a step below {check.twin.meta['step_s']:.3g} s (--step-s)"
        )


def _crosscheck_all(out: Path | None, force: bool, json: bool) -> None:
    with results(out, "crosscheck-all", force=force) as draft:
        with progress_bars("all nine") as report:
            rows = nine_structures.crosscheck_nine(progress=lambda f: report("all nine", f))
        review = nine_structures.save(rows, draft.folder).name
        folder = draft.keep()
    print_results(
        json,
        lambda: nine_structures.table(rows),
        lambda: nine_structures.numbers(rows) | {"review": str(folder / review)},
    )
    message(json, f"stored {folder}", f"look at it: flexura review {folder / review}")
    if not all(row.passed for row in rows):
        raise typer.Exit(1)
