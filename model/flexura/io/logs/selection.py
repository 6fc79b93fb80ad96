"""A Run from the columns of a log: its clock, its channels in SI units, and what was left out."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from ..quantities import Unit, channel, unit
from ..run import Run
from .damage import changed, check_size, missing_rows
from .log import Column, Log
from .mapping import Map, Source
from .names import TIMES, known, sensor
from .timebase import Timebase, from_clock, from_column, from_rate, in_time, misfit, on

EQUAL = ({"N m", "J"},)  # SI units of one dimension that channels tell apart


@dataclass(frozen=True)
class Taken:
    """A channel and where it comes from."""

    channel: str
    head: str
    unit: str
    si: str
    gaps: int


@dataclass(frozen=True)
class Understood:
    """What was understood of a log.

    Attributes:
        run: of the columns that were taken.
        form: the file's format in words.
        clock: the run's times in words.
        taken: channels and their columns.
        left: heads of the other columns.
        notes: what was assumed.
        why: by head, why a column cannot be taken as it is; `left` has others that can.
    """

    run: Run
    form: str
    clock: str
    taken: list[Taken]
    left: list[str]
    notes: list[str] = field(default_factory=list)
    why: dict[str, str] = field(default_factory=dict)


def understood(
    log: Log, asked: Map | None = None, *, robot: dict[str, Any] | None = None, every: bool = False
) -> Understood:
    """Make a Run of a log.

    Args:
        log: the file's columns.
        asked: which column is which channel; without, columns that are named as channels and have
            a unit are taken, and the first column in a unit of time is the clock.
        robot: the tables of a robot file, for the metadata.
        every: take the other columns too, as sensor/NAME.

    Returns:
        The run, and what was taken, left out and assumed.

    Raises:
        InputError: a column is not there or is damaged, a unit does not fit, the clock is none.
    """
    clock = _clock(log, asked)
    chosen = _mapped(log, asked) if asked else _named(log, clock)
    free = _free(log, clock, chosen)
    wanted = [column for column, _ in chosen.values()]
    if every:
        wanted += [column for column in free if not column.fault]
    if not wanted:
        raise InputError(_nothing(log, every), file=log.file)
    base = _timebase(log, asked, clock, wanted)
    if len(base.t) < 2:
        raise InputError("expected two rows or more", file=log.file)
    why = {c.head: text for c in free if (text := c.fault or misfit(log, base, c))}
    if every:
        for place, column in enumerate(log.columns, 1):
            if column.head not in why and any(column is each for each in free):
                _add(log, chosen, sensor(column.name or str(place)), column, Source(place))
        if not chosen:
            raise InputError(_nothing(log, every, why), file=log.file)
    channels, units, taken, replaced = {}, {}, [], {}
    for name, (column, source) in chosen.items():
        if column.fault:
            raise InputError(column.fault, key=f"column {column.head!r}", file=log.file)
        check_size(log, column.head, column.values)
        values = on(log, base, column)
        own = _unit(log, name, column, source)
        said = source.unit or column.unit
        if (source.scale, source.offset) != (1.0, 0.0):
            values = source.scale * values + source.offset
        channels[name], units[name] = own.to_si(values), own.si
        if said != own.si and said:
            replaced[name] = said
        gaps = int(np.isnan(channels[name]).sum())
        taken.append(Taken(name, column.head, said or "none", own.si, gaps))
    meta = dict(log.meta) if log.own else _meta(log, chosen, base)
    if replaced and not log.own:
        meta["original_units"] = replaced
    if base.start:
        meta["clock_start_s"] = base.start
    if robot is not None:
        meta["robot"] = robot
    used = {id(column) for column, _ in chosen.values()}
    left = [column.head for column in free if id(column) not in used]
    if every and not log.own:
        why |= log.unread
        left += list(log.unread)
    try:
        run = Run(base.t, channels, units, meta)
    except (InputError, ValueError) as error:
        raise InputError(str(error), file=log.file) from None
    notes = [*log.notes, *base.notes, *base.of_others(), *missing_rows(log, run.t)]
    notes += [
        f"{each.head!r}: the unit {each.si} is not known, and is kept as it is"
        for each in taken
        if not log.own and unit(each.si) is None
    ]
    if asked is None:
        notes += changed(log, run)
    return Understood(run, log.form, base.said, taken, left, notes, why)


def _mapped(log: Log, asked: Map) -> dict[str, tuple[Column, Source]]:
    """The column of each channel of map.toml."""
    return {
        name: (_found(log, source.column, f'channel."{name}".column', asked.file), source)
        for name, source in asked.channels.items()
    }


def _named(log: Log, clock: Column | None) -> dict[str, tuple[Column, Source]]:
    """Columns that are named as channels and have a unit; of an own export all but the clock."""
    chosen: dict[str, tuple[Column, Source]] = {}
    for place, column in enumerate(log.columns, 1):
        name = column.name if log.own else known(column.name)
        if column is not clock and name and (log.own or column.unit):
            _add(log, chosen, name, column, Source(place))
    return chosen


def _add(
    log: Log,
    chosen: dict[str, tuple[Column, Source]],
    name: str,
    column: Column,
    source: Source,
) -> None:
    """Choose a column for a channel. Raises InputError if it has one."""
    if name in chosen:
        raise InputError(
            f"two columns for {name}, {chosen[name][0].head!r} and {column.head!r}: "
            "choose one with --map",
            file=log.file,
        )
    chosen[name] = (column, source)


def _free(log: Log, clock: Column | None, chosen: dict[str, tuple[Column, Source]]) -> list[Column]:
    """The columns that are no channel, and no part of the clock."""
    used = {id(column) for column, _ in chosen.values()} | {id(clock)}
    dates = clock.dates if clock is not None else ""
    return [
        column
        for column in log.columns
        if id(column) not in used and not (column.calendar == "dates" and column.head == dates)
    ]


def _found(log: Log, asked: str | int, key: str, file: str) -> Column:
    """A column by its number from 1, its head, or its name without the unit."""
    if isinstance(asked, int):
        if asked > len(log.columns):
            expected = f"expected a number up to {len(log.columns)}, of the columns of {log.file}"
            raise InputError(expected, key=key, value=asked, file=file)
        return log.columns[asked - 1]
    plain = " ".join(asked.split())
    for of in (
        lambda column: {column.head, column.name},
        lambda column: {column.head.lower().strip("/"), column.name.lower().strip("/")},
    ):
        found = [column for column in log.columns if {plain, plain.lower().strip("/")} & of(column)]
        if len(found) == 1:
            return found[0]
        if found:
            expected = f"{len(found)} columns have this name: give the number"
            raise InputError(expected, key=key, value=asked, file=file)
    raise InputError(
        f"no such column in {log.file}; there are: {_heads(log)}", key=key, value=asked, file=file
    )


def _clock(log: Log, asked: Map | None) -> Column | None:
    """The column of the clock: map.toml's, else the first one in a unit of time."""
    if asked is not None and asked.time is not None:
        column = _found(log, asked.time.column, "time.column", asked.file)
        dated = [c for c in log.columns if column.calendar == "dates" and c.dates == column.head]
        return next(iter(dated), column)
    if asked is not None and asked.rate is not None:
        return None
    of_messages = not log.own and any(column.clock.startswith("/") for column in log.columns)
    if of_messages:
        return None
    free = [column for column in log.columns if not known(column.name)]
    timed = sorted((c for c in free if in_time(c.unit)), key=lambda c: bool(c.calendar))
    bare = [c for c in free if not c.unit and c.name.lower().rpartition(".")[2] in TIMES]
    return next(iter(timed + bare), None)


