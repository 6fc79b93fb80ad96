"""The times of an imported run, and columns that have other times."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...errors import InputError
from ..quantities import EPOCH_S, LATEST_S, fault, unit
from .log import Column, Log

FASTEST_S = 2e-5  # most loggers of robots are slower
LATE_S = 1000.0  # a clock that begins later counts from the first sample


@dataclass(frozen=True)
class Timebase:
    """Times (T,) [s], what was taken off them [s], what they are in words; `clock`, a name in
    Log.clocks, or "" for a column."""

    t: np.ndarray
    start: float
    said: str
    clock: str = ""
    notes: list[str] = field(default_factory=list)


def in_time(said: str) -> bool:
    """Whether a unit is one of time."""
    found = unit(said) if said else None
    return found is not None and found.si == "s"


def from_rate(rate: float, length: int) -> Timebase:
    """Times of a log without a clock, k / rate [s]."""
    return Timebase(np.arange(length) / rate, 0.0, f"{rate:g} samples a second")


def from_column(log: Log, column: Column, said: str, scale: tuple[float, float]) -> Timebase:
    """Times of a column; long numbers and dates from the first one on.

    Raises:
        InputError: the column is no clock; the row is named.
    """
    if column.fault:
        raise InputError(column.fault, key=f"clock {column.head!r}", file=log.file)
    if len(column.values) < 2:
        raise InputError("expected two rows or more", file=log.file)
    notes = []
    if column.calendar and said != "s":
        expected = "expected no other unit than s: its cells are dates or times of day"
        raise InputError(expected, key=f"unit of {column.head!r}", value=said, file=log.file)
    if not said:
        said = _guessed(float(column.values[0]))
        notes.append(f"the clock {column.head!r} says no unit: {said} are taken")
    own = unit(said)
    if own is None or own.si != "s":
        raise InputError("expected a unit of time", key=f"unit of {column.head!r}", value=said)
    values = scale[0] * column.values + scale[1] if scale != (1.0, 0.0) else column.values
    absolute = own.to_si(values)
    t = absolute
    if column.since is not None and absolute[0] > EPOCH_S:
        t = own.to_si(scale[0] * column.since)
    measured = not log.own or log.meta.get("source") == "experiment"
    _check(log, t, f"clock {column.head!r}", measured, float(absolute[0]))
    notes += _rate(t, said) if measured else []
    text = f"{column.head!r} in {said}"
    if column.dates:
        text = f"{column.dates!r} and {column.head!r}"
    if column.since is not None and t is not absolute:
        return Timebase(t, float(absolute[0]), text, notes=notes)
    return _early(Timebase(t, 0.0, text, notes=notes), log.own)


def from_clock(log: Log, name: str) -> Timebase:
    """Times that the file gives beside its columns.

    Raises:
        InputError: they are no clock; the row is named.
    """
    clock = log.clocks[name]
    _check(log, clock.t, clock.said, True, clock.start_s)
    if clock.start_s > EPOCH_S:
        start = clock.start_s + float(clock.t[0])
        return Timebase(clock.t - clock.t[0], start, clock.said, name)
    return _early(Timebase(clock.t + clock.start_s, 0.0, clock.said, name), log.own)


def on(log: Log, base: Timebase, column: Column) -> np.ndarray:
    """A column's numbers at the run's times: row by row, or interpolated from its own clock.

    Raises:
        InputError: it has another number of rows, and no clock of its own.
    """
    same = len(column.values) == len(base.t)
    if not base.clock and same:
        return column.values
    own = log.clocks.get(column.clock)
    if own is None or not base.clock:
        raise InputError(
            f"{len(column.values)} rows, the clock has {len(base.t)}",
            key=f"column {column.head!r}",
            file=log.file,
        )
    first = log.clocks[base.clock]
    if column.clock == base.clock or (
        same and own.start_s == first.start_s and np.array_equal(own.t, first.t)
    ):
        return column.values
    _check(log, own.t, own.said, True, own.start_s)
    base.notes.append(f"{column.head!r} is interpolated: its clock is {own.said}")
    t = first.t + (first.start_s - own.start_s)
    there = np.isfinite(column.values)
    if not there.any():
        return np.full(len(t), np.nan)
    known, values = own.t[there], column.values[there]
    return np.interp(t, known, values, left=np.nan, right=np.nan)


def _rate(t: np.ndarray, said: str) -> list[str]:
    """A sentence on a clock that is faster than most loggers, or none."""
    step = float(np.median(np.diff(t)))
    if step > FASTEST_S:
        return []
    return [f"the clock has {1 / step:.4g} samples a second: is {said} its unit?"]


def _check(log: Log, t: np.ndarray, said: str, measured: bool, first: float) -> None:
    late = measured and np.isfinite(first) and first > LATEST_S
    wrong = fault(np.append(first, t[1:]) if late else t, measured)
    if wrong is not None:
        raise InputError(wrong.text, key=f"{log.row(wrong.row)}, {said}", file=log.file)


def _early(base: Timebase, own: bool) -> Timebase:
    """A clock that began long before the log counts from the first sample."""
    start = float(base.t[0])
    if own or start < LATE_S:
        return base
    return Timebase(base.t - start, start, base.said, base.clock, base.notes)


def _guessed(first: float) -> str:
    """The unit of a calendar's clock by its size; seconds for others."""
    for size, said in ((1e17, "ns"), (1e14, "us"), (1e11, "ms")):
        if first > size:
            return said
    return "s"
