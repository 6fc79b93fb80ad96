"""The host's side of a session, on a line whose other end the test plays: each frame, each time."""

from __future__ import annotations

import random
from dataclasses import FrozenInstanceError

import numpy as np
import pytest

from flexlab.board.base import BoardError
from flexlab.board.protocol import messages
from flexlab.board.protocol.declaration import CONTROL_HZ, DECLARATION, MESSAGES, Result
from flexlab.board.protocol.frames import Deframer, encode
from flexlab.board.protocol.session import Link, seconds

TELEMETRY, IDENTITY = MESSAGES["telemetry"], MESSAGES["identity"]


class Line:
    """A line at which the test answers. `said`: (time, message, number) of what the host writes."""

    label, emulated = "a line", True

    def __init__(self, time=1.0):
        self.time, self.said, self.resets, self.arriving = time, [], [], b""
        self.step = None  # of every wait [s]; None: as long as asked

    def write(self, data):
        for payload in Deframer().feed(data):
            code, number = messages.head(payload)
            self.said.append((self.time, messages.BY_CODE[code].name, number))

    def read(self):
        data, self.arriving = self.arriving, b""
        return data

    def wait(self, seconds):
        self.time += seconds if self.step is None else self.step

    def now(self):
        return self.time

    def reset(self):
        self.resets.append(self.time)

    def arrive(self, name, number=0, **values):
        """A frame of the board; fields that are not given are 0."""
        fields = {f.name: [0] * f.length if f.length > 1 else 0 for f in MESSAGES[name].fields}
        self.arriving += encode(messages.pack(name, number, **(fields | values)))

    def acknowledge(self, name, number):
        self.arrive("ack", number, command=MESSAGES[name].code, result=Result.ok)


def polled(link, time):
    """What the host has said up to a time at which it is polled."""
    link.board.time = time
    link.poll()
    return [name for _, name, _ in link.board.said]


@pytest.fixture
def greeted():
    """A session that was opened at 1 s, with number 10; nothing has been said since."""
    line = Line()
    line.step = 0.0
    link = Link(line, sequence=10, repeat_s=0.25, answer_s=1.0, keepalive_s=0.5)
    line.arrive("identity", declaration=DECLARATION)
    assert not link.alive

    def answer(data, write=line.write):
        write(data)
        line.acknowledge("hello", 10)

    line.write = answer
    link.connect()
    del line.write
    assert link.alive and line.said == [(1.0, "hello", 10)]
    line.said.clear()
    return link


def test_a_stop_goes_out_of_turn_then_in_turn_and_nothing_that_waited_is_sent():
    link = Link(Line(), sequence=10)
    link.submit("keepalive")
    link.stop()
    assert link.board.said == [(1.0, "stop", 8)]
    link.poll()
    assert link.board.said == [(1.0, "stop", 8), (1.0, "stop", 10)]
    link.board.acknowledge("stop", 10)
    link.poll()
    assert link.idle and len(link.board.said) == 2


def test_numbers_follow_each_other_and_begin_again_after_the_last(monkeypatch):
    monkeypatch.setattr(random.SystemRandom, "randrange", lambda self, end: end - 1)
    line = Line()
    line.emulated = False
    link = Link(line)
    for number in (0xFFFF, 0):
        asked = link.submit("stop")
        link.poll()
        assert link.board.said[-1] == (1.0, "stop", number)
        link.board.acknowledge("stop", number)
        link.poll()
        assert asked.done and asked.sequence == number


def test_a_session_with_an_emulated_board_is_the_same_each_time():
    links = [Link(Line()) for _ in range(2)]
    for link in links:
        link.submit("stop")
        link.poll()
    assert [link.board.said for link in links] == [[(1.0, "stop", 1)]] * 2


def test_a_command_that_waits_has_no_number_time_or_answer():
    asked = Link(Line(), sequence=10).submit("stop")
    assert (asked.sequence, asked.first_s, asked.attempts, asked.detail) == (0, 0.0, 0, 0)
    assert asked.answer is None and not asked.done


def test_listening_forgets_what_waited():
    link = Link(Line(), sequence=10)
    link.submit("stop")
    link.board.arrive("identity", declaration=DECLARATION)
    who = link.listen()
    assert link.idle and link.board.said == [] and not link.alive
    with pytest.raises(FrozenInstanceError):
        who.tick = 1


