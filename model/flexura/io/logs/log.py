"""What a foreign file holds: columns of numbers, each with its clock where the file says one."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...errors import InputError


@dataclass(frozen=True)
class Clock:
    """Times that a file gives beside its columns: `start_s` + `t` (T,) [s], `said` in words."""

    t: np.ndarray
    start_s: float
    said: str


@dataclass(frozen=True)
class Column:
    """Numbers (T,) with the name and the unit that the file gives them.

    Attributes:
        name: without the unit.
        head: as it stands in the file.
        unit: "" if the file says none.
        values: (T,); NaN where there is none.
        since: numbers (T,) less the first one, where they are too long for a double; else None.
        clock: a name in `Log.clocks`, or "".
        fault: what is wrong with a row, or "".
        calendar: "times" of day, "dates" alone, or "both" together; "" for numbers.
        dates: the head of the column that has the dates of these times of day, or "".
    """

    name: str
    head: str
    unit: str
    values: np.ndarray
    since: np.ndarray | None = None
    clock: str = ""
    fault: str = ""
    calendar: str = ""
    dates: str = ""


@dataclass(frozen=True)
class Log:
    """A foreign file.

    Attributes:
        file: its path.
        form: the format in words.
        columns: in the file's order.
        clocks: by name.
        meta: of a run of flexura that was exported, else what the file says about itself.
        own: whether it is an export of flexura.
        lines: the line of a row's number in a text file, by row from 0.
        notes: what was assumed.
        unread: what has no numbers to take, and why, by its head.
        digest: of the numbers of an export of flexura, as it says, or "".
    """

    file: str
    form: str
    columns: list[Column]
    clocks: dict[str, Clock] = field(default_factory=dict)
    meta: dict[str, Any] = field(default_factory=dict)
    own: bool = False
    lines: list[int] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    unread: dict[str, str] = field(default_factory=dict)
    digest: str = ""

    def row(self, number: int) -> str:
        """What a row is called in an error.

        Args:
            number: of the row, from 1.

        Returns:
            "row 7", and its line in a text file.
        """
        line = f" (line {self.lines[number - 1]})" if number <= len(self.lines) else ""
        return f"row {number}{line}"


def damaged(path: object, form: str, error: BaseException) -> InputError:
    """What a reader of another project says of a damaged file, in one sentence."""
    reason = (str(error).strip() or type(error).__name__).splitlines()[0]
    if isinstance(error, KeyError) and " " not in reason:
        reason = f"{reason} is missing"
    return InputError(f"a damaged {form} ({reason[:160]})", file=str(path))


def floats(values: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
    """Numbers or dates of any type as float64 (T,) [s of dates]; `since` of a Column."""
    values = np.asarray(values).reshape(-1)
    if values.dtype.kind in "mM":
        kind = "datetime64[ns]" if values.dtype.kind == "M" else "timedelta64[ns]"
        whole = values.astype(kind).astype(np.int64)
        since = (whole - whole[:1]) / 1e9
        since[np.isnat(values)] = np.nan
        return np.where(np.isnat(values), np.nan, whole / 1e9), since
    if values.dtype.kind in "iu" and len(values) and abs(int(values[0])) > 2**53:
        first = int(values[0])
        return values.astype(float), np.array([int(v) - first for v in values], dtype=float)
    return values.astype(np.float64), None
