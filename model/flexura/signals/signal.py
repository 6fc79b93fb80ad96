"""Functions of time with their first two derivatives: motions to follow, forces and torques to
apply.

A Signal is a list of segments; on each, with s = t - t0,

    y(s) = c0 + c1 s + ... + c5 s^5 + A sin(w s + phi),

which holds cycloids, harmonics, polynomials, bang-bang profiles and cubic splines in one form that
the core evaluates without calling back into Python. Before the first segment y keeps its first
value. `shaping.py` adds the signals that leave a mode at rest; `parsing.py` reads signals from
tables.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..io import Tables, array, finite_arguments

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
    """y and dy/dt (T,) of packed segments (60) at many times.

    Args:
        segments: (k, 10), one or more.
        t: times (T,) [s].

    Returns:
        The two arrays.
    """
    rows = segments[np.maximum(np.searchsorted(segments[:, 0], t, side="right") - 1, 0)]
    late = t - rows[:, 0]
    s = np.maximum(late, 0.0)
    y, yd = np.zeros(len(s)), np.zeros(len(s))
    for k in range(6, 0, -1):
        yd = yd * s + y
        y = y * s + rows[:, k]
    A, w = rows[:, 7], rows[:, 8]
    if A.any():
        angle = w * s + rows[:, 9]
        y, yd = y + A * np.sin(angle), yd + A * w * np.cos(angle)
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


@finite_arguments
def constant(value: float) -> Signal:
    """y = value.

    Args:
        value: at all times.

    Returns:
        The Signal.
    """
    return from_segments([segment(0.0, value)], kind="constant", value=value)


@finite_arguments
def step(value: float, at_s: float = 0.0) -> Signal:
    """0, then `value` from `at_s` on.

    Args:
        value: after the step.
        at_s: instant of the step [s].

    Returns:
        The Signal.
    """
    return from_segments(
        [segment(-1e300, 0.0), segment(at_s, value)], kind="step", value=value, at_s=at_s
    )


@finite_arguments
def harmonic(
    amplitude: float, frequency_Hz: float, phase_rad: float = 0.0, offset: float = 0.0
) -> Signal:
    """y = offset + amplitude cos(2 pi f t + phase), the form of the dissertation's inverse law.

    Args:
        amplitude: of the oscillation.
        frequency_Hz: f [Hz].
        phase_rad: at t = 0 [rad].
        offset: mean.

    Returns:
        The Signal.
    """
    row = segment(0.0, offset, A=amplitude, w=2 * np.pi * frequency_Hz, phi=phase_rad + np.pi / 2)
    return from_segments(
        [row],
        kind="harmonic",
        amplitude=amplitude,
        frequency_Hz=frequency_Hz,
        phase_rad=phase_rad,
        offset=offset,
    )


@finite_arguments
def ramp(end: float, duration_s: float, start: float = 0.0, at_s: float = 0.0) -> Signal:
    """y along a straight line from start to end in `duration_s`, then rest.

    Its velocity jumps at both ends of the line. As a prescribed motion it is good for runs that lie
    between them.

    Args:
        end: value at the end.
        duration_s: of the line [s].
        start: value before.
        at_s: begin [s].

    Returns:
        The Signal.
    """
    check_duration(duration_s)
    rows = [
        segment(at_s, start, (end - start) / duration_s),
        segment(at_s + duration_s, end),
    ]
    return from_segments(rows, kind="ramp", end=end, duration_s=duration_s, start=start, at_s=at_s)


@finite_arguments
def cycloid(end: float, duration_s: float, start: float = 0.0, at_s: float = 0.0) -> Signal:
    """y = start + A [s/T - sin(2 pi s/T)/(2 pi)], A = end - start (61), then rest.

    Args:
        end: value at the end.
        duration_s: T [s].
        start: value before.
        at_s: begin [s].

    Returns:
        The Signal.
    """
    check_duration(duration_s)
    A, T = end - start, duration_s
    rows = [
        segment(at_s, start, A / T, A=-A / (2 * np.pi), w=2 * np.pi / T),
        segment(at_s + T, end),
    ]
    return from_segments(
        rows, kind="cycloid", end=end, duration_s=duration_s, start=start, at_s=at_s
    )


@finite_arguments
def polynomial(end: float, duration_s: float, start: float = 0.0, at_s: float = 0.0) -> Signal:
    """y = start + A (10 u^3 - 15 u^4 + 6 u^5), u = s/T: velocity and acceleration zero at both
    ends.

    Args:
        end: value at the end; A = end - start.
        duration_s: T [s].
        start: value before.
        at_s: begin [s].

    Returns:
        The Signal.
    """
    check_duration(duration_s)
    rows = [_rise(at_s, start, end - start, duration_s), segment(at_s + duration_s, end)]
    return from_segments(
        rows, kind="polynomial", end=end, duration_s=duration_s, start=start, at_s=at_s
    )


@finite_arguments
def trapezoidal(
    end: float, duration_s: float, rise_s: float, start: float = 0.0, at_s: float = 0.0
) -> Signal:
    """From start to end with a trapezoid of velocity.

    Args:
        end: value at the end.
        duration_s: of the whole motion [s].
        rise_s: of the constant acceleration, and of the opposite one at the end [s].
        start: value before.
        at_s: begin [s].

    Returns:
        The Signal.

    Raises:
        InputError: a time is not positive, or two rises do not fit into the duration.
    """
    check_duration(duration_s)
    T, r = duration_s, rise_s
    if not 0 < r <= T / 2:
        raise InputError(
            f"expected a rise above 0 and at most half the duration, {T / 2:g} s",
            key="rise_s",
            value=r,
        )
    v = (end - start) / (T - r)
    a = v / r
    brake = at_s + max(T - r, r)
    rows = [
        segment(at_s, start, 0.0, a / 2),
        segment(at_s + r, start + v * r / 2, v),
        segment(brake, end - v * r / 2, v, -a / 2),
        segment(at_s + T, end),
    ]
    return from_segments(
        rows,
        kind="trapezoidal",
        end=end,
        duration_s=duration_s,
        rise_s=rise_s,
        start=start,
        at_s=at_s,
    )


@finite_arguments
def bang_bang(
    amplitude: float, duration_s: float, rise_s: float = 0.0, at_s: float = 0.0
) -> Signal:
    """+amplitude for the first half of the duration, -amplitude for the second, then 0.

    Args:
        amplitude: A.
        duration_s: of both halves [s].
        rise_s: time that every change takes, along 10 u^3 - 15 u^4 + 6 u^5 [s]. A change is centred
            on its instant; the first and the last lie inside the duration.
        at_s: begin [s].

    Returns:
        The Signal.

    Raises:
        InputError: a time is not positive, or the changes do not fit into the duration.
    """
    check_duration(duration_s)
    a, T, r = amplitude, duration_s, rise_s
    if not 0 <= r <= T / 4:
        raise InputError(
            f"expected a rise between 0 and a quarter of the duration, {T / 4:g} s",
            key="rise_s",
            value=r,
        )
    if r == 0:
        rows = [segment(at_s, a), segment(at_s + T / 2, -a), segment(at_s + T, 0.0)]
    else:
        rows = [
            _rise(at_s, 0.0, a, r),
            segment(at_s + r, a),
            _rise(at_s + T / 2 - r / 2, a, -2 * a, r),
            segment(at_s + T / 2 + r / 2, -a),
            _rise(at_s + T - r, -a, a, r),
            segment(at_s + T, 0.0),
        ]
    if at_s > 0:
        rows.insert(0, segment(0.0))
    return from_segments(
        rows, kind="bang_bang", amplitude=amplitude, duration_s=duration_s, rise_s=rise_s, at_s=at_s
    )


def table(t_s: ArrayLike, y: ArrayLike) -> Signal:
    """A cubic spline with zero second derivative at its ends; then the last value.

    Args:
        t_s: ascending times (k,) [s], k >= 2.
        y: values at them (k,).

    Returns:
        The Signal.
    """
    from scipy.interpolate import CubicSpline

    times, values = _columns("t_s", t_s, "y", y, 2)
    coefficients = CubicSpline(
        times, values, bc_type="natural"
    ).c  # (4, k - 1), highest power first
    rows = [segment(times[k], *coefficients[::-1, k]) for k in range(len(times) - 1)] + [
        segment(times[-1], values[-1])
    ]
    return from_segments(rows, kind="table", t_s=times.tolist(), y=values.tolist())


def piecewise(at_s: ArrayLike, value: ArrayLike) -> Signal:
    """Constant from each instant to the next: the dissertation's bang-bang torques.

    Args:
        at_s: instants (k,) [s].
        value: values from them on (k,).

    Returns:
        The Signal.
    """
    times, values = _columns("at_s", at_s, "value", value, 1)
    rows = [segment(t, v) for t, v in zip(times, values, strict=True)]
    return from_segments(rows, kind="piecewise", at_s=times.tolist(), value=values.tolist())


KINDS = {
    f.__name__: f
    for f in (
        constant,
        step,
        harmonic,
        ramp,
        cycloid,
        polynomial,
        trapezoidal,
        bang_bang,
        table,
        piecewise,
    )
}


def _rise(t0: float, start: float, change: float, duration: float) -> list[float]:
    try:
        return segment(
            t0,
            start,
            0.0,
            0.0,
            10 * change / duration**3,
            -15 * change / duration**4,
            6 * change / duration**5,
        )
    except ArithmeticError:  # 1e-200 or 1e200 seconds
        raise InputError(
            "expected a duration that leaves the derivatives finite",
            key="duration_s",
            value=duration,
        ) from None


def _columns(
    key: str, times: Any, other: str, values: Any, least: int
) -> tuple[np.ndarray, np.ndarray]:
    """Ascending times (k,) and as many values, `least` or more. Raises InputError."""
    expected = f"expected at least {'two' if least == 2 else 'one'} ascending times"
    t = array(times, key, expected, (None,))
    if len(t) < least or not np.all(np.diff(t) > 0):
        raise InputError(expected, key=key, value=t.tolist())
    return t, array(values, other, f"expected {len(t)} finite values, one a time", (len(t),))


def check_duration(duration_s: float) -> None:
    """Refuse a duration that is not above 0 s. Raises InputError."""
    if not duration_s > 0:
        expected = "expected a duration above 0 in seconds"
        raise InputError(expected, key="duration_s", value=duration_s)
