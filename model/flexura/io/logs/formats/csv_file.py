"""CSV and its kin: any separator, a decimal comma, up to three rows of heads, comments."""

from __future__ import annotations

import csv
import json
import re
from collections import Counter
from dataclasses import dataclass
from typing import Any

from ....errors import InputError
from ...quantities import suffix, unit
from ..log import Column, Log
from ..names import parted
from .text import decoded, gap, number, numbers, numeric, refused

SEPARATORS = ("\t", ";", ",", "|", " ")
NAMES = {"\t": "tabs", ";": "semicolons", ",": "commas", "|": "strokes", " ": "blanks"}
COMMENT = ("#", "%", "//", '"#')
SAMPLE = 200  # lines that tell the separator
PREAMBLE = 60  # lines above the numbers, at most
KLIPPER = ("time", "accel_x", "accel_y", "accel_z")


@dataclass(frozen=True)
class _Line:
    number: int
    text: str


def read(raw: bytes, file: str) -> Log:
    """The columns of a text file.

    Args:
        raw: its bytes.
        file: its path.

    Raises:
        InputError: it is no table of numbers, or a row has too many or too few cells.
    """
    text, encoding = decoded(raw, file)
    every = [_Line(k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip()]
    comments = [line for line in every if line.text.lstrip().startswith(COMMENT)]
    lines = [line for line in every if not line.text.lstrip().startswith(COMMENT)]
    if not lines:
        raise InputError("empty: expected rows of numbers", file=file)
    separator, comma, first = _layout(lines, file)
    places = [line.number for line in lines[first:]]
    rows = [_cells(line.text, separator) for line in lines[first:]]
    width = Counter(map(len, rows[:SAMPLE])).most_common(1)[0][0]
    for k, cells in enumerate(rows):
        if len(cells) != width:
            raise InputError(
                f"{len(cells)} cells, the other rows have {width}: expected a whole row",
                key=f"row {k + 1} (line {places[k]})",
                file=file,
            )
    above = [_heads(line.text, separator) for line in lines[:first]]
    if width > 1 and not any(cells[-1] for cells in rows):  # a separator at the end of each line
        rows, width = [cells[:-1] for cells in rows], width - 1
        above = [cells[:-1] if cells[-1] == "" else cells for cells in above]
    if above and len(above[-1]) not in (1, width):
        raise InputError(
            f"{len(above[-1])} heads above rows of {width} cells: expected a head a column",
            key=f"line {lines[first - 1].number}",
            file=file,
        )
    heads = _without_titles([cells for cells in above if len(cells) == width])[-3:]
    own = _own(comments)
    named = _named(heads or _from_comments(comments, separator, width), width, own.get("units", {}))
    columns, notes = [], []
    for k, (head, name, said) in enumerate(named):
        found = numbers([cells[k] for cells in rows], comma)
        fault = ""
        if (wrong := found.wrong) >= 0:
            fault = f"row {wrong + 1} (line {places[wrong]}): {refused(rows[wrong][k], comma)}"
        said = "s" if found.times else said
        columns.append(
            Column(name, head, said, found.values, found.since, fault=fault, times=found.times)
        )
        if found.unordered:
            notes.append(f"{head!r}: {rows[0][k]!r} is read as month/day/year")
    form = f"CSV, {encoding}, {NAMES[separator]}" + (", decimal comma" if comma else "")
    if tuple(column.name for column in columns) == KLIPPER:
        form = "accelerometer CSV of Klipper"
        notes.append("accelerations are in mm/s^2, as Klipper writes them")
        columns = [columns[0], *map(_acceleration, columns[1:])]
    if not text.endswith(("\n", "\r")):
        notes.append(f"line {every[-1].number} has no end: the last number may be cut off")
    about = own.get("meta")
    return Log(
        file,
        form,
        columns,
        meta=about or {},
        own=about is not None,
        lines=places,
        notes=notes,
        digest=str(own.get("digest", {}).get("sha256", "")),
    )


def _acceleration(column: Column) -> Column:
    name = f"sensor/{column.name}"
    return Column(name, column.head, "mm/s^2", column.values, fault=column.fault)


def _layout(lines: list[_Line], file: str) -> tuple[str, bool, int]:
    """The separator, whether the decimal sign is a comma, and the first line of numbers."""
    best: tuple[tuple[float, ...], str, bool, int] | None = None
    quoted = any('"' in line.text for line in lines[: PREAMBLE + SAMPLE])
    for order, separator in enumerate(SEPARATORS):
        for comma in (False, True) if separator != "," or quoted else (False,):
            found = _first(lines, separator, comma)
            if found is not None:
                first, same, width, share = found
                rank = (width > 1, share, same, -int(comma), -order)
                if best is None or rank > best[0]:
                    best = rank, separator, comma, first
    if best is None:
        raise InputError(
            "no table of numbers: expected rows of numbers under at most three rows of heads"
            + _seen(lines),
            file=file,
        )
    return best[1], best[2], best[3]


def _seen(lines: list[_Line]) -> str:
    """Where a file without a table looks most like one, and what is no number there."""
    most, text = 0, ""
    for line in lines[:PREAMBLE]:
        there = [separator for separator in SEPARATORS[:-1] if separator in line.text]
        for separator in there or SEPARATORS[-1:]:
            cells = _cells(line.text, separator)
            for comma in (False, True):
                wrong = [cell for cell in cells if not numeric(cell, comma)]
                count = sum(any(c.isdigit() for c in cell) for cell in cells)
                if wrong and count > most:
                    most, text = count, f"; line {line.number}: {refused(wrong[0], comma)}"
    return text


def _first(lines: list[_Line], separator: str, comma: bool) -> tuple[int, int, int, float] | None:
    """The first line of numbers under a guess; how many like it follow, their cells, and the share
    of those that are numbers."""
    for first in range(min(len(lines), PREAMBLE)):
        cells = _cells(lines[first].text, separator)
        if not _numbers(cells, comma):
            continue
        part = [_cells(line.text, separator) for line in lines[first : first + SAMPLE]]
        alike = [row for row in part if len(row) == len(cells) and _numbers(row, comma)]
        if 2 * len(alike) > len(part):
            count = sum(numeric(cell, comma) for row in alike for cell in row)
            share = round(count / (len(alike) * len(cells)), 2)
            return first, len(alike), len(cells), share
    return None


def _numbers(cells: list[str], comma: bool) -> bool:
    """Whether a row is one of numbers; a column of texts may stand beside them."""
    found = sum(number(cell, comma) is not None for cell in cells)
    return found > 0 and 2 * sum(numeric(cell, comma) for cell in cells) > len(cells)


def _cells(line: str, separator: str) -> list[str]:
    if separator == " ":
        return line.split()
    if '"' not in line:
        return [cell.strip() for cell in line.split(separator)]
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]


