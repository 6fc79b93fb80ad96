"""The session between host and firmware, on the emulated board: greeting, refusals, a bad line,
real pyserial."""

from __future__ import annotations

import random
import threading
import time

import numpy as np
import pytest
from serial.tools import list_ports
from serial.tools.list_ports_common import ListPortInfo

from boards import BENCH, Rigged, elf, finish
from flexlab import rig
from flexlab.board.base import BoardError
from flexlab.board.commissioning import commission
from flexlab.board.emulator.emulated import LABEL, EmulatedBoard
from flexlab.board.protocol import messages
from flexlab.board.protocol import session as link_module
from flexlab.board.protocol.declaration import (
    BAUD_BIT_S,
    CONFIG,
    DECLARATION,
    MESSAGES,
    TELEMETRY_EVERY_TICKS,
    Fault,
    Result,
    State,
)
from flexlab.board.protocol.frames import Deframer, decode, encode
from flexlab.board.protocol.session import Link, Refused
from flexlab.board.pty import Pty
from flexlab.board.serial_port import SerialBoard, find, ports
from flexlab.experiment.flash import as_float32, settings_crc
from flexlab.rig.plant.rigid_plant import RigidPlant
from flexura.errors import InputError


def test_greeting():
    with Rigged(blank=True) as r:
        who = r.link.identity
        assert who.declaration == DECLARATION and who.resets == ("power_on",)
        assert who.state is State.fault and who.fault is Fault.bad_configuration  # a blank EEPROM
        assert who.configuration_crc == settings_crc(
            {name: item.default for name, item in CONFIG.items()}
        )
        assert r.board.label == LABEL and r.board.emulated and LABEL.startswith("emulated")


def test_a_board_of_another_declaration_is_refused_by_name(monkeypatch):
    monkeypatch.setattr(link_module, "DECLARATION", DECLARATION ^ 1)
    board = EmulatedBoard(elf(), RigidPlant(BENCH))
    with pytest.raises(
        BoardError,
        match=rf"{LABEL}: firmware .* speaks declaration {DECLARATION:08x}, this host speaks ",
    ):
        Link(board).connect()
    finish(board)


def test_the_board_refuses_a_host_of_another_declaration():
    with Rigged() as r:
        with pytest.raises(Refused) as refused:
            r.link.command("hello", declaration=DECLARATION ^ 1)
        assert refused.value.result is Result.wrong_declaration


@pytest.mark.parametrize(
    ("result", "detail", "said"),
    [
        (Result.wrong_state, State.running, "running"),
        (Result.wrong_state, 99, "99"),
        (Result.fault_persists, Fault.limit_low, "limit_low"),
        (Result.fault_persists, 99, "99"),
        (Result.inconsistent, 0, next(iter(CONFIG))),
        (Result.inconsistent, len(CONFIG) - 1, list(CONFIG)[-1]),
        (Result.inconsistent, len(CONFIG), str(len(CONFIG))),
        (Result.wrong_index, 1, "1"),
    ],
)
def test_a_refusal_names_what_its_detail_is_a_number_of(result, detail, said):
    """Or gives the number, where a board of another kind has more of them."""
    assert str(Refused("arm", result, int(detail))).endswith(f"(detail {said})")


class Silent:
    """A line on which nothing answers by itself."""

    label, emulated, time = "emulated silence", True, 0.0

    def __init__(self):
        self.writes, self.resets, self.arrived = [], [], b""

    def write(self, data):
        self.writes.append(self.time)

    def read(self):
        data, self.arrived = self.arrived, b""
        return data

    def wait(self, seconds):
        self.time += seconds

    def now(self):
        return self.time

    def reset(self):
        self.resets.append(self.time)


