"""Types of the fields of protocol.toml, in C++, in Python's struct module, in bytes."""

from __future__ import annotations

from typing import Any

from pins import Mistake

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


def split(kind: str) -> tuple[str, int]:
    """'i16[4]' -> ('i16', 4); 'u8' -> ('u8', 1)."""
    name, _, length = kind.partition("[")
    if name not in TYPES or (length and not length.endswith("]")):
        raise Mistake(
            f"type {kind!r}: expected one of {', '.join(TYPES)}, with [length] for several"
        )
    return name, int(length.rstrip("]") or 1)


def struct_format(message: dict[str, Any]) -> str:
    """The fields as a format of the struct module."""
    counts = [
        (TYPES[name][1], n) for name, n in (split(field["type"]) for field in message["fields"])
    ]
    return "<" + "".join(f"{n}{letter}" if n > 1 else letter for letter, n in counts)


def camel(name: str) -> str:
    """config_read -> ConfigRead."""
    return "".join(part.capitalize() for part in name.split("_"))
