"""The command `flexura invert`."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

import flexura as fx
from flexura.io import FILE, write_toml

from ..studies.drive_requirements import efforts
from . import tables
from .options import Force, Json, Out, RobotFile
from .output import message, print_results, progress_bars, report_saved
from .results import results

MANOEUVRE = "manoeuvre.toml"


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
        typer.Option(metavar="FILE", help="CSV file with the columns t, x, y or t, angle"),
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
        t, tip = _columns(table)
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


def _columns(path: Path) -> tuple[np.ndarray, Any]:
    """Times, and the path as `fx.invert` takes it, of a CSV file."""
    expected = "expected a CSV file of numbers with 2 or 3 columns, t and angle or t, x and y"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of an empty file
            rows = np.genfromtxt(path, delimiter=",", comments="#", ndmin=2)
    except (OSError, ValueError) as error:
        raise fx.InputError(f"{expected} ({error})", file=str(path)) from None
    if len(rows) and np.isnan(rows[0]).all():  # the names of the columns
        rows = rows[1:]
    if rows.ndim != 2 or rows.shape[1] not in (2, 3) or len(rows) < 2:
        raise fx.InputError(expected, file=str(path))
    bad = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    if len(bad):
        raise fx.InputError(f"{expected}; row {bad[0] + 1} has something else", file=str(path))
    back = np.flatnonzero(np.diff(rows[:, 0]) <= 0)
    if len(back):
        text = f"expected ascending times in seconds; row {back[0] + 2} is not later"
        raise fx.InputError(text, file=str(path), key="t", value=float(rows[back[0] + 1, 0]))
    return rows[:, 0], rows[:, 1] if rows.shape[1] == 2 else (rows[:, 1], rows[:, 2])
