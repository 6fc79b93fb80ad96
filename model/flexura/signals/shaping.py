"""Motions that leave a mode of the robot at rest: input shaping, and a cycloid matched to the
mode."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..errors import InputError
from ..io import finite_arguments
from .kinds import cycloid
from .signal import COLUMNS, Signal, from_segments

MAX_SEGMENTS = 100_000  # shaping a shaped signal doubles its segments


@finite_arguments
def zv(signal: Signal, frequency_Hz: float, damping_ratio: float = 0.0) -> Signal:
    """Zero-vibration shaper: two copies, y = [y(t) + k y(t - T/2)] / (1 + k) (78).

    They leave the mode at rest afterwards. k = exp(-pi zeta / sqrt(1 - zeta^2)); T = 1 / (f sqrt(1
    - zeta^2)), the damped period of the mode (Singer and Seering 1990, J. Dyn. Syst. Meas. Control
    112, 76-82). What the signal starts and ends with is kept. Exact in y, dy/dt and d2y/dt2. A
    frequency off by e leaves a vibration proportional to e.

    Args:
        signal: the signal.
        frequency_Hz: f, natural frequency of the mode [Hz].
        damping_ratio: zeta, its damping ratio.

    Returns:
        The shaped Signal, longer by T/2.
    """
    return _shape("zv", signal, frequency_Hz, damping_ratio, lambda k: [1, k])


@finite_arguments
def zvd(signal: Signal, frequency_Hz: float, damping_ratio: float = 0.0) -> Signal:
    """Zero-vibration-and-derivative shaper: three copies, weights 1, 2k, k^2 over (1 + k)^2, at 0,
    T/2, T (78); see `zv`.

    A frequency off by e leaves a vibration proportional to e^2 only.

    Args:
        signal: the signal.
        frequency_Hz: natural frequency of the mode [Hz].
        damping_ratio: its damping ratio.

    Returns:
        The shaped Signal, longer by T.
    """
    return _shape("zvd", signal, frequency_Hz, damping_ratio, lambda k: [1, 2 * k, k * k])


@finite_arguments
def ei(
    signal: Signal, frequency_Hz: float, damping_ratio: float = 0.0, tolerance: float = 0.05
) -> Signal:
    """Extra-insensitive shaper: three copies, weights (1 + V) / 4, k (1 - V) / 2, k^2 (1 + V) / 4
    over their sum, at 0, T/2, T; see `zv`.

    V, the `tolerance`, is the vibration that stays at the frequency itself, as a share of the
    unshaped motion's. For it the frequency may be off by more than with `zvd`: by 20 % either way
    with V = 0.05 (Singhose, Seering and Singer 1994, J. Mech. Design 116, 654-659).

    Args:
        signal: the signal.
        frequency_Hz: natural frequency of the mode [Hz].
        damping_ratio: its damping ratio.
        tolerance: V, from 0 to below 1.

    Returns:
        The shaped Signal, longer by T.

    Raises:
        InputError: a tolerance that is none.
    """
    if not 0 <= tolerance < 1:
        raise InputError("expected a share from 0 to below 1", key="tolerance", value=tolerance)
    v = tolerance
    weights = lambda k: [(1 + v) / 4, k * (1 - v) / 2, k * k * (1 + v) / 4]
    made = _shape("ei", signal, frequency_Hz, damping_ratio, weights)
    return Signal(made.segments, made.spec | {"tolerance": tolerance})


@finite_arguments
def matched_cycloid(
    end: float, frequency_Hz: float, periods: int = 2, start: float = 0.0, at_s: float = 0.0
) -> Signal:
    """A cycloid of whole periods of an undamped mode, which leaves it at rest: T = periods / f
    (79).

    Its acceleration is one sine of period T. The mode's response to a whole number n of its periods
    is zero at the end, but for n = 1, its resonance. For a robot: `matched_cycloid(0.3,
    fx.frequencies(system)[0])`.

    Args:
        end: value at the end.
        frequency_Hz: f, of the mode [Hz].
        periods: whole number, 2 or more.
        start: value before.
        at_s: begin [s].

    Returns:
        The Signal.

    Raises:
        InputError: the frequency is not positive, or `periods` is below 2.
    """
    if periods < 2:
        raise InputError(
            "expected 2 or more periods of the mode; 1 is its resonance",
            key="periods",
            value=periods,
        )
    _frequency(frequency_Hz)
    made = cycloid(end, periods / frequency_Hz, start, at_s)
    spec = {
        "kind": "matched_cycloid",
        "end": end,
        "frequency_Hz": frequency_Hz,
        "periods": periods,
        "start": start,
        "at_s": at_s,
    }
    return Signal(made.segments, spec)


KINDS: dict[str, Callable[..., Signal]] = {f.__name__: f for f in (matched_cycloid, zv, zvd, ei)}
_Weights = Callable[[float], list[float]]  # of the copies, from k


def _shape(
    kind: str, signal: Signal, frequency_Hz: float, damping_ratio: float, weights: _Weights
) -> Signal:
    if not isinstance(signal, Signal) or not len(signal.segments):
        raise InputError("expected a Signal of segments, no function", key="signal", value=signal)
    _frequency(frequency_Hz)
    if not 0 <= damping_ratio < 1:
        raise InputError(
            "expected a damping ratio from 0 to below 1", key="damping_ratio", value=damping_ratio
        )
    root = np.sqrt(1 - damping_ratio**2)
    copies = np.array(weights(np.exp(-np.pi * damping_ratio / root)), dtype=float)
    most = MAX_SEGMENTS // len(copies)
    if len(signal.segments) > most:
        expected = f"expected a signal of at most {most} segments"
        raise InputError(expected, key="signal", value=len(signal.segments))
    turning = signal.segments[:, 7] != 0
    if len(np.unique(signal.segments[turning, 8])) > 1:
        expected = "expected a signal with a single frequency in all its segments"
        raise InputError(expected, key="signal")
    delays = np.arange(len(copies)) / (2 * frequency_Hz * root)
    shares = zip(copies / copies.sum(), delays, strict=True)
    rows = stretches([(weight, delay, signal.segments) for weight, delay in shares])
    return from_segments(
        rows, kind=kind, signal=signal.spec, frequency_Hz=frequency_Hz, damping_ratio=damping_ratio
    )


def stretches(parts: Sequence[tuple[float, float, np.ndarray]]) -> list[list[float]]:
    """The segments of a sum of signals, sum_k weight_k y_k(t - delay_k): one segment on each
    stretch between two starts.

    Args:
        parts: weight, delay [s] and segments (k, 10) of each; one frequency in all of them.

    Returns:
        Rows of segments.
    """
    starts = [segments[:, 0] + delay for _, delay, segments in parts]
    rows = []
    for t0 in np.unique(np.concatenate(starts)):
        row, turning = np.zeros(COLUMNS), 0j
        for (weight, _, segments), own in zip(parts, starts, strict=True):
            k = np.searchsorted(own, t0, side="right") - 1
            piece, s = segments[max(k, 0)], t0 - own[k] if k >= 0 else 0.0
            c = np.array(piece[1:7])
            if k < 0:  # this one has not begun: it holds its first value
                row[1] += weight * (c[0] + piece[7] * np.sin(piece[9]))
                continue
            for i in range(5):  # the polynomial about its new origin, by repeated division (Horner)
                for j in range(4, i - 1, -1):
                    c[j] += s * c[j + 1]
            row[1:7] += weight * c
            if piece[7] != 0:
                turning += weight * piece[7] * np.exp(1j * (piece[8] * s + piece[9]))
                row[8] = piece[8]
        row[0], row[7], row[9] = t0, abs(turning), np.angle(turning)
        rows.append(row.tolist())
    return rows


def _frequency(value: float) -> None:
    if not value > 0:
        raise InputError("expected a frequency above 0 in hertz", key="frequency_Hz", value=value)
