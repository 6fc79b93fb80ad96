"""The times of an imported run, and columns that have other times."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ...errors import InputError
from ..quantities import EPOCH_S, LATEST_S, doubted, fault, slow, unit
from .log import Clock, Column, Log

FASTEST_S = 2e-5  # most loggers of robots are slower
LATE_S = 1000.0  # a clock that begins later counts from the first sample


@dataclass(frozen=True)
class Timebase:
    """The clock of a run.

    Attributes:
        t: times (T,) [s].
        start: what was taken off them [s].
        said: what they are, in words.
        clock: the name in Log.clocks of the columns that have it, or "".
        first: its times as the log has them, by which other clocks are told.
        notes: what was assumed.
        others: columns with other clocks, by what is said of them.
    """

    t: np.ndarray
    start: float
    said: str
    first: Clock
    clock: str = ""
    notes: list[str] = field(default_factory=list)
    others: dict[tuple[str, str], list[str]] = field(default_factory=dict)

    def of_others(self) -> list[str]:
        """A sentence on the columns of each other clock."""
        out = []
        for (done, said), heads in self.others.items():
            more = f" and {len(heads) - 3} more" if len(heads) > 3 else ""
            shown = ", ".join(map(repr, heads[:3])) + more
            which = "is" if len(heads) == 1 else "are"
            out.append(f"{shown} {which} {done}: {'its' if which == 'is' else 'their'} {said}")
        return out


def in_time(said: str) -> bool:
    """Whether a unit is one of time.

    Args:
        said: the unit, or "".

    Returns:
        True if it is.
    """
    found = unit(said) if said else None
    return found is not None and found.si == "s"


def from_rate(rate: float, length: int) -> Timebase:
    """Times of a log without a clock, k / rate [s]."""
    t, said = np.arange(length) / rate, f"{rate:g} samples a second"
    return Timebase(t, 0.0, said, first=Clock(t, 0.0, said))


def from_column(log: Log, column: Column, asked: str, scale: tuple[float, float]) -> Timebase:
    """Times of a column; long numbers and dates from the first one on.

    Args:
        log: the file.
        column: its clock.
        asked: the unit that a map gives it, or "".
        scale: factor and offset of its numbers.

    Raises:
        InputError: the column is no clock; the row is named.
    """
    if column.fault:
        raise InputError(column.fault, key=f"clock {column.head!r}", file=log.file)
    if len(column.values) < 2:
        raise InputError("expected two rows or more", file=log.file)
    notes = []
    said = asked or column.unit
    if column.calendar and said != "s":
        expected = "expected no other unit than s: its cells are dates or times of day"
        raise InputError(expected, key=f"unit of {column.head!r}", value=said, file=log.file)
    if not said:
        said = _guessed(float(column.values[0]))
        notes.append(f"the clock {column.head!r} says no unit: {said} are taken")
    own = unit(said)
    if own is None or own.si != "s":
        key = f"unit of {column.head!r}"
        raise InputError("expected a unit of time", key=key, value=said, file=log.file)
    values = scale[0] * column.values + scale[1] if scale != (1.0, 0.0) else column.values
    absolute = own.to_si(values)
    t = absolute
    if column.since is not None and absolute[0] > EPOCH_S:
        t = own.to_si(scale[0] * column.since)
    measured = not log.own or doubted(log.meta)
    stated = bool(asked or column.calendar or own != unit("s"))
    _check(log, t, f"clock {column.head!r}", measured, float(absolute[0]), stated)
    if measured and not asked and not column.calendar:
        notes += _rate(t, said)
    text = f"{column.head!r} in {said}"
    if column.dates:
        text = f"{column.dates!r} and {column.head!r}"
    clock = column.clock if column.clock.startswith("/") else ""  # of messages
    start = float(absolute[0]) if column.since is not None and t is not absolute else 0.0
    first = log.clocks.get(clock, Clock(t, start, text))
    base = Timebase(t, start, text, first, clock, notes)
    return base if start else _early(base, log.own)


def from_clock(log: Log, name: str) -> Timebase:
    """Times that the file gives beside its columns.

    Raises:
        InputError: they are no clock; the row is named.
    """
    clock = log.clocks[name]
    _check(log, clock.t, clock.said, True, clock.start_s)
    if clock.start_s > EPOCH_S:
        start = clock.start_s + float(clock.t[0])
        return Timebase(clock.t - clock.t[0], start, clock.said, clock, name)
    return _early(Timebase(clock.t + clock.start_s, 0.0, clock.said, clock, name), log.own)


def misfit(log: Log, base: Timebase, column: Column) -> str:
    """Why a column has no numbers at the run's times, or ""."""
    own = log.clocks.get(column.clock)
    if _by_row(log, base, column):
        return ""
    if own is None:
        return f"{len(column.values)} rows, the clock has {len(base.t)}"
    if not len(own.t):
        return "no rows"
    wrong = fault(own.t)
    if wrong is not None:
        return f"its clock, {own.said}: row {wrong.row}: {wrong.text}"
    begins = [float(clock.start_s + clock.t[0]) for clock in (own, base.first)]
    if (begins[0] > EPOCH_S) != (begins[1] > EPOCH_S):
        return (
            f"its clock, {own.said}, begins at {begins[0]:.12g} s, that of the run at "
            f"{begins[1]:.12g} s: one of them is of the calendar"
        )
    return ""


