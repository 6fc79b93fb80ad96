"""A program for the ATmega2560, read from its ELF file: what its flash holds, and where its symbols
are. simavr reads such files too, and crashes with damaged ones and those of other machines.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flexura.errors import InputError

NEEDED = ("__ctors_end", "__data_load_start")  # around the code
FLASH_BYTES = 256 * 1024
# ELF32, little-endian: identification of 16 bytes, type, machine, version, entry, where program and
# section headers are, flags, sizes and numbers of both.
_HEADER = struct.Struct("<16sHHIIIIIHHHHHH")
_SEGMENT = struct.Struct("<IIIIIIII")
_SECTION = struct.Struct("<IIIIIIIIII")
_SYMBOL = struct.Struct("<IIIBBH")
_IDENTIFICATION = b"\x7fELF\x01\x01\x01"  # 32 bits, little-endian, version 1
_PROGRAM, _AVR, _AVR6 = 2, 83, 6
_LOADED, _SYMBOLS, _STRINGS = 1, 2, 3
_MACHINES = {3: "an x86", 40: "an ARM", 62: "an x86-64", 183: "an AArch64", 243: "a RISC-V"}


@dataclass(frozen=True)
class Program:
    """The flash from address 0 on, and addresses by symbol; those of data begin at 0x800000."""

    flash: bytes
    symbols: dict[str, int]


def read(path: Path) -> Program:
    """Read a program. Raises InputError, in one sentence, unless the file is whole and for this
    processor."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise _refused(path, error.strerror or str(error)) from None
    if len(data) < _HEADER.size or not data.startswith(_IDENTIFICATION):
        raise _refused(path, f"it is no ELF file of 32 bits{_machine_of(data)}")
    head = _HEADER.unpack_from(data)
    kind, machine, flags = head[1], head[2], head[7]
    if machine != _AVR:
        raise _refused(path, f"it is for {_MACHINES.get(machine, f'machine {machine}')}")
    if flags & 0x7F != _AVR6:
        raise _refused(path, f"it is for another AVR (architecture {flags & 0x7F}, not {_AVR6})")
    if kind != _PROGRAM:
        raise _refused(path, "it is no program: it was not linked")
    try:
        segments = _table(data, _SEGMENT, head[5], head[9], head[10])
        sections = _table(data, _SECTION, head[6], head[11], head[12])
        found = Program(_flash(data, segments), _symbols(data, sections))
    except _Damaged as damaged:
        raise _refused(path, f"it is damaged: {damaged}") from None
    for name in NEEDED:
        if name not in found.symbols:
            raise _refused(path, f"it has no symbol {name}: was it stripped?")
    begin, end = (found.symbols[name] for name in NEEDED)
    if not begin <= end <= len(found.flash):
        raise _refused(path, "it is damaged: the symbols around its code point outside the flash")
    return found


class _Damaged(Exception):
    """What is wrong in a file of the right kind."""


def _table(
    data: bytes, row: struct.Struct, at: int, size: int, count: int
) -> list[tuple[Any, ...]]:
    if size != row.size or not count or at + size * count > len(data):
        raise _Damaged("its headers are outside the file")
    return [row.unpack_from(data, at + size * k) for k in range(count)]


def _part(data: bytes, at: int, size: int) -> bytes:
    if at + size > len(data):
        raise _Damaged("a section or segment is longer than the file")
    return data[at : at + size]


def _flash(data: bytes, segments: list[tuple[Any, ...]]) -> bytes:
    """What is loaded below the addresses of data, at its place."""
    out = bytearray()
    for kind, at, _, address, size, *_ in segments:
        if kind != _LOADED or not size or address >= 0x800000:
            continue
        if address + size > FLASH_BYTES:
            raise _Damaged(
                f"{size} bytes at address {address:#x} are beyond the flash of {FLASH_BYTES} bytes"
            )
        out.extend(b"\xff" * (address + size - len(out)))
        out[address : address + size] = _part(data, at, size)
    if not out:
        raise _Damaged("nothing in it goes into the flash")
    return bytes(out)


def _symbols(data: bytes, sections: list[tuple[Any, ...]]) -> dict[str, int]:
    """Global symbols, and local ones where no global one has their name."""
    out: dict[str, int] = {}
    for _, kind, _, _, at, size, link, *_ in sections:
        if kind != _SYMBOLS:
            continue
        if link >= len(sections) or sections[link][1] != _STRINGS:
            raise _Damaged("its symbols have no names")
        names = _part(data, *sections[link][4:6])
        table = _part(data, at, size - size % _SYMBOL.size)
        rows = sorted(_SYMBOL.iter_unpack(table), key=lambda row: row[3] >> 4 != 1)
        for name, address, *_ in rows:
            end = names.find(b"\0", name)
            if end < 0:
                raise _Damaged("a symbol has no name")
            out.setdefault(names[name:end].decode("ascii", "replace"), address)
    return out


def _machine_of(data: bytes) -> str:
    """The machine of an ELF file of 64 bits, in words."""
    if data[:5] != b"\x7fELF\x02" or len(data) < 20:
        return ""
    machine = int.from_bytes(data[18:20], "little" if data[5] == 1 else "big")
    return f", but for {_MACHINES.get(machine, f'machine {machine}')}"


def _refused(path: Path, why: str) -> InputError:
    return InputError(
        f"expected an ELF file of a firmware for the ATmega2560; {why}", file=str(path)
    )
