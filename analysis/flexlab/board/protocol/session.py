"""The host's end of the protocol: a session with a board, commands that are acknowledged and
repeated, telemetry as it comes.

One command is on its way at a time. It is repeated with the same sequence number until its
acknowledgement arrives, each time when the measured round trip is over. The board answers a
repeated number as before and does nothing: a lost answer never makes it act twice. When there is
nothing to say, `keepalive` says that the host is there.
"""

from __future__ import annotations

import random
from collections import deque
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..base import Board, BoardError
from . import messages
from .declaration import (
    CONFIG,
    CONTROL_HZ,
    DECLARATION,
    MESSAGES,
    RESULTS,
    Fault,
    Reset,
    Result,
    State,
)
from .frames import Deframer, encode
from .round_trip import RoundTrip

STEP_S = 0.001  # how long the host lets the board's time pass before it looks again
# commands whose answer may take longer than the usual time to repeat, s
SLOW = {"config_save": 2.0}
# commands that are answered by a message and an acknowledgement, and that message
READS = {"config_read": "config_value", "program_read": "program"}
_REPORT_CODE = MESSAGES["telemetry"].code
_REPORT_BYTES = messages.HEAD_BYTES + messages.TELEMETRY.itemsize


class Refused(BoardError):
    """The board said no: `result` and `detail` as declared."""

    def __init__(self, command: str, result: Result, detail: int) -> None:
        self.command, self.result, self.detail = command, result, detail
        super().__init__(
            f"the board refused {command}: {RESULTS[result]} (detail {_detail(result, detail)})"
        )


@dataclass(frozen=True)
class Identity:
    """What a board says about itself before anything else."""

    declaration: int
    protocol: int
    firmware: str
    compiler: str
    resets: tuple[str, ...]
    state: State
    fault: Fault
    configuration_crc: int
    tick: int


@dataclass
class Command:
    """A command that waits, is on its way, or was answered."""

    name: str
    values: dict[str, Any]
    sequence: int = 0
    frame: bytes = b""
    due_s: float = -1.0  # when it is sent, again or for the first time
    first_s: float = 0.0  # when it was sent
    attempts: int = 0
    result: Result | None = None
    detail: int = 0
    answer: dict[str, Any] | None = None

    @property
    def done(self) -> bool:
        """Whether the board has answered."""
        return self.result is not None


@dataclass
class Counts:
    """What went over the line, for the run's metadata."""

    repeated: int = 0
    bad_frames: int = 0
    unknown_frames: int = 0
    telemetry: int = 0
    telemetry_lost: int = 0
    restarts: int = 0
    keepalives: int = 0


