"""Frames and messages of the serial line: published examples, round trips, damage."""

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexlab.board.protocol import frames, messages
from flexlab.board.protocol.declaration import CONFIG, MESSAGES
from robots import fast

RUN = bytes(range(1, 255))


@pytest.mark.parametrize(
    "data, stuffed",
    [  # Cheshire and Baker's rule applied by hand
        (b"", b"\x01"),
        (b"\x00", b"\x01\x01"),
        (b"\x00\x00", b"\x01\x01\x01"),
        (b"\x11\x22\x00\x33", b"\x03\x11\x22\x02\x33"),
        (b"\x11\x00\x00\x00", b"\x02\x11\x01\x01\x01"),
        (RUN[:253], b"\xfe" + RUN[:253]),
        (RUN + b"\xff", b"\xff" + RUN + b"\x02\xff"),
        (RUN + b"\x00", b"\xff" + RUN + b"\x01\x01"),
    ],
)
def test_cobs_examples(data, stuffed):
    assert frames.cobs(data) == stuffed and frames.uncobs(stuffed) == data


@pytest.mark.parametrize("bytes_kept", [4096, 4097])
def test_4096_bytes_are_kept_of_what_does_not_end(bytes_kept):
    """Noise in front of them is forgotten, a frame of one byte more with it."""
    size = next(n for n in range(3000, 5000) if len(frames.encode(b"\1" * n)) == bytes_kept + 1)
    frame, deframer = frames.encode(b"\1" * size), frames.Deframer()
    deframer.feed(b"\1\1\1" + frame[:-1])
    whole = bytes_kept == 4096
    assert deframer.feed(frame[-1:]) == ([b"\1" * size] if whole else [])
    assert deframer.bad == (not whole)


def test_a_checksum_alone_is_no_payload():
    """Four bytes of 0 have the checksum of nothing."""
    assert frames.decode(frames.cobs(bytes(4))) is None
    assert frames.decode(frames.encode(b"\0")[:-1]) == b"\0"


def test_crc_check_value():
    """The catalogue's check value of CRC-32/ISO-HDLC is 0xCBF43926 for "123456789"."""
    assert frames.uncobs(frames.encode(b"123456789")[:-1])[-4:] == b"\x26\x39\xf4\xcb"


@fast
@given(st.binary(min_size=1, max_size=600))
def test_a_payload_comes_back(payload):
    frame = frames.encode(payload)
    assert 0 not in frame[:-1] and frame[-1] == 0
    assert frames.decode(frame[:-1]) == payload


@fast
@given(st.binary(min_size=1, max_size=60), st.data())
def test_a_flipped_bit_is_never_taken_for_the_payload(payload, data):
    """The CRC finds every single flipped bit; where it turns a length byte into another
    the structure breaks as well."""
    frame = bytearray(frames.encode(payload)[:-1])
    at, bit = data.draw(st.integers(0, len(frame) - 1)), data.draw(st.integers(0, 7))
    frame[at] ^= 1 << bit
    assert all(frames.decode(part) is None for part in bytes(frame).split(b"\0"))


@fast
@given(
    st.lists(st.binary(min_size=1, max_size=40), max_size=8),
    st.lists(st.integers(0, 60), max_size=8),
)
def test_however_the_stream_is_cut(payloads, cuts):
    stream = b"\0" + b"".join(map(frames.encode, payloads))
    deframer, out, rest = frames.Deframer(), [], stream
    for n in cuts:
        out += deframer.feed(rest[:n])
        rest = rest[n:]
    assert out + deframer.feed(rest) == payloads and deframer.bad == 0


@fast
@given(st.binary(max_size=3000))
def test_noise_costs_no_more_than_the_frames_it_hits(noise):
    deframer = frames.Deframer()
    deframer.feed(noise + b"\0")
    assert deframer.feed(frames.encode(b"after")) == [b"after"]


def test_without_a_zero_byte_nothing_piles_up():
    deframer = frames.Deframer()
    for _ in range(100):
        deframer.feed(b"\xff" * 1000)
    assert len(deframer._rest) <= frames.MAX_PENDING


@pytest.mark.parametrize("name", MESSAGES)
def test_a_message_comes_back(name):
    message = MESSAGES[name]
    values = {f.name: 1 if f.length == 1 else list(range(f.length)) for f in message.fields}
    payload = messages.pack(name, 0x1234, **values)
    assert messages.head(payload) == (message.code, 0x1234)
    assert messages.unpack(message, messages.body(payload)) == values
    assert messages.unpack(message, messages.body(payload) + b"\0") is None
    assert messages.dtype(message).itemsize == struct.calcsize(message.layout)


def test_a_field_that_does_not_fit_is_refused():
    with pytest.raises(
        ValueError, match=r"reference: expected the fields position_1, position_2, steps"
    ):
        messages.pack("reference", 0, position_1=1)
    with pytest.raises(ValueError, match="reference"):
        messages.pack("reference", 0, position_1=2**31, position_2=0, steps=0)
    with pytest.raises(ValueError, match=r"drives\.rate: at most 8 numbers, not 9"):
        messages.pack(
            "drives", 0, first=0, count=8, final=0, voltage=[0] * 8, rate=[0] * 9, voltage_2=[0] * 8
        )


def test_reports_become_arrays():
    names = [f.name for f in MESSAGES["telemetry"].fields]
    bodies = [
        messages.body(messages.pack("telemetry", k, **{n: k + i for i, n in enumerate(names)}))
        for k in range(3)
    ]
    table = messages.reports(bodies)
    assert table.dtype.names == tuple(names)
    for i, name in enumerate(names):
        np.testing.assert_array_equal(table[name], [i, i + 1, i + 2])
    assert len(messages.reports([])) == 0


def test_settings_are_numbered_in_their_order():
    assert [item.number for item in CONFIG.values()] == list(range(len(CONFIG)))
