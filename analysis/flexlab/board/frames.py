"""Frames on the serial line: COBS(payload, CRC-16) and a zero byte.

COBS: S. Cheshire and M. Baker, Consistent overhead byte stuffing, IEEE/ACM Trans. Networking 7 (1999) 159-172.
CRC-16/CCITT-FALSE: polynomial 0x1021, start 0xFFFF, low byte first.
"""

from __future__ import annotations

from binascii import crc_hqx

MAX_PENDING = 4096  # without a zero byte in this many the line carries something else


def encode(payload: bytes) -> bytes:
    """The bytes that go on the line for a payload."""
    data = payload + crc_hqx(payload, 0xFFFF).to_bytes(2, "little")
    out = bytearray()
    for block in data.split(b"\0"):
        while len(block) >= 254:
            out += b"\xff" + block[:254]
            block = block[254:]
        out += bytes((len(block) + 1,)) + block
    return bytes(out) + b"\0"


def decode(frame: bytes) -> bytes | None:
    """The payload of what stood before a zero byte, or None when it is no frame or its CRC is wrong."""
    out, at, end = bytearray(), 0, len(frame)
    while at < end:
        code = frame[at]
        if code == 0 or at + code > end:
            return None
        out += frame[at + 1 : at + code]
        at += code
        if at < end and code < 255:
            out.append(0)
    if len(out) < 3 or crc_hqx(bytes(out[:-2]), 0xFFFF) != int.from_bytes(out[-2:], "little"):
        return None
    return bytes(out[:-2])


class Deframer:
    """Cuts a stream of bytes into payloads; `bad` counts what came between zero bytes and was no frame."""

    def __init__(self) -> None:
        self.bad = 0
        self._rest = b""

    def feed(self, data: bytes) -> list[bytes]:
        *frames, rest = (self._rest + data).split(b"\0")
        self._rest = rest[-MAX_PENDING:]
        payloads = [(frame, decode(frame)) for frame in frames if frame]
        self.bad += sum(payload is None for _, payload in payloads)
        return [payload for _, payload in payloads if payload is not None]
