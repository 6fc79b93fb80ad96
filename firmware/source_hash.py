"""The firmware's hash: of all that the program is compiled from, the pins with it."""

from __future__ import annotations

import hashlib
from pathlib import Path

FIRMWARE = Path(__file__).resolve().parent
SOURCES = ("src", "lib", "platformio.ini", "flags.py")


def source_hash(firmware: Path = FIRMWARE) -> int:
    """32 bits of the SHA-256 over names and contents of the sources; never 0, which means none."""
    out = hashlib.sha256()
    files = [
        path
        for name in SOURCES
        for path in (firmware / name, *(firmware / name).rglob("*"))
        if path.is_file()
    ]
    for path in sorted(files):
        out.update(path.relative_to(firmware).as_posix().encode() + b"\0")
        out.update(path.read_bytes() + b"\0")
    return int.from_bytes(out.digest()[:4], "little") or 1
