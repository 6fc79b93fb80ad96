"""The experiment itself: arm, stream, start, watch, and the motors off at its end, whatever that
is."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..board.base import BoardError
from ..board.protocol.declaration import ANNOUNCE_EVERY_TICKS, CONTROL_HZ, FAULTS, Fault, State
from ..board.protocol.player import Knots, Player
from ..board.protocol.session import Link, Refused
from ..recordings.recording import Recording, RecordingError

LOOK_S = 0.02  # how often the host looks at what came
QUIET_S = 0.3  # how long it waits for the motors' stop to be acknowledged


@dataclass(frozen=True)
class Ended:
    """How an experiment ended: `complete` if everything planned was done; `stopped` if the board
    said that its outputs are off; `interrupted` if a person wanted it."""

    complete: bool
    text: str
    stopped: bool
    interrupted: bool = False


def execute(
    link: Link,
    knots: Knots,
    recording: Recording,
    settle_s: float,
    stop_asked: Callable[[], str],
    observe: Callable[[np.ndarray, float], None],
    broken: str = "",
) -> Ended:
    """Play the knots and hold the last one for `settle_s`; returns how that ended, with the motors
    told to stop.

    `stop_asked()` says why to end early, or ""; `observe(reports, part)` gets the new reports and
    which part of the time is over. What is wrong with line, board or disk ends the experiment and
    is in the result, not raised. `broken` says what is known to be broken: then it is never
    complete.
    """
    text, interrupted, wrong = "", False, None
    try:
        text, interrupted = _play(link, knots, settle_s, stop_asked, observe)
    except (BoardError, RecordingError) as error:
        wrong = error
    stopped = quiet(link)
    if wrong is not None:
        text = _behind(link, wrong)
    if broken:
        text = f"{broken}: {text or 'the board noticed nothing'}"
    complete, text = text == "", text or "all done"
    if not stopped:
        text += "; no answer to the stop: the board stops by itself when it hears nothing"
    if recording.failed is not None:
        complete, text = False, str(recording.failed)
    try:
        recording.event(
            text, "INFO" if complete else "ERROR", _tick(link), ended=True, complete=complete
        )
    except RecordingError as error:
        complete, text = False, str(error)
    return Ended(complete, text, stopped, interrupted)


def _play(
    link: Link,
    knots: Knots,
    settle_s: float,
    stop_asked: Callable[[], str],
    observe: Callable[[np.ndarray, float], None],
) -> tuple[str, bool]:
    """Why it ended, "" when everything was done, and whether a person wanted that."""
    player = Player(link, knots)
    total = len(knots) * knots.period_s + settle_s
    player.start()
    begin, done_at = link.board.now(), None
    while True:
        player.run(LOOK_S)
        now = link.board.now()
        observe(link.telemetry(), min((now - begin) / total, 1.0))
        if reason := _reason(link):
            return reason, False
        if asked := stop_asked():
            return asked, True
        if player.done and done_at is None:
            done_at = now
        if done_at is not None and now - done_at >= settle_s:
            return "", False


def _reason(link: Link) -> str:
    """Why the board does not run any more, if it does not."""
    if not link.alive:
        identity = link.identity
        return (
            f"the board was reset ({', '.join(identity.resets) or 'cause unknown'})"
            if identity
            else "the board was reset"
        )
    try:
        newest = link.newest
    except BoardError:
        return ""
    if newest["state"] == State.fault:
        fault = Fault(newest["fault"])
        return f"fault {fault.name}: {' '.join(FAULTS[fault])}"
    return ""


def _behind(link: Link, wrong: Exception) -> str:
    """What is behind an error: a board that refuses was reset or has a fault, and will say so."""
    if isinstance(wrong, Refused) and not _reason(link):
        with contextlib.suppress(BoardError, RecordingError):
            link.run(1.5 * ANNOUNCE_EVERY_TICKS / CONTROL_HZ)
    return _reason(link) or str(wrong)


def quiet(link: Link) -> bool:
    """Tell the motors to stop; true when the board has acknowledged that, or was reset and has its
    outputs off anyway."""
    try:
        link.stop()
        end = link.board.now() + QUIET_S
        while not link.idle and link.board.now() < end and link.alive:
            link.run(0.005)
        return link.idle or not link.alive
    except (BoardError, Refused, RecordingError):
        return False


def _tick(link: Link) -> int | None:
    try:
        return int(link.newest["tick"])
    except BoardError:
        return None