@pytest.mark.parametrize(
    ("asks", "seconds"),
    [(lambda link: link.connect(2.0), 2.0), (Link.connect, 5.0), (Link.listen, 5.0)],
)
def test_a_silent_line_is_no_board(asks, seconds):
    """Greeted after half the time, reset after three quarters; nothing was counted."""
    silent = Silent()
    link = Link(silent)
    said = rf"emulated silence: no good frame within {seconds:g} s .*flexura flash"
    with pytest.raises(BoardError, match=said):
        asks(link)
    assert silent.writes == pytest.approx([seconds / 2], abs=0.01)
    assert silent.resets == pytest.approx([0.75 * seconds], abs=0.01)
    assert silent.time == pytest.approx(seconds, abs=0.01)
    assert not any(vars(link.counts).values())


@pytest.mark.parametrize(("name", "repeat_s", "end_s"), [("stop", 0.05, 1), ("config_save", 2, 40)])
def test_a_command_without_an_answer_is_repeated_and_given_up(name, repeat_s, end_s):
    """A command that takes long has more time."""
    line = Silent()
    link = Link(line)
    with pytest.raises(BoardError, match=f"no answer to {name} after 20 attempts"):
        link.command(name)
    assert line.writes == pytest.approx(repeat_s * np.arange(20), abs=0.03)
    assert line.time == pytest.approx(end_s, abs=0.02)
    assert link.counts.repeated == 19 and link.idle


def test_an_answer_to_another_command_is_none():
    """A number may be that of a session before."""
    line = Silent()
    link = Link(line, sequence=7)
    asked = link.submit("stop")
    link.poll()
    for name, number, done in (("keepalive", 7, False), ("stop", 8, False), ("stop", 7, True)):
        answer = {"command": MESSAGES[name].code, "result": Result.ok, "detail": 0}
        line.arrived = encode(messages.pack("ack", number, **answer))
        link.poll()
        assert asked.done == link.idle == done


def test_a_session_left_open_by_another_program_is_taken_over():
    with Rigged() as r:
        r.link.run(0.02)
        second = Link(r.board, sequence=5)
        assert second.connect().state is State.idle
        second.command("keepalive")


def test_configuration_goes_there_and_back_and_outlives_a_reset():
    with Rigged(blank=True) as r:
        wanted = rig.configuration(BENCH)
        r.link.write_configuration(wanted)
        assert r.link.read_configuration() == {
            name: as_float32(value) for name, value in wanted.items()
        }
        r.board.reset()
        who = r.link.connect()
        assert (
            who.configuration_crc == settings_crc(wanted)
            and who.state is State.idle
            and who.resets == ("external",)
        )
        assert r.link.read_configuration() == {
            name: as_float32(value) for name, value in wanted.items()
        }


@pytest.mark.parametrize("name", CONFIG)
def test_no_setting_is_taken_outside_its_range(name, blank):
    item = CONFIG[name]
    ends = (item.least, -np.inf), (item.greatest, np.inf)
    for value in (*(np.nextafter(*map(np.float32, end)) for end in ends), np.nan, np.inf):
        with pytest.raises(Refused) as refused:
            blank.link.command("config_write", item=item.number, value=float(value))
        assert refused.value.result is Result.out_of_range


@pytest.fixture(scope="module")
def blank():
    with Rigged(blank=True) as r:
        yield r


def test_telemetry_comes_every_second_tick_without_a_gap():
    with Rigged() as r:
        r.link.run(1.0)
        table = r.link.telemetry()
        assert len(table) == pytest.approx(500, abs=3)
        assert set(np.diff(table["tick"][3:])) == {TELEMETRY_EVERY_TICKS}
        assert (
            r.link.counts.telemetry_lost == r.link.counts.bad_frames == r.link.counts.repeated == 0
        )
        assert table["supply"].mean() == pytest.approx(12000, rel=0.01)


class Noisy(EmulatedBoard):
    """The emulated board at a line that loses or spoils some of the bytes, both ways."""

    rate = 0.0

    def _spoil(self, data: bytes) -> bytes:
        out = bytearray()
        for byte in data:
            luck = self.noise.random()
            if luck >= self.rate / 2:  # else lost
                out.append(byte ^ 1 << self.noise.randrange(8) if luck < self.rate else byte)
        return bytes(out)

    noise = random.Random(1)

    def write(self, data):
        super().write(self._spoil(data))

    def read(self):
        return self._spoil(super().read())


