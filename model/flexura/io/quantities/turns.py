"""Angles of more than a turn, which may have been meant in degrees."""

from __future__ import annotations

import logging
import math
from functools import lru_cache

_log = logging.getLogger("flexura")
TURN = 2 * math.pi * (1 + 1e-6)


def note_turns(key: str, *angles: float) -> None:
    """Say an angle of more than a turn in turns and degrees, by the logger "flexura".

    Args:
        key: whose angles they are.
        angles: as given [rad]; the largest is said.
    """
    largest = max(angles, key=abs)
    if abs(largest) > TURN:
        _say(key, float(f"{largest:.4g}"))


@lru_cache(maxsize=1000)  # once: a search makes the same robot many times
def _say(key: str, angle: float) -> None:
    turns, degrees = angle / (2 * math.pi), math.degrees(angle)
    _log.warning("%s: %g rad are %.3g turns, %.4g degrees", key, angle, turns, degrees)
