"""The errors of flexura: of bad input, which names the file, the key, the value and what was
expected, and of numbers that fail."""

from __future__ import annotations

import functools
import mmap
import sys
import traceback
from collections.abc import Callable
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")
LIBRARIES = frozenset({"numpy", "scipy", "exudyn"})
OURS = LIBRARIES | {"flexura", "flexlab"}


class FlexuraError(Exception):
    """Something the user can put right; the command prints it as one line and exits with status
    2."""


class InputError(FlexuraError):
    """A wrong value in a file or an argument.

    Attributes:
        file: name of the file; may be "".
        key: of the value.
        value: as read.
        expected: in words, with the unit.
    """

    def __init__(
        self, expected: str, *, key: str = "", value: object = None, file: str = "", more: int = 0
    ) -> None:
        self.file, self.key, self.value, self.expected = file, key, value, expected
        where = f"{file}: " if file else ""
        shown = "" if value is None else f" = {_short(value)}"
        tail = f" (and {more} more wrong {'value' if more == 1 else 'values'})" if more else ""
        super().__init__(
            _one_line(f"{where}{_cut(key, 200)}{shown}{': ' if key else ''}{expected}{tail}")
        )

    def in_file(self, file: str) -> InputError:
        """The same error, with the file's name.

        Args:
            file: name of the file.

        Returns:
            The error to raise.
        """
        return InputError(self.expected, key=self.key, value=self.value, file=file)


class OutOfMemory(FlexuraError, MemoryError):
    """There is less memory than an array or the core asks for."""


def within_memory(function: Callable[P, T]) -> Callable[P, T]:
    """A function whose MemoryError, from whatever library, is OutOfMemory with its size."""

    @functools.wraps(function)
    def guarded(*arguments: P.args, **options: P.kwargs) -> T:
        try:
            return function(*arguments, **options)
        except MemoryError as error:
            raise out_of_memory(error) from None

    return guarded


def out_of_memory(error: MemoryError) -> OutOfMemory:
    """The error that says what did not fit: NumPy and Arrow tell the size."""
    if isinstance(error, OutOfMemory):
        return error
    size = str(error).replace("std::bad_alloc", "").replace("bad allocation", "")
    what = f" ({size})" if size else " (a small piece more was refused)"
    return OutOfMemory(
        _one_line(
            f"not enough memory{what}: ask for fewer samples, elements or robots at once, or give "
            "the process more"
        )
    )


def room_for(size: int, what: str) -> None:
    """Ask for memory and give it back, before what would not survive that there is none.

    Args:
        size: bytes.
        what: they are for.

    Raises:
        MemoryError: there is not enough.
    """
    try:
        mmap.mmap(-1, size).close()
    except OSError:
        raise MemoryError(f"{size / 1e6:.0f} MB for {what}") from None


class WrongValue(ValueError):
    """A wrong value found by a check across several keys of one table; `key` is relative to that
    table."""

    def __init__(self, key: str, value: object, expected: str) -> None:
        self.key, self.value, self.expected = key, value, expected
        super().__init__(expected)


def _short(value: object) -> str:
    try:
        return _cut(repr(value).replace("\n", " "), 60)
    except (
        ValueError,
        RecursionError,
    ):  # a number of thousands of digits, tables in tables without end
        return f"(a very long {type(value).__name__})"


def _cut(text: str, limit: int) -> str:
    return text if len(text) <= limit else text[: limit - 3] + "..."


def _one_line(text: str) -> str:
    """Line ends and what no terminal shows, from a key or a file's name, as escapes."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


class NumericalError(FlexuraError):
    """A calculation failed in its numbers: what was computed, why it failed, and what to try."""


def guarded(what: str) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """A function whose numerical failures are `NumericalError`s.

    Args:
        what: the function computes, as the message says it: "the natural frequencies".

    Returns:
        A decorator. Failures of the caller's own code, as of a drive function, pass unchanged.
    """

    def decorated(function: Callable[P, T]) -> Callable[P, T]:
        @functools.wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> T:
            try:
                return function(*args, **kwargs)
            except FlexuraError:
                raise
            except MemoryError as error:
                raise out_of_memory(error) from None
            except Exception as error:
                why = numerical_failure(error)
                if why is None:
                    raise
                raise NumericalError(f"{what} cannot be computed: {why}") from error

        return call

    return decorated


def numerical_failure(error: BaseException) -> str | None:
    """Why numbers failed, in words, if that is what an exception says; None for any other.

    What passes through a module that is neither of this project nor of a library that it calls is
    the caller's own failure.
    """
    frames = [f.f_globals.get("__name__", "") for f, _ in traceback.walk_tb(error.__traceback__)]
    homes = [name.partition(".")[0] for name in frames]
    if not all(home in OURS or home in sys.stdlib_module_names - {"__main__"} for home in homes):
        return None
    kind = type(error).__name__
    if kind == "LinAlgError":
        return (
            f"its equations are singular or not finite ({error}); look for masses, lengths or "
            "stiffnesses that are many orders of magnitude apart"
        )
    in_library = bool(homes) and homes[-1] in LIBRARIES
    if (
        isinstance(error, ArithmeticError)
        or kind.startswith("Arpack")
        or (isinstance(error, ValueError) and in_library)
    ):
        return (
            f"its numbers are too large, too small or not finite ({error}); look for values that "
            "are many orders of magnitude apart"
        )
    if type(error) is RuntimeError and (in_library or homes[-1:] == ["flexura"]):
        return str(error) or "the compiled core failed"
    return None
