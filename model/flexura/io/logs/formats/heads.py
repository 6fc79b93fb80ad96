"""Rows above the numbers of a text file: heads, units, titles, and rows of numbers that are
damaged."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass

from ....errors import InputError
from ...quantities import is_unit, suffix
from ..names import parted
from .text import gap, number, numeric, refused

MARKS = "#%/\"' "  # what a comment begins with


@dataclass(frozen=True)
class Line:
    """A line of a text file by its number from 1."""

    number: int
    text: str


def cells_of(line: str, separator: str) -> list[str]:
    """The cells of a row."""
    if separator == " ":
        return line.split()
    if '"' not in line:
        return [cell.strip() for cell in line.split(separator)]
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]


def heads_of(line: str, separator: str) -> list[str]:
    """The cells of a head; a unit in brackets belongs to the word before it."""
    if separator == " ":
        return re.split(r"\s+(?![\[(])", line.strip())
    return cells_of(line, separator)


def without_titles(heads: list[list[str]]) -> list[list[str]]:
    """Rows of heads without titles, which a spreadsheet pads: words in the first cell alone."""
    titles = [row for row in heads if row[0] and not any(row[1:]) and not is_units(row)]
    others = [row for row in heads if row not in titles]
    return others if any(len(row) > 1 for row in others) else heads


def without_preamble(heads: list[tuple[list[str], bool]], comma: bool) -> list[list[str]]:
    """Rows of heads without what a program says above them in as many cells.

    That ends with an empty line, with a row that has a number, or before a row of heads with units.

    Args:
        heads: the rows, each with whether an empty line stands before it.
        comma: whether the decimal sign is a comma.
    """
    begin = 0
    for k, (row, after_break) in enumerate(heads):
        if is_units(row):
            continue
        own_units = sum(parted(cell)[1] != "" for cell in row)
        if after_break or 2 * own_units > len(row):
            begin = k
        elif k + 1 < len(heads) and any(number(cell, comma) is not None for cell in row):
            begin = k + 1
    return [row for row, _ in heads[begin:]]


def from_comments(comments: list[Line], separator: str, width: int) -> list[list[str]]:
    """Heads that stand in the last comment above the numbers, as `#time,accel_x`."""
    for line in reversed(comments):
        cells = heads_of(line.text.lstrip().lstrip(MARKS), separator)
        if len(cells) == width > 1:
            return [cells]
    return []


def named(heads: list[list[str]], width: int, own: dict[str, str]) -> list[tuple[str, str, str]]:
    """Head, name and unit of each column, from up to three rows of heads; `own`: units by head."""
    rows = [row for row in heads if not is_units(row)]
    given = next((row for row in heads if is_units(row)), None)
    out = []
    for k in range(width):
        head = " ".join(row[k] for row in heads if row[k]).strip() or f"column {k + 1}"
        top = rows[0][k].strip() if rows else ""
        if top in own:
            out.append((top, top.removesuffix(f"_{suffix(own[top])}"), own[top]))
        elif given is not None and not gap(given[k]):
            out.append((head, top, given[k].strip().strip("[]()").strip()))
        else:
            out.append((head, *parted(top)))
    return out


def is_units(row: list[str]) -> bool:
    """Whether a row of heads has units: each cell is one, or empty."""
    said = [cell for cell in row if not gap(cell)]
    bracketed = [cell for cell in said if cell[:1] in "[(" and cell[-1:] in "])"]
    return bool(said) and (len(bracketed) == len(said) or all(map(is_unit, said)))


def check_damage(above: list[Line], first: Line, separator: str, comma: bool, file: str) -> None:
    """Refuse a damaged row of numbers that would pass for a row of heads.

    Args:
        above: the lines above the numbers.
        first: the first line of numbers.
        separator: of cells.
        comma: whether the decimal sign is a comma.
        file: its path.

    Raises:
        InputError: by line and cell.
    """
    below = cells_of(first.text, separator)
    found: tuple[Line, str] | None = None
    for k, line in reversed(list(enumerate(above))):
        cells = cells_of(line.text, separator)
        wrong = None if is_units(cells) else _wrong(cells, below, comma)
        if len(cells) != len(below):
            headed = any(len(cells_of(each.text, separator)) == len(below) for each in above[:k])
            alike = _shape_differs(line.text, first.text) <= 2
            if alike or (headed and _kind(line.text, comma) in ("spoilt", "number")):
                wrong = line.text.strip()
        if wrong is None:
            break
        found = line, wrong
    if found is not None:
        raise InputError(
            f"a damaged row of numbers: {refused(found[1], comma)}",
            key=f"line {found[0].number}",
            file=file,
        )


def like_rows(comments: list[Line], below: list[str], separator: str, comma: bool) -> list[str]:
    """A sentence on comments that look like rows of numbers, or none."""
    numbers = []
    for line in comments:
        cells = cells_of(line.text.lstrip().lstrip(MARKS), separator)
        kinds = _kinds(cells, below, comma) if len(cells) == len(below) else []
        if "number" in kinds and "word" not in kinds:
            numbers.append(line.number)
    if not numbers:
        return []
    more = f", and {len(numbers) - 1} others" if len(numbers) > 1 else ""
    return [f"line {numbers[0]}{more}: a comment that looks like a row of numbers is left out"]


def _wrong(cells: list[str], below: list[str], comma: bool) -> str | None:
    """The cell that is no number, of a row above the numbers that is one of numbers itself."""
    if len(cells) != len(below):
        return None
    kinds = _kinds(cells, below, comma)
    count = kinds.count("number")
    pairs = [
        (kind, cell, under) for kind, cell, under in zip(kinds, cells, below, strict=True) if kind
    ]
    wrong = [(cell, under) for kind, cell, under in pairs if kind in ("spoilt", "word")]
    if not wrong:
        return None
    if count and (2 * count > len(pairs) or "word" not in kinds):
        return wrong[0][0]
    if "word" not in kinds and all(_shape_differs(cell, under) <= 1 for cell, under in wrong):
        return wrong[0][0]
    return None


def _kinds(cells: list[str], below: list[str], comma: bool) -> list[str]:
    """What cells are that stand above numbers: "number", "gap", "spoilt" (most of it digits) or
    "word"; "" above a text."""
    return [
        _kind(cell, comma) if numeric(under, comma) and not gap(under) else ""
        for cell, under in zip(cells, below, strict=True)
    ]


def _kind(cell: str, comma: bool) -> str:
    if gap(cell):
        return "gap"
    if numeric(cell, comma):
        return "number"
    letters = [c for c in cell if c.isalnum()]
    return "spoilt" if 2 * sum(c.isdigit() for c in letters) > len(letters) else "word"


def _shape_differs(cell: str, other: str) -> int:
    """How many characters of a cell are of another kind than those of another of its length."""
    if len(cell) != len(other):
        return max(len(cell), len(other))
    return sum(
        a != b and not (a.isdigit() and b.isdigit()) for a, b in zip(cell, other, strict=True)
    )
