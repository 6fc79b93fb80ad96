"""The emulated board offered as a serial port: a pseudo-terminal that any serial program can open.

It keeps to the wall clock: emulated time runs no faster, and when the machine is too slow for it,
it lags and says by how much. A pseudo-terminal has no reset line and no line rate, so opening it
does not reset the board; everything else is as on the line.
"""

from __future__ import annotations

import contextlib
import os
import sys
import time
from collections.abc import Callable

from flexura.errors import FlexuraError

from .base import Board

if sys.platform != "win32":
    import tty

STEP_S = 0.002


class Pty:
    """A board behind a pseudo-terminal; `device` is the name to open. Use as a context manager."""

    def __init__(self, board: Board) -> None:
        if sys.platform == "win32":
            raise FlexuraError("a board as a pseudo-terminal needs Linux or macOS")
        self.board = board
        self.lag_s = 0.0  # the largest so far
        self.dropped = 0  # bytes that nobody took in time, as with a real adapter
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.device = os.ttyname(self._slave)

    def __enter__(self) -> Pty:
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._master)
        os.close(self._slave)

    def serve(self, until: Callable[[], bool]) -> None:
        """Run the board at the pace of the wall clock until `until()` is true."""
        wall, start = time.monotonic(), self.board.now()
        while not until():
            self._exchange()
            ahead = (self.board.now() - start) - (time.monotonic() - wall)
            if ahead > 0:
                time.sleep(ahead)
            self.lag_s = max(self.lag_s, -ahead)

    def _exchange(self) -> None:
        with contextlib.suppress(BlockingIOError):
            self.board.write(os.read(self._master, 4096))
        self.board.wait(STEP_S)
        data = self.board.read()
        try:
            self.dropped += len(data) - (os.write(self._master, data) if data else 0)
        except BlockingIOError:
            self.dropped += len(data)
