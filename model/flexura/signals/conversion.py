"""Signals from what people have: numbers, tables of values, and functions of time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..io import array, function_of, number
from .kinds import constant, table
from .signal import COLUMNS, Signal

SAMPLES = (65, 257, 1025, 4097)  # of a function, the first that are enough
GOOD, POOR = 1e-11, 1e-6  # of the range of its values: what a spline may be off by between them
# What a signal can be given as; arrays (T,) go with times. None: no signal.
SignalLike: TypeAlias = Signal | ArrayLike | Callable[[float], float] | None
EXPECTED = "expected a number, a Signal, a function of time, or an array of a value each time"


@dataclass(frozen=True, repr=False)
class FunctionSignal(Signal):
    """A Python function of time as a Signal; `key` names it in messages. It has no segments."""

    function: Callable[[float], float] = float
    key: str = "signal"

    def value(self, t: float) -> float:
        """The function's value.

        Args:
            t: time [s].

        Returns:
            y.

        Raises:
            InputError: the function gives anything but a finite number.
        """
        given = self.function(t)
        if isinstance(given, np.ndarray) and given.size == 1:
            given = given.item()
        return number(given, self.key, f"expected a finite number from the function at t = {t:g} s")

    def __call__(self, t: float) -> tuple[float, float, float]:
        """y, and its derivatives by differences."""
        h = 1e-4 * max(abs(t), 1.0)
        low, y, high = self.value(t - h), self.value(t), self.value(t + h)
        return y, (high - low) / (2 * h), (high - 2 * y + low) / h**2


def as_signal(value: SignalLike, key: str, t: np.ndarray | None = None) -> Signal | None:
    """A Signal from what a caller gives.

    Args:
        value: None, a number, a Signal, a function of t [s], or values (T,) at the times `t`.
        key: name of the argument, for the message.
        t: times (T,) [s].

    Returns:
        Numbers as constant Signals, arrays as cubic splines (`table`), functions as a
        FunctionSignal.

    Raises:
        InputError: anything else; an array without times, or of another length.
    """
    if value is None or isinstance(value, Signal):
        return value
    if isinstance(value, type) or not (callable(value) or np.iterable(value)):
        return constant(number(value, key, EXPECTED))
    if callable(value):
        return FunctionSignal(
            np.zeros((0, COLUMNS)),
            _function_spec(value),
            function_of(value, key, (1,), EXPECTED),
            key,
        )
    if isinstance(value, str | bytes | dict | set):
        raise InputError(EXPECTED, key=key, value=value)
    if np.ndim(array(value, key, EXPECTED)) == 0:
        return constant(number(np.asarray(value).item(), key, EXPECTED))
    if t is None:
        text = "expected times with these values: signals.table(t_s, y), or the argument t_s"
        raise InputError(text, key=key, value=value)
    if len(t) < 2:
        raise InputError("expected two times or more for a table of values", key="t_eval", value=t)
    values = array(value, key, f"expected {len(t)} finite values, one at each time", (len(t),))
    return table(t, values)


def as_signals(
    value: SignalLike | Sequence[SignalLike], joints: int, key: str, t: np.ndarray | None = None
) -> list[Signal | None]:
    """One Signal or function a joint.

    Args:
        value: one entry a joint, each as `as_signal` reads it; or values (T, joints) at the times
            `t`; of a robot with one joint also its entry alone.
        joints: how many the robot has.
        key: name of the argument, for the message.
        t: times (T,) [s].

    Returns:
        One entry a joint, None for a free one.

    Raises:
        InputError: another number of entries, or an entry that is nothing of this.
    """
    expected = f"expected {joints} entries, one a joint: numbers, Signals, functions of t or arrays"
    if isinstance(value, str | bytes | dict | set) or value is None:
        raise InputError(expected, key=key, value=value)
    if isinstance(value, Signal) or callable(value) or not np.iterable(value):
        entries: list[Any] = [value]
    elif isinstance(value, np.ndarray) and value.ndim == 2:
        entries = list(value.T) if t is not None and len(value) == len(t) else list(value)
    else:
        entries = list(value)
    if joints == 1 and t is not None and len(entries) == len(t) > 1 and not _has_entries(entries):
        entries = [entries]
    if len(entries) != joints:
        raise InputError(expected, key=key, value=len(entries))
    return [as_signal(entry, f"{key}[{i}]", t) for i, entry in enumerate(entries, 1)]


def _function_spec(function: Callable[..., Any]) -> dict[str, Any]:
    return {"kind": "function", "name": getattr(function, "__name__", type(function).__name__)}


def _has_entries(value: Any) -> bool:
    return any(isinstance(x, Signal) or callable(x) or np.iterable(x) for x in value)


def spline(signal: FunctionSignal, start: float, end: float) -> Signal:
    """A function of time as a spline of fifth order.

    As many equally spaced values are taken as the spline needs to meet the function between them.
    Where its acceleration jumps, the spline rounds the jump over a few thousandths of the time.

    Args:
        signal: the function.
        start: begin of the spline [s].
        end: end of the spline [s].

    Returns:
        The Signal.

    Raises:
        InputError: a value is no finite number; its position or velocity jumps.
    """
    from scipy.interpolate import PPoly, make_interp_spline

    if not end > start:
        return constant(signal.value(start))
    for count in SAMPLES:
        t = np.linspace(start, end, count)
        y = np.array([signal.value(float(at)) for at in t])
        made = make_interp_spline(t, y, k=5)
        middles = (t[:-1] + t[1:]) / 2
        off = np.abs(made(middles) - [signal.value(float(at)) for at in middles])
        size = max(float(np.ptp(y)), 1e-12 * float(np.abs(y).max()), 1e-300)
        if off.max() <= GOOD * size:
            break
    if off.max() > POOR * size:
        at = float(middles[int(np.argmax(off))])
        raise InputError(
            f"expected a motion without jumps in position and velocity; this function has one near "
            f"t = {at:.4g} s: {WHAT_TO_DO}",
            key=signal.key,
        )
    pieces = PPoly.from_spline(made)
    rows = [
        [float(a), *map(float, c[::-1]), 0.0, 0.0, 0.0]
        for a, b, c in zip(pieces.x[:-1], pieces.x[1:], pieces.c.T, strict=True)
        if b > a
    ]
    return Signal(np.array(rows), signal.spec)


WHAT_TO_DO = "end the run there, or round it (signals.trapezoidal, polynomial, cycloid)"
