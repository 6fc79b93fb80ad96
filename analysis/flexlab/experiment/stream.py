"""Execution of an experiment: arm, stream, start, watch, and motors off at its end."""

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

POLL_S = 0.02  # how often the host looks at what came
STOP_TIMEOUT_S = 0.3  # how long it waits for the motors' stop to be acknowledged


@dataclass(frozen=True)
class StreamResult:
    """How an experiment ended.

    `complete`: everything planned was done. `stopped`: the board reported its outputs off.
    `interrupted`: a person ended it.
    """

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
) -> StreamResult:
    """Play the knots, hold the last one, and stop the motors.

    Errors of line, board or disk end the experiment and are reported in the result, not raised.

    Args:
        link: the session with the board.
        knots: the knots.
        recording: receives the event of the end.
        settle_s: how long the last knot is held [s].
        stop_asked: returns why to end early, or "".
        broken: what is known to be broken, or ""; then the experiment is never complete.
        observe: called with new reports and the finished fraction.
    """
    text, interrupted, failure = "", False, None
    try:
        text, interrupted = _play(link, knots, settle_s, stop_asked, observe)
    except (BoardError, RecordingError) as error:
        failure = error
    stopped = stop_motors(link)
    if failure is not None:
        text = _cause_of(link, failure)
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
    return StreamResult(complete, text, stopped, interrupted)


def _play(
    link: Link,
    knots: Knots,
    settle_s: float,
    stop_asked: Callable[[], str],
    observe: Callable[[np.ndarray, float], None],
) -> tuple[str, bool]:
    """Play the knots.

    Returns:
        Why it ended, "" if all is done; and whether a person asked for it.
    """
    player = Player(link, knots)
    total = len(knots) * knots.period_s + settle_s
    player.start()
    begin, done_at = link.board.now(), None
    while True:
        player.run(POLL_S)
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
    """Why the board no longer runs; "" if it runs."""
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


def _cause_of(link: Link, failure: Exception) -> str:
    """The cause of an error: a board that refuses was reset or has a fault, and will report it."""
    if isinstance(failure, Refused) and not _reason(link):
        with contextlib.suppress(BoardError, RecordingError):
            link.run(1.5 * ANNOUNCE_EVERY_TICKS / CONTROL_HZ)
    return _reason(link) or str(failure)


def stop_motors(link: Link) -> bool:
    """Stop the motors.

    Returns:
        Whether the board acknowledged it, or was reset and has its outputs off anyway.
    """
    try:
        link.stop()
        end = link.board.now() + STOP_TIMEOUT_S
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