def _heads(line: str, separator: str) -> list[str]:
    """The cells of a head; a unit in brackets belongs to the word before it."""
    if separator == " ":
        return re.split(r"\s+(?![\[(])", line.strip())
    return _cells(line, separator)


def _without_titles(heads: list[list[str]]) -> list[list[str]]:
    """Rows of heads without titles, which a spreadsheet pads: words in the first cell alone."""
    titles = [row for row in heads if row[0] and not any(row[1:]) and not _units(row)]
    others = [row for row in heads if row not in titles]
    return others if any(len(row) > 1 for row in others) else heads


def _from_comments(comments: list[_Line], separator: str, width: int) -> list[list[str]]:
    """Heads that stand in the last comment above the numbers, as `#time,accel_x`."""
    for line in reversed(comments):
        cells = _heads(line.text.lstrip().lstrip("#%/\"' "), separator)
        if len(cells) == width > 1:
            return [cells]
    return []


def _named(heads: list[list[str]], width: int, own: dict[str, str]) -> list[tuple[str, str, str]]:
    """Head, name and unit of each column, from up to three rows of heads; `own`: units by head."""
    rows = [row for row in heads if not _units(row)]
    given = next((row for row in heads if _units(row)), None)
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


def _units(row: list[str]) -> bool:
    """Whether a row of heads has units: each cell is one, or empty."""
    said = [cell for cell in row if not gap(cell)]
    bracketed = [cell for cell in said if cell[:1] in "[(" and cell[-1:] in "])"]
    return bool(said) and (
        len(bracketed) == len(said) or all(unit(cell) is not None for cell in said)
    )


def _own(comments: list[_Line]) -> dict[str, Any]:
    """Units and metadata of an export of flexura, from its comments."""
    found: dict[str, Any] = {}
    for line in comments[:10]:
        key, _, text = line.text.lstrip("# ").partition(": ")
        if key in ("units", "meta", "digest"):
            try:
                value = json.loads(text)
            except ValueError:
                continue
            if isinstance(value, dict):
                found[key] = value
    return found
