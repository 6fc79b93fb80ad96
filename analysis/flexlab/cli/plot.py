"""The command `flexura plot`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from flexura.errors import InputError
from flexura.io import FILE, write_bytes
from flexura.io.drawing import FORMS, attempted, figure, heading, saved

from .options import ForceFile, Json
from .output import message, print_results
from .results import file_result
from .runs import RobotNumber, legend_names, one_run


def plot(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="folder of a run, or its run.parquet")],
    channels: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[CHANNEL...]",
            help="channels, or patterns such as 'joint/*/position'; further runs are drawn too",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="a new .pdf, .svg or .png; default: run.pdf"),
    ] = None,
    title: Annotated[str, typer.Option(help="above the figure; default: the robot's name")] = "",
    robot: RobotNumber = None,
    force: ForceFile = False,
    json: Json = False,
) -> None:
    """Draw a run over time: one panel a unit, the legend beside it.

    Without channels: joint positions, tip deflections, drives and energies.

    \b
    Example: flexura plot logs/first 'joint/*/position' --out joints.pdf
    """
    beside = [Path(text) for text in channels or () if _is_run(text)]
    patterns = [text for text in channels or () if not _is_run(text)]
    target = out or (run if run.is_dir() else run.parent) / "run.pdf"
    form = target.suffix.lower().removeprefix(".")
    if form not in FORMS:
        expected = f"expected a file that ends with .{', .'.join(FORMS)}"
        raise InputError(expected, key="--out", value=str(target))
    paths = [run, *beside]
    with file_result(target, force=force) as draft:
        runs = [one_run(path, robot) for path in paths]
        with attempted(str(target)):
            drawing = figure(runs, patterns, names=legend_names(paths, runs), title=title)
            drawn = saved(drawing, form, Title=title or heading(runs))
        write_bytes(draft, drawn)
    if json:
        print_results(True, lambda: None, lambda: {"file": str(target)})
    message(json, f"stored {target}")


def _is_run(text: str) -> bool:
    """Whether an argument is a further run: a folder or file of that name is there."""
    path = Path(text)
    return path.is_file() or (path / FILE).is_file()