def on(log: Log, base: Timebase, column: Column) -> np.ndarray:
    """A column's numbers at the run's times: row by row, or interpolated from its own clock.

    Raises:
        InputError: they do not fit (`misfit`).
    """
    if wrong := misfit(log, base, column):
        raise InputError(wrong, key=f"column {column.head!r}", file=log.file)
    own = log.clocks.get(column.clock)
    if own is None or _by_row(log, base, column):
        if own is not None and _apart(own.t, base.first.t):
            said = f"own clock, {own.said}, is not taken"
            base.others.setdefault(("taken row by row", said), []).append(column.head)
        return column.values
    base.others.setdefault(("interpolated", f"clock is {own.said}"), []).append(column.head)
    t = base.first.t + (base.first.start_s - own.start_s)
    there = np.isfinite(column.values)
    if not there.any():
        return np.full(len(t), np.nan)
    known, values = own.t[there], column.values[there]
    return np.interp(t, known, values, left=np.nan, right=np.nan)


def _by_row(log: Log, base: Timebase, column: Column) -> bool:
    """Whether a column's rows are those of the clock: its clock is the same or is not told, or the
    clock is a column of the file, which counts more."""
    own = log.clocks.get(column.clock)
    if len(column.values) != len(base.t):
        return False
    if own is None or column.clock == base.clock or not base.clock:
        return True
    return own.start_s == base.first.start_s and np.array_equal(own.t, base.first.t)


def _apart(t: np.ndarray, other: np.ndarray) -> bool:
    """Whether two clocks of as many rows run apart by more than half a step."""
    step = float(np.median(np.diff(other)))
    return bool(np.abs((t - t[0]) - (other - other[0])).max() > step / 2)


def _rate(t: np.ndarray, said: str) -> list[str]:
    """A sentence on a clock that is faster or slower than most loggers, or none."""
    step = float(np.median(np.diff(t)))
    if step > FASTEST_S and not slow(t):
        return []
    return [f"the clock has {1 / step:.4g} samples a second: is {said} its unit?"]


def _check(
    log: Log, t: np.ndarray, said: str, measured: bool, first: float, stated: bool = True
) -> None:
    late = measured and np.isfinite(first) and first > LATEST_S
    wrong = fault(np.append(first, t[1:]) if late else t, measured, stated)
    if wrong is not None:
        raise InputError(wrong.text, key=f"{log.row(wrong.row)}, {said}", file=log.file)


def _early(base: Timebase, own: bool) -> Timebase:
    """A clock that began long before the log counts from the first sample."""
    start = float(base.t[0])
    if own or start < LATE_S:
        return base
    return replace(base, t=base.t - start, start=start)


def _guessed(first: float) -> str:
    """The unit of a calendar's clock by its size; seconds for others."""
    for size, said in ((1e17, "ns"), (1e14, "us"), (1e11, "ms")):
        if first > size:
            return said
    return "s"