def _timebase(log: Log, asked: Map | None, clock: Column | None, columns: list[Column]) -> Timebase:
    """The times of the run."""
    if asked is not None and asked.rate is not None:
        return from_rate(asked.rate, len(columns[0].values))
    if clock is not None:
        said = asked.time.unit if asked is not None and asked.time is not None else ""
        scale = (asked.time.scale, asked.time.offset) if asked and asked.time else (1.0, 0.0)
        return from_column(log, clock, said or clock.unit, scale)
    own = [column for column in columns if column.clock in log.clocks]
    if not own:
        raise InputError(
            "no clock: expected a column in a unit of time, as Time [s], or --map with [time]; "
            f"there are: {_heads(log)}",
            file=log.file,
        )
    return from_clock(log, max(own, key=lambda column: len(column.values)).clock)


def _unit(log: Log, name: str, column: Column, source: Source) -> Unit:
    """The unit of a column, if it is one of the channel's."""
    said = source.unit or column.unit
    about = channel(name)
    free = name.startswith("sensor/")
    if not said and (free or about.units == ("1",)):
        return Unit("1")
    own = unit(said) if said else None
    expected = " or ".join(about.units) or "SI"
    key = f"column {column.head!r}"
    if not said:
        raise InputError(
            f"no unit: expected one for {name}, as {expected}, in the head or in --map",
            key=key,
            file=log.file,
        )
    if own is None:
        if free:
            return Unit(said)
        raise InputError(
            f"a unit that is not known: expected one for {name}, as {expected}",
            key=f"unit of {key}",
            value=said,
            file=log.file,
        )
    if about.units and own.si not in about.units:
        for pair in EQUAL:
            if own.si in pair and (other := pair & set(about.units)):
                return Unit(other.pop(), own.factor)
        hint = ""
        if own.si == "1":
            hint = f'; in --map give unit = "{about.units[0]}" and the scale of a count'
        raise InputError(
            f"{name} is in {expected}, not in {own.si}{hint}",
            key=f"unit of {key}",
            value=said,
            file=log.file,
        )
    return own


def _meta(log: Log, chosen: dict[str, tuple[Column, Source]], base: Timebase) -> dict[str, Any]:
    """Where a run comes from."""
    columns = {
        name: {"column": column.head, "unit": source.unit or column.unit or "1"}
        | ({"scale": source.scale} if source.scale != 1.0 else {})
        | ({"offset": source.offset} if source.offset != 0.0 else {})
        for name, (column, source) in chosen.items()
    }
    about = {"file": Path(log.file).name, "format": log.form, "clock": base.said}
    return {
        "source": "experiment",
        "program": "flexura import",
        "complete": True,
        "imported": about | {"columns": columns},
    }


def _nothing(log: Log, every: bool, why: dict[str, str] | None = None) -> str:
    """What is said where no column is taken."""
    if every:
        found = (why or {}) | log.unread
        said = "; ".join(f"{head!r}: {text}" for head, text in list(found.items())[:8])
        return f"no column can be taken: {said}" if said else "no columns of numbers"
    bare = [column.head for column in log.columns if known(column.name) and not column.unit]
    if bare:
        return f"no unit: expected a head as {bare[0]} [rad], or --map with unit, for {bare[0]!r}"
    return (
        "no column is named as a channel: expected heads as joint/1/position [deg], or --map "
        f"map.toml, or --all; there are: {_heads(log)}"
    )


def _heads(log: Log) -> str:
    heads = [column.head for column in log.columns] or ["no columns of numbers"]
    return ", ".join(heads[:12]) + (f" and {len(heads) - 12} more" if len(heads) > 12 else "")
