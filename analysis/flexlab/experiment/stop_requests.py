"""Ways in which a person stops an experiment: stop key, Ctrl-C, a closing terminal.

All set one flag. It is no exception, so that no frame and no record is cut, and the motors stop in
order. Stop keys are read on Linux and macOS only; Ctrl-C works everywhere.
"""

from __future__ import annotations

import os
import select
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

if sys.platform != "win32":
    import termios
    import tty

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
    keys = sys.platform != "win32" and sys.stdin is not None and sys.stdin.isatty()
    stop = StopRequest(sys.stdin.fileno() if keys else None)
    signals = [getattr(signal, name, None) for name in ("SIGINT", "SIGTERM", "SIGHUP")]
    before = {s: signal.signal(s, stop.signalled) for s in signals if s is not None}
    try:
        with _single_keys(stop._stdin):
            yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def _single_keys(stdin: int | None) -> Iterator[None]:
    if sys.platform == "win32" or stdin is None:
        yield
        return
    was = termios.tcgetattr(stdin)
    try:
        tty.setcbreak(stdin)
        yield
    finally:
        with suppress(termios.error):  # the terminal may be gone
            termios.tcsetattr(stdin, termios.TCSADRAIN, was)
