"""The command `flexura demo`."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Annotated

import typer

from ..comparison import table
from . import tables
from .demonstration import demonstrate
from .options import Force, Json
from .output import interrupted, progress_bars, say, show
from .results import results


def demo(
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="FOLDER", help="new folder for the results; default logs/demo-1, ..."
        ),
    ] = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Show the dissertation's rig along its inverse law.

    It is simulated here and in Exudyn, and runs as an experiment on the emulated board.

    \b
    Example: flexura demo
    """
    with results(out, "demo", force=force) as draft:
        with progress_bars("native", "twin", "emulated") as report:
            done = demonstrate(draft.folder, report)
        runs = (done.check.simulation, done.check.twin, done.comparison.experiment)
        stopped = any(map(interrupted, runs))
        folder = draft.keep(interrupted=stopped)
        done = done.moved(draft.folder, folder)
    drawn = done.picture if isinstance(done.picture, Path) else None
    show(
        json,
        lambda: [tables.check_table(done.check), table.table(done.comparison)],
        lambda: (
            tables.check_json(done.check)
            | {
                "experiment": table.numbers(done.comparison),
                "review": str(done.review),
                "picture": drawn and str(drawn),
            }
        ),
    )
    lines = [
        f"stored {folder}: the runs, a report, the review"
        + (f" and its picture {drawn.name}" if drawn else "")
    ]
    if drawn is None:
        lines.append(f"no picture: {done.picture}")
    lines += [
        "next:",
        f"  flexura review {done.review}",
        f"  open {done.review.parent / 'report.html'}",
        "  flexura bench forward",
        "  flexura crosscheck model/robots/two-link-arm.toml",
        "  flexura --help",
    ]
    if shutil.which("flexura") is None:
        lines.append("(the command is in .venv/bin; to find it: source .venv/bin/activate)")
    say(json, *lines)
    if not done.passed:
        raise typer.Exit(130 if stopped else 1)
