"""The command `flexura demo`."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Annotated, Any

import typer

from ..comparison import table
from ..runs.table import Table
from . import tables
from .demonstration import Demonstration, demonstrate, numbers
from .options import Force, Json
from .output import message, print_results, progress_bars
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
        stopped = any(run.interrupted for run in done.runs) or (
            done.check is not None and done.check.interrupted
        )
        folder = draft.keep(interrupted=stopped)
        done = done.moved(draft.folder, folder)
    drawn = done.picture if isinstance(done.picture, Path) else None
    print_results(json, lambda: _tables(done), lambda: _numbers(done))
    message(json, *[f"left out: {text}" for text in done.left_out])
    lines = [f"stored {folder}"]
    if done.review is not None and drawn is None:
        lines.append(f"no picture: {done.picture}")
    lines.append("next:")
    if done.review is not None:
        lines += [
            f"  flexura review {done.review}",
            f"  open {done.review.parent / 'report.html'}",
            "  flexura bench forward",
        ]
    lines += ["  flexura crosscheck two-link-arm", "  flexura robots", "  flexura --help"]
    if shutil.which("flexura") is None:
        lines.append("(the command is in .venv/bin; to find it: source .venv/bin/activate)")
    message(json, *lines)
    if not done.passed:
        raise typer.Exit(130 if stopped else 1)


def _tables(done: Demonstration) -> list[Table]:
    """The cross-check, or the native run alone, and the experiment beside its simulation."""
    first = tables.check_table(done.check) if done.check else tables.run_table(done.simulation)
    return [first, *([table.table(done.comparison)] if done.comparison else [])]


def _numbers(done: Demonstration) -> dict[str, Any]:
    first = tables.check_json(done.check) if done.check else tables.run_json(done.simulation)
    second = {"experiment": table.numbers(done.comparison)} if done.comparison else {}
    return first | second | numbers(done)
