"""Tables with some values changed, by keys as link.2.length_m whose numbers count from 1."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel

from ..errors import InputError
from .toml_files import Tables


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
    if not (part.isascii() and part.isdigit() and 1 <= int(part[:9]) <= len(table)):
        raise InputError(
            f"expected a number from 1 to {len(table)}, not {part!r}", key=path, value=value
        )
    return int(part) - 1
