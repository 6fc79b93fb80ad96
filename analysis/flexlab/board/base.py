"""What a board is for the host: bytes and a clock. A serial port and an emulated ATmega2560 look
the same from here."""

from __future__ import annotations

from typing import Protocol

from flexura.errors import FlexuraError


class BoardError(FlexuraError):
    """The board or the line to it does not do what it must."""


class Board(Protocol):
    """Bytes to and from the firmware, and the time that passes for it.

    `label` names the board for people; it begins with "emulated" if and only if `emulated` is true,
    and both go into the metadata of every run. No method blocks for longer than it was told to.
    """

    label: str
    emulated: bool

    def write(self, data: bytes) -> None:
        """Put bytes on the line. Raises BoardError when there is no line any more."""

    def read(self) -> bytes:
        """What has arrived since the last call, perhaps nothing. Raises BoardError as `write`
        does."""

    def wait(self, seconds: float) -> None:
        """Let time pass, at most so much: a serial port returns as soon as bytes arrive."""

    def now(self) -> float:
        """Seconds on the board's side of the line: the wall clock, or the emulated processor's
        cycles."""

    def reset(self) -> None:
        """Reset the processor, as opening its port does."""

    def close(self) -> None:
        """Give the port back, or end the emulation. May be called twice."""
