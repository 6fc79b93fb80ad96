"""The one error that bad input raises: it names the file, the key, the value and what was expected."""

from __future__ import annotations


class FlexuraError(Exception):
    """Something the user can put right; the command prints it as one line and exits with status 2."""


class InputError(FlexuraError):
    """A wrong value in a file or an argument.

    Attributes: `file` (may be ""), `key`, `value` (as read), `expected` (in words, with the unit).
    """

    def __init__(self, expected: str, *, key: str = "", value: object = None, file: str = "", more: int = 0) -> None:
        self.file, self.key, self.value, self.expected = file, key, value, expected
        where = f"{file}: " if file else ""
        shown = "" if value is None else f" = {_short(value)}"
        tail = f" (and {more} more wrong {'value' if more == 1 else 'values'})" if more else ""
        super().__init__(f"{where}{key}{shown}{': ' if key else ''}{expected}{tail}")

    def in_file(self, file: str) -> InputError:
        """The same error, with the file's name."""
        return InputError(self.expected, key=self.key, value=self.value, file=file)


class WrongValue(ValueError):
    """A wrong value found by a check across several keys of one table; `key` is relative to that table."""

    def __init__(self, key: str, value: object, expected: str) -> None:
        self.key, self.value, self.expected = key, value, expected
        super().__init__(expected)


def _short(value: object, limit: int = 60) -> str:
    text = repr(value).replace("\n", " ")
    return text if len(text) <= limit else text[: limit - 3] + "..."
