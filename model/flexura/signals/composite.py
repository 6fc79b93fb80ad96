"""Signals that excite a robot, and signals made of others: pulses, chirps, noise; sums, delays."""

from __future__ import annotations

import builtins
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..io import finite_arguments, whole
from .conversion import FunctionSignal
from .shaping import MAX_SEGMENTS, stretches
from .signal import COLUMNS, Signal, check_duration, from_segments, segment

BEFORE = -1e300  # s: a segment that begins there is what was always
PIECES = 64  # polynomials of fifth order in a period of a chirp: they are off by 2e-11 of it
ZERO = [BEFORE, *([0.0] * (COLUMNS - 1))]


@dataclass(frozen=True)
class SumSignal(FunctionSignal):
    """A sum of signals whose frequencies differ: no segment has two of them."""

    parts: tuple[Signal, ...] = ()

    def __call__(self, t: float) -> tuple[float, float, float]:
        """y and its derivatives, the sums of the parts' own."""
        y, yd, ydd = np.sum([part(t) for part in self.parts], axis=0).tolist()
        return y, yd, ydd


@finite_arguments
def pulse(value: float, duration_s: float, at_s: float = 0.0) -> Signal:
    """0, then `value` for the duration, then 0.

    Args:
        value: of the pulse.
        duration_s: of the pulse [s].
        at_s: its begin [s].

    Returns:
        The Signal.

    Raises:
        InputError: a duration that is not positive.
    """
    check_duration(duration_s)
    rows = [ZERO, segment(at_s, value), segment(at_s + duration_s, 0.0)]
    return from_segments(rows, kind="pulse", value=value, duration_s=duration_s, at_s=at_s)


@finite_arguments
def chirp(
    amplitude: float, start_Hz: float, end_Hz: float, duration_s: float, at_s: float = 0.0
) -> Signal:
    """amplitude sin(2 pi (f0 s + (f1 - f0) s^2 / (2 T))): a sine whose frequency changes evenly.

    It is 0 before and after. Polynomials of fifth order stand for it, exact to 2e-11.

    Args:
        amplitude: of the sine.
        start_Hz: f0, the frequency at the begin [Hz].
        end_Hz: f1, the frequency at the end [Hz].
        duration_s: T [s].
        at_s: begin [s].

    Returns:
        The Signal.

    Raises:
        InputError: a duration or frequencies that are not positive, or too many periods.
    """
    check_duration(duration_s)
    for key, value in (("start_Hz", start_Hz), ("end_Hz", end_Hz)):
        if value < 0:
            raise InputError("expected a frequency of 0 or more in hertz", key=key, value=value)
    count = PIECES * duration_s * max(start_Hz, end_Hz)
    if count > MAX_SEGMENTS:
        expected = f"expected at most {MAX_SEGMENTS // PIECES} periods"
        raise InputError(expected, key="duration_s", value=duration_s)
    s = np.linspace(0.0, duration_s, max(math.ceil(count), 4) + 1)
    rate, growth = 2 * np.pi * start_Hz, 2 * np.pi * (end_Hz - start_Hz) / duration_s
    phase, speed = rate * s + growth * s**2 / 2, rate + growth * s
    y = amplitude * np.array([np.sin(phase), speed * np.cos(phase), -(speed**2) * np.sin(phase)])
    y[2] += amplitude * growth * np.cos(phase)
    rows = [ZERO, *_hermite(at_s + s, y), segment(at_s + duration_s, 0.0)]
    return from_segments(
        rows,
        kind="chirp",
        amplitude=amplitude,
        start_Hz=start_Hz,
        end_Hz=end_Hz,
        duration_s=duration_s,
        at_s=at_s,
    )


