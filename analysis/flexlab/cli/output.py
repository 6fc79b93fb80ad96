"""What the commands share: progress bars and events on stderr, tables or JSON on stdout."""

from __future__ import annotations

import json as json_
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import typer

import flexura as fx
from flexura.io import FILE
from flexura.signals import as_loads

from ..crosscheck.default_manoeuvre import described as described_manoeuvre
from ..crosscheck.default_manoeuvre import modest
from ..runs.formatting import printable
from ..runs.table import WIDTH
from .verbosity import quiet


def load_request(
    robot: Path, manoeuvre: Path | None, prescribed: bool = False, start: str | None = None
) -> Any:
    """The assembled robot and what it is asked to do; a manoeuvre of its own is told on stderr."""
    described = fx.load(robot)
    try:
        system = fx.assemble(described)
    except fx.InputError as error:
        raise error if error.file else error.in_file(str(robot)) from None
    asked = None if manoeuvre is None else fx.load_manoeuvre(manoeuvre, len(described.links))
    if asked is None:
        asked = modest(system)
        if not quiet():
            typer.echo(described_manoeuvre(asked, described), err=True)
    try:
        asked = asked.prescribed() if prescribed else asked
        lengths = [link.length_m for link in described.links]
        as_loads(asked.loads, lengths, 0.0, asked.duration_s)
    except fx.InputError as error:
        raise error.in_file(str(manoeuvre)) from None
    return system, replace(asked, start=start or asked.start)


def check_followed(asked: fx.Manoeuvre, manoeuvre: Path | None, options: str) -> None:
    """Refuse a motion that nothing follows; `options` of the command say what to do."""
    for i, joint in enumerate(asked.drive.joints, 1):
        if joint.has_unfollowed_motion:
            raise fx.InputError(
                f"joint {i} has a motion, but neither gains nor prescribed: give it kp and kd, or "
                f"{options}",
                key=f"joint[{i}].motion",
                file=str(manoeuvre or ""),
            )


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


def simulate_asked(
    system: fx.System, asked: fx.Manoeuvre, drive: Any, bar: str, **how: Any
) -> fx.Run:
    """Simulate what is asked, with a progress bar; `how`: rtol and method."""
    with progress_bars(bar) as report:
        run = fx.simulate(
            system,
            asked.t,
            drive,
            start=asked.start,
            loads=asked.loads,
            payloads=asked.payloads,
            progress=lambda fraction: report(bar, fraction),
            **how,
        )
    run.meta["manoeuvre"] = asked.name
    return run


def print_results(json: bool, tables: Callable[[], Any], data: Callable[[], Any]) -> None:
    """Print a table, or several, or JSON; 80 columns wide where there is no terminal."""
    if json:
        typer.echo(json_.dumps(data(), indent=1))
        return
    from rich.console import Console

    console = Console(width=None if sys.stdout.isatty() else WIDTH)
    made = tables()
    for k, table in enumerate(made if isinstance(made, list) else [made]):
        if k:
            console.print()
        console.print(table)


def message(json: bool, *lines: str) -> None:
    """Print lines, without the control characters that names may have; nothing beside JSON."""
    if not json and not quiet():
        for line in lines:
            typer.echo(printable(line))


def warn(line: str) -> None:
    """Print a line on stderr."""
    typer.echo(printable(line), err=True)


def events(run: Any) -> None:
    """Print a run's events on stderr."""
    for event in run.meta.get("events", []):
        source, level = run.meta.get("source", "run"), event["level"].lower()
        warn(f"{source}: {level} at t = {event['t']:.4g} s: {event['text']}")


def report_saved(run: Any, folder: Path, json: bool) -> None:
    """Say what happened to a run and where it is; end with the status of an incomplete one."""
    events(run)
    message(json, f"stored {folder / FILE}", f"look at it: flexura review {folder}")
    if not run.complete:
        raise typer.Exit(130 if run.interrupted else 1)
