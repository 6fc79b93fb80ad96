"""The board at a serial port."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any, NamedTuple

from flexura.errors import InputError
from flexura.optional import Optional

from .base import BoardError

list_ports = Optional("serial.tools.list_ports")
serial = Optional("serial")

# USB vendor and product of the Mega 2560 and of the serial chips on its copies
KNOWN = {
    (0x2341, 0x0010): "Arduino Mega 2560",
    (0x2341, 0x0042): "Arduino Mega 2560 R3",
    (0x2A03, 0x0010): "Arduino Mega 2560 (arduino.org)",
    (0x2A03, 0x0042): "Arduino Mega 2560 R3 (arduino.org)",
    (0x1A86, 0x7523): "CH340 serial chip, as on copies of the Mega 2560",
    (0x1A86, 0x5523): "CH341 serial chip, as on copies of the Mega 2560",
    (0x10C4, 0xEA60): "CP210x serial chip",
    (0x0403, 0x6001): "FT232R serial chip",
}


class Port(NamedTuple):
    """A serial port that may be the board."""

    device: str
    what: str


def ports() -> Iterator[Port]:
    """Serial ports whose USB identity is a Mega 2560's or that of a serial chip on its copies."""

    for port in sorted(list_ports.comports(), key=lambda p: p.device):
        if what := KNOWN.get((port.vid or 0, port.pid or 0)):
            yield Port(port.device, what)


def find() -> str:
    """The one port that may be the board. Raises InputError that lists what was found when there is
    none, or a choice."""
    found = list(ports())
    if len(found) == 1:
        return found[0].device
    listed = ", ".join(f"{p.device} ({p.what})" for p in found)
    raise InputError(
        f"more than one board is plugged in: {listed}; name one of them"
        if found
        else (
            "no board is plugged in (looked for the USB identity of a Mega 2560); name the port, "
            "or use --emulated"
        ),
        key="--port",
    )


class SerialBoard:
    """A board at a serial port, opened for this program alone. Opening resets the board (DTR);
    outputs are off until armed.

    A port without modem lines is a pseudo-terminal: what answers there is a program and is called
    emulated.
    """

    def __init__(self, device: str, baud: int) -> None:

        self.label = device
        try:
            # dtr stays as pyserial sets it: the falling edge is the reset that puts the board into
            # a known state
            self._port: Any = serial.Serial(
                device, baud, timeout=0, write_timeout=1.0, exclusive=True
            )
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            expected = f"cannot be opened ({reason}): expected the board's serial port"
            raise InputError(expected, key="--port", value=device) from None
        self.emulated = self._pseudo()
        if self.emulated:
            self.label = f"emulated board at {device}"
        self._begin = time.monotonic()
        self._early = b""

    def _pseudo(self) -> bool:
        try:
            _ = self._port.cts
        except OSError:
            return True
        return False

    def write(self, data: bytes) -> None:
        """Send bytes to the board.

        Args:
            data: the bytes.

        Raises:
            BoardError: the line is gone.
        """
        try:
            self._port.write(data)
        except OSError as error:
            raise BoardError(f"{self.label}: the line is gone ({error})") from None

    def read(self) -> bytes:
        """The bytes that have come from the board.

        Returns:
            The bytes since the last call.

        Raises:
            BoardError: the line is gone.
        """
        early, self._early = self._early, b""
        try:
            return early + self._port.read(self._port.in_waiting)
        except (
            OSError,
            TypeError,
        ) as error:  # TypeError: pyserial, when the port was closed meanwhile
            raise BoardError(f"{self.label}: the line is gone ({error})") from None

    def wait(self, seconds: float) -> None:
        """Wait for a byte.

        Args:
            seconds: at most so long [s].

        Raises:
            BoardError: the line is gone.
        """
        try:
            self._port.timeout = seconds
            self._early += self._port.read(1)
            self._port.timeout = 0
        except (OSError, TypeError) as error:
            raise BoardError(f"{self.label}: the line is gone ({error})") from None

    def now(self) -> float:
        """The time since the port was opened [s]."""
        return time.monotonic() - self._begin

    def reset(self) -> None:
        """Reset the board by its DTR line.

        Raises:
            BoardError: the line is gone.
        """
        try:
            self._port.dtr = False
            time.sleep(0.05)
            self._port.reset_input_buffer()
            self._port.dtr = True
        except OSError as error:
            raise BoardError(f"{self.label}: silent, and without a reset line ({error})") from None
        self._early = b""

    def close(self) -> None:
        """Close the port."""
        self._port.close()
