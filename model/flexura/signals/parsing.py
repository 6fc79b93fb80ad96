"""Signals from the tables of manoeuvre and controller files."""

from __future__ import annotations

import inspect
import math
from typing import Any

import numpy as np

from ..errors import InputError
from . import composite, kinds, shaping
from .signal import Signal

# what a table of a signal may be, by its kind
KINDS = kinds.KINDS | shaping.KINDS | composite.KINDS


def from_spec(spec: object, *, key: str = "signal") -> Signal:
    """A signal from its table, for example `{ kind = "cycloid", end = 1.0, duration_s = 0.5 }`.

    Args:
        spec: the table, or a number for a constant.
        key: its name, for messages.

    Returns:
        The Signal.

    Raises:
        InputError: an unknown kind or key, or a wrong value.
    """
    if is_plausible(spec):
        spec = {"kind": "constant", "value": spec}
    if not isinstance(spec, dict):
        expected = f"expected a number, or a table with kind, one of {', '.join(KINDS)}"
        raise InputError(expected, key=key, value=spec)
    kind = spec.get("kind")
    if not isinstance(kind, str) or kind not in KINDS:
        missing = "missing: " if kind is None else ""
        raise InputError(
            f"{missing}expected one of {', '.join(KINDS)}", key=f"{key}.kind", value=kind
        )
    known = inspect.signature(KINDS[kind]).parameters
    for name, value in spec.items():
        if name != "kind" and name not in known:
            raise InputError(
                f"an unknown key; known for {kind}: {', '.join(known)}",
                key=f"{key}.{name}",
                value=value,
            )
    given: dict[str, Any] = {}
    for name, parameter in known.items():
        expected, good = _FORMS[str(parameter.annotation)]
        if name in spec:
            value = spec[name]
            if not good(value):
                raise InputError(f"expected {expected}", key=f"{key}.{name}", value=value)
            if str(parameter.annotation) == "Sequence[Signal]":
                own = enumerate(value, 1)
                given[name] = [from_spec(each, key=f"{key}.{name}[{i}]") for i, each in own]
            else:
                given[name] = (
                    from_spec(value, key=f"{key}.{name}") if isinstance(value, dict) else value
                )
        elif parameter.default is parameter.empty:
            raise InputError(f"missing: expected {expected}", key=f"{key}.{name}")
    try:
        with np.errstate(all="ignore"):
            return KINDS[kind](**given)
    except InputError as error:
        raise InputError(error.expected, key=f"{key}.{error.key}", value=error.value) from None
    except (
        ArithmeticError,
        ValueError,
    ):  # numbers near the ends of the range, in scipy's spline too
        raise InputError(
            "expected numbers whose derivatives are finite", key=f"{key}.kind", value=kind
        ) from None


MOST = 1e12  # of a number of a manoeuvre or gains file, in its own unit: beyond is a slip
PLAUSIBLE = "a finite number between -1e12 and 1e12"


def is_plausible(value: object) -> bool:
    """Whether a value is a finite number as files have them, at most `MOST` in size.

    Args:
        value: the value.

    Returns:
        True for an int or a float, not for a bool.
    """
    return isinstance(value, int | float) and is_finite(value) and abs(value) <= MOST


def is_finite(value: object) -> bool:
    """Whether a value is a finite number, as read from a file.

    Args:
        value: the value.

    Returns:
        True for an int or a finite float, not for a bool.
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number that no float can hold
        return False


def _numbers(value: Any) -> bool:
    return isinstance(value, list) and all(map(is_plausible, value))


_FORMS = {  # what a key takes, by the annotation of the parameter of its name
    "float": (PLAUSIBLE, is_plausible),
    "int": ("a whole number", lambda value: isinstance(value, int) and not isinstance(value, bool)),
    "ArrayLike": ("a list of finite numbers between -1e12 and 1e12", _numbers),
    "Sequence[Signal]": ("a list of tables of signals", lambda value: isinstance(value, list)),
    "Signal": ("a table of a signal, with its kind", lambda value: isinstance(value, dict)),
}
