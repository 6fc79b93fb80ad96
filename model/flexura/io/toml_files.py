"""Reading and writing TOML files: one clear error for whatever is wrong with them, and never half a
file."""

from __future__ import annotations

import os
import re
import tomllib
from typing import Any, TypeAlias

from pydantic import BaseModel

from ..errors import InputError
from .files import check_suffix, write_text

# Of a TOML or JSON file: its values are what the file says, until they are checked.
Tables: TypeAlias = dict[str, Any]

MAX_BYTES = 10_000_000
# a.a.a.a...: tomllib's time and memory grow with the square
_TOO_DEEP = re.compile(r"""(?:\.[ \t]*[\w"'-]+[ \t]*){300}""")


def read_toml(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The tables of a TOML file.

    Args:
        path: of the file.

    Returns:
        The tables.

    Raises:
        InputError: it is not a readable TOML file.
    """
    if not isinstance(path, str | os.PathLike):
        raise InputError("expected the path of a TOML file", key="path", value=path)
    name = os.fspath(path)
    try:
        with open(path, "rb") as stream:
            raw = stream.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise InputError("no such file: expected the path of a TOML file", file=name) from None
    except IsADirectoryError:
        raise InputError("a directory: expected the path of a TOML file", file=name) from None
    except (OSError, ValueError) as error:
        raise InputError(
            f"cannot be read ({getattr(error, 'strerror', None) or error}): expected a TOML file",
            file=name,
        ) from None
    if len(raw) > MAX_BYTES:
        raise InputError(f"more than {MAX_BYTES // 10**6} MB: expected a TOML file", file=name)
    try:
        text = raw.decode("utf-8-sig")  # some editors begin a file with a byte order mark
    except UnicodeDecodeError as error:
        raise InputError(
            f"not a text (byte {error.start} is not UTF-8): expected a TOML file", file=name
        ) from None
    if _TOO_DEEP.search(text):
        raise InputError("not valid TOML (nested too deeply)", file=name)
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise InputError("not valid TOML (nested too deeply)", file=name) from None
    except ValueError as error:  # TOMLDecodeError, or a number of thousands of digits
        raise InputError(f"not valid TOML ({error})", file=name) from None


def write_toml(path: str | os.PathLike[str], data: dict[str, Any], *, new: bool = False) -> None:
    """Write tables as a TOML file, as a whole.

    Args:
        path: of the file.
        data: the tables.
        new: no file may be there.

    Raises:
        InputError: its name does not end with .toml, or it cannot be written.
    """
    import tomli_w

    check_suffix(path, ".toml", "path")
    write_text(path, tomli_w.dumps(data), new=new)


def changed(tables: Any, changes: Tables, where: str = "a robot file") -> dict[str, Any]:
    """Tables with some values changed: copies along the way; what does not change stays as it is.

    Args:
        tables: a table of tables, lists and values, or a model of one.
        changes: values by key.
        where: the place, for messages.

    Returns:
        The new table.

    Raises:
        InputError: a key leads nowhere.
    """
    copied = lambda table: dict(table.__dict__) if isinstance(table, BaseModel) else table.copy()
    out: dict[str, Any] = copied(tables)
    for path, value in changes.items():
        *parents, last = path.split(".")
        table: Any = out
        for part in parents:
            key: Any = index_of(table, part, path, value) if isinstance(table, list) else part
            inner = table[key] if isinstance(table, list) else table.get(key)
            inner = {} if inner is None else list(inner) if isinstance(inner, tuple) else inner
            if not isinstance(inner, dict | list | BaseModel):
                raise InputError(
                    f"expected a place in {where}; {part} isn't a table", key=path, value=value
                )
            table[key] = copied(inner)
            table = table[key]
        table[index_of(table, last, path, value) if isinstance(table, list) else last] = value
    return out


def index_of(table: list[Any] | tuple[Any, ...], part: str, path: str, value: Any = None) -> int:
    """The index of an entry of a list, from its number as people count.

    Args:
        table: the list.
        part: the number in the key.
        path: the key, for messages.
        value: that is put there, for messages.

    Returns:
        The index, from 0.

    Raises:
        InputError: there is no such entry.
    """
    if not table:
        text = "expected a key that leads somewhere: there are no entries to count here"
        raise InputError(text, key=path, value=value)
    if not (part.isascii() and part.isdigit() and 1 <= int(part[:9]) <= len(table)):
        raise InputError(
            f"expected a number from 1 to {len(table)}, not {part!r}", key=path, value=value
        )
    return int(part) - 1
