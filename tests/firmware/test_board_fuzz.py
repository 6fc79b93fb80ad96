"""Noise on the serial line of the emulated board: 10^5 bytes, random and mutated from good frames.
It stays alive and safe."""

import random

from boards import Rigged
from flexlab.board.protocol import messages
from flexlab.board.protocol.declaration import DECLARATION, MESSAGES, State
from flexlab.board.protocol.frames import decode, encode

BYTES = 100_000


def good_frames(noise: random.Random) -> list[bytes]:
    """Every command of the protocol with fields at random, numbers at random: what an attacker or a
    broken host would send."""
    out = []
    for name, message in MESSAGES.items():
        if message.code >= 128:
            continue
        size = len(
            messages.pack(name, 0, **{f.name: 0 if f.length == 1 else [] for f in message.fields})
        )
        body = DECLARATION.to_bytes(4, "little") if name == "hello" else noise.randbytes(size - 3)
        out.append(encode(bytes([message.code]) + noise.randbytes(2) + body))
    return out


def mutated(noise: random.Random) -> bytes:
    """A good frame with one to three bytes changed, dropped, doubled or swapped, or cut off; never
    whole."""
    while True:
        frame = bytearray(noise.choice(good_frames(noise)))
        for _ in range(noise.randint(1, 3)):
            k = noise.randrange(len(frame))
            kind = noise.randrange(5)
            if kind == 0:
                frame[k] = noise.randrange(256)
            elif kind == 1:
                del frame[k]
            elif kind == 2:
                frame.insert(k, frame[k])
            elif kind == 3:
                frame[k], frame[-1 - k] = frame[-1 - k], frame[k]
            else:
                frame = frame[: k + 1]
            if not frame:
                break
        if all(decode(bytes(part)) is None for part in bytes(frame).split(b"\0") if part):
            return bytes(frame)


def test_noise_and_broken_frames_move_nothing():
    """None of it is a frame with a right CRC: the outputs stay off all the time, and a session
    opens afterwards as ever."""
    noise = random.Random(11)
    with Rigged() as r:
        sent = 0
        while sent < BYTES:
            data = (
                mutated(noise)
                if noise.random() < 0.7
                else bytes(noise.randrange(256) for _ in range(noise.randint(1, 90)))
            )
            r.board.write(data)
            sent += len(data)
        while r.board.simulator.unsent:
            r.board.wait(0.01)
        r.board.wait(0.02)
        assert r.last_driven == 0 and r.board.simulator.window.resets == 0
        r.board.write(b"\0")
        r.link.connect()
        r.link.run(0.05)
        assert r.state in (State.idle, State.fault) and r.link.read_configuration()


def test_good_frames_with_senseless_fields_leave_the_board_safe():
    """Whole frames with a right CRC, in sequence, fields at random: whatever is obeyed, no output
    is ever on outside Armed and Running, positions stay in range, and the board goes on telling
    what it does."""
    noise = random.Random(12)
    with Rigged(host_timeout_s=5.0) as r:
        r.link.run(0.02)
        number, sent = r.link._next, 0
        while sent < BYTES // 4:
            frame = noise.choice(good_frames(noise))
            payload = bytearray(decode(frame[:-1]) or b"")
            if payload[0] == MESSAGES["hello"].code:
                continue
            payload[1:3] = number.to_bytes(2, "little")
            number = number + 1 & 0xFFFF
            data = encode(bytes(payload))
            sent += len(data)
            r.board.write(data)
            r.board.wait(0.004)
            for report in r.board.read().split(b"\0"):
                r.link._take(decode(report) or b"")
            assert (
                r.driven == (r.state in (State.armed, State.running))
                or r.board.now() - r.last_driven / 16e6 < 0.005
            )
        assert r.link.counts.telemetry > 1000 and r.board.simulator.window.resets == 0
        r.link.connect()
        assert r.link.identity.state in (State.idle, State.fault)
