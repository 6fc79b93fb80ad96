"""Step pulses of the board's second joint, by the firmware's own code in the core."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .. import core
from ..errors import InputError


def board_pulses(
    settings: Sequence[float],
    knots: np.ndarray,
    period_log2: int,
    given: int,
    ticks: int,
    *,
    open_loop: bool,
) -> tuple[np.ndarray, np.ndarray]:
    """Replay a trajectory through the firmware's player, fixed-point PID (70) and step generator.

    Joint 2 is controlled on its own pulses, without the deflection.

    Args:
        settings: the board's settings in SI units, in the order of its declaration.
        knots: integers (K, 4): positions [counts / 256] of both joints, then velocities [counts /
            256 per tick]; in open loop zeros, then voltage [mV] and rate [microsteps/s].
        period_log2: 2^period_log2 control ticks lie between two knots.
        given: microsteps that were given before the start.
        ticks: number of control ticks.
        open_loop: whether the knots are drives that hold for a period.

    Returns:
        Of each pulse the counts of the step timer since the start (P,), and the direction (P,), 1
        or -1.

    Raises:
        InputError: another number of settings or knots, or a setting that the firmware refuses.
    """
    values = np.ascontiguousarray(settings, dtype=float)
    rows = np.ascontiguousarray(knots, dtype=np.int64)
    try:
        found = core.board_pulses(values, open_loop, period_log2, rows, given, ticks)
    except ValueError as error:
        raise InputError(str(error), key="settings") from None
    return np.asarray(found[0]), np.asarray(found[1])
