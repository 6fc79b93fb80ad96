"""Numbers that callers give as arguments: read as floats, or refused by the argument's name."""

from __future__ import annotations

import functools
import inspect
import math
import os
from collections.abc import Callable, Sequence
from typing import Any, ParamSpec, TypeVar

import numpy as np

from ..errors import InputError

MOST = 10**9  # a whole number beyond is a slip
P = ParamSpec("P")
T = TypeVar("T")


def number(value: Any, key: str, expected: str = "expected a finite number") -> float:
    """A finite number as a float.

    Args:
        value: what was given.
        key: name of the argument.
        expected: what is said of a wrong value.

    Returns:
        The number.

    Raises:
        InputError: it is a text, a bool, an array, or not finite.
    """
    if isinstance(value, bool | np.bool_ | str | bytes | list | tuple | dict | set):
        raise InputError(expected, key=key, value=value)
    if isinstance(value, np.ndarray) and value.ndim:
        raise InputError(expected, key=key, value=value)
    try:
        found = float(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError(expected, key=key, value=value) from None
    if not math.isfinite(found):
        raise InputError(expected, key=key, value=value)
    return found


MOST_HZ = 1e6  # ticks a second: beyond, a run of seconds would not end


def tick_rate(value: Any) -> float:
    """A rate of ticks, `rate_Hz`, as a float.

    Args:
        value: what was given.

    Returns:
        The rate [Hz].

    Raises:
        InputError: it is no number above 0 and up to 1e6.
    """
    expected = "expected a rate above 0 and up to 1e6 in hertz"
    rate = number(value, "rate_Hz", expected)
    if not 0 < rate <= MOST_HZ:
        raise InputError(expected, key="rate_Hz", value=value)
    return rate


def array(
    value: Any, key: str, expected: str, shape: tuple[int | None, ...] | None = None
) -> np.ndarray:
    """A new array of finite floats.

    Args:
        value: what was given.
        key: name of the argument.
        expected: what is said of a wrong value.
        shape: the lengths that it must have, None for any length or, in place of the tuple, for any
            shape.

    Returns:
        The array.

    Raises:
        InputError: it is no array of finite numbers of this shape.
    """
    try:
        found = np.asarray(value)
        good = found.dtype.kind in "iuf" or (found.dtype.kind == "O" and not _texts(found))
        out = np.array(found, dtype=float) if good else None
    except (TypeError, ValueError, OverflowError):
        out = None
    if out is None or not np.all(np.isfinite(out)) or not _fits(out.shape, shape):
        raise InputError(expected, key=key, value=value)
    return out


def whole(value: Any, key: str, least: int, expected: str = "") -> int:
    """A whole number that is not too small.

    Args:
        value: what was given.
        key: name of the argument.
        least: the smallest number that is good.
        expected: what is said of a wrong value.

    Returns:
        The number.

    Raises:
        InputError: it is none.
    """
    expected = expected or f"expected a whole number, {least} or more"
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise InputError(expected, key=key, value=value)
    if not least <= value <= MOST:
        raise InputError(expected, key=key, value=value)
    return int(value)


def choice(value: Any, key: str, known: Sequence[str]) -> str:
    """One of the known words.

    Args:
        value: what was given.
        key: name of the argument.
        known: the words.

    Returns:
        The word.

    Raises:
        InputError: it is none of them.
    """
    if not isinstance(value, str) or value not in known:
        words = [f'"{word}"' for word in known]
        text = " or ".join(words) if len(words) < 3 else f"one of {', '.join(known)}"
        raise InputError(f"expected {text}", key=key, value=value)
    return value


def flag(value: Any, key: str) -> bool:
    """True or False.

    Args:
        value: what was given.
        key: name of the argument.

    Returns:
        The bool.

    Raises:
        InputError: it is neither.
    """
    if not isinstance(value, bool | np.bool_):
        raise InputError("expected True or False", key=key, value=value)
    return bool(value)


def function_of(value: Any, key: str, counts: Sequence[int], expected: str) -> Any:
    """A function that can be called with one of so many arguments.

    Args:
        value: what was given.
        key: name of the argument.
        counts: of positional arguments.
        expected: what is said of a wrong value.

    Returns:
        The function.

    Raises:
        InputError: it is none.
    """
    if not callable(value) or not any(takes(value, count) for count in counts):
        raise InputError(expected, key=key, value=value)
    return value


def takes(function: Any, count: int) -> bool:
    """Whether a function can be called with so many arguments.

    Args:
        function: the function.
        count: number of positional arguments.

    Returns:
        True if it can, as far as its signature says.
    """
    try:
        inspect.signature(function).bind(*[0.0] * count)
    except TypeError:
        return False
    except ValueError:  # a builtin without a signature
        return True
    return True


def check_progress(progress: Any) -> None:
    """Refuse what cannot show progress.

    Args:
        progress: what was given.

    Raises:
        InputError: it is neither None nor a function of the finished fraction.
    """
    if progress is not None:
        function_of(progress, "progress", (1,), "expected a function of the finished fraction")


def finite_arguments(function: Callable[P, T]) -> Callable[P, T]:
    """Check the arguments of a function that are annotated `float` or `int`.

    Args:
        function: the function.

    Returns:
        The function; it raises InputError, by the argument's name, for what is no finite number.

    Raises:
        InputError: raised by the returned function only.
    """
    signature = inspect.signature(function)
    kinds = {name: str(p.annotation) for name, p in signature.parameters.items()}
    whole = [name for name, kind in kinds.items() if kind == "int"]
    real = [name for name, kind in kinds.items() if kind == "float"]

    @functools.wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> T:
        given = signature.bind(*args, **kwargs)
        for name in real:
            if name in given.arguments:
                value = given.arguments[name]
                found = number(value, name)
                given.arguments[name] = value if isinstance(value, int | float) else found
        for name in whole:
            if name in given.arguments:
                value = number(given.arguments[name], name, "expected a whole number")
                if value != round(value):
                    raise InputError("expected a whole number", key=name, value=value)
                given.arguments[name] = int(value)
        return function(*given.args, **given.kwargs)

    return checked


def available_memory() -> int:
    """The memory [bytes] that this process can still take: the system's, and its own limit."""
    found = [2**62]
    try:
        with open("/proc/meminfo", encoding="ascii") as stream:
            found += [
                int(line.split()[1]) * 1024 for line in stream if line[:13] == "MemAvailable:"
            ]
    except OSError:
        if hasattr(os, "sysconf") and "SC_PHYS_PAGES" in os.sysconf_names:
            found.append(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    try:
        import resource

        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit != resource.RLIM_INFINITY:
            with open("/proc/self/statm", encoding="ascii") as stream:
                taken = int(stream.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
            found.append(max(limit - taken, 0))
    except (ImportError, OSError):  # no limit is known
        pass
    return min(found)


def check_memory(needed: float, what: str, key: str, value: object) -> None:
    """Refuse what does not fit.

    Args:
        needed: bytes.
        what: they are for, and what to do, as the message says it.
        key: the argument that is too large.
        value: of it.

    Raises:
        InputError: there is less memory than needed.
    """
    there = available_memory()
    if needed > there:
        raise InputError(
            f"expected what fits into memory: {what}; it would take {needed / 1e9:.3g} GB, and "
            f"{there / 1e9:.3g} GB are there",
            key=key,
            value=value,
        )


def _texts(found: np.ndarray) -> bool:
    return any(isinstance(x, str | bytes | bool | type(None)) for x in found.flat)


def _fits(shape: tuple[int, ...], asked: tuple[int | None, ...] | None) -> bool:
    if asked is None:
        return True
    return len(shape) == len(asked) and all(
        want in (None, has) for has, want in zip(shape, asked, strict=True)
    )
