"""Text files: their encoding, and the numbers in their cells."""

from __future__ import annotations

import codecs
import math
import re
from datetime import datetime
from decimal import Decimal, InvalidOperation

import numpy as np

from ....errors import InputError

_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_GAPS = {"", "nan", "-nan", "+nan", "na", "n/a", "null", "none", "-", "--", "#n/a", "nan(ind)"}
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?|[+-]?inf(inity)?", re.IGNORECASE)
_CLOCK = re.compile(r"(\d{1,2}):(\d\d):(\d\d(?:[.,]\d+)?)")
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
    strange = sum(not (c.isprintable() or c in "\t\r\n\f") for c in text[:100_000])
    if strange > 0.02 * min(len(text), 100_000):
        raise InputError("not a text, and no format of a log that is known", file=file)
    return text, named


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
    if comma:
        if "." in plain:
            return None
        plain = plain.replace(",", ".")
    if _NUMBER.fullmatch(plain) is None:
        return None
    return float(plain.replace("d", "e").replace("D", "E"))


def numeric(cell: str, comma: bool) -> bool:
    """Whether a cell is a number, a gap or a time of day."""
    return gap(cell) or number(cell, comma) is not None or moment(cell) is not None


def moment(cell: str) -> float | None:
    """A date with a time, or a time of day, in seconds; None if it is none."""
    plain = cell.strip()
    if matched := _CLOCK.fullmatch(plain):
        hours, minutes, seconds = matched.groups()
        return 3600 * int(hours) + 60 * int(minutes) + float(seconds.replace(",", "."))
    if ":" not in plain or not plain[:4].isdigit():
        return None
    try:
        return datetime.fromisoformat(plain.replace("/", "-").replace(",", ".")).timestamp()
    except (ValueError, OverflowError, OSError):
        return None


def numbers(cells: list[str], comma: bool) -> tuple[np.ndarray, np.ndarray | None, int]:
    """A column of cells as numbers.

    Args:
        cells: of one column.
        comma: whether the decimal sign is a comma.

    Returns:
        Values (T,), NaN in gaps; the same less the first one if they are long, or None; the place
        from 0 of the first cell that is no number, or -1.
    """
    out = np.full(len(cells), np.nan)
    long = False
    for k, cell in enumerate(cells):
        value = number(cell, comma)
        if value is None and not gap(cell):
            value = moment(cell)
            if value is None:
                return out, None, k
        if value is not None:
            out[k] = value
            long = long or (len(cell) > LONG and abs(value) > 1e8)
    return out, _since(cells, comma) if long else None, -1


def _since(cells: list[str], comma: bool) -> np.ndarray | None:
    """Numbers with more digits than a double holds, less the first one."""
    try:
        exact = [
            None if gap(c) else Decimal(c.strip().replace(",", ".") if comma else c.strip())
            for c in cells
        ]
    except InvalidOperation:  # dates
        return None
    first = next(value for value in exact if value is not None)
    if not all(v is None or v.is_finite() for v in exact):
        return None
    return np.array([math.nan if v is None else float(v - first) for v in exact])
