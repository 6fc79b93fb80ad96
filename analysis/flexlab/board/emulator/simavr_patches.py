"""Code that simavr 1.6 executes wrongly, moved to where it does not.

An AVR skip (CPSE, SBRC, SBRS, SBIC, SBIS) passes over the next instruction, of one word or two.
simavr takes ADIW and SBIW with a constant whose low four bits are 12 to 15 for two words long (its
mask for CALL and JMP is too wide) and passes over one instruction too many. avr-gcc emits such
pairs, for a signed 16-bit division by 16 as `sbrc r25, 7; adiw r24, 15`.

Each pair is replaced by a jump to a trampoline in the flash's unused end, where a one-word jump
follows the skip. That costs 6 to 8 cycles more than on the chip.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

from flexura.errors import FlexuraError

TOP = 0x3E000  # below the boot loader, which an emulated board does not have
_BYTES = 14  # of a trampoline


def repair(flash: Any, begin: int, end: int) -> int:
    """Replace all such pairs between two addresses of a flash image, in place; returns their
    number.

    Raises FlexuraError where a branch leads into the middle of a pair, which no compiler is known
    to do.
    """
    place = TOP
    found = _pairs(bytes(flash[:end]), begin)
    for at in found:
        place -= _BYTES
        if place < end:
            raise FlexuraError("no room in the flash for the code that simavr executes wrongly")
        skip, passed = _word(flash, at), _word(flash, at + 2)
        # place: the skip; +2: rjmp to +8 when it does not skip; +4: jmp on; +8: the instruction;
        # +10: jmp on
        for k, word in enumerate((skip, 0xC002, *_jump(at + 4), passed, *_jump(at + 4))):
            _put(flash, place + 2 * k, word)
        for k, word in enumerate(_jump(place)):
            _put(flash, at + 2 * k, word)
    return len(found)


@lru_cache(maxsize=4)  # the same program is loaded many times
def _pairs(flash: bytes, begin: int) -> tuple[int, ...]:
    """The addresses of all such pairs in a flash image, from `begin` on."""
    code = list(_instructions(flash, begin, len(flash)))
    found = [at for at, word in code if _skips(word) and _mistaken(_word(flash, at + 2))]
    targets = {_target(flash, at, word) for at, word in code}
    for at in found:
        if at + 2 in targets:
            raise FlexuraError(
                f"simavr executes the code at {at:#x} wrongly (a skip over ADIW or SBIW), and it "
                f"cannot be moved"
            )
    return tuple(found)


def _word(flash: Any, at: int) -> int:
    return flash[at] | flash[at + 1] << 8


def _put(flash: Any, at: int, word: int) -> None:
    flash[at], flash[at + 1] = word & 255, word >> 8


def _jump(to: int) -> tuple[int, int]:
    """JMP, as two words; its address counts words and fits the second one's 16 bits up to 128 KB,
    the rest is in the first."""
    words = to // 2
    return 0x940C | words >> 16 & 1, words & 0xFFFF


def _skips(word: int) -> bool:
    return word & 0xFC00 == 0x1000 or word & 0xFC08 == 0xFC00 or word & 0xFD00 == 0x9900


def _mistaken(word: int) -> bool:
    return word & 0xFE0C == 0x960C


def _instructions(flash: Any, begin: int, end: int) -> Iterator[tuple[int, int]]:
    """(address, first word) of each instruction; avr-gcc keeps tables out of this part of the
    flash."""
    at = begin
    while at < end - 2:
        word = _word(flash, at)
        yield at, word
        at += 4 if word & 0xFE0C == 0x940C or word & 0xFC0F == 0x9000 else 2  # JMP, CALL; LDS, STS


def _target(flash: Any, at: int, word: int) -> int | None:
    """Where a jump, branch or call leads."""
    if word & 0xE000 == 0xC000:  # RJMP, RCALL
        return at + 2 + 2 * ((word & 0xFFF) - (word << 1 & 0x1000))
    if word & 0xF800 == 0xF000:  # BRBS, BRBC
        return at + 2 + 2 * ((word >> 3 & 0x7F) - (word >> 2 & 0x80))
    if word & 0xFE0C == 0x940C:  # JMP, CALL
        return 2 * ((word >> 3 & 0x3E | word & 1) << 16 | _word(flash, at + 2))
    return None
