"""Types of the fields of protocol.toml, in C++, in Python's struct module, in bytes."""

from __future__ import annotations

import math
from typing import Any

from pins import ONE_LINE, Mistake, is_text

ENUMERATIONS = {
    "states": "State",
    "modes": "Mode",
    "faults": "Fault",
    "results": "Result",
    "flags": "Flag",
    "resets": "Reset",
    "stop_trials": "StopTrial",
}
TYPES = {
    "u8": ("uint8_t", "B"),
    "u16": ("uint16_t", "H"),
    "u32": ("uint32_t", "I"),
    "i16": ("int16_t", "h"),
    "i32": ("int32_t", "i"),
    "f32": ("float", "f"),
}


NUMBER, WHOLE, TEXT = "a finite number", "a whole number", ONE_LINE
TABLE, LIST = "a table", "a list of tables"
# what each entry of a table has
ENTRIES = {
    **{key: {"code": WHOLE, "text": TEXT} for key in ENUMERATIONS},
    "faults": {"code": WHOLE, "text": TEXT, "remedy": TEXT},
    "config": {"default": NUMBER, "min": NUMBER, "max": NUMBER, "text": TEXT},
}
FITS = {
    NUMBER: lambda value: type(value) in (int, float) and math.isfinite(value),
    WHOLE: lambda value: type(value) is int,
    TEXT: is_text,
    TABLE: lambda value: isinstance(value, dict),
    LIST: lambda value: isinstance(value, list) and all(isinstance(entry, dict) for entry in value),
}


def check_shape(declared: dict[str, Any]) -> None:
    """Every table, list, number and text is one, and all are there. Raises Mistake."""
    _check("", declared, {"name": TEXT, "version": WHOLE, "message": LIST})
    _check("", declared, dict.fromkeys(("constants", "pins", *ENTRIES), TABLE))
    _check("", declared, {"second_motor": TABLE}, needed=False)
    _check("constants", declared["constants"], dict.fromkeys(declared["constants"], WHOLE))
    for key, kinds in ENTRIES.items():
        _check(key, declared[key], dict.fromkeys(declared[key], TABLE))
        for name, entry in declared[key].items():
            _check(f"{key}.{name}", entry, kinds)
    for i, message in enumerate(declared["message"], 1):
        where = f"message[{i}]"
        _check(where, message, {"name": TEXT, "code": WHOLE, "text": TEXT, "fields": LIST})
        _check_name(where, message["name"])
        for j, field in enumerate(message["fields"], 1):
            where = f"message {message['name']!r}: fields[{j}]"
            _check(where, field, {"name": TEXT, "type": TEXT})
            _check(where, field, {"unit": TEXT, "text": TEXT}, needed=False)
            _check_name(where, field["name"])


def _check(where: str, table: dict[str, Any], kinds: dict[str, str], needed: bool = True) -> None:
    for key, kind in kinds.items():
        place = f"{where}.{key}" if where else key
        if key not in table:
            if needed:
                raise Mistake(f"{place}: missing; expected {kind}")
            continue
        if kind == TABLE or where == "constants":
            _check_name(place, key)
        if not FITS[kind](table[key]):
            raise Mistake(f"{place} = {_shown(table[key])}: expected {kind}")


def _check_name(where: str, name: str) -> None:
    if not (name.isidentifier() and name.isascii()):
        raise Mistake(f"{where}: the name {name!r}: expected letters, digits and underlines")


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def split(kind: str) -> tuple[str, int]:
    """'i16[4]' -> ('i16', 4); 'u8' -> ('u8', 1)."""
    name, _, length = kind.partition("[")
    count = length.removesuffix("]")
    if name not in TYPES or (length and not (length.endswith("]") and count.isdecimal())):
        raise Mistake(
            f"type {kind!r}: expected one of {', '.join(TYPES)}, with [length] for several"
        )
    return name, int(count or 1)


def struct_format(message: dict[str, Any]) -> str:
    """The fields as a format of the struct module."""
    counts = [
        (TYPES[name][1], n) for name, n in (split(field["type"]) for field in message["fields"])
    ]
    return "<" + "".join(f"{n}{letter}" if n > 1 else letter for letter, n in counts)


def camel(name: str) -> str:
    """config_read -> ConfigRead."""
    return "".join(part.capitalize() for part in name.split("_"))
