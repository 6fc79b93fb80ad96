"""What is wrong with the tables of a file, in plain words: key, value, what was expected."""

from __future__ import annotations

import difflib
import unicodedata
from collections.abc import Iterable, Mapping
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from ..errors import InputError, WrongValue

FORMAT = 1  # of the project's files, the one that is written
MOST_LETTERS = 200
MOST_MEANT = 5  # keys that a message suggests


def is_name(value: Any) -> bool:
    """Whether a value is a name.

    Args:
        value: what was given.

    Returns:
        True for a text of one line, not too long, without control characters.
    """
    if not isinstance(value, str) or len(value) > MOST_LETTERS:
        return False
    kinds = map(unicodedata.category, value)
    return not any(kind.startswith("C") or kind in ("Zl", "Zp") for kind in kinds)


# what else the field calls a key
SYNONYMS = {
    "zeta": "ratio",
    "xi": "ratio",
    "E": "young_modulus_Pa",
    "EI": "bending_stiffness_N_m2",
    "rho": "density_kg_m3",
}


def meant(key: str, known: Iterable[str]) -> str:
    """The keys that a wrong one may stand for.

    Args:
        key: as it was given.
        known: those that its table may have.

    Returns:
        A synonym, else all that begin with it, else the one whose spelling is nearest, for example
        "kp_1_V_m or kp_1_N_m"; "" where there is none.
    """
    names = list(known)
    if SYNONYMS.get(key) in names:
        return SYNONYMS[key]
    for begin in (f"{key}_", key) if key else ():
        longer = [name for name in names if name.startswith(begin)]
        if 1 <= len(longer) <= MOST_MEANT:
            return " or ".join(longer)
    return " ".join(difflib.get_close_matches(key, names, 1, 0.6))


def explain(
    error: ValidationError, model: type[BaseModel], data: Any, file: str = ""
) -> InputError:
    """The first problem that pydantic found, as an InputError.

    Args:
        error: of pydantic.
        model: what was to be read.
        data: from what.
        file: its name, for the message.

    Returns:
        The error to raise; its keys are counted from 1, as in `link[2].length_m`.
    """
    problems = [
        problem for problem in error.errors() if _fits(problem["loc"], data)
    ] or error.errors()
    first = _misspelt(problems) or problems[0]
    table: type[BaseModel] | None = model
    keys: list[str] = []
    expected, value, found = "", data, True
    for part in first["loc"]:
        if isinstance(part, int):
            keys[-1] += f"[{part + 1}]"
        elif table is not None and part in table.model_fields:
            field = table.model_fields[part]
            keys.append(part)
            expected = field.description or expected
            table = _table_inside(field.annotation, value, part)
        elif first["type"] == "extra_forbidden" and part == first["loc"][-1]:
            keys.append(str(part) or '""')
        else:
            continue  # a branch of a union, not a key
        try:
            value = value[part]
        except (KeyError, IndexError, TypeError):
            value, found = None, False
    more = len(problems) - 1
    wrong = (first.get("ctx") or {}).get("error")
    if isinstance(wrong, WrongValue):
        tail = wrong.key.split(".")
        path = keys[:-1] if keys and keys[-1] == tail[0] else keys
        return InputError(
            _worded(wrong.expected),
            key=".".join(path + tail),
            value=wrong.value,
            file=file,
            more=more,
        )
    key = ".".join(keys) or "the file"
    if first["type"] == "extra_forbidden":
        given = _at(data, first["loc"][:-1])
        known = getattr(table, "keys_beside", lambda _: table.model_fields if table else [])(given)
        near = meant(keys[-1], known)
        hint = f"did you mean {near}?" if near else f"known here: {', '.join(known)}"
        if near in given:
            hint += " It is there too"
        return InputError(f"an unknown key; {hint}", key=key, value=value, file=file, more=more)
    if first["type"] == "missing":
        return InputError(f"missing: expected {expected}", key=key, file=file, more=more)
    if first["type"] == "too_long" and isinstance(value, list) and isinstance(value[0], dict):
        value = len(value)
    return InputError(
        _worded(expected or first["msg"]),
        key=key,
        value=value if found else None,
        file=file,
        more=more,
    )


def _worded(expected: str) -> str:
    return expected if expected.startswith("missing") else f"expected {expected}"


def _misspelt(problems: list[Any]) -> Any:
    """A missing key may be there under a wrong name, which is then the better thing to say."""
    if problems[0]["type"] != "missing":
        return None
    return next(
        (
            p
            for p in problems
            if p["type"] == "extra_forbidden" and p["loc"][:-1] == problems[0]["loc"][:-1]
        ),
        None,
    )


def _at(data: Any, loc: tuple[int | str, ...]) -> Mapping[str, Any]:
    """The table at a place, without the names of a union's branches, which are no keys."""
    for part in loc:
        try:
            data = data[part]
        except (KeyError, IndexError, TypeError):
            continue
    return data if isinstance(data, Mapping) else {}


def _fits(loc: tuple[int | str, ...], value: Any) -> bool:
    """Where a key takes a list or something else, Pydantic says what is wrong for both: is this
    about the one that was given?"""
    for part in loc:
        if isinstance(part, str) and part.startswith("list["):
            if not isinstance(value, list):
                return False
            continue
        if isinstance(part, str) and isinstance(value, list):
            return False
        try:
            value = value[part]
        except (KeyError, IndexError, TypeError):
            continue  # a missing key, or the name of a form
    return True


def _table_inside(annotation: Any, value: Any, part: Any) -> type[BaseModel] | None:
    """The model that describes a key's table, or the entries of its list."""
    tables = _tables(annotation)
    if len(tables) > 1:  # a table or a list of tables: look at what was given
        given = value.get(part) if isinstance(value, dict) else None
        return tables[-1] if isinstance(given, list) else tables[0]
    return tables[0] if tables else None


def _tables(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [table for arg in get_args(annotation) for table in _tables(arg)]


def check_format(tables: Mapping[str, Any], file: str = "") -> None:
    """Refuse tables of a format that is not known; an absent key is the present one.

    Args:
        tables: of the file.
        file: its name, for the message.

    Raises:
        InputError: not a whole number from 1 to `FORMAT`: a newer flexura wrote the file.
    """
    value = tables.get("format", FORMAT)
    if not isinstance(value, int) or isinstance(value, bool) or value < 1:
        expected = f"expected a whole number from 1 to {FORMAT}"
        raise InputError(expected, key="format", value=value, file=file)
    if value > FORMAT:
        newer = "a newer flexura wrote this file; type: pip install --upgrade flexura"
        raise InputError(
            f"{newer}; known here: up to {FORMAT}", key="format", value=value, file=file
        )
