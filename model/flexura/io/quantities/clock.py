"""The clock of a run: times are finite and ascend, and count from the first sample where they are
those of a calendar."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

EPOCH_S = 1e8  # a later first time is one of a calendar, of 1973 or after
LATEST_S = 1e10  # the year 2286: later times are in another unit
SLOWEST_S = 0.45  # most measured robots are sampled faster: a slower clock may be in milliseconds
FEW = 8  # samples that tell nothing about a clock's unit


class Fault(NamedTuple):
    """What is wrong with a clock: the row, counted from 1, and a sentence."""

    row: int
    text: str


def fault(t: np.ndarray, measured: bool = False, stated: bool = False) -> Fault | None:
    """The first fault of a clock.

    Args:
        t: times (T,) [s].
        measured: whether a logger took the times, so that milliseconds may pass for seconds.
        stated: whether their unit is beyond doubt, so that they may be slow.

    Returns:
        None if the times are finite and ascend, and, if measured, are likely in seconds.
    """
    wrong = ~np.isfinite(t)
    wrong[1:] |= ~(np.diff(t) > 0)
    if wrong.any():
        k = int(wrong.argmax())
        return Fault(k + 1, _sentence(t, k))
    if measured and len(t) and t[0] > LATEST_S:
        return Fault(1, f"the time is {t[0]:.6g} s: expected seconds, not milliseconds or less")
    if measured and not stated and slow(t):
        step = float(t[1] - t[0])
        return Fault(
            2,
            f"the time is {step:.4g} s after row 1: is the clock in milliseconds or microseconds? "
            'If it is in seconds, a map of the log says so: [time] unit = "s"',
        )
    return None


def doubted(meta: Mapping[str, Any]) -> bool:
    """Whether milliseconds may pass for seconds in a run: it was measured, and `flexura import` has
    not looked at its clock.

    Args:
        meta: of the run.

    Returns:
        True if they may.
    """
    return meta.get("source") == "experiment" and "imported" not in meta


def slow(t: np.ndarray) -> bool:
    """Whether most measured robots are sampled faster.

    Args:
        t: times (T,) [s], ascending.

    Returns:
        True if milliseconds may pass for seconds.
    """
    return len(t) >= FEW and bool(np.median(np.diff(t)) > SLOWEST_S)


def _sentence(t: np.ndarray, k: int) -> str:
    if not np.isfinite(t[k]):
        return f"the time is {t[k]}: expected a finite number of seconds"
    before = float(t[k - 1])
    if t[k] == before:
        return f"the time {before:.9g} s stands there twice: expected ascending times"
    after_first = t[k] - t[0] < 0.5 * (before - t[0])
    reset = "; the clock was reset" if k > 1 and after_first else ""
    return f"the time falls from {before:.9g} to {float(t[k]):.9g} s{reset}"


def from_first(t: np.ndarray) -> tuple[np.ndarray, float]:
    """Times that count from the first sample if they are those of a calendar.

    Args:
        t: times (T,) [s], finite and ascending.

    Returns:
        Times (T,) [s], and what was taken off [s]: 0 for a clock of another kind.
    """
    start = float(t[0]) if len(t) and t[0] > EPOCH_S else 0.0
    return (t - start, start) if start else (t, 0.0)