def test_through_a_line_that_spoils_bytes_every_command_is_done_once():
    """Of 100 bytes one is lost or spoilt: frames of 15 to 60 bytes then fail by the dozen.
    Set-points sent twice would be refused (wrong_index) or show in `buffered`."""
    board = Noisy(elf(), RigidPlant(BENCH))
    board.noise = random.Random(3)
    link = Link(board, sequence=1, repeat_s=0.01, answer_s=0.5)
    link.connect()
    board.rate = 0.01
    wanted = rig.configuration(BENCH)
    link.write_configuration(wanted)
    link.command("clear", fault=Fault.bad_configuration)
    assert commission(link).may_move
    assert link.read_configuration() == {name: as_float32(value) for name, value in wanted.items()}
    link.command("reference", position_1=11, position_2=24, steps=32)
    link.command("arm", mode=2)
    for k in range(15):
        zeros = {name: [0] * 4 for name in ("position_1", "position_2", "velocity_1", "velocity_2")}
        link.command("setpoints", first=4 * k, count=4, final=0, **zeros)
    link.run(0.02)
    board.rate = 0.0
    link.run(0.01)
    assert link.counts.repeated > 30 and link.counts.bad_frames > 30
    newest = link.newest
    assert (newest["position_1"], newest["position_2"], newest["steps"]) == (11, 24, 32)
    assert newest["buffered"] == 60 and newest["state"] == State.armed
    link.command("stop")
    finish(board)


def acks(data: bytes) -> list[tuple[int, Result]]:
    """(sequence number, result) of the acks in a stream of bytes."""
    payloads = Deframer().feed(data)
    return [
        (
            messages.head(p)[1],
            Result(messages.unpack(messages.MESSAGES["ack"], messages.body(p))["result"]),
        )
        for p in payloads
        if messages.head(p)[0] == messages.MESSAGES["ack"].code
    ]


def test_a_repeated_command_is_answered_and_not_obeyed_again():
    with Rigged() as r:
        r.link.run(0.01)
        first = encode(messages.pack("reference", 101, position_1=5, position_2=6, steps=7))
        assert r.link._next == 101
        r.board.read()
        r.board.write(first)
        r.board.wait(0.01)
        assert acks(r.board.read()) == [(101, Result.ok)]
        other = encode(messages.pack("reference", 101, position_1=50, position_2=60, steps=70))
        for frame in (first, other):  # the number counts, not what the frame says
            r.board.write(frame)
            r.board.wait(0.01)
            assert acks(r.board.read()) == [(101, Result.ok)]
        r.board.write(encode(messages.pack("keepalive", 103)))
        r.board.wait(0.01)
        assert acks(r.board.read()) == [(103, Result.out_of_sequence)]
        r.link._next = 102
        r.link.run(0.01)
        assert r.link.newest["position_1"] == 5 and r.link.newest["steps"] == 7


@pytest.mark.parametrize("damage", ["flipped", "truncated", "lengthened"])
def test_a_damaged_command_does_nothing(damage):
    """Each bit of an `arm` flipped, the frame cut at each byte, a byte put in at each place: none
    is obeyed."""
    with Rigged() as r:
        r.link.command("reference", position_1=0, position_2=0, steps=0)
        frame = encode(messages.pack("arm", r.link._next, mode=2))
        spoilt = {
            "flipped": [
                frame[:k] + bytes([frame[k] ^ 1 << i]) + frame[k + 1 :]
                for k in range(len(frame) - 1)
                for i in range(8)
            ],
            "truncated": [frame[:k] + b"\0" for k in range(1, len(frame) - 1)],
            "lengthened": [frame[:k] + b"\x55" + frame[k:] for k in range(len(frame))],
        }[damage]
        for bad in spoilt:
            assert decode(bad[:-1]) is None or 0 in bad[:-1]
            r.board.write(bad + b"\0")
            r.board.wait(0.0025)
        r.board.wait(0.02)
        assert [result for _, result in acks(r.board.read()) if result is Result.ok] == []
        r.link.run(0.01)
        assert r.state is State.idle and not r.driven


