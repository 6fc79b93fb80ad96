"""Load the firmware and the rig's settings into a board, and read them back."""

from __future__ import annotations

import struct
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zlib import crc32

from flexura.errors import FlexuraError, InputError
from flexura.optional import Missing, load

from ..board.base import Board, BoardError
from ..board.commissioning import program
from ..board.emulator.emulated import EmulatedBoard
from ..board.protocol.declaration import BAUD_BIT_S, CONFIG, Fault
from ..board.protocol.session import Identity, Link
from ..board.serial_port import SerialBoard, find
from ..paths import FIRMWARE
from ..rig import RigSetup, configuration
from ..rig.plant.rigid_plant import RigidPlant
from ..runs.formatting import number
from ..runs.table import Styled, Table

RIG = "rig"  # the rig that comes with flexura

Say = Callable[[str], None]


@dataclass(frozen=True)
class Setting:
    """A setting of the board beside that of the rig file."""

    name: str
    board: float
    rig: float

    @property
    def agrees(self) -> bool:
        """Whether both are equal in single precision."""
        return self.board == as_float32(self.rig)


@dataclass(frozen=True)
class FlashResult:
    """The outcome; `board` is the port or "emulated ATmega2560"."""

    board: str
    emulated: bool
    elf: Path
    identity: Identity
    settings: list[Setting]
    configured: bool

    @property
    def differing(self) -> list[str]:
        """Settings of the board that differ from the rig file's."""
        return [setting.name for setting in self.settings if not setting.agrees]


def as_float32(value: float) -> float:
    """A value in single precision, as the board keeps it."""
    return float(struct.unpack("<f", struct.pack("<f", value))[0])


def settings_crc(settings: dict[str, float]) -> int:
    """The board's checksum of its settings: CRC-32 over all, in order, single precision."""
    return crc32(struct.pack(f"<{len(CONFIG)}f", *(settings[name] for name in CONFIG)))


def build(*options: str, firmware: Path = FIRMWARE) -> Path:
    """Build the firmware with PlatformIO and return its ELF file. Raises FlexuraError with the end
    of the compiler's output."""
    script = firmware / "build.py"
    if not script.is_file():
        raise Missing(
            "the firmware's sources are not in an installed package: build it in a checkout of the "
            "project, or name a built one (--firmware ELF)"
        )
    load("platformio")
    done = subprocess.run(
        [sys.executable, str(script), *options],
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
    )
    if done.returncode:
        said = "\n".join((done.stdout + done.stderr).strip().splitlines()[-15:])
        raise FlexuraError(f"the firmware was not built or not loaded:\n{said}")
    return Path(done.stdout.strip().splitlines()[-1])


def flash(
    setup: RigSetup,
    port: str | None = None,
    emulated: bool = False,
    configure: bool = False,
    say: Say = print,
) -> FlashResult:
    """Build, load, meet the board, and read its settings; with `configure` write the rig's, store
    them, and see them again after a reset.

    Raises BoardError when the board does not come up as it must; nothing moves in any case.
    """
    if emulated and port:
        raise InputError("expected either a port or --emulated", key="--port", value=port)
    wanted = configuration(setup)
    device = None if emulated else port or find()
    if device and not Path(device).exists():
        raise InputError(
            "no such device: expected the board's serial port", key="--port", value=device
        )
    say("building the firmware")
    elf = build(*(["--upload-port", device] if device else []))
    say(
        f"loaded into {device}"
        if device
        else "loaded into an emulated ATmega2560: no hardware is touched"
    )
    board: Board = (
        SerialBoard(device, BAUD_BIT_S) if device else EmulatedBoard(elf, RigidPlant(setup))
    )
    try:
        link = Link(board)
        identity = link.connect()
        versions = (
            f"firmware {identity.firmware}, avr-gcc {identity.compiler}, declaration "
            f"{identity.declaration:08x}"
        )
        say(f"first good frame: {versions}")
        if configure:
            identity = write_and_reset(link, wanted, say)
        found = link.read_configuration()
        if not program(link).may_move:
            say(
                "the emergency stop is not proven with this firmware: the next experiment asks for "
                "a press"
            )
    finally:
        board.close()
    settings = [Setting(name, found[name], value) for name, value in wanted.items()]
    done = FlashResult(board.label, board.emulated, elf, identity, settings, configure)
    if configure and done.differing:
        raise BoardError(
            f"{board.label}: read back other values than written: {', '.join(done.differing)}"
        )
    return done


def write_and_reset(link: Link, wanted: dict[str, float], say: Say) -> Identity:
    """Write and store all settings, reset the board, and see that it comes up with them.

    Args:
        link: an open session; a new one is open afterwards.
        wanted: all settings, by name.
        say: tells what was done.

    Returns:
        What the board says of itself.

    Raises:
        BoardError: it does not come up with them.
    """
    link.command("config_defaults")
    link.write_configuration(wanted)
    say(f"wrote and stored {len(wanted)} settings")
    link.board.reset()
    identity = link.connect()
    if identity.fault is Fault.bad_configuration or identity.configuration_crc != settings_crc(
        wanted
    ):
        raise BoardError(
            f"{link.board.label}: after a reset the board does not have the settings that were "
            f"stored (checksum "
            f"{identity.configuration_crc:08x}, expected {settings_crc(wanted):08x}, fault "
            f"{identity.fault.name})"
        )
    say("reset: the board came up with them")
    return identity


def table(done: FlashResult) -> Table:
    """The settings, those of the board and those of the rig file."""
    who = done.identity
    title = f"{done.board}: firmware {who.firmware}, {who.state.name}, fault {who.fault.name}"
    out = Table(title, ("setting", "board", "rig file", ""), ("setting",))
    for s in done.settings:
        differs = "" if s.agrees else Styled("differs", "yellow")
        out.add(s.name, number(s.board, 7), number(s.rig, 7), differs)
    return out


def data(done: FlashResult) -> dict[str, Any]:
    """The same for scripts."""
    who = done.identity
    return {
        "board": done.board,
        "emulated": done.emulated,
        "elf": str(done.elf),
        "firmware": who.firmware,
        "compiler": who.compiler,
        "declaration": f"{who.declaration:08x}",
        "resets": list(who.resets),
        "state": who.state.name,
        "fault": who.fault.name,
        "configured": done.configured,
        "differing": done.differing,
        "settings": {s.name: {"board": s.board, "rig": s.rig} for s in done.settings},
    }
