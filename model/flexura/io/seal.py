"""Seals: a digest of all bytes of a file, in the file, so that damage is never read as numbers.

A seal is a text of 90 bytes: a mark, the SHA-256 of all other bytes in hexadecimal digits, and a
mark again. It stands where the format's other readers do not look. In Parquet that is before the
footer, in JSON it is the value of the key `seal`, elsewhere it is the end. There are two marks, so
that a damaged one does not make the file pass for one that never had a seal.
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
from pathlib import Path
from typing import Any

from ..errors import InputError, room_for

BEGIN, END = b"flexura-seal:", b":flexura-seal"
DIGITS = 64
SIZE = len(BEGIN) + DIGITS + len(END)
KEY = "seal"
LARGE = 10_000_000  # bytes
ARROW = 16 << 20  # bytes that Arrow takes at most for itself
FOOTER = 8  # of Parquet: the size of its metadata, and PAR1

_log = logging.getLogger("flexura")


class Damaged(InputError):
    """A file whose bytes are not those that were written."""


def sealed(data: bytes, at: int | None = None) -> bytes:
    """Put a seal into a file's content.

    Args:
        data: the content.
        at: where; by default at the end.

    Returns:
        The sealed content.
    """
    at = len(data) if at is None else at
    digest = hashlib.sha256(data).hexdigest().encode()
    return data[:at] + BEGIN + digest + END + data[at:]


def sealed_parquet(data: bytes) -> bytes:
    """Seal a Parquet file before its footer, where no reader of Parquet looks.

    Args:
        data: the content of the file.

    Returns:
        The sealed content.
    """
    return sealed(data, len(data) - FOOTER - int.from_bytes(data[-FOOTER:-4], "little"))


def sealed_json(table: dict[str, Any], indent: int | None = None) -> bytes:
    """A table as sealed JSON: its first key is `seal`.

    Args:
        table: the table.
        indent: as in `json.dumps`.

    Returns:
        The content of the file.
    """
    text = json.dumps({KEY: ""} | table, indent=indent).encode()
    return sealed(text, text.index(b'""') + 1)


def read_sealed(
    path: str | os.PathLike[str], advice: str, damaged: str = "damaged"
) -> tuple[bytes, bool]:
    """The content of a file that is trusted: every byte is as it was written.

    Args:
        path: the file.
        advice: what to do with a damaged one, as "restore a copy".
        damaged: what is damaged, as "a damaged run".

    Returns:
        The content without its seal, Parquet as it is; and whether there was a seal. Files of
        older versions have none: see `say_unsealed`.

    Raises:
        Damaged: a byte differs.
        OSError: it cannot be read.
    """
    data = Path(path).read_bytes()
    places = _places(data)
    for at in places:
        rest = data[:at] + data[at + SIZE :]
        if data[at : at + SIZE] == BEGIN + hashlib.sha256(rest).hexdigest().encode() + END:
            return (data if data[:4] == b"PAR1" else rest), True
    if places:
        text = f"{damaged}: its bytes do not fit its checksum; {advice}"
        raise Damaged(text, file=os.fspath(path))
    return data, False


def read_sealed_json(
    path: str | os.PathLike[str], advice: str, damaged: str = "damaged"
) -> tuple[Any, bool]:
    """What a JSON file holds, without its seal; see `read_sealed`.

    Args:
        path: of the file.
        advice: what to do about a damaged file, for the message.
        damaged: what is said of a damaged file.

    Returns:
        The table, and whether there was a seal.

    Raises:
        Damaged: a byte differs.
        OSError: it cannot be read.
        ValueError: it is no JSON.
        RecursionError: it is nested too deeply.
    """
    content, there = read_sealed(path, advice, damaged)
    found = json.loads(content)
    if isinstance(found, dict):
        found.pop(KEY, None)
    return found, there


def room_for_arrow(size: int = 0) -> None:
    """Ask for memory before Arrow does: where a small piece is refused, Arrow ends the process or
    waits for ever.

    Args:
        size: bytes of the table.

    Raises:
        MemoryError: there is not enough.
    """
    room_for(ARROW + size, "Parquet")  # by mmap, as Arrow's own pool does, beside that of C


def read_table(content: bytes) -> Any:
    """The table of a Parquet file's content.

    Small ones are read without threads: Arrow ends the process if there is no memory for one.

    Args:
        content: of the file.

    Returns:
        Arrow's table.

    Raises:
        pyarrow.ArrowException, OSError, ValueError: it is no Parquet file.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    room_for_arrow(len(content))
    large = len(content) > LARGE
    file = pq.ParquetFile(
        pa.BufferReader(content), pre_buffer=large, page_checksum_verification=True
    )
    return file.read(use_threads=large)


def say_unsealed(path: str | os.PathLike[str]) -> None:
    """Say in one line, by the logger "flexura", that a file has no seal.

    Args:
        path: of the file.
    """
    _log.warning("%s: of an older version, without a checksum: damage is not seen", path)


def _places(data: bytes) -> list[int]:
    """Where seals may begin: at each first mark, and before each second one."""
    found = set()
    for mark, offset in ((BEGIN, 0), (END, -len(BEGIN) - DIGITS)):
        at = data.find(mark)
        while at >= 0:
            found.add(max(at + offset, 0))
            at = data.find(mark, at + 1)
    return sorted(found)
