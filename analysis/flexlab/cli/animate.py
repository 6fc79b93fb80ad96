"""The command `flexura animate`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..runs.of_robot import check_own
from .options import ForceFile, Json
from .output import message, print_results, progress_bars
from .results import file_result
from .runs import RobotNumber, one_run


def animate(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="folder of a run, or its run.parquet")],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="a new .gif or .mp4; default: run.gif"),
    ] = None,
    frame_rate: Annotated[float, typer.Option(help="pictures a second of the film")] = 25.0,
    duration_s: Annotated[
        float | None,
        typer.Option(help="duration of the film [s]; default: the run's own, but 3 to 12"),
    ] = None,
    robot: RobotNumber = None,
    force: ForceFile = False,
    json: Json = False,
) -> None:
    """Write a run as a film.

    It shows the links as bent as they are, the way of the tip, and a clock.

    \b
    Example: flexura animate logs/first --out first.gif
    """
    target = out or (run if run.is_dir() else run.parent) / "run.gif"
    shown = one_run(run, robot)
    check_own(shown, str(run))
    with file_result(target, force=force) as draft, progress_bars("pictures") as report:
        shown.animate(
            draft,
            frame_rate=frame_rate,
            duration=duration_s,
            progress=lambda fraction: report("pictures", fraction),
        )
    if json:
        print_results(True, lambda: None, lambda: {"file": str(target)})
    message(json, f"stored {target}")