def test_a_silent_board_is_greeted_after_half_the_time_reset_after_three_quarters():
    """Looks at quarters of a second: what is due at a look is done at the next one."""
    line = Line(time=0.0)
    line.step = 0.25
    with pytest.raises(BoardError, match="no good frame within 2 s"):
        Link(line, sequence=10).listen(2.0)
    assert line.said == [(1.25, "stop", 10), (1.25, "hello", 10)]
    assert line.resets == [1.75] and line.time == 2.25


def test_the_session_is_kept_alive_at_equal_times(greeted):
    assert polled(greeted, 1.25) == []
    assert polled(greeted, 1.5) == ["keepalive"] and greeted.counts.keepalives == 1
    greeted.board.acknowledge("keepalive", 11)
    assert polled(greeted, 1.625) == polled(greeted, 1.875) == ["keepalive"]
    assert polled(greeted, 2.0) == ["keepalive", "keepalive"]
    assert greeted.counts.keepalives == 2


def test_a_command_is_repeated_and_given_up_when_its_time_has_come():
    link = Link(Line(), sequence=10, repeat_s=0.25, answer_s=0.5)
    link.submit("stop")
    assert polled(link, 1.0) == polled(link, 1.1875) == ["stop"]
    assert polled(link, 1.25) == polled(link, 1.4375) == ["stop", "stop"]
    with pytest.raises(BoardError, match="no answer to stop after 2 attempts"):
        polled(link, 1.5)


def test_only_the_second_answer_to_a_repeated_command_is_measured(greeted):
    asked = greeted.submit("stop")
    for time in (1.0, 1.25):
        polled(greeted, time)
    greeted.board.acknowledge("stop", asked.sequence)
    polled(greeted, 1.375)
    assert asked.done and asked.attempts == 2
    mean = lambda: greeted.round_trip.mean_s
    before = mean()
    for number in (asked.sequence - 1, asked.sequence + 1):  # of other commands
        greeted.board.acknowledge("stop", number)
        polled(greeted, 1.375)
    assert mean() == before
    greeted.board.arrive("config_value", asked.sequence)  # of this number, but no ack
    polled(greeted, 1.375)
    assert mean() == before
    greeted.board.acknowledge("stop", asked.sequence)
    polled(greeted, 1.375)
    measured = mean()
    assert measured == pytest.approx(before + (0.375 - before) / 8)
    greeted.board.acknowledge("stop", asked.sequence)  # a third answer says nothing new
    polled(greeted, 1.375)
    assert mean() == measured


def frame(code, size):
    """A frame with a message's code and as many bytes of zeros."""
    return encode(bytes([code, 0, 0]) + bytes(size))


@pytest.mark.parametrize(
    "strange",
    [
        encode(b"\x01"),  # too short for a head
        frame(max(messages.BY_CODE) + 1, 4),
        frame(IDENTITY.code, 1),
        frame(TELEMETRY.code, messages.TELEMETRY.itemsize - 1),
        frame(TELEMETRY.code, messages.TELEMETRY.itemsize + 1),
        frame(max(messages.BY_CODE) + 1, messages.TELEMETRY.itemsize),
    ],
)
def test_a_good_frame_that_is_no_message_is_counted_and_left_alone(greeted, strange):
    greeted.board.arriving = strange
    greeted.poll()
    assert (greeted.counts.unknown_frames, greeted.counts.bad_frames) == (1, 0)
    assert greeted.counts.telemetry == 0 and greeted.alive


def test_reports_that_are_missing_are_counted_over_the_end_of_their_numbers(greeted):
    for number in (0xFFFD, 0xFFFE, 1, 2, 5):  # 0xFFFF and 0, 3 and 4 are missing
        greeted.board.arrive("telemetry", number)
    greeted.poll()
    assert (greeted.counts.telemetry, greeted.counts.telemetry_lost) == (5, 4)
    assert len(greeted.telemetry()) == 5 and len(greeted.telemetry()) == 0


def test_no_time_passes_in_a_run_that_has_none_left():
    line = Line(time=0.0)
    Link(line, sequence=10).run(1e-9)
    assert line.time == 0.0


def test_time_stamps_are_ticks_of_the_control_loop():
    assert list(seconds(np.array([0, CONTROL_HZ, 3 * CONTROL_HZ]))) == [0.0, 1.0, 3.0]
