"""Text files: their encoding, and the numbers in their cells."""

from __future__ import annotations

import codecs
import math
import re
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation

import numpy as np

from ....errors import InputError
from .moments import day, day_first, moment

_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_GAPS = {"", "nan", "-nan", "+nan", "na", "n/a", "null", "none", "-", "--", "#n/a", "nan(ind)"}
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?|[+-]?inf(inity)?", re.IGNORECASE)
# Thousands set apart, where no reading as a decimal sign is left: the key is the decimal comma.
_GROUPED = {
    comma: re.compile(
        rf"[+-]?\d{{1,3}}(?:(?:{mark}\d{{3}})+{point}\d+|(?:{mark}\d{{3}}){{2,}})"
        rf"|[+-]?\d{{1,3}}(?:[' \u00a0\u202f]\d{{3}})+(?:{point}\d+)?"
    )
    for comma, mark, point in ((False, ",", r"\."), (True, r"\.", ","))
}
_APART = re.compile("[' \u00a0\u202f]")
SAMPLE = 50  # cells that tell what a column is
LONG = 15  # digits that a double holds in any case


def decoded(raw: bytes, file: str) -> tuple[str, str]:
    """The text of a file, and its encoding in words.

    Raises:
        InputError: it is no text.
    """
    for mark, encoding in _MARKS:
        if raw.startswith(mark):
            return _decoded(raw, encoding, file), encoding.removesuffix("-sig").upper()
    zeros = raw[:4096].count(0)
    if zeros:
        odd = raw[1:4096:2].count(0)
        if zeros > 0.3 * min(len(raw), 4096) and max(odd, zeros - odd) > 0.9 * zeros:
            encoding = "utf-16-le" if 2 * odd > zeros else "utf-16-be"
            return _decoded(raw, encoding, file), "UTF-16"
        raise InputError("not a text, and no format of a log that is known", file=file)
    try:
        text, named = raw.decode("utf-8"), "UTF-8"
    except UnicodeDecodeError:
        text, named = raw.decode("cp1252", errors="replace"), "Windows-1252"
    strange = sum(not (c.isprintable() or c.isspace() or c in "\ufeff") for c in text[:100_000])
    if strange > 0.02 * min(len(text), 100_000):
        raise InputError("not a text, and no format of a log that is known", file=file)
    return text, named


def likely(raw: bytes) -> bool:
    """Whether bytes are a text."""
    try:
        decoded(raw, "")
    except InputError:
        return False
    return True


def _decoded(raw: bytes, encoding: str, file: str) -> str:
    try:
        return raw.decode(encoding)
    except UnicodeDecodeError as error:
        raise InputError(
            f"damaged at byte {error.start}: not {encoding.removesuffix('-sig').upper()}", file=file
        ) from None


def gap(cell: str) -> bool:
    """Whether a cell says that there is no value."""
    return cell.strip().lower() in _GAPS


def number(cell: str, comma: bool) -> float | None:
    """A cell as a number; None if it is none. `comma`: the decimal sign is a comma."""
    plain = cell.strip()
    if _GROUPED[comma].fullmatch(plain):
        plain = _APART.sub("", plain).replace("." if comma else ",", "")
    if comma:
        if "." in plain:
            return None
        plain = plain.replace(",", ".")
    if _NUMBER.fullmatch(plain) is None:
        return None
    return float(plain.replace("d", "e").replace("D", "E"))


def numeric(cell: str, comma: bool) -> bool:
    """Whether a cell is a number, a gap, a date or a time of day."""
    if gap(cell) or number(cell, comma) is not None:
        return True
    return any(read(cell, first) is not None for read in (moment, day) for first in (False, True))


def refused(cell: str, comma: bool) -> str:
    """Why a cell is no number."""
    shown = repr(cell[:40])
    if number(cell, not comma) is not None:
        other = "point" if comma else "comma"
        return (
            f"{shown} has a decimal {other}, or thousands set apart: expected numbers without, "
            f"and a decimal {'comma' if comma else 'point'}"
        )
    if ":" in cell and any(c.isdigit() for c in cell):
        return f"{shown} is no time: expected one as 2026-11-29 14:03:05.1, or a time of day"
    return f"{shown} is no number"


@dataclass(frozen=True)
class Cells:
    """A column of cells as numbers.

    Attributes:
        values: (T,); NaN in gaps.
        since: the same less the first one if they are long or dates, or None.
        wrong: place from 0 of the first cell that is no number, or -1; no later one is read.
        calendar: "times" of day, "dates" alone, or "both" together: values are in seconds; or "".
        unordered: whether they are dates, and none tells the day from the month.
    """

    values: np.ndarray
    since: np.ndarray | None = None
    wrong: int = -1
    calendar: str = ""
    unordered: bool = False


def numbers(cells: list[str], comma: bool) -> Cells:
    """A column of cells as numbers.

    Args:
        cells: of one column.
        comma: whether the decimal sign is a comma.
    """
    out: np.ndarray = np.full(len(cells), np.nan)
    days: np.ndarray = np.zeros(len(cells))
    long, calendar, order, alone = False, False, None, False
    for k, cell in enumerate(cells):
        value = number(cell, comma)
        if value is None and not gap(cell):
            if not calendar:
                order, alone = day_first(cells), _dates(cells)
            begin = day(cell, bool(order)) if alone else None
            found = moment(cell, bool(order)) if begin is None else (begin, 0.0)
            if found is None:
                return Cells(out, wrong=k, calendar="dates" if alone else "")
            days[k], value = found
            calendar = True
        if value is not None:
            out[k] = value
            long = long or (len(cell) > LONG and abs(value) > 1e8)
    if calendar:
        if not days.any():
            return Cells(out, calendar="times")
        kind, since = "dates" if alone else "both", (days - days[0]) + (out - out[0])
        return Cells(days + out, since, calendar=kind, unordered=order is None)
    return Cells(out, _since(cells, comma) if long else None)


def _dates(cells: list[str]) -> bool:
    """Whether most cells of a column are dates without times."""
    there = [cell for cell in cells[:SAMPLE] if not gap(cell)]
    found = sum(day(cell) is not None or day(cell, day_first=True) is not None for cell in there)
    return 2 * found > len(there)


def _since(cells: list[str], comma: bool) -> np.ndarray | None:
    """Numbers with more digits than a double holds, less the first one."""
    try:
        exact = [
            None if gap(c) else Decimal(c.strip().replace(",", ".") if comma else c.strip())
            for c in cells
        ]
    except InvalidOperation:  # thousands set apart
        return None
    first = next(value for value in exact if value is not None)
    if not all(v is None or v.is_finite() for v in exact):
        return None
    return np.array([math.nan if v is None else float(v - first) for v in exact])
