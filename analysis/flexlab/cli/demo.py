"""The command `flexura demo`."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Annotated

import typer

from ..comparison import table
from . import tables
from .demonstration import demonstrate
from .output import interrupted, progress_bars, say, show


def demo(
    out: Annotated[
        Path, typer.Option("--out", metavar="FOLDER", help="where to leave the results")
    ] = Path("logs/demo"),
    json: Annotated[
        bool, typer.Option("--json", help="print JSON instead of tables, for scripts")
    ] = False,
) -> None:
    """The dissertation's rig along its inverse law: natively, in Exudyn, and as an experiment on
    the emulated board.

    \b
    Example: flexura demo
    """
    with progress_bars("native", "twin", "emulated") as report:
        done = demonstrate(out, report)
    drawn = done.picture if isinstance(done.picture, Path) else None
    show(
        json,
        lambda: tables.check_table(done.check),
        lambda: (
            tables.check_json(done.check)
            | {
                "experiment": table.numbers(done.comparison),
                "review": str(done.review),
                "picture": drawn and str(drawn),
            }
        ),
    )
    if not json:
        show(json, lambda: table.table(done.comparison), dict)
    lines = [
        f"stored {out}: the runs, a report, the review"
        + (f" and its picture {drawn.name}" if drawn else "")
    ]
    if drawn is None:
        lines.append(f"no picture: {done.picture}")
    lines += [
        "next:",
        f"  flexura review {done.review}      the review, in a window",
        f"  open {done.review.parent / 'report.html'}             the report, in a browser",
        "  flexura bench forward                                    another experiment, emulated",
        "  flexura crosscheck model/robots/two-link-arm.toml        another robot, in two programs",
        "  flexura --help                                           everything else",
    ]
    if shutil.which("flexura") is None:
        lines.append("(the command is in .venv/bin; to have it at hand: source .venv/bin/activate)")
    say(json, *lines)
    if not done.passed:
        runs = (done.check.simulation, done.check.twin, done.comparison.experiment)
        raise typer.Exit(130 if any(map(interrupted, runs)) else 1)
