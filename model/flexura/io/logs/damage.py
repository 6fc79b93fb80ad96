"""Damage that a file's own format does not show: numbers that nothing measures, missing rows, an
export of flexura whose numbers are others."""

from __future__ import annotations

import hashlib

import numpy as np

from ...errors import InputError
from ..run import Run
from .log import Log

LARGEST = 1e30  # no quantity that is logged is so large, in any unit
EVEN, GAP = 0.01, 1.5  # of the usual step: what steps of an even clock differ by; what is a gap
FEW_GAPS = 0.1  # of the steps: more gaps, or other odd steps, and the clock is not even


def digest(run: Run) -> str:
    """A text that tells the times and numbers of a run from any others.

    Args:
        run: the run.

    Returns:
        32 hexadecimal digits.
    """
    found = hashlib.sha256()
    for values in (run.t, *run.channels.values()):
        plain = np.where(np.isnan(values), np.nan, values)  # all NaN are one
        found.update(np.ascontiguousarray(plain, dtype="<f8").tobytes())
    return found.hexdigest()[:32]


def check_size(log: Log, head: str, values: np.ndarray) -> None:
    """Refuse numbers that nothing measures.

    Args:
        log: the file.
        head: of the column.
        values: its numbers (T,).

    Raises:
        InputError: a finite number is larger than 1e30; the row is named.
    """
    wrong = np.isfinite(values) & (np.abs(values) > LARGEST)
    if wrong.any():
        k = int(wrong.argmax())
        raise InputError(
            f"{values[k]:.4g} is larger than anything that is measured: the file is damaged",
            key=f"{log.row(k + 1)}, column {head!r}",
            file=log.file,
        )


def missing_rows(log: Log, t: np.ndarray) -> list[str]:
    """A sentence on rows that are missing in an even clock, or none.

    Args:
        log: the file.
        t: its times (T,) [s].
    """
    steps = np.diff(t)
    usual = float(np.median(steps))
    long = steps > GAP * usual
    count = int(long.sum())
    even = np.abs(steps[~long] - usual) <= EVEN * usual
    if not count or count > FEW_GAPS * len(steps) or np.mean(even) < 1 - FEW_GAPS:
        return []
    k = int(long.argmax())
    more = f", and at {count - 1} others" if count > 1 else ""
    return [
        f"rows are missing after {log.row(k + 1)}{more}: a step of {steps[k]:.4g} s, the others "
        f"are {usual:.4g} s"
    ]


def changed(log: Log, run: Run) -> list[str]:
    """A sentence on an export of flexura whose numbers are not those that were written, or none.

    Args:
        log: the file.
        run: all that it holds.
    """
    if not log.digest or log.digest == digest(run):
        return []
    return ["its numbers are not those that flexura wrote: it was edited or is damaged"]
