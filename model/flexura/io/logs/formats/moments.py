"""Dates and times of day as loggers and spreadsheets write them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from datetime import UTC, datetime

_CLOCK = r"(\d{1,2}):(\d\d):(\d\d(?:[.,]\d+)?)(?:\s*([AaPp])\.?[Mm]\.?)?"
_TIME = re.compile(_CLOCK)
# Three parts with the same mark between them, once; a short month may have its point.
_WORD = r"[^\W\d_]+(?:\.(?= ))?"
_DAY = rf"({_WORD}|\d{{4}}|\d{{1,2}})([-./ ])({_WORD}|\d{{1,2}})(?:,(?= ))?\2(\d{{4}}|\d{{1,2}})"
_ALONE = re.compile(_DAY)
_DATE = re.compile(rf"{_DAY}(?:\s*,\s*|\s+|T){_CLOCK}\s*(Z|[+-]\d\d:?\d\d)?")
_MONTHS = (
    *("january", "february", "march", "april", "may", "june"),
    *("july", "august", "september", "october", "november", "december"),
)


def moment(cell: str, day_first: bool = False) -> tuple[float, float] | None:
    """A date with a time, or a time of day.

    Args:
        cell: ISO 8601, as "2026-11-29 14:03:05.1"; or as "29.11.2026 14:03:05,1",
            "11/29/2026 2:03:05.1 PM", "29-Nov-2026 14:03:05", "14:03:05.1".
        day_first: whether 03/04/2026 is in April.

    Returns:
        Seconds from 1970 to the day, 0 without a date, and seconds of the day; a date without a
        zone is one of UTC. None if it is no time.
    """
    plain = cell.strip()
    if ":" not in plain:
        return None
    if matched := _TIME.fullmatch(plain):
        seconds = _seconds(*matched.groups())
        return None if seconds is None else (0.0, seconds)
    matched = _DATE.fullmatch(plain)
    if matched is None:
        return None
    *clock, zone = matched.groups()[4:]
    begin, seconds = _begin(matched, day_first), _seconds(*clock)
    return None if begin is None or seconds is None else (begin - _ahead(zone), seconds)


def day(cell: str, day_first: bool = False) -> float | None:
    """A date without a time.

    Args:
        cell: in one of the forms of `moment`.
        day_first: whether 03/04/2026 is in April.

    Returns:
        Seconds from 1970 to the day in UTC; None if it is no date.
    """
    matched = _ALONE.fullmatch(cell.strip())
    return None if matched is None else _begin(matched, day_first)


def day_first(cells: Iterable[str]) -> bool | None:
    """Whether the day stands before the month in the dates of a column.

    Args:
        cells: of the column.

    Returns:
        None if there are dates, and none of them tells; False without dates in numbers.
    """
    told: bool | None = False
    for cell in cells:
        plain = cell.strip()
        matched = _DATE.fullmatch(plain) or _ALONE.fullmatch(plain)
        if matched is None or not (matched[1].isdigit() and matched[3].isdigit()):
            continue
        if matched[2] == "." or len(matched[1]) == 4:
            return matched[2] == "."
        if max(int(matched[1]), int(matched[3])) > 12:
            return int(matched[1]) > 12
        told = None
    return told


def _ahead(zone: str | None) -> float:
    """What a zone is ahead of UTC [s]."""
    if zone in (None, "Z"):
        return 0.0
    size = 3600.0 * int(zone[1:3]) + 60.0 * int(zone[-2:])
    return -size if zone[0] == "-" else size


def _begin(matched: re.Match[str], day_first: bool) -> float | None:
    """Seconds from 1970 to a day in UTC."""
    first, mark, second, third = matched.groups()[:4]
    ordered = _ordered(first, second, third, day_first or mark == ".")
    if ordered is None:
        return None
    try:
        return datetime(*ordered, tzinfo=UTC).timestamp()
    except (ValueError, OverflowError):
        return None


def _ordered(first: str, second: str, third: str, day_first: bool) -> tuple[int, int, int] | None:
    """Year, month and day."""
    if len(third) == 1 or (len(first) == 4 and first.isdigit()):
        whole = len(first) == 4 and (first + second + third).isdigit() and len(third) < 4
        return (int(first), int(second), int(third)) if whole else None
    named = [_month(text) for text in (first, second)]
    if named[0] or named[1]:
        number, month = (second, named[0]) if named[0] else (first, named[1])
        return (_year(third), month, int(number)) if number.isdigit() else None
    if not (first.isdigit() and second.isdigit()):
        return None
    day, month = (int(first), int(second)) if day_first else (int(second), int(first))
    return _year(third), month, day


def _month(text: str) -> int:
    """The number of a month by its English name, or its first letters; 0 for another text."""
    plain = text.rstrip(".").lower()
    found = (k for k, name in enumerate(_MONTHS, 1) if len(plain) > 2 and name.startswith(plain))
    return next(found, 0)


def _year(text: str) -> int:
    return int(text) + (2000 if len(text) == 2 else 0)


def _seconds(hours: str, minutes: str, seconds: str, half: str | None) -> float | None:
    """Seconds of a day; None for a time that no clock shows."""
    hour, second = int(hours), float(seconds.replace(",", "."))
    if half:
        if not 1 <= hour <= 12:
            return None
        hour = hour % 12 + (12 if half in "Pp" else 0)
    if hour > 24 or int(minutes) > 59 or math.floor(second) > 60:
        return None
    if hour == 24 and (int(minutes) or second):
        return None
    return 3600 * hour + 60 * int(minutes) + second
