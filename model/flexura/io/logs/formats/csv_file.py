"""CSV and its kin: any separator, a decimal comma, up to three rows of heads, comments."""

from __future__ import annotations

import json
from collections import Counter
from typing import Any

from ....errors import InputError
from ..calendar import joined
from ..log import Column, Log
from .heads import (
    Line,
    cells_of,
    check_damage,
    from_comments,
    heads_of,
    is_units,
    like_rows,
    named,
    without_preamble,
    without_titles,
)
from .text import decoded, number, numbers, numeric, refused

SEPARATORS = ("\t", ";", ",", "|", " ")
NAMES = {"\t": "tabs", ";": "semicolons", ",": "commas", "|": "strokes", " ": "blanks"}
COMMENT = ("#", "%", "//", '"#')
SAMPLE = 200  # lines that tell the separator
PREAMBLE = 60  # lines above the numbers, at most
KLIPPER = ("time", "accel_x", "accel_y", "accel_z")


def read(raw: bytes, file: str) -> Log:
    """The columns of a text file.

    Args:
        raw: its bytes.
        file: its path.

    Raises:
        InputError: it is no table of numbers, or a row has too many or too few cells.
    """
    text, encoding = decoded(raw, file)
    numbered = [Line(k, line) for k, line in enumerate(text.splitlines(), 1)]
    every = [line for line in numbered if line.text.strip()]
    empty = {line.number for line in numbered if not line.text.strip()}
    comments = [line for line in every if line.text.lstrip().startswith(COMMENT)]
    lines = [line for line in every if not line.text.lstrip().startswith(COMMENT)]
    if not lines:
        raise InputError("empty: expected rows of numbers", file=file)
    separator, comma, first = _layout(lines, file)
    check_damage(lines[:first], lines[first], separator, comma, file)
    places = [line.number for line in lines[first:]]
    rows = [cells_of(line.text, separator) for line in lines[first:]]
    width = Counter(map(len, rows[:SAMPLE])).most_common(1)[0][0]
    for k, cells in enumerate(rows):
        if len(cells) != width:
            raise InputError(
                f"{len(cells)} cells, the other rows have {width}: expected a whole row",
                key=f"row {k + 1} (line {places[k]})",
                file=file,
            )
    above = [heads_of(line.text, separator) for line in lines[:first]]
    if width > 1 and not any(cells[-1] for cells in rows):  # a separator at the end of each line
        rows, width = [cells[:-1] for cells in rows], width - 1
        above = [cells[:-1] if cells[-1] == "" else cells for cells in above]
    if above and len(above[-1]) not in (1, width):
        raise InputError(
            f"{len(above[-1])} heads above rows of {width} cells: expected a head a column",
            key=f"line {lines[first - 1].number}",
            file=file,
        )
    after = [line.number - 1 in empty for line in lines[:first]]
    wide = [pair for pair in zip(above, after, strict=True) if len(pair[0]) == width]
    heads = without_titles(without_preamble(wide, comma))[-3:]
    own = _own(comments)
    named_columns = named(
        heads or from_comments(comments, separator, width), width, own.get("units", {})
    )
    columns, notes = [], []
    for k, (head, name, said) in enumerate(named_columns):
        found = numbers([cells[k] for cells in rows], comma)
        fault = ""
        if (wrong := found.wrong) >= 0:
            fault = f"row {wrong + 1} (line {places[wrong]}): {refused(rows[wrong][k], comma)}"
            if not any(number(cells[k], comma) is not None for cells in rows):
                fault = f"no numbers: {fault}"
        said = "s" if found.calendar in ("times", "both") else said
        kind = found.calendar
        columns.append(
            Column(name, head, said, found.values, found.since, fault=fault, calendar=kind)
        )
        if found.unordered:
            notes.append(f"{head!r}: {rows[0][k]!r} is read as month/day/year")
    columns, more = joined(columns)
    notes += more + like_rows(comments, rows[0], separator, comma)
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


def _layout(lines: list[Line], file: str) -> tuple[str, bool, int]:
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


def _seen(lines: list[Line]) -> str:
    """Where a file without a table looks most like one, and what is no number there."""
    most, text = 0, ""
    for line in lines[:PREAMBLE]:
        there = [separator for separator in SEPARATORS[:-1] if separator in line.text]
        for separator in there or SEPARATORS[-1:]:
            cells = cells_of(line.text, separator)
            for comma in (False, True):
                wrong = [cell for cell in cells if not numeric(cell, comma)]
                count = sum(any(c.isdigit() for c in cell) for cell in cells)
                if wrong and count > most:
                    most, text = count, f"; line {line.number}: {refused(wrong[0], comma)}"
    return text


def _first(lines: list[Line], separator: str, comma: bool) -> tuple[int, int, int, float] | None:
    """The first line of numbers under a guess; how many like it follow, their cells, and the share
    of those that are numbers."""
    for first in range(min(len(lines), PREAMBLE)):
        cells = cells_of(lines[first].text, separator)
        if not _numbers(cells, comma) or _row_of_units(cells, comma):
            continue
        part = [cells_of(line.text, separator) for line in lines[first : first + SAMPLE]]
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


def _row_of_units(cells: list[str], comma: bool) -> bool:
    """Whether a row is one of units, some of them 1: "s;1;1"."""
    return is_units(cells) and not all(numeric(cell, comma) for cell in cells)


def _own(comments: list[Line]) -> dict[str, Any]:
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
