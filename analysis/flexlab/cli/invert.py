"""The command `flexura invert`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

import flexura as fx
from flexura.io import FILE, write_toml
from flexura.io.logs import TIMES, Column, Map, Source, in_time, read_log, understood
from flexura.io.quantities import slow

from ..studies.drive_requirements import efforts
from . import tables
from .options import Force, Json, Out, RobotFile
from .output import message, print_results, progress_bars, report_saved, warn
from .results import results

MANOEUVRE = "manoeuvre.toml"
# Columns of a table: the channel whose units they have, and the unit of one that says none.
CHANNELS = {
    "t": ("", "s"),
    "x": ("tip/x", "m"),
    "y": ("tip/y", "m"),
    "angle": ("link/1/angle", "rad"),
    "place": ("tip/x", "m"),
}


def _numbers(param: typer.CallbackParam, value: Any) -> Any:
    """Refuse texts of an option that takes several numbers, as before anything else that is
    wrong: too few of them take the next option in."""
    try:
        _floats(value)
    except ValueError:
        expected = f"expected {len(value)} numbers, {param.metavar}"
        raise fx.InputError(expected, key=param.opts[0], value=" ".join(value)) from None
    return value


def _floats(texts: tuple[str, ...] | None) -> Any:
    return None if texts is None else tuple(map(float, texts))


def invert(
    robot: RobotFile,
    line: Annotated[
        tuple[str, str, str, str] | None,
        typer.Option(
            metavar="X Y X Y", callback=_numbers, help="a straight way from place to place [m]"
        ),
    ] = None,
    circle: Annotated[
        tuple[str, str, str] | None,
        typer.Option(
            metavar="X Y RADIUS", callback=_numbers, help="once round a circle, from its right [m]"
        ),
    ] = None,
    point: Annotated[
        list[str] | None,
        typer.Option(metavar="X,Y", help="a corner of straight ways [m]; two or more"),
    ] = None,
    angle: Annotated[
        tuple[str, str] | None,
        typer.Option(
            metavar="FROM TO",
            callback=_numbers,
            help="of a robot with one joint: polar angle of the tip [rad], or its place along the "
            "rail [m]",
        ),
    ] = None,
    table: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="a log with the columns t, x, y or t, angle or t, place (of a rail); heads may "
            "have units, as x [mm]",
        ),
    ] = None,
    duration: Annotated[float, typer.Option(metavar="SECONDS", help="of the path")] = 1.0,
    step: Annotated[float, typer.Option(metavar="SECONDS", help="between rows, at most")] = 1e-3,
    least_squares: Annotated[
        bool,
        typer.Option("--least-squares", help="the nearest motion, where none is exact"),
    ] = False,
    out: Out = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Compute joint motions and drives with which the tip follows a path.

    The joints begin before the tip does. The result is a run, and a manoeuvre file with motions and
    feedforward for `flexura simulate --prescribed` or a controller.

    \b
    Example: flexura invert rig --line 0.38 0.1 0.42 0.2 --duration 0.6
    """
    described = fx.load(robot)
    given = {
        "--line": line,
        "--circle": circle,
        "--point": point,
        "--angle": angle,
        "--table": table,
    }
    asked = [key for key, value in given.items() if value]
    if len(asked) != 1:
        raise fx.InputError(
            f"expected one of {', '.join(given)}", key="path", value=", ".join(asked) or "none"
        )
    ends, ring, span = map(_floats, (line, circle, angle))
    _check_numbers(duration, step, span)
    t = np.linspace(0.0, duration, max(round(duration / step), 1) + 1)
    tip: Any
    if table is not None:
        t, tip = table_of(table, described)
    elif ends is not None:
        tip = fx.signals.paths.line(ends[:2], ends[2:], duration)
    elif ring is not None:
        tip = fx.signals.paths.circle(ring[:2], ring[2], duration)
    elif point:
        tip = fx.signals.paths.polyline([_place(p) for p in point], duration)
    else:
        low, high = span
        tip = lambda s: low + (high - low) * fx.signals.paths.smooth_rise(s / duration)
    with results(out, "invert", robot.stem, force=force) as draft:
        with progress_bars("invert") as report:
            try:
                run = fx.invert(
                    described,
                    t,
                    tip,
                    least_squares=least_squares,
                    progress=lambda fraction: report("invert", fraction),
                )
            except fx.InputError as error:
                raise _as_asked(error, asked[0], table) from None
        run.meta["manoeuvre"] = f"the path of {asked[0]}"
        run.save(draft.folder)
        write_toml(draft.folder / MANOEUVRE, fx.feedforward(run).spec())
        folder = draft.keep()
    rows = efforts(run)
    about = {key: run.meta[key] for key in ("tip_error_m", "iterations", "path_s", "zeros_1_s")}
    print_results(
        json,
        lambda: tables.effort_table(rows, run),
        lambda: (
            tables.run_json(run)
            | about
            | {
                "drives": [vars(r) for r in rows],
                "run": str(folder / FILE),
                "manoeuvre": str(folder / MANOEUVRE),
            }
        ),
    )
    start, end = run.meta["path_s"]
    message(
        json,
        f"tip within {1e3 * run.meta['tip_error_m']:.2g} mm of its path, after "
        f"{run.meta['iterations']} iterations",
        f"the joints begin {start - run.t[0]:.3g} s before the tip and end {run.t[-1] - end:.3g} s "
        f"after it",
        f"stored {folder / MANOEUVRE}",
    )
    report_saved(run, folder, json)


