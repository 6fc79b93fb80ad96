"""A Run from the columns of a log: its clock, its channels in SI units, and what was left out."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from ..quantities import Unit, channel, check_unit, unit
from ..run import Run
from . import choice
from .damage import changed, check_size, missing_rows
from .log import Column, Log
from .mapping import Map, Source
from .names import sensor
from .timebase import Timebase, misfit, on

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
    clock = choice.clock(log, asked)
    chosen = choice.mapped(log, asked) if asked else choice.named(log, clock)
    free = choice.free(log, clock, chosen)
    wanted = [column for column, _ in chosen.values()]
    if every:
        wanted += [column for column in free if not column.fault]
    if not wanted:
        raise InputError(choice.nothing(log, every), file=log.file)
    base = choice.timebase(log, asked, clock, wanted)
    if len(base.t) < 2:
        raise InputError("expected two rows or more", file=log.file)
    why = {c.head: text for c in free if (text := c.fault or misfit(log, base, c))}
    if every:
        for place, column in enumerate(log.columns, 1):
            if column.head not in why and any(column is each for each in free):
                choice.add(log, chosen, sensor(column.name or str(place)), column, Source(place))
        if not chosen:
            raise InputError(choice.nothing(log, every, why), file=log.file)
    channels, units, taken, replaced = _converted(log, chosen, base)
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


def _converted(
    log: Log, chosen: dict[str, tuple[Column, Source]], base: Timebase
) -> tuple[dict[str, np.ndarray], dict[str, str], list[Taken], dict[str, str]]:
    """The chosen columns in SI units on the run's times: values and units by channel, what was
    taken, and by channel the unit that was replaced."""
    channels: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}
    taken: list[Taken] = []
    replaced: dict[str, str] = {}
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
    return channels, units, taken, replaced


def _unit(log: Log, name: str, column: Column, source: Source) -> Unit:
    """The unit of a column, if it is one of the channel's."""
    said = source.unit or column.unit
    about = channel(name)
    free = name.startswith("sensor/")
    if not said and (free or about.units == ("1",)):
        return Unit("1")
    key = f"column {column.head!r}"
    check_unit(said, f"unit of {key}", log.file)
    own = unit(said) if said else None
    expected = " or ".join(about.units) or "SI"
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
