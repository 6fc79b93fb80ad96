"""Is a file a program for the ATmega2560? simavr reads any ELF file, and crashes with some."""

from __future__ import annotations

import struct
from pathlib import Path

from flexura.errors import InputError

# ELF32, little-endian: identification of 16 bytes, type, machine, version, entry, where program and
# section headers are, flags, sizes and numbers of both.
_HEADER = struct.Struct("<16sHHIIIIIHHHHHH")
_SECTION = struct.Struct("<IIIIIIIIII")
_SYMBOL = struct.Struct("<IIIBBH")
_IDENTIFICATION = b"\x7fELF\x01\x01\x01"  # 32 bits, little-endian, version 1
_EXECUTABLE, _AVR, _AVR6 = 2, 83, 6
_SYMBOLS, _STRINGS, _NOTHING = 2, 3, 8  # kinds of section; the last has no bytes in the file
_MACHINES = {3: "an x86", 40: "an ARM", 62: "an x86-64", 183: "an AArch64", 243: "a RISC-V"}
FLASH_BYTES = 256 * 1024
_DATA, _ROOM = 0x800000, 0x1000000  # addresses of SRAM, EEPROM and fuses begin and end there


def check(path: Path) -> None:
    """Raise InputError, in one sentence, unless the file is whole and for this processor."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise _refused(path, error.strerror or str(error)) from None
    if len(data) < _HEADER.size or not data.startswith(_IDENTIFICATION):
        raise _refused(path, f"it is no ELF file of 32 bits{_machine_of(data)}")
    head = _HEADER.unpack_from(data)
    kind, machine, sections_at, flags = head[1], head[2], head[6], head[7]
    size, count, names = head[11:14]
    if machine != _AVR:
        raise _refused(path, f"it is for {_MACHINES.get(machine, f'machine {machine}')}")
    if flags & 0x7F != _AVR6:
        raise _refused(path, f"it is for another AVR (architecture {flags & 0x7F}, not {_AVR6})")
    if kind != _EXECUTABLE:
        raise _refused(path, "it is no program: it was not linked")
    if size != _SECTION.size or not count or sections_at + size * count > len(data):
        raise _refused(path, "it is damaged: its sections are not in it")
    sections = [_SECTION.unpack_from(data, sections_at + size * k) for k in range(count)]
    if names >= count or sections[names][1] != _STRINGS:
        raise _refused(path, "it is damaged: its sections have no names")
    for section in sections:
        _check_section(path, data, sections, section)


def _check_section(
    path: Path, data: bytes, sections: list[tuple[int, ...]], section: tuple[int, ...]
) -> None:
    """A section's bytes are in the file, its address in the processor; symbols have names there."""
    _, kind, loaded, address, at, size, link = section[:7]
    if kind != _NOTHING and at + size > len(data):
        raise _refused(path, "it is damaged: a section ends behind its end")
    if loaded & 2 and size and not (address + size <= FLASH_BYTES or _DATA <= address < _ROOM):
        raise _refused(path, f"it is damaged: {size} bytes at address {address:#x}")
    if kind == _STRINGS and size and data[at + size - 1]:
        raise _refused(path, "it is damaged: a name does not end")
    if kind == _SYMBOLS:
        if size % _SYMBOL.size or link >= len(sections) or sections[link][1] != _STRINGS:
            raise _refused(path, "it is damaged: its symbols have no names")
        room = sections[link][5]
        for offset in range(at, at + size, _SYMBOL.size):
            if _SYMBOL.unpack_from(data, offset)[0] >= max(room, 1):
                raise _refused(path, "it is damaged: a symbol has no name")


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
