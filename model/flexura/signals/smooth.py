"""Whether a motion can be followed: position and velocity without jumps."""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from .conversion import WHAT_TO_DO
from .signal import Signal, evaluate_many


def check_smooth(motion: Signal, key: str, start: float = -np.inf, end: float = np.inf) -> None:
    """Refuse a motion whose position or velocity jumps: no finite force follows it.

    Args:
        motion: the motion.
        key: name of the argument, for the message.
        start: begin of the interval, itself excluded [s].
        end: end of the interval, itself excluded [s].

    Raises:
        InputError: it jumps between `start` and `end`.
    """
    breaks = motion.breaks[1:]
    inside = breaks[(breaks > start) & (breaks < end)]
    jumps = inside[~_smooth_at(motion, inside)]
    if len(jumps):
        raise InputError(
            f"expected a motion without jumps in position and velocity; it has one at t = "
            f"{jumps[0]:g} s: {WHAT_TO_DO}",
            key=key,
        )


def _smooth_at(motion: Signal, at: np.ndarray) -> np.ndarray:
    """Whether position and velocity do not jump, for each of the times (k,)."""
    if not len(at):
        return np.ones(0, dtype=bool)
    before = np.array(evaluate_many(motion.segments, np.nextafter(at, -np.inf)))
    after = np.array(evaluate_many(motion.segments, at))
    return np.asarray(np.isclose(before, after, rtol=1e-7, atol=1e-9).all(axis=0))


def up_to(motion: Signal, end: float) -> Signal:
    """The motion without what it jumps to at the end of a run.

    Args:
        motion: the motion.
        end: of the run [s].

    Returns:
        The motion, or its segments before `end`.
    """
    kept = int(np.searchsorted(motion.breaks, end))
    last = motion.breaks[kept : kept + 1]
    if kept > 0 and (last == end).any() and not _smooth_at(motion, last).all():
        return Signal(motion.segments[:kept], motion.spec)
    return motion
