"""An ATmega2560 that runs a firmware's ELF file in simavr: `shim/`, compiled when first used,
behind ctypes.

Nothing here follows the wall clock: the same calls give the same bytes and edges at the same cycles
every time. simavr is GPLv3; the compiled shim links to it, stays in this user's cache and is not
distributed.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import subprocess
from collections.abc import Iterable
from ctypes import (
    c_char,
    c_char_p,
    c_int,
    c_size_t,
    c_uint8,
    c_uint16,
    c_uint32,
    c_uint64,
    c_void_p,
)
from pathlib import Path
from typing import Any

from flexura.errors import FlexuraError
from flexura.io import replaced
from flexura.optional import Missing

from .elf import read
from .simavr_patches import repair

CLOCK_HZ = 16_000_000
ROLES = {
    name: k
    for k, name in enumerate(
        (
            "forward",
            "reverse",
            "enable",
            "forward_2",
            "reverse_2",
            "enable_2",
            "step",
            "step_up",
            "step_disable",
        ),
        1,
    )
}
RESET_CAUSES = {"power-on": 1, "external": 2, "brown-out": 4, "watchdog": 8}  # MCUSR
_PIN_REGISTERS = {p: 0x20 + 3 * k for k, p in enumerate("ABCDEFG")} | {
    p: 0x100 + 3 * k for k, p in enumerate("HJKL")
}
_SOURCES = sorted(Path(__file__).with_name("shim").glob("*.[ch]"))
_HEADERS = Path("/usr/include/simavr")
_INSTALL = "on Debian type: apt-get install gcc libc6-dev simavr libsimavr-dev"
_ROOM = 1 << 16


class Window(ctypes.Structure):
    """What plant and board exchange, a window of cycles at a time (`window_t` in shim/board.h)."""

    _fields_ = (
        ("encoder", ctypes.c_double * 2),
        ("duty", ctypes.c_double * 2),
        ("steps", ctypes.c_double),
        ("steps_mean", ctypes.c_double),
        ("motor_on", ctypes.c_double * 2),
        *[
            (name, ctypes.c_double)
            for name in (
                "stepper_on",
                "driven_cycle",
                "step_cycle",
                "resets",
            )
        ],
    )


class Edge(ctypes.Structure):
    """A change of a traced line: at which cycle, which line, and its level from then on."""

    _fields_ = (("cycle", c_uint64), ("line", c_uint32), ("level", c_uint32))


_INTERFACE: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "board_new": (c_void_p, (c_char_p, c_uint32, c_uint32, c_uint32)),
    "board_free": (None, (c_void_p,)),
    "board_window": (ctypes.POINTER(Window), (c_void_p,)),
    "board_line": (c_int, (c_void_p, c_char, c_int, c_int, c_int, c_int)),
    "board_cut": (None, (c_void_p, c_uint32, c_int)),
    "board_trace": (None, (c_void_p, c_uint32, c_int)),
    "board_encoder": (None, (c_void_p, c_int, c_char, c_int, c_char, c_int)),
    "board_pin": (None, (c_void_p, c_uint64, c_char, c_int, c_int)),
    "board_stick": (None, (c_void_p, c_char, c_int, c_int)),
    "board_adc": (None, (c_void_p, c_uint64, c_int, c_int)),
    "board_send": (None, (c_void_p, c_char_p, c_size_t)),
    "board_unsent": (c_size_t, (c_void_p,)),
    "board_received": (c_size_t, (c_void_p,)),
    "board_receive": (c_size_t, (c_void_p, c_void_p, c_size_t)),
    "board_edges": (c_size_t, (c_void_p, c_void_p, c_size_t)),
    "board_run": (c_int, (c_void_p, c_uint64, c_uint32)),
    "board_cycle": (c_uint64, (c_void_p,)),
    "board_pc": (c_uint32, (c_void_p,)),
    "board_data": (ctypes.POINTER(c_uint8), (c_void_p,)),
    "board_flash": (ctypes.POINTER(c_uint8), (c_void_p,)),
    "board_reset": (None, (c_void_p, c_uint8)),
    "board_eeprom": (c_int, (c_void_p, c_int, c_void_p, c_uint16, c_uint32)),
    "board_vector": (None, (c_void_p, c_int, c_uint64 * 4)),
    "board_log": (c_char_p, (c_void_p,)),
}


def compile_shim() -> Path:
    """The shared library of shim/, from the cache or compiled now (under a second). Raises
    Missing, which says what to install."""
    config = _HEADERS / "sim_core_config.h"
    if not config.is_file():
        raise Missing(
            f"the emulated board needs simavr, whose headers are not in {_HEADERS}; {_INSTALL}"
        )
    digest = hashlib.sha256(
        b"".join(path.read_bytes() for path in (*_SOURCES, config))
    ).hexdigest()[:16]
    folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "flexura"
    target = folder / f"board-{digest}.so"
    if target.exists():
        return target
    parts = [str(path) for path in _SOURCES if path.suffix == ".c"]
    options = ["-O2", "-shared", "-fPIC", f"-I{_HEADERS}"]
    with replaced(target) as draft:
        command = ["cc", *options, "-o", str(draft), *parts, "-lsimavr", "-lm"]
        try:
            done = subprocess.run(command, capture_output=True, text=True)
        except FileNotFoundError:
            raise Missing(
                f"the emulated board needs a C compiler, and there is no cc; {_INSTALL}"
            ) from None
        if done.returncode:
            raise FlexuraError(
                f"the emulated board's shim does not compile; {_INSTALL}\n{done.stderr.strip()}"
            )
    return target


def _library() -> ctypes.CDLL:
    library = ctypes.CDLL(str(compile_shim()))
    for name, (result, arguments) in _INTERFACE.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library


class Simulator:
    """One simulated ATmega2560: run it to a cycle; post and read pins, ADC, serial bytes, EEPROM,
    memory.

    `slice_cycles` is how long simavr may run without looking up. It changes the speed only, which a
    test shows.
    """

    def __init__(self, elf: Path, baud: int, slice_cycles: int = 1000) -> None:
        program = read(elf)
        self._symbols = program.symbols
        self._lib = _library()
        handle = self._lib.board_new(program.flash, len(program.flash), CLOCK_HZ, baud)
        if not handle:
            raise FlexuraError("simavr knows no ATmega2560")
        self._board = c_void_p(handle)
        self._run, self._slice = self._lib.board_run, slice_cycles
        self.window: Window = self._lib.board_window(self._board).contents
        self.data, self.flash = (
            self._lib.board_data(self._board),
            self._lib.board_flash(self._board),
        )
        repair(self.flash, self.symbol("__ctors_end"), self.symbol("__data_load_start"))
        self._bytes, self._edges = (c_uint8 * _ROOM)(), (Edge * _ROOM)()

    def close(self) -> None:
        """Free the emulated processor."""
        if self._board:
            self._lib.board_free(self._board)
            self._board = c_void_p()

    def run(self, until_cycle: int) -> None:
        """Run to the given cycle, or to the end of the instruction that reaches it."""
        if self._run(self._board, until_cycle, self._slice):
            raise FlexuraError(
                f"the simulated processor stopped at address {self.pc:#x}: "
                f"{self.log() or 'no reason given'}"
            )

    @property
    def cycle(self) -> int:
        """Cycles of the processor since the start."""
        return self._lib.board_cycle(self._board)

    @property
    def pc(self) -> int:
        """The program counter [bytes]."""
        return self._lib.board_pc(self._board)

    def line(
        self, port: str, bit: int, role: int = 0, *, rest: bool = False, traced: bool = False
    ) -> int:
        """Watch an output pin that rests at a level without the firmware; with a role (ROLES) it
        drives the plant.

        Returns the line's number in `edges`."""
        number = self._lib.board_line(self._board, port.encode(), bit, role, rest, traced)
        if number < 0:
            raise FlexuraError("too many watched pins")
        return number

    def cut(self, line: int, broken: bool) -> None:
        """Break the wire of a watched output pin, or mend it: what it led to is at rest."""
        self._lib.board_cut(self._board, line, broken)

    def trace(self, line: int, on: bool) -> None:
        """Record the edges of a line, or stop doing so.

        Args:
            line: its number.
            on: whether edges are recorded.
        """
        self._lib.board_trace(self._board, line, on)

    def encoder(self, number: int, a: tuple[str, int], b: tuple[str, int]) -> None:
        """Wire a quadrature encoder's lines to two pins (port, bit); A leads upwards."""
        self._lib.board_encoder(self._board, number, a[0].encode(), a[1], b[0].encode(), b[1])

    def pin(self, port: str, bit: int, level: bool, cycle: int | None = None) -> None:
        """Drive an input pin, now or at a later cycle."""
        self._lib.board_pin(
            self._board, self.cycle if cycle is None else cycle, port.encode(), bit, level
        )

    def level(self, port: str, bit: int) -> bool:
        """The level at a pin now, as the firmware would read it."""
        return bool(self.data[_PIN_REGISTERS[port]] >> bit & 1)

    def stick(self, port: str, bit: int, level: bool | None) -> None:
        """A wire that broke or shorted: the pin keeps this level whatever drives it; None mends
        it."""
        self._lib.board_stick(self._board, port.encode(), bit, -1 if level is None else int(level))

    def adc(self, channel: int, millivolts: int) -> None:
        """Set the voltage at an analogue input.

        Args:
            channel: of the converter.
            millivolts: the voltage [mV].
        """
        self._lib.board_adc(self._board, self.cycle, channel, millivolts)

    def send(self, data: bytes) -> None:
        """Put bytes on the serial line; they arrive at its pace, after those that are still on
        it."""
        self._lib.board_send(self._board, data, len(data))

    @property
    def unsent(self) -> int:
        """Bytes on the serial line that have not arrived yet."""
        return self._lib.board_unsent(self._board)

    def receive(self) -> bytes:
        """The bytes that the firmware has sent since the last call."""
        out = b""
        while n := self._lib.board_receive(self._board, self._bytes, _ROOM):
            out += bytes(memoryview(self._bytes)[:n])
        return out

    def edges(self) -> list[tuple[int, int, int]]:
        """(cycle, line, level) of traced lines since the last call."""
        out: list[tuple[int, int, int]] = []
        while n := self._lib.board_edges(self._board, self._edges, _ROOM):
            out += [(e.cycle, e.line, e.level) for e in self._edges[:n]]
        return out

    def reset(self, cause: str = "external") -> None:
        """A reset from outside the processor, its cause in MCUSR. simavr has no supply voltage: a
        brown-out is this too."""
        self._lib.board_reset(self._board, RESET_CAUSES[cause])

    def read_eeprom(self, offset: int, size: int) -> bytes:
        """Bytes of the EEPROM.

        Args:
            offset: of the first byte.
            size: number of bytes.

        Returns:
            The bytes.
        """
        got = (c_uint8 * size)()
        self._lib.board_eeprom(self._board, 0, got, offset, size)
        return bytes(got)

    def write_eeprom(self, offset: int, data: bytes) -> None:
        """Write bytes into the EEPROM.

        Args:
            offset: of the first byte.
            data: the bytes.
        """
        self._lib.board_eeprom(self._board, 1, (c_uint8 * len(data))(*data), offset, len(data))

    def symbol(self, name: str) -> int:
        """The address of a symbol of the ELF file; data addresses count from 0."""
        if name not in self._symbols:
            raise FlexuraError(f"the firmware has no symbol {name}")
        return self._symbols[name] & 0x7FFFFF

    def patch(self, address: int, words: Iterable[int]) -> None:
        """Overwrite flash with instruction words, to make the firmware misbehave where a test wants
        it to."""
        for k, word in enumerate(words):
            self.flash[address + 2 * k], self.flash[address + 2 * k + 1] = word & 255, word >> 8

    def interrupts(self) -> dict[int, tuple[int, int, int, int]]:
        """By vector number: entries, cycles in all, cycles of the longest, and of the longest
        without those that interrupted it.

        0 stands for all of them, with the cycles in which any was running."""
        out = {}
        for vector in range(58):
            values = (c_uint64 * 4)()
            self._lib.board_vector(self._board, vector, values)
            if values[0]:
                out[vector] = values[0], values[1], values[2], values[3]
        return out

    def log(self) -> str:
        """What simavr complained about since the last call; nothing, if all went well."""
        return self._lib.board_log(self._board).decode(errors="replace")
