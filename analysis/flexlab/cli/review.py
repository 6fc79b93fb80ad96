"""The command `flexura review`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import flexura as fx
from flexura.population import is_population

from .. import review as rerun
from ..runs.deviation import common
from ..runs.of_robot import check_own
from .options import ForceFile, Json
from .output import message, print_results, warn
from .results import counted, file_result
from .runs import RobotNumber, one_run


def review(
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN [RUN...]",
            help="up to six folders of runs, or of a population with --robot; or a review, .rrd",
        ),
    ],
    save: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.rrd", help="write the review to this file instead of opening it"
        ),
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option(metavar="FILE.png", help="draw the review into this file, without a screen"),
    ] = None,
    robot: RobotNumber = None,
    time_s: Annotated[
        float | None,
        typer.Option(help="the picture's instant [s]; default: the largest tip deflection"),
    ] = None,
    force: ForceFile = False,
    json: Json = False,
) -> None:
    """Look at one run, or at several side by side, in Rerun.

    The first one is what the others are compared with. A log without a robot is drawn as the robot
    of another run.

    \b
    Example: flexura review logs/first logs/second --save review.rrd
    """
    if time_s is not None and picture is None:
        raise fx.InputError("expected together with --picture", key="--time-s", value=time_s)
    drawn = None if picture is None else str(picture)
    if runs[0].suffix == ".rrd" and len(runs) == 1 and save is None:
        target = runs[0]
        with file_result(picture, "--picture", force=force, suffix=".png") as draft:
            if picture is not None:
                rerun.picture(target, draft, time_s=time_s)
    else:
        read = [one_run(folder, robot if is_population(folder) else None) for folder in runs]
        for path, one in zip(runs, read, strict=True):
            check_own(one, str(path))
        for path, other in zip(runs[1:], read[1:], strict=True):
            if not common(read[0], other).any():
                warn(f"{path} has no time in common with {runs[0]}: there is no deviation")
        beside = (runs[0] if runs[0].is_dir() else runs[0].parent) / "review.rrd"
        target = save or (picture.with_suffix(".rrd") if picture else beside)
        if target == beside and target.exists() and not force:
            target = counted(target)
        with (
            file_result(
                target, "--save" if save else "--picture", force=force, suffix=".rrd"
            ) as draft,
            file_result(picture, "--picture", force=force, suffix=".png") as drawing,
        ):
            rerun.write_review(draft, read)
            if picture is not None:
                rerun.picture(draft, drawing, time_s=time_s)
        message(json, f"stored {target}")
    if picture is not None:
        message(json, f"stored {picture}")
    if json:
        print_results(True, lambda: None, lambda: {"review": str(target), "picture": drawn})
    if save is None and picture is None:
        rerun.open_viewer(target)
