"""Which columns of a log are which channels, and which is the clock."""

from __future__ import annotations

from ...errors import InputError
from .log import Column, Log
from .mapping import Map, Source
from .names import TIMES, known
from .timebase import Timebase, from_clock, from_column, from_rate, in_time


def mapped(log: Log, asked: Map) -> dict[str, tuple[Column, Source]]:
    """The column of each channel of map.toml."""
    return {
        name: (_found(log, source.column, f'channel."{name}".column', asked.file), source)
        for name, source in asked.channels.items()
    }


def named(log: Log, clock: Column | None) -> dict[str, tuple[Column, Source]]:
    """Columns that are named as channels and have a unit; of an own export all but the clock."""
    chosen: dict[str, tuple[Column, Source]] = {}
    for place, column in enumerate(log.columns, 1):
        name = column.name if log.own else known(column.name)
        if column is not clock and name and (log.own or column.unit):
            add(log, chosen, name, column, Source(place))
    return chosen


def add(
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


def free(log: Log, clock: Column | None, chosen: dict[str, tuple[Column, Source]]) -> list[Column]:
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


def clock(log: Log, asked: Map | None) -> Column | None:
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


def timebase(log: Log, asked: Map | None, clock: Column | None, columns: list[Column]) -> Timebase:
    """The times of the run."""
    if asked is not None and asked.rate is not None:
        return from_rate(asked.rate, len(columns[0].values))
    if clock is not None:
        said = asked.time.unit if asked is not None and asked.time is not None else ""
        scale = (asked.time.scale, asked.time.offset) if asked and asked.time else (1.0, 0.0)
        return from_column(log, clock, said, scale)
    own = [column for column in columns if column.clock in log.clocks]
    if not own:
        raise InputError(
            "no clock: expected a column in a unit of time, as Time [s], or --map with [time]; "
            f"there are: {_heads(log)}",
            file=log.file,
        )
    return from_clock(log, max(own, key=lambda column: len(column.values)).clock)


def nothing(log: Log, every: bool, why: dict[str, str] | None = None) -> str:
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
