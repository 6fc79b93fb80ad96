"""What the commands share: progress bars and events on stderr, tables or JSON on stdout."""

from __future__ import annotations

import json as json_
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import typer

import flexura as fx

from ..crosscheck.default_manoeuvre import modest
from .verbosity import quiet


def prepare(robot: Path, manoeuvre: Path | None) -> Any:
    """The assembled robot and what it is asked to do."""
    described = fx.load(robot)
    try:
        system = fx.assemble(described)
    except fx.InputError as error:
        raise error if error.file else error.in_file(str(robot)) from None
    asked = None if manoeuvre is None else fx.load_manoeuvre(manoeuvre, len(described.links))
    return system, asked or modest(system)


@contextmanager
def progress_bars(*names: str) -> Iterator[Callable[[str, float], None]]:
    """Progress bars on a terminal's stderr, nothing elsewhere."""
    if quiet() or not sys.stderr.isatty():
        yield lambda name, fraction: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description:>8}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        tasks = {name: bars.add_task(name, total=1.0) for name in names}
        yield lambda name, fraction: bars.update(tasks[name], completed=fraction)


def show(json: bool, table: Callable[[], Any], data: Callable[[], Any]) -> None:
    if json:
        typer.echo(json_.dumps(data(), indent=1))
        return
    from rich.console import Console

    console = Console() if sys.stdout.isatty() else Console(width=120)
    console.print(table())


def say(json: bool, *lines: str) -> None:
    if not json and not quiet():
        for line in lines:
            typer.echo(line)


def events(run: Any) -> None:
    for event in run.meta.get("events", []):
        typer.echo(
            f"{run.meta['source']}: {event['level'].lower()} at t = {event['t']:.4g} s: "
            f"{event['text']}",
            err=True,
        )


def stored(run: Any, path: Path, json: bool) -> None:
    """What happened to a run and where it is; the status of one that did not come to its end."""
    events(run)
    say(json, f"stored {path}", f"look at it: flexura review {path.parent}")
    if not run.complete:
        raise typer.Exit(130 if interrupted(run) else 1)


def interrupted(run: Any) -> bool:
    return any(event["text"] == "interrupted" for event in run.meta.get("events", []))


def default_folder(command: str, robot: Path) -> Path:
    return Path("logs") / f"{command}-{robot.stem}"
