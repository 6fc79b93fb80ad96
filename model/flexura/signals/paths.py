"""Paths of a tip in the plane over time, from rest to rest: a pair of Signals, x and y [m].

Along its way a tip goes as s(u) = u^5 (126 - 420 u + 540 u^2 - 315 u^3 + 70 u^4), u = t/T (117):
velocity, acceleration, jerk and its derivative are zero at both ends, so that a flexible robot can
follow with modest drives.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..io import array, finite_arguments
from .conversion import FunctionSignal, spline
from .signal import COLUMNS, Signal, check_duration

POINT = "expected a place (x, y) in metres"


def smooth_rise(u: Any) -> Any:
    """s(u) (117), 0 before u = 0 and 1 after u = 1."""
    v = np.clip(u, 0.0, 1.0)
    return v**5 * (126 + v * (-420 + v * (540 + v * (-315 + v * 70))))


@finite_arguments
def line(
    start: ArrayLike, end: ArrayLike, duration_s: float, at_s: float = 0.0
) -> tuple[Signal, Signal]:
    """A straight way from start to end, both (x, y) [m]."""
    ends = [array(place, key, POINT, (2,)) for key, place in (("start", start), ("end", end))]
    if not np.any(ends[0] != ends[1]):
        raise InputError("expected an end other than the start", key="end", value=end)
    return polyline(ends, duration_s, at_s)


@finite_arguments
def polyline(points: ArrayLike, duration_s: float, at_s: float = 0.0) -> tuple[Signal, Signal]:
    """Straight ways from point to point (k, 2) [m], at rest in each; each takes its share of the
    length in the duration."""
    expected = "expected two places (x, y) or more, each other than the one before, in metres"
    places = array(points, "points", expected, (None, 2))
    lengths = np.linalg.norm(np.diff(places, axis=0), axis=1)
    if len(places) < 2 or not np.all(lengths > 0):
        raise InputError(expected, key="points", value=points)
    check_duration(duration_s)
    marks = at_s + duration_s * np.append(0.0, np.cumsum(lengths) / lengths.sum())
    parts = []
    for a, b, t0, t1 in zip(places[:-1], places[1:], marks[:-1], marks[1:], strict=True):
        rise = _moved(smooth_rise, float(t0), float(t1))
        parts.append([_scaled(rise, a[k], b[k] - a[k]) for k in range(2)])
    return _joined(parts)


@finite_arguments
def circle(
    centre: Any,
    radius: float,
    duration_s: float,
    start_rad: float = 0.0,
    turn_rad: float = 2 * np.pi,
    at_s: float = 0.0,
) -> tuple[Signal, Signal]:
    """A way round a circle of `radius` [m] about `centre` (x, y) [m]: from the polar angle
    `start_rad` on, by `turn_rad`, to the left where that is above 0."""
    middle = array(centre, "centre", POINT, (2,))
    if not radius > 0:
        raise InputError("expected a radius above 0 in metres", key="radius", value=radius)
    check_duration(duration_s)

    turned = lambda u: start_rad + turn_rad * smooth_rise(u)
    ways = [lambda u: np.cos(turned(u)), lambda u: np.sin(turned(u))]
    parts = [_moved(way, at_s, at_s + duration_s) for way in ways]
    return _joined([[_scaled(parts[k], middle[k], radius) for k in range(2)]])


def _moved(way: Callable[[float], Any], start: float, end: float) -> np.ndarray:
    """Segments of way((t - start) / (end - start)) between two times, and of rest after."""
    function = lambda t: float(way((t - start) / (end - start)))
    one = FunctionSignal(np.zeros((0, COLUMNS)), {"kind": "path"}, function, "path")
    rest = np.zeros((1, COLUMNS))
    rest[0, :2] = end, float(way(1.0))
    return np.concatenate([spline(one, start, end).segments, rest])


def _scaled(segments: np.ndarray, offset: float, factor: float) -> np.ndarray:
    out = segments.copy()
    out[:, 1:7] *= factor
    out[:, 1] += offset
    return out


def _joined(parts: list[list[np.ndarray]]) -> tuple[Signal, Signal]:
    x, y = (
        np.concatenate([*(part[k][:-1] for part in parts[:-1]), parts[-1][k]]) for k in range(2)
    )
    return Signal(x, {"kind": "path"}), Signal(y, {"kind": "path"})
