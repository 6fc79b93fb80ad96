"""LVM, the text format of LabVIEW's "Write to Measurement File"."""

from __future__ import annotations

from itertools import count

import numpy as np

from ....errors import InputError
from ..log import Clock, Column, Log
from .moments import moment
from .text import decoded, numbers, refused

END = "***End_of_Header***"
SEPARATORS = {"Tab": "\t", "Comma": ",", "Semicolon": ";"}
ROWS = ("X0", "Delta_X", "Y_Unit_Label", "Samples")  # entries of a value a channel
NO_CHANNEL = ("", "X_Value", "Comment")
UNITS = {"Volts": "V", "Volt": "V", "Amps": "A", "g": "g", "Newtons": "N"}


def read(raw: bytes, file: str) -> Log:
    """The channels of an LVM file; its segments follow each other.

    Raises:
        InputError: a row, or a header, is damaged.
    """
    text, _ = decoded(raw, file)
    lines = text.splitlines()
    about, start = _header(lines, 0, file)
    separator = SEPARATORS.get(about.get("Separator", "Tab"), "\t")
    comma = about.get("Decimal_Separator", ".") == ","
    layout = about.get("X_Columns", "One")
    if layout not in ("One", "Multi", "No"):
        raise InputError(
            "expected X_Columns of One, Multi or No", key="X_Columns", value=layout, file=file
        )
    table: dict[str, list[np.ndarray]] = {}
    clocks: dict[str, list[np.ndarray]] = {}
    units: dict[str, str] = {}
    places: list[int] = []
    first: float | None = None
    while True:
        own, start = _header(lines, start, file, separator)
        began = _moment(own.get("Date", ""), own.get("Time", ""))
        first = began if first is None else first
        shift = began - first if began is not None and first is not None else 0.0
        names = lines[start].split(separator) if start < len(lines) else []
        end = next((k for k in range(start + 1, len(lines)) if not lines[k].strip()), len(lines))
        rows = [line.split(separator) for line in lines[start + 1 : end]]
        if not rows or len(names) < 2:
            raise InputError(
                "expected a row of names and rows of numbers", key=f"line {start + 1}", file=file
            )
        places += range(start + 2, end + 1)
        parts = _segment(names, rows, layout, comma, own, separator, start + 2, file)
        _counted(own, [len(values) for _, values, _ in parts], separator, start + 1, file)
        for name, (t, values, said) in zip(_plain(names), parts, strict=True):
            earlier = clocks.setdefault(name, [])
            late = bool(earlier and len(t) and len(earlier[-1]) and t[0] <= earlier[-1][-1])
            earlier.append(t + shift if late else t)
            table.setdefault(name, []).append(values)
            units[name] = said
        start = end
        while start < len(lines) and not lines[start].strip():
            start += 1
        if start >= len(lines):
            break
    columns, held = [], {}
    for name, pieces in table.items():
        clock = name if layout == "Multi" else "X_Value"
        held[clock] = Clock(np.concatenate(clocks[name]), 0.0, "the file's X_Value")
        columns.append(Column(name, name, units[name], np.concatenate(pieces), clock=clock))
    lines_of = places if layout != "Multi" else []
    return Log(file, "LVM of LabVIEW", columns, held, {}, lines=lines_of)


def _header(
    lines: list[str], start: int, file: str, separator: str = "\t"
) -> tuple[dict[str, str], int]:
    """A header's entries, and the line after it; the first value where there are several."""
    found: dict[str, str] = {}
    for k in count(start):
        if k >= len(lines):
            raise InputError(f"a header without {END}", key=f"line {start + 1}", file=file)
        if lines[k].startswith(END):
            return found, k + 1
        key, _, rest = lines[k].partition(separator)
        if not rest and "\t" in lines[k]:  # the file's own header, before the separator is known
            key, _, rest = lines[k].partition("\t")
        found[key] = rest if key in ROWS else rest.split(separator)[0]
    raise AssertionError


def _plain(names: list[str]) -> list[str]:
    """The names of channels; a number tells those apart that stand there twice."""
    found: list[str] = []
    for name in (name.strip() for name in names if name.strip() not in NO_CHANNEL):
        again = sum(each == name or each.startswith(f"{name} (") for each in found)
        found.append(f"{name} ({again + 1})" if again else name)
    return found


def _segment(
    names: list[str],
    rows: list[list[str]],
    layout: str,
    comma: bool,
    own: dict[str, str],
    separator: str,
    line: int,
    file: str,
) -> list[tuple[np.ndarray, np.ndarray, str]]:
    """Clock [s], values and unit of each channel of one segment."""
    every = [k for k, name in enumerate(names) if name.strip() not in NO_CHANNEL]
    labels = own.get("Y_Unit_Label", "").split(separator)
    out = []
    for place, k in enumerate(every):
        at = k - 1 if layout == "Multi" else 0
        values = _numbers(rows, k, comma, line, file)
        if layout == "No":
            t = _base(own, place, len(values), comma, separator, file)
        else:
            t = _numbers(rows, at, comma, line, file)
        there = np.isfinite(t)
        last = int(np.flatnonzero(there)[-1]) + 1 if there.any() else 0
        t, values = (t[:last], values[:last]) if layout == "Multi" else (t, values)
        said = labels[place].strip() if place < len(labels) else ""
        out.append((t, values, UNITS.get(said, said)))
    return out


def _numbers(rows: list[list[str]], k: int, comma: bool, line: int, file: str) -> np.ndarray:
    cells = [row[k] if k < len(row) else "" for row in rows]
    found = numbers(cells, comma)
    wrong = found.wrong
    if wrong < 0:
        short = next((i for i, row in enumerate(rows[:-1]) if k >= len(row)), -1)
        wrong = short if k < len(rows[0]) else -1
        if wrong < 0:
            return found.values
    raise InputError(
        refused(cells[wrong], comma),
        key=f"row {wrong + 1} (line {line + wrong})",
        file=file,
    )


def _counted(own: dict[str, str], lengths: list[int], separator: str, line: int, file: str) -> None:
    """Refuse a segment with other channels, or fewer rows of one, than its header says; where a
    program writes one header for all, more rows follow."""
    said = own.get("Channels", "").split(separator)[0].strip()
    if said.isdigit() and int(said) != len(lengths):
        raise InputError(
            f"{len(lengths)} channels, the header says {said}: expected all of them",
            key=f"line {line}",
            file=file,
        )
    for k, said in enumerate(own.get("Samples", "").split(separator)[: len(lengths)], 1):
        if said.strip().isdigit() and int(said) > lengths[k - 1]:
            raise InputError(
                f"channel {k} has {lengths[k - 1]} rows, the header says {said.strip()} samples: "
                "expected the whole segment",
                key=f"line {line + max(lengths)}",
                file=file,
            )


def _base(
    own: dict[str, str], place: int, length: int, comma: bool, separator: str, file: str
) -> np.ndarray:
    """X0 + k Delta_X, k = 0, 1, ... [s]."""
    found = []
    for key in ("X0", "Delta_X"):
        cells = own.get(key, "").split(separator)
        cell = cells[min(place, len(cells) - 1)]
        value = numbers([cell], comma)
        if value.wrong >= 0 or not np.isfinite(value.values[0]):
            raise InputError("expected a number of seconds", key=key, value=cell, file=file)
        found.append(float(value.values[0]))
    return found[0] + np.arange(length) * found[1]


def _moment(date: str, time: str) -> float | None:
    """A header's date and time [s]."""
    found = moment(f"{date} {time}")
    return None if found is None else sum(found)