def _as_asked(error: fx.InputError, option: str, table: Path | None) -> fx.InputError:
    """The error with the option or the file that the path is from."""
    if error.key != "tip":
        return error
    if table is not None:
        return error.in_file(str(table))
    value = None if error.value == "a function" else error.value
    return fx.InputError(error.expected, key=option, value=value)


def _check_numbers(duration: float, step: float, angle: tuple[float, float] | None) -> None:
    for key, value in (("--duration", duration), ("--step", step)):
        if not 0 < value < 1e6:
            raise fx.InputError("expected a time above 0 in seconds", key=key, value=value)
    if angle is not None and not np.isfinite(angle).all():
        raise fx.InputError("expected two finite numbers", key="--angle", value=angle)
    if duration / step > 1e6:
        raise fx.InputError("expected at most a million rows", key="--step", value=step)


def _place(text: str) -> list[float]:
    try:
        x, y = map(float, text.split(","))
    except ValueError:
        raise fx.InputError("expected two numbers, X,Y", key="--point", value=text) from None
    return [x, y]


def table_of(path: Path, robot: fx.Robot) -> tuple[np.ndarray, Any]:
    """Times, and the path as `fx.invert` takes it, of a table: a log with the path's columns."""
    log = read_log(path)
    moving = [link.joint.type for link in robot.links if not link.joint.locked]
    wanted = ("t", "angle" if moving == ["R"] else "place") if len(moving) == 1 else ("t", "x", "y")
    heads = ", ".join(repr(column.head) for column in log.columns[:8])
    if len(log.columns) != len(wanted):
        raise fx.InputError(
            f"expected the columns {', '.join(wanted)} for this robot; there are "
            f"{len(log.columns)}: {heads}",
            file=str(path),
        )
    named = [_of_path(column) for column in log.columns]
    unnamed = not any(column.name for column in log.columns)
    found = {name: k for k, name in enumerate(wanted if unnamed else named, 1)}
    if set(found) != set(wanted):
        raise fx.InputError(
            f"expected the heads {', '.join(wanted)}, or these with units, not {heads}",
            file=str(path),
        )
    sources = {
        name: Source(k, log.columns[k - 1].unit or CHANNELS[name][1]) for name, k in found.items()
    }
    channels = {CHANNELS[name][0]: sources[name] for name in wanted[1:]}
    read = understood(log, Map(str(path), sources["t"], None, channels))
    notes = list(read.notes)
    if not log.columns[found["t"] - 1].unit and slow(read.run.t):
        notes.append(f"its rows are {np.diff(read.run.t)[0]:g} s apart: t without a unit is in s")
    for note in notes:
        warn(f"{path}: {note}")
    tip = [read.run[name] for name in channels]
    gaps = np.flatnonzero(~np.isfinite(tip).all(axis=0))
    if len(gaps):
        raise fx.InputError(
            "a cell without a number: expected a whole path",
            key=log.row(int(gaps[0]) + 1),
            file=str(path),
        )
    return read.run.t, tip[0] if len(tip) == 1 else tuple(tip)


def _of_path(column: Column) -> str:
    """What a column of a table is: "t", "x", "y", "angle", "place", or its own name."""
    name = column.name.lower().removeprefix("tip").lstrip("/_ ")
    return "t" if in_time(column.unit) or column.calendar or name in TIMES else name
