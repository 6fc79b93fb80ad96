"""Dates and times of day that stand in two columns are one clock."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .log import Column

DAY_S = 86400.0


def joined(columns: list[Column]) -> tuple[list[Column], list[str]]:
    """Columns whose times of day have their dates.

    A time of day gets the date of the nearest column of dates. Without one, or where all dates are
    the same, times that fall by more than half a day have passed midnight.

    Args:
        columns: of a file.

    Returns:
        The columns in the same order, and what was assumed.
    """
    places = [k for k, column in enumerate(columns) if column.calendar == "dates"]
    out, notes = [], []
    for k, column in enumerate(columns):
        if column.calendar == "dates":
            fault = column.fault or "it has dates without times"
            column = replace(column, fault=fault)
        elif column.calendar == "times":
            near = min(places, key=lambda place: (abs(place - k), place), default=None)
            dates = None if near is None else columns[near]
            column, note = _dated(column, dates)
            notes += note
        out.append(column)
    return out, notes


def _dated(times: Column, dates: Column | None) -> tuple[Column, list[str]]:
    """A column of times of day with its dates, or from the first day on."""
    seconds = times.values
    days = np.zeros(len(seconds)) if dates is None else dates.values
    fault, notes = times.fault, []
    if dates is not None and dates.fault and not fault:
        fault = f"column {dates.head!r}: {dates.fault}"
    falls = np.diff(seconds, prepend=seconds[:1]) < -DAY_S / 2
    if np.all(days == days[:1]) and falls.any():
        if dates is not None:
            row = int(falls.argmax())
            notes = [
                f"{dates.head!r} stays where {times.head!r} passes midnight after row {row}: "
                "the next day is taken"
            ]
        days = days + DAY_S * np.cumsum(falls)
    since = (days - days[:1]) + (seconds - seconds[:1])
    head = "" if dates is None else dates.head
    return replace(times, values=days + seconds, since=since, fault=fault, dates=head), notes