@dataclass
class Link:
    """A session with a board.

    `sequence` starts the count; without one it is chosen at random, a number that nobody played
    before, as the protocol asks; on an emulated board it is 1, so that the same session is the same
    byte for byte. A command is repeated after the measured round trip, until one is measured and at
    most after `repeat_s`; the host gives up `answer_s` after its first attempt.
    """

    board: Board
    sequence: int | None = None
    repeat_s: float = 0.05
    answer_s: float = 1.0
    keepalive_s: float = 0.05
    counts: Counts = field(default_factory=Counts)
    identity: Identity | None = None

    def __post_init__(self) -> None:
        self._deframer = Deframer()
        self._waiting: deque[Command] = deque()
        self._now: Command | None = None
        self._next = self._first() if self.sequence is None else self.sequence
        self._telemetry: list[bytes] = []
        self._newest = b""
        self._last_report: int | None = None
        self._last_said = 0.0
        self._open = False
        self.round_trip = RoundTrip(self.repeat_s)
        self._answered = (-1, 0.0)  # the last command's number, and how long its answer took

    # ---- session

    def _first(self) -> int:
        """The first number of a session."""
        return 1 if self.board.emulated else random.SystemRandom().randrange(1 << 16)

    def connect(self, timeout_s: float = 5.0) -> Identity:
        """Wait for the board's first good frame, refuse a board of another declaration, open a
        session."""
        found = self.listen(timeout_s)
        if found.declaration != DECLARATION:
            raise BoardError(
                f"{self.board.label}: firmware {found.firmware} speaks declaration "
                f"{found.declaration:08x}, this host speaks "
                f"{DECLARATION:08x}; load the firmware of this version: flexura flash"
            )
        self.command("hello", declaration=DECLARATION)
        self._open = True
        self._last_report = None
        return found

    def listen(self, timeout_s: float = 5.0) -> Identity:
        """The board's next announcement, nothing being said before it (a bootloader may be
        listening).

        A board that keeps silent may be in a session that another program left: after half the time
        it is told to stop and greeted, after three quarters it is reset.
        """
        self._open, self._now, self.identity = False, None, None
        self._waiting.clear()
        begin = self.board.now()
        greet = encode(messages.pack("stop", self._next)) + encode(
            messages.pack("hello", self._next, declaration=DECLARATION)
        )
        rest = deque([(0.5, lambda: self.board.write(greet)), (0.75, self.board.reset)])
        while self.identity is None:
            self._step(STEP_S)
            passed = (self.board.now() - begin) / timeout_s
            if rest and passed > rest[0][0]:
                rest.popleft()[1]()
            if passed > 1:
                raise BoardError(
                    f"{self.board.label}: no good frame within {timeout_s:g} s "
                    f"({self._deframer.bad} bad ones); is it the rig's "
                    "board, and was its firmware loaded? flexura flash"
                )
        return self.identity

    # ---- commands

    def command(self, name: str, **values: Any) -> Command:
        """Send a command and wait for its answer. Raises Refused, or BoardError when there is
        none."""
        asked = self.submit(name, **values)
        while not asked.done:
            self._step(STEP_S)
        assert asked.result is not None
        if asked.result is not Result.ok:
            raise Refused(name, asked.result, asked.detail)
        return asked

    def submit(self, name: str, **values: Any) -> Command:
        """Queue a command; `run` or `poll` send it and take its answer."""
        asked = Command(name, values)
        messages.pack(name, 0, **values)  # a mistake shows here, not later
        self._waiting.append(asked)
        return asked

    def stop(self) -> None:
        """Outputs off now, before everything that waits: once out of turn, which the board obeys,
        and once to be acknowledged."""
        self._waiting.clear()
        self.board.write(encode(messages.pack("stop", self._next - 2)))
        self.submit("stop")

    @property
    def idle(self) -> bool:
        """Nothing waits for an answer."""
        return self._now is None and not self._waiting

    # ---- time

    def run(self, seconds: float) -> None:
        """Let time pass with the session kept alive: queued commands go out, telemetry comes in."""
        end = self.board.now() + seconds
        while (left := end - self.board.now()) > 1e-9:
            self._step(min(STEP_S, left))

    def poll(self) -> None:
        """Take what has arrived, send what is due; no time passes on an emulated board."""
        self._receive()
        self._speak()

    def _step(self, seconds: float) -> None:
        self._speak()
        self.board.wait(seconds)
        self._receive()

    def _receive(self) -> None:
        if data := self.board.read():
            for payload in self._deframer.feed(data):
                self._take(payload)
            self.counts.bad_frames = self._deframer.bad

    def _speak(self) -> None:
        now = self.board.now()
        if (
            self._now is None
            and not self._waiting
            and self._open
            and now - self._last_said >= self.keepalive_s
        ):
            self._waiting.append(Command("keepalive", {}))
            self.counts.keepalives += 1
        if self._now is None and self._waiting:
            self._now = self._waiting.popleft()
            self._now.sequence = self._next
            self._now.frame = encode(messages.pack(self._now.name, self._next, **self._now.values))
            self._next = (self._next + 1) & 0xFFFF
        if self._now is not None and now >= self._now.due_s:
            self._send(now)

    def _send(self, now: float) -> None:
        asked = self._now
        assert asked is not None
        slow_s = SLOW.get(asked.name, 0.0)
        if asked.attempts == 0:
            asked.first_s = now
        elif now - asked.first_s >= max(self.answer_s, 20 * slow_s):
            self._now = None
            raise BoardError(
                f"{self.board.label}: no answer to {asked.name} after {asked.attempts} attempts"
            )
        self.counts.repeated += asked.attempts > 0
        asked.attempts += 1
        asked.due_s = now + max(slow_s, self.round_trip.repeat_s)
        self._last_said = now
        self.board.write(asked.frame)

    # ---- what arrives

    def _take(self, payload: bytes) -> None:
        if (
            len(payload) == _REPORT_BYTES and payload[0] == _REPORT_CODE
        ):  # most of what comes, and not read here
            self._report(payload)
            return
        found = messages.head(payload)
        message = messages.BY_CODE.get(found[0]) if found else None
        data = messages.body(payload)
        values = messages.unpack(message, data) if message else None
        if found is None or message is None or values is None:
            self.counts.unknown_frames += 1
            return
        if message.name == "identity":
            self._introduce(values)
        elif self._now is not None and found[1] == self._now.sequence:
            self._answer(self._now, message.name, values)
        elif message.name == "ack" and found[1] == self._answered[0]:
            self.round_trip.measured(self._answered[1])  # it was repeated too early
            self._answered = (-1, 0.0)

    def _answer(self, asked: Command, name: str, values: dict[str, Any]) -> None:
        """What the board said about the command that is on its way."""
        if name == READS.get(asked.name):
            asked.answer = values
        elif name == "ack" and values["command"] == MESSAGES[asked.name].code:
            if asked.name in READS and values["result"] == Result.ok and asked.answer is None:
                return  # the value was lost on its way: asked again, it comes again
            asked.result, asked.detail = Result(values["result"]), values["detail"]
            self._now = None
            took = self.board.now() - asked.first_s
            if asked.name in SLOW:
                return
            if asked.attempts == 1:
                self.round_trip.measured(took)
            else:
                self._answered = (asked.sequence, took)

    def _report(self, payload: bytes) -> None:
        self._newest = messages.body(payload)
        self._telemetry.append(self._newest)
        self.counts.telemetry += 1
        sequence = payload[1] | payload[2] << 8
        if self._last_report is not None:
            self.counts.telemetry_lost += (sequence - self._last_report - 1) & 0xFFFF
        self._last_report = sequence

    def _introduce(self, said: dict[str, Any]) -> None:
        # a board announces itself until it is greeted: this one started anew, and the session is
        # over
        if self._open:
            self.counts.restarts += 1
            self._open = False
        self.identity = Identity(
            said["declaration"],
            said["protocol"],
            ".".join(map(str, said["firmware"])),
            ".".join(map(str, said["compiler"])),
            tuple(cause.name for cause in Reset if said["reset"] >> cause & 1),
            State(said["state"]),
            Fault(said["fault"]),
            said["configuration_crc"],
            said["tick"],
        )

    @property
    def alive(self) -> bool:
        """The session is open: the board has not been reset since `connect`."""
        return self._open

    # ---- telemetry

    def telemetry(self) -> np.ndarray:
        """The reports since the last call, as a record array in the declared units."""
        taken, self._telemetry = self._telemetry, []
        return messages.reports(taken)

    @property
    def newest(self) -> dict[str, Any]:
        """The newest report, whether `telemetry` has taken it or not. Raises BoardError when there
        was none."""
        values = messages.unpack(MESSAGES["telemetry"], self._newest)
        if values is None:
            raise BoardError(f"{self.board.label}: no telemetry yet")
        return values

    # ---- configuration

    def read_configuration(self) -> dict[str, float]:
        """The configuration in use, every item, as the board keeps it (single precision)."""
        asked = {
            name: self.command("config_read", item=item.number).answer
            for name, item in CONFIG.items()
        }
        return {
            name: float(answer["value"]) for name, answer in asked.items() if answer is not None
        }

    def write_configuration(self, values: dict[str, float], save: bool = True) -> None:
        """Change items of the configuration in use and store it."""
        for name, value in values.items():
            self.command("config_write", item=CONFIG[name].number, value=value)
        if save:
            self.command("config_save")


def seconds(ticks: np.ndarray) -> np.ndarray:
    """Time stamps of reports in seconds since the board's reset."""
    return ticks / CONTROL_HZ


def _detail(result: Result, detail: int) -> str:
    if result is Result.wrong_state:
        return State(detail).name if detail in State._value2member_map_ else str(detail)
    if result is Result.fault_persists:
        return Fault(detail).name if detail in Fault._value2member_map_ else str(detail)
    if result is Result.inconsistent and detail < len(CONFIG):
        return list(CONFIG)[detail]
    return str(detail)