def test_frames_of_a_session_played_again_are_refused():
    """All that was said to make the joints move, once more and word for word: out of sequence,
    nothing moves."""
    with Rigged() as r:
        said: list[bytes] = []
        write = r.board.write
        r.board.write = lambda data: (said.append(data), write(data))[1]
        r.go(r.back_and_forth(), 0.2)
        assert r.driven
        r.player = None
        r.link.command("stop")
        r.board.write = write
        r.link.run(0.02)
        assert r.state is State.idle and not r.driven
        off = r.last_driven
        r.board.read()
        for frame in said:
            write(frame)
            r.board.wait(0.004)
        r.board.wait(0.02)
        answers = acks(r.board.read())
        assert len(answers) >= len(said) - 1
        assert {result for sequence, result in answers[:-1]} == {Result.out_of_sequence}
        assert r.last_driven == off and not r.driven


def test_stop_is_obeyed_whatever_its_number():
    with Rigged() as r:
        r.go(r.back_and_forth(), 0.2)
        assert r.driven
        r.board.write(encode(messages.pack("stop", 0xBEEF)))
        r.board.wait(0.002)
        assert not r.driven
        r.player = None
        r.link.run(0.02)
        assert r.state is State.idle


def test_a_reset_ends_the_session_and_the_host_sees_it():
    with Rigged() as r:
        r.link.run(0.2)
        assert r.link.alive
        r.board.reset()
        r.link.keepalive_s = 10.0
        r.link.run(0.2)
        assert not r.link.alive and r.link.counts.restarts == 1


def test_real_pyserial_at_a_pseudo_terminal():
    """Smoke test at the wall clock's pace, with wide limits: the emulated board behind a pty,
    pyserial at the other end."""
    board = EmulatedBoard(elf(), RigidPlant(BENCH))
    done = threading.Event()
    with Pty(board) as served:
        server = threading.Thread(target=served.serve, args=(done.is_set,))
        server.start()
        try:
            port = SerialBoard(served.device, BAUD_BIT_S)
            link = Link(port, repeat_s=0.5)
            assert link.connect(20.0).declaration == DECLARATION
            assert link.read_configuration() == {
                name: as_float32(item.default) for name, item in CONFIG.items()
            }
            begin = time.monotonic()
            link.run(1.0)
            assert time.monotonic() - begin < 20
            assert link.counts.telemetry > 50
            with pytest.raises(Refused, match="arm"):
                link.command("arm", mode=1)  # it is in Fault: blank EEPROM
        finally:
            done.set()
            server.join()
    with pytest.raises(BoardError, match=r"/dev/.*: the line is gone"):  # unplugged
        link.run(1.0)
    port.close()
    with pytest.raises(BoardError, match="the line is gone"):
        port.write(b"x")
    finish(board)


def plugged(*identities):
    ports = []
    for k, (vid, pid) in enumerate(identities):
        port = ListPortInfo(f"/dev/ttyACM{k}")
        port.vid, port.pid = vid, pid
        ports.append(port)
    return lambda: ports[::-1]


def test_the_one_mega_that_is_plugged_in_is_found(monkeypatch):
    monkeypatch.setattr(
        list_ports, "comports", plugged((0x0403, 0x6015), (0x2341, 0x0042), (None, None))
    )
    assert find() == "/dev/ttyACM1" and [p.what for p in ports()] == ["Arduino Mega 2560 R3"]


def test_no_board_or_two_of_them_are_named(monkeypatch):
    monkeypatch.setattr(list_ports, "comports", plugged((None, None)))
    with pytest.raises(InputError, match=r"--port: no board is plugged in .* or use --emulated"):
        find()
    monkeypatch.setattr(list_ports, "comports", plugged((0x1A86, 0x7523), (0x2341, 0x0042)))
    with pytest.raises(
        InputError,
        match=r"more than one board is plugged in: /dev/ttyACM0 \(CH340.*, /dev/ttyACM1 \(Arduino",
    ):
        find()