@finite_arguments
def noise(
    rms: float, cutoff_Hz: float, duration_s: float, seed: int = 0, at_s: float = 0.0
) -> Signal:
    """Random values up to a frequency, always the same ones for a seed; 0 before and after.

    A cubic spline goes through independent normal values, two in a period of the cutoff. It begins
    and ends at rest.

    Args:
        rms: standard deviation of the values.
        cutoff_Hz: the highest frequency that the values have [Hz].
        duration_s: of the noise [s].
        seed: of the random numbers, 0 or more.
        at_s: begin [s].

    Returns:
        The Signal.

    Raises:
        InputError: a number out of its range, or too many periods.
    """
    from scipy.interpolate import CubicSpline

    check_duration(duration_s)
    if not cutoff_Hz > 0:
        expected = "expected a frequency above 0 in hertz"
        raise InputError(expected, key="cutoff_Hz", value=cutoff_Hz)
    seed = whole(seed, "seed", 0)
    if 2 * cutoff_Hz * duration_s > MAX_SEGMENTS:
        expected = f"expected at most {MAX_SEGMENTS // 2} periods of the cutoff"
        raise InputError(expected, key="duration_s", value=duration_s)
    times = np.linspace(0.0, duration_s, max(math.ceil(2 * cutoff_Hz * duration_s), 2) + 1)
    values = rms * np.random.default_rng(seed).standard_normal(len(times))
    values[[0, -1]] = 0.0
    c = CubicSpline(times, values, bc_type="clamped").c[::-1].T
    rows = [segment(at_s + t, *own) for t, own in zip(times, c.tolist(), strict=False)]
    return from_segments(
        [ZERO, *rows, segment(at_s + duration_s, 0.0)],
        kind="noise",
        rms=rms,
        cutoff_Hz=cutoff_Hz,
        duration_s=duration_s,
        seed=seed,
        at_s=at_s,
    )


@finite_arguments
def delayed(signal: Signal, by_s: float) -> Signal:
    """The signal some time later: y(t - by_s).

    Args:
        signal: to be delayed.
        by_s: the delay [s].

    Returns:
        The Signal.

    Raises:
        InputError: a signal that is none, or a function.
    """
    rows = _segments(signal, "signal").copy()
    rows[:, 0] += by_s
    return from_segments(rows.tolist(), kind="delayed", signal=signal.spec, by_s=by_s)


def sum(signals: Sequence[Signal]) -> Signal:  # named as numpy's is
    """The sum of signals.

    One of several harmonics of different frequencies is a function of time, without segments.

    Args:
        signals: one or more.

    Returns:
        The Signal.

    Raises:
        InputError: no signal, one that is a function, or too many segments.
    """
    if not isinstance(signals, Sequence) or isinstance(signals, str | bytes) or not signals:
        raise InputError("expected a list of signals", key="signals", value=signals)
    parts = [_segments(each, f"signals[{i}]") for i, each in enumerate(signals, 1)]
    if builtins.sum(map(len, parts)) > MAX_SEGMENTS:
        expected = f"expected signals of at most {MAX_SEGMENTS} segments together"
        raise InputError(expected, key="signals")
    spec = {"kind": "sum", "signals": [each.spec for each in signals]}
    rates = {w for rows in parts for w in np.unique(rows[rows[:, 7] != 0, 8]).tolist()}
    if len(rates) > 1:
        value: Callable[[float], float] = lambda t: math.fsum(each(t)[0] for each in signals)
        empty = np.zeros((0, COLUMNS))
        return SumSignal(empty, spec, value, "sum", tuple(signals))
    return from_segments(stretches([(1.0, 0.0, rows) for rows in parts]), **spec)


KINDS: dict[str, Callable[..., Signal]] = {
    f.__name__: f for f in (pulse, chirp, noise, delayed, sum)
}


def _segments(signal: Signal, key: str) -> np.ndarray:
    if not isinstance(signal, Signal) or not len(signal.segments):
        raise InputError("expected a Signal of segments, no function", key=key, value=signal)
    return signal.segments


def _hermite(t: np.ndarray, y: np.ndarray) -> list[list[float]]:
    """Segments of fifth order between times (k,) with the values and derivatives y (3, k)."""
    h, a, b = np.diff(t), y[:, :-1], y[:, 1:]
    gap = b[0] - a[0] - h * (a[1] + h * a[2] / 2)
    slope, bend = h * (b[1] - a[1] - h * a[2]), h**2 * (b[2] - a[2])
    c3 = (10 * gap - 4 * slope + bend / 2) / h**3
    c4 = (-15 * gap + 7 * slope - bend) / h**4
    c5 = (6 * gap - 3 * slope + bend / 2) / h**5
    return [segment(*own) for own in np.array([t[:-1], *a[:2], a[2] / 2, c3, c4, c5]).T.tolist()]
