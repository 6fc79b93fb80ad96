"""Signals of the benchmark: those of flexura, and Kane's spin-up."""

from __future__ import annotations

import numpy as np

import flexura as fx
from flexura.signals import bang_bang, cycloid, harmonic, piecewise

__all__ = ["bang_bang", "cycloid", "harmonic", "piecewise", "spin_up"]


def spin_up(speed: float, duration: float) -> fx.Signal:
    """Kane's rotation, whose rate rises as t - sin(w t)/w with w = 2 pi / duration.

    Args:
        speed: final rate [rad/s].
        duration: time until it is reached [s].
    """
    w = 2 * np.pi / duration
    a, b = speed / duration, speed / duration / w**2
    rows = [
        [0.0, -b, 0, a / 2, 0, 0, 0, b, w, np.pi / 2],
        [duration, speed * duration / 2, speed, 0, 0, 0, 0, 0, 0, 0],
    ]
    return fx.Signal(np.array(rows), {"kind": "spin_up"})
