"""Runs that commands are given: a folder, a file, or one robot of a population."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

import flexura as fx
from flexura.errors import InputError
from flexura.io import Run, called
from flexura.population import is_population

RobotNumber = Annotated[
    int | None,
    typer.Option("--robot", metavar="K", help="of a population: which robot, counted from 1"),
]


def one_run(path: Path, robot: int | None = None) -> Run:
    """The run in a folder or file; of a population that of robot K.

    Raises:
        InputError: there is no run, or a population without a robot's number.
    """
    if not is_population(path):
        if robot is not None:
            raise InputError(
                "expected a folder of a population, made by flexura simulate --vary",
                key="--robot",
                value=robot,
                file=str(path),
            )
        return Run.read(path)
    found = fx.Population.read(path)
    if robot is None:
        raise InputError(
            f"a population of {found.count} robots: choose one with --robot K, or write all with "
            f"flexura export {path} --to csv",
            key="RUN",
            value=str(path),
        )
    return found.run(robot)


def legend_names(paths: Sequence[Path], runs: Sequence[Run]) -> list[str]:
    """What each run is called in a legend: its kind, and its folder where kinds are the same."""
    kinds = list(map(called, runs))
    folders = [(path if path.is_dir() else path.parent).resolve().name for path in paths]
    return [
        kind if kinds.count(kind) == 1 else f"{folder}, {kind}"
        for kind, folder in zip(kinds, folders, strict=True)
    ]
