"""`flexura identify ROBOT RUN... --fit KEY`: parameters of any robot, from runs of it."""

from __future__ import annotations

import json as json_
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer

import flexura as fx
from flexura.io import find, write_text

from ..identification import Identification, identify_robot
from ..identification.fit import report
from ..identification.fit.unknowns import assigned, of_channel
from ..runs.of_robot import check_channels
from .output import message, print_results, progress_bars, warn
from .results import counted, file_result

_KEY = re.compile(r"(link|joint)\.\d+\..+|payload\..+|.+/.+\.(gain|offset|delay_s|cutoff_\w+)")


@dataclass(frozen=True)
class Asked:
    """What is to be fitted, by what. `robot` is None where the run's own file is meant."""

    robot: Path | None
    runs: tuple[Path, ...]
    fit: dict[str, float | None]


def asked_of(paths: Sequence[Path], fit: Sequence[str]) -> Asked | None:
    """What the arguments ask for; None: the identification of a rig, from its experiment.

    Further words after --fit KEY are keys too if no run is there.

    Raises:
        InputError: keys without a run, or runs without keys.
    """
    words = [word for text in fit for word in text.split(",") if word]
    rest = []
    for path in paths:
        text = str(path)
        if fit and _KEY.match(text) and not path.exists():
            words.append(text)
        else:
            rest.append(path)
    robot = rest[0] if rest and _is_robot(rest[0]) else None
    runs = tuple(rest[1:] if robot else rest)
    if not words and robot is None and len(rest) == 1:
        return None
    if not runs:
        raise fx.InputError("expected a run or more after ROBOT", key="RUN")
    if late := [path for path in runs if path.suffix == ".toml"]:
        expected = "expected runs here: the robot file stands before them"
        raise fx.InputError(expected, key="RUN", value=str(late[0]))
    if not words:
        raise fx.InputError(
            "expected what to fit, as --fit payload.mass_kg --fit link.1.damping.beta_s",
            key="--fit",
        )
    given = [assigned(word, "--fit") for word in words]
    twice = [key for key, _ in given if [k for k, _ in given].count(key) > 1]
    if twice:
        raise fx.InputError("expected each key once", key="--fit", value=twice[0])
    return Asked(robot, runs, dict(given))


def _is_robot(path: Path) -> bool:
    """Whether an argument is a robot file, or the name of one that comes with flexura."""
    if path.is_dir() or path.suffix == ".parquet":
        return False
    if path.suffix == ".toml":
        return True
    try:
        return find(path, "robots").is_file()
    except fx.InputError:
        return False


def identify_asked(
    asked: Asked,
    *,
    fix: Sequence[str],
    inputs: Sequence[str],
    channels: Sequence[str],
    controller: Path | None,
    span: tuple[float | None, float | None],
    check: Path | None,
    out: Path | None,
    force: bool,
    json: bool,
) -> None:
    """Fit, print the results, then write the files."""
    runs = [fx.Run.read(path) for path in asked.runs]
    robot = _robot(asked, runs[0])
    fixed = {}
    for text in fix:
        key, value = assigned(text, "--fix")
        if value is None:
            raise fx.InputError("expected KEY=VALUE", key="--fix", value=text)
        fixed[key] = value
    other = None if check is None else fx.Run.read(check)
    for path, run in zip([*asked.runs, check], [*runs, other], strict=True):
        if run is not None:
            check_channels(run, robot, str(path))
    first = asked.runs[0]
    home = first if first.is_dir() else first.parent
    with (
        file_result(out, force=force, suffix=".toml"),
        file_result(None if out is None else _beside(out), force=force),
    ):
        with progress_bars("fit") as told:
            found = identify_robot(
                robot,
                runs,
                asked.fit,
                fix=fixed,
                inputs=inputs,
                channels=channels,
                controller=controller,
                from_s=span[0],
                to_s=span[1],
                progress=lambda fraction: told("fit", fraction),
            )
        errors = None if other is None else _errors(found, other)
        stored: list[Path] = []
        missing = ""
        if json:  # one document says all of it
            stored, missing = _written(found, out, home, force)
        data: dict[str, Any] = report.numbers(found) | {"stored": list(map(str, stored))}
        if missing:
            data["not_stored"] = missing
        if errors is not None:
            data["check"] = {name: {"file": a, "identified": b} for name, (a, b) in errors.items()}
        shown = [] if errors is None else [report.checked(found, errors)]
        print_results(json, lambda: [*report.tables(found), *shown], lambda: data)
        if not json:
            stored, missing = _written(found, out, home, force)
    if missing:
        warn(missing)
    else:
        message(json, f"stored {', '.join(map(str, stored))}")
    if missing and out is not None:
        raise typer.Exit(1)


def _robot(asked: Asked, run: fx.Run) -> fx.Robot:
    if asked.robot is not None:
        return fx.load(asked.robot)
    tables = run.meta.get("robot")
    if not isinstance(tables, dict) or not tables:
        raise fx.InputError(
            "the run has no robot file in its metadata: expected ROBOT before it",
            key="ROBOT",
            file=str(asked.runs[0]),
        )
    return fx.Robot.from_dict(tables, file=str(asked.runs[0]))


def _errors(found: Identification, other: fx.Run) -> dict[str, tuple[float, float]]:
    before, after = found.predict(other, identified=False), found.predict(other)
    return {name: (before[name], after[name]) for name in after}


def _beside(path: Path) -> Path:
    return path.with_name(f"{path.stem}-report.json")


def _written(
    found: Identification, out: Path | None, home: Path, force: bool = False
) -> tuple[list[Path], str]:
    """The robot file and the report beside it; or why they could not be written."""
    path = out or counted(home / "identified", folder=True) / "robot.toml"
    beside = _beside(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        fx.save(found.robot, path, overwrite=force)
        text = json_.dumps(report.numbers(found), indent=1) + "\n"
        write_text(beside, text, new=not force)
    except (fx.InputError, OSError) as error:
        return [], f"{path} is not written: {error}"
    own = [key for key in found.values if of_channel(key)[0]]
    if own:
        warn(f"no robot file holds what channels do: {', '.join(own)} stand in {beside} only")
    return [path, beside], ""
