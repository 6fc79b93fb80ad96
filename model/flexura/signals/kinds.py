"""The kinds of signals: constants, steps, harmonics, polynomials, cycloids, trapezoids, tables."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..io import array, finite_arguments
from .signal import Signal, check_duration, from_segments, segment


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
