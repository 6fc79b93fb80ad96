"""The proof of the emergency stop: the board sees it pressed and released, and keeps that with its
settings and the hash of its firmware. Without it the board refuses `arm`.

A real board's stop is pressed by a person. An emulated board in this process presses its own: its
switch, at the declared pin, is opened and closed. That proof lives and dies with the emulation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from .base import Board
from .protocol.declaration import PINS, PINS_HASH, StopTrial
from .protocol.session import Link

PRESS_S = 60.0  # how long a person may take
HELD_S = 0.06  # how long an emulated stop is pressed
LOOK_S = 0.05


@dataclass(frozen=True)
class Program:
    """What a board runs: hashes of its firmware and of its pins, the firmware with which the stop
    was proven (0: none), and what it has seen of the stop since its reset."""

    firmware: int
    pins: int
    proven: int
    stop: StopTrial

    @property
    def may_move(self) -> bool:
        """The emergency stop is proven with this very firmware."""
        return self.proven == self.firmware

    @property
    def pins_are_declared(self) -> bool:
        """The firmware was built with the pins that this program knows."""
        return self.pins == PINS_HASH


def program(link: Link) -> Program:
    """Ask the board what it runs."""
    said = link.command("program_read").answer
    assert said is not None
    return Program(said["firmware"], said["pins"], said["proven"], StopTrial(said["stop"]))


def where(name: str) -> str:
    """A pin in words: pin 26, PA4."""
    pin = PINS[name]
    return f"pin {pin.pin}, P{pin.port}{pin.bit}"


def press_by_itself(board: Board) -> Callable[[bool], None] | None:
    """What presses the stop of an emulated board in this process; None for any other."""
    return getattr(board, "press_stop", None)


def commission(
    link: Link,
    board: Board | None = None,
    say: Callable[[str], None] = lambda text: None,
    given_up: Callable[[], str] = lambda: "",
) -> Program:
    """Have the stop pressed and released once, and the proof stored; nothing if there is one.

    The settings in use are stored with it. Idle only.

    Args:
        link: an open session.
        board: the board behind it, if `link.board` is a wrapper.
        say: tells the person at the bench what to do.
        given_up: says why not to wait any longer, or "".

    Returns:
        What the board runs; `may_move` says whether the stop is proven now.
    """
    found = program(link)
    if found.may_move:
        return found
    press = press_by_itself(board or link.board)
    if press is not None:
        for pressed in (True, False):
            press(pressed)
            link.run(HELD_S)
    else:
        say(
            f"press the emergency stop and release it ({where('emergency_stop')}): it is not "
            f"proven with this firmware yet; waiting {PRESS_S:g} s"
        )
        end = link.board.now() + PRESS_S
        while link.board.now() < end and program(link).stop is not StopTrial.released:
            link.run(LOOK_S)
            if given_up():
                return program(link)
    found = program(link)
    if found.stop is StopTrial.released:
        link.command("commission")
        link.command("config_save")
        found = program(link)
    return found
