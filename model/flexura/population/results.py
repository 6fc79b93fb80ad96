"""What came of the robots of a population: one table of all, one Run of one."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Protocol

import numpy as np

from ..errors import InputError
from ..io import Run, Tables, changed, whole
from ..signals import acts

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ..robot import Robot
    from .store import Chunk


class Simulated(Protocol):
    """What the results need of a population."""

    @property
    def t(self) -> np.ndarray:
        """Times (T,) [s]."""

    @property
    def units(self) -> Mapping[str, str]:
        """Of the channels."""

    @property
    def count(self) -> int:
        """Of robots."""

    @property
    def acting(self) -> Mapping[str, list[Tables]]:
        """Tables of loads and changes of the payload."""

    @property
    def base(self) -> Robot | None:
        """The robot that was varied."""

    def __iter__(self) -> Iterator[Chunk]:
        """The chunks that are done."""


def tabulated(population: Simulated) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """One row a robot; see `Population.table`."""
    parts: list[dict[str, np.ndarray]] = []
    units: dict[str, str] = {}
    for chunk in population:
        part = {"robot": np.arange(chunk.first + 1, chunk.first + 1 + len(chunk))}
        part |= chunk.vary
        part |= {"status": chunk.status, "reached_s": chunk.reached_s}
        part["event"] = np.array(chunk.event, dtype=object)
        for name, values in chunk.values.items():
            if values.ndim == 1:
                part[name] = values
                continue
            part[f"{name}/peak"], part[f"{name}/end"] = _peak(values), _last(values)
            for what in ("peak", "end"):
                units[f"{name}/{what}"] = population.units.get(name, "1")
        parts.append(part)
    names = dict.fromkeys(name for part in parts for name in part)
    nothing = lambda part: np.full(len(part["robot"]), np.nan)  # of refused robots
    columns = {
        name: np.concatenate([part[name] if name in part else nothing(part) for part in parts])
        for name in names
    }
    return columns, units


def one_run(population: Simulated, robot: int) -> Run:
    """The channels of one robot, from 1; see `Population.run`."""
    expected = f"expected the number of a robot, 1 to {population.count}"
    robot = whole(robot, "robot", 1, expected)
    if robot > population.count:
        raise InputError(expected, key="robot", value=robot)
    for chunk in population:
        k = robot - 1 - chunk.first
        if 0 <= k < len(chunk):
            return _run(population, chunk, k)
    raise InputError("expected a robot that is done; this one is not yet", key="robot", value=robot)


def _run(population: Simulated, chunk: Chunk, k: int) -> Run:
    """Row k of a chunk, up to where the robot stopped."""
    kept = {name: rows[k] for name, rows in chunk.values.items() if rows.ndim == 2}
    if not kept:
        raise InputError(
            f"expected a population with channels; only {', '.join(chunk.values)} was kept",
            key="robot",
            value=chunk.first + k + 1,
        )
    there = np.isfinite(np.array(list(kept.values()))).any(axis=0)
    end = len(there) - int(there[::-1].argmax()) if there.any() else 0
    values = {key: float(column[k]) for key, column in chunk.vary.items()}
    status, event = str(chunk.status[k]), chunk.event[k]
    level = "WARN" if status == "done" else "ERROR"
    meta = {
        "source": "simulation",
        "program": "flexura",
        "population": {"robot": chunk.first + k + 1, "vary": values},
        "complete": status == "done",
        "events": [{"t": float(chunk.reached_s[k]), "level": level, "text": event}]
        if event
        else [],
    }
    tables = {name.removesuffix("s"): each for name, each in population.acting.items()}
    acting = changed(tables, {key: value for key, value in values.items() if acts(key)})
    meta |= {f"{name}s": each for name, each in acting.items()}
    if population.base is not None:
        described = population.base.replace({k: v for k, v in values.items() if not acts(k)})
        meta |= {"name": described.name, "robot": described.to_dict()}
    return Run(
        population.t[:end],
        {name: row[:end] for name, row in kept.items()},
        {name: population.units[name] for name in kept},
        meta,
    )


def _peak(values: np.ndarray) -> np.ndarray:
    """The largest magnitude of each row (b, T); NaN of a row without values."""
    size = np.where(np.isfinite(values), np.abs(values), -1.0).max(axis=1, initial=-1.0)
    return np.where(size < 0, np.nan, size)


def _last(values: np.ndarray) -> np.ndarray:
    """The last value of each row (b, T) that there is; NaN of a row without values."""
    there = np.isfinite(values)
    at = values.shape[1] - 1 - there[:, ::-1].argmax(axis=1)
    return np.where(there.any(axis=1), values[np.arange(len(values)), at], np.nan)
