"""Functions of time with their first two derivatives: motions to follow, forces and torques to
apply.

A Signal is a list of segments; on each, with s = t - t0,

    y(s) = c0 + c1 s + ... + c5 s^5 + A sin(w s + phi),

which holds cycloids, harmonics, polynomials, bang-bang profiles and cubic splines in one form that
the core evaluates without calling back into Python. Before the first segment y keeps its first
value. `kinds.py` has the usual ones, `shaping.py` those that leave a mode at rest; `parsing.py`
reads signals from tables.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..errors import InputError
from ..io import Tables, array

COLUMNS = 10  # t0, c0 ... c5, A, w, phi
FEW = 8  # segments that are looked through one by one


def _segment(segments: np.ndarray, t: float) -> list[float]:
    """The last one of segments (k, 10) that starts at or before t, else the first."""
    if len(segments) > FEW:
        low = max(int(np.searchsorted(segments[:, 0], t, side="right")) - 1, 0)
        row: list[float] = segments[low].tolist()
        return row
    rows: list[list[float]] = segments.tolist()
    for row in reversed(rows):
        if row[0] <= t:
            return row
    return rows[0]


def evaluate(segments: np.ndarray, t: float) -> tuple[float, float, float]:
    """y, dy/dt and d2y/dt2 of packed segments (60).

    Args:
        segments: (k, 10).
        t: time [s].

    Returns:
        The three numbers; 0 where k = 0.
    """
    if len(segments) == 0:
        return 0.0, 0.0, 0.0
    t0, c0, c1, c2, c3, c4, c5, A, w, phi = _segment(segments, t)
    s = t - t0
    if s < 0.0:  # before the first segment: hold
        return c0 + A * math.sin(phi), 0.0, 0.0
    y = c0 + s * (c1 + s * (c2 + s * (c3 + s * (c4 + s * c5))))
    yd = c1 + s * (2 * c2 + s * (3 * c3 + s * (4 * c4 + s * 5 * c5)))
    ydd = 2 * c2 + s * (6 * c3 + s * (12 * c4 + s * 20 * c5))
    if A != 0.0:
        sine, cosine = math.sin(w * s + phi), math.cos(w * s + phi)
        y, yd, ydd = y + A * sine, yd + A * w * cosine, ydd - A * w * w * sine
    return y, yd, ydd


def evaluate_many(segments: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """y and dy/dt (T,) of packed segments (60) at many times; y has the digits of `evaluate`.

    Args:
        segments: (k, 10).
        t: times (T,) [s].

    Returns:
        The two arrays; 0 where k = 0.
    """
    if len(segments) == 0:
        return np.zeros(len(t)), np.zeros(len(t))
    rows = segments[np.maximum(np.searchsorted(segments[:, 0], t, side="right") - 1, 0)]
    late = t - rows[:, 0]
    s = np.maximum(late, 0.0)
    y, yd = np.zeros(len(s)), np.zeros(len(s))
    for k in range(6, 0, -1):
        yd = yd * s + y
        y = y * s + rows[:, k]
    A, w = rows[:, 7], rows[:, 8]
    if A.any():
        angles = (w * s + rows[:, 9]).tolist()  # NumPy's sines depend on the processor
        y = y + A * np.array([math.sin(angle) for angle in angles])
        yd = yd + A * w * np.array([math.cos(angle) for angle in angles])
    return y, np.where(late < 0, 0.0, yd)


@dataclass(frozen=True)
class Signal:
    """A function of time (60): `signal(t)` gives (y, dy/dt, d2y/dt2); `segments` (k, 10); `breaks`
    where it isn't smooth."""

    segments: np.ndarray
    spec: Tables = field(default_factory=dict)

    def __post_init__(self) -> None:
        expected = f"expected segments (k, {COLUMNS}): t0, c0 to c5, A, w, phi"
        given = self.segments
        if not (isinstance(given, np.ndarray) and given.dtype == float and given.ndim == 2):
            given = array(given, "segments", expected)
        if given.ndim != 2 or given.shape[1] != COLUMNS:
            raise InputError(expected, key="segments", value=given.shape)
        if not isinstance(self.spec, dict):
            raise InputError("expected a table", key="spec", value=self.spec)
        object.__setattr__(self, "segments", given)

    def __repr__(self) -> str:
        return f"Signal: {self.said()}"

    def said(self) -> str:
        """Its kind and its table, without the values of long lists: "cycloid(end=0.8, ...)"."""
        parts = []
        for key, value in self.spec.items():
            if key != "kind":
                short = f"{len(value)} values" if isinstance(value, list) else value
                parts.append(f"{key}={short:g}" if isinstance(short, float) else f"{key}={short}")
        kind = self.spec.get("kind", "segments")
        return f"{kind}({', '.join(parts) or f'{len(self.segments)} rows'})"

    def __call__(self, t: float) -> tuple[float, float, float]:
        """y, dy/dt and d2y/dt2.

        Args:
            t: time [s].

        Returns:
            The three numbers.
        """
        return evaluate(self.segments, float(t))

    @property
    def breaks(self) -> np.ndarray:
        """Where segments begin (k,) [s]."""
        return self.segments[:, 0]


def segment(t0: float, *c: float, A: float = 0.0, w: float = 0.0, phi: float = 0.0) -> list[float]:
    """One segment's row (60).

    Args:
        t0: where it begins [s].
        *c: coefficients c0, c1, ... up to c5; the others are 0.
        A: amplitude of its wave.
        w: the wave's frequency [rad/s].
        phi: the wave's phase [rad].

    Returns:
        Ten numbers.
    """
    return [t0, *c, *([0.0] * (6 - len(c))), A, w, phi]


def from_segments(rows: list[list[float]], **spec: Any) -> Signal:
    """A Signal from the rows of its segments (60).

    Args:
        rows: ten numbers each.
        spec: the signal's table in a file.

    Returns:
        The Signal.

    Raises:
        InputError: a number is not finite.
    """
    segments = np.array(rows, dtype=float).reshape(-1, COLUMNS)
    if not np.isfinite(segments).all():
        raise InputError(
            "expected numbers whose derivatives are finite", key="kind", value=spec["kind"]
        )
    segments.setflags(write=False)
    return Signal(segments, spec)


def check_duration(duration_s: float) -> None:
    """Refuse a duration that is not above 0 s. Raises InputError."""
    if not duration_s > 0:
        expected = "expected a duration above 0 in seconds"
        raise InputError(expected, key="duration_s", value=duration_s)
