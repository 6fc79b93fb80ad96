"""Messages as the protocol declares them, to payload bytes and back; telemetry as arrays."""

from __future__ import annotations

import re
import struct
from typing import Any

import numpy as np

from .declaration import MESSAGES, Message

BY_CODE = {message.code: message for message in MESSAGES.values()}
_HEAD = struct.Struct("<BH")  # code, sequence number
HEAD_BYTES = _HEAD.size


def pack(name: str, sequence: int, **values: Any) -> bytes:
    """The payload of a message; a field of several numbers takes a list, filled up with zeros.

    Raises ValueError for a field that is missing, unknown, too long or does not fit its type.
    """
    message = MESSAGES[name]
    if set(values) != {field.name for field in message.fields}:
        raise ValueError(
            f"{name}: expected the fields {', '.join(f.name for f in message.fields) or 'none'}, "
            f"not {list(values)}"
        )
    flat: list[Any] = []
    for field in message.fields:
        given = list(values[field.name]) if field.length > 1 else [values[field.name]]
        if len(given) > field.length:
            raise ValueError(
                f"{name}.{field.name}: at most {field.length} numbers, not {len(given)}"
            )
        flat += given + [0] * (field.length - len(given))
    try:
        return _HEAD.pack(message.code, sequence & 0xFFFF) + struct.pack(message.layout, *flat)
    except struct.error as error:
        raise ValueError(f"{name}: {error} in {values}") from None


def head(payload: bytes) -> tuple[int, int] | None:
    """(code, sequence number), or None for a payload that is too short."""
    return _HEAD.unpack_from(payload) if len(payload) >= _HEAD.size else None


def body(payload: bytes) -> bytes:
    """The payload of a frame without its head.

    Args:
        payload: the payload.

    Returns:
        The bytes of the message's fields.
    """
    return payload[_HEAD.size :]


def unpack(message: Message, data: bytes) -> dict[str, Any] | None:
    """The fields of a message's body, or None where the length is not the declared one."""
    if len(data) != struct.calcsize(message.layout):
        return None
    flat = list(struct.unpack(message.layout, data))
    out: dict[str, Any] = {}
    for field in message.fields:
        out[field.name] = (
            flat.pop(0) if field.length == 1 else [flat.pop(0) for _ in range(field.length)]
        )
    return out


def dtype(message: Message) -> np.dtype:
    """The packed layout of a message's body as a numpy record."""
    kinds = {"B": "u1", "H": "<u2", "I": "<u4", "h": "<i2", "i": "<i4", "f": "<f4"}
    letters = re.findall(r"(\d*)([a-zA-Z])", message.layout)
    return np.dtype(
        [
            (field.name, kinds[letter])
            if field.length == 1
            else (field.name, kinds[letter], (field.length,))
            for field, (_, letter) in zip(message.fields, letters, strict=True)
        ]
    )


TELEMETRY = dtype(MESSAGES["telemetry"])


def reports(bodies: list[bytes]) -> np.ndarray:
    """Telemetry as a record array, one entry a report, integers in the declared units: nothing is
    missing, nothing invented."""
    return np.frombuffer(b"".join(bodies), dtype=TELEMETRY)
