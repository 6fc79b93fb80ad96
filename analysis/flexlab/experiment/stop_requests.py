"""Ways in which a person stops an experiment: stop key, Ctrl-C, a closing terminal.

All set one flag. It is no exception, so that no frame and no record is cut, and the motors stop in
order.
"""

from __future__ import annotations

import os
import select
import signal
import sys
import termios
import tty
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

KEYS = {b" ": "space", b"q": "q", b"\x1b": "Esc"}
KEYS_HELP = "space, q or Esc stops the motors"


class StopRequest:
    """Whether and how somebody asked to stop."""

    def __init__(self, stdin: int | None) -> None:
        self._stdin = stdin
        self._how = ""

    def signalled(self, number: int, _: Any) -> None:
        """Handle a signal."""
        self._how = (
            "interrupted"
            if number == signal.SIGINT
            else f"interrupted ({signal.Signals(number).name})"
        )

    def asked(self) -> str:
        """How somebody asked to stop; "" if nobody did."""
        while (
            not self._how and self._stdin is not None and select.select([self._stdin], [], [], 0)[0]
        ):
            pressed = os.read(self._stdin, 1)
            if not pressed:
                self._stdin = None
            elif pressed in KEYS:
                self._how = f"stopped with the key {KEYS[pressed]}"
        return self._how


@contextmanager
def watch_for_stop() -> Iterator[StopRequest]:
    """Read keys as they are pressed, and turn SIGINT, SIGTERM and SIGHUP into a stop request."""
    stop = StopRequest(sys.stdin.fileno() if sys.stdin is not None and sys.stdin.isatty() else None)
    before = {
        s: signal.signal(s, stop.signalled) for s in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    }
    try:
        with _single_keys(stop._stdin):
            yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def _single_keys(stdin: int | None) -> Iterator[None]:
    if stdin is None:
        yield
        return

    was = termios.tcgetattr(stdin)
    try:
        tty.setcbreak(stdin)
        yield
    finally:
        with suppress(termios.error):  # the terminal may be gone
            termios.tcsetattr(stdin, termios.TCSADRAIN, was)
