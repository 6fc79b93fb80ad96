"""map.toml: which column of a log is the clock, and which is which channel."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any

from ...errors import InputError
from ..arguments import number
from ..quantities import check_unit, meant, unit
from ..toml_files import read_toml
from ..validation import is_name

_TIME = ("column", "unit", "rate_Hz")
_CHANNEL = ("column", "unit", "scale", "offset")


@dataclass(frozen=True)
class Source:
    """Where a channel's numbers come from: value = scale x + offset in `unit`."""

    column: str | int
    unit: str = ""
    scale: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Map:
    """The clock's column, or the rate [1/s] of a log without a clock, and the channels by name."""

    file: str = ""
    time: Source | None = None
    rate: float | None = None
    channels: dict[str, Source] = field(default_factory=dict)


def read_map(path: str | os.PathLike[str]) -> Map:
    """Read map.toml.

    Args:
        path: of the file.

    Returns:
        Which column is which channel.

    Raises:
        InputError: by file, key and value, for what is wrong in it.
    """
    name = os.fspath(path)
    tables = read_toml(path)
    try:
        return _map(tables, name)
    except InputError as error:
        raise error if error.file else error.in_file(name) from None


def _map(tables: dict[str, Any], name: str) -> Map:
    for key, value in tables.items():
        if key not in ("time", "channel"):
            raise InputError("an unknown key; known here: time, channel", key=key)
        if not isinstance(value, dict):
            raise InputError("expected a table", key=key, value=value)
    time = tables.get("time")
    rate = None
    clock = None
    if time is not None:
        _known(time, _TIME, "time")
        if "rate_Hz" in time:
            rate = number(time["rate_Hz"], "time.rate_Hz", "expected a rate above 0 in hertz")
            if rate <= 0 or "column" in time:
                expected = "expected a rate above 0 in hertz, without a column"
                raise InputError(expected, key="time.rate_Hz", value=rate)
        else:
            clock = _source(time, "time")
            said = unit(clock.unit) if clock.unit else None
            if clock.unit and (said is None or said.si != "s"):
                raise InputError("expected a unit of time", key="time.unit", value=clock.unit)
    channels = {}
    for channel, table in tables.get("channel", {}).items():
        key = f'channel."{channel}"'
        if not is_name(channel) or not isinstance(table, dict):
            raise InputError("expected a table with column and unit", key=key, value=table)
        if wrong := meant(channel):
            raise InputError(f"an unknown channel; {wrong}", key=key)
        _known(table, _CHANNEL, key)
        channels[channel] = _source(table, key)
    if not channels:
        raise InputError('missing: expected a table as [channel."joint/1/position"]', key="channel")
    return Map(name, clock, rate, channels)


def _known(table: dict[str, Any], keys: tuple[str, ...], name: str) -> None:
    for key in table:
        if key not in keys:
            raise InputError(f"an unknown key; known here: {', '.join(keys)}", key=f"{name}.{key}")


def _source(table: dict[str, Any], name: str) -> Source:
    if "column" not in table:
        raise InputError("missing: expected a column's name or number", key=f"{name}.column")
    column = table["column"]
    counted = isinstance(column, int) and not isinstance(column, bool) and column >= 1
    if not (isinstance(column, str) and column) and not counted:
        raise InputError(
            "expected a column's name, or its number from 1", key=f"{name}.column", value=column
        )
    said = table.get("unit", "")
    if not isinstance(said, str) or ("unit" in table and not said.strip()):
        raise InputError('expected a unit, as "mm"', key=f"{name}.unit", value=said)
    check_unit(said, f"{name}.unit")
    scale = number(table.get("scale", 1.0), f"{name}.scale")
    if scale == 0:
        raise InputError("expected a number other than 0", key=f"{name}.scale", value=scale)
    return Source(column, said.strip(), scale, number(table.get("offset", 0.0), f"{name}.offset"))
