"""Frames on the serial line: COBS(payload, CRC-32) and a zero byte.

COBS: S. Cheshire and M. Baker, Consistent overhead byte stuffing, IEEE/ACM Trans. Networking 7
(1999) 159-172. The CRC is that of IEEE 802.3, low byte first.
"""

from __future__ import annotations

from zlib import crc32

CRC_BYTES = 4
MAX_PENDING = 4096  # without a zero byte in this many the line carries something else


def cobs(data: bytes) -> bytes:
    """The same information without zero bytes: each block is led by its length plus one; 255 leads
    254 bytes and no zero."""
    out = bytearray()
    for block in data.split(b"\0"):
        while len(block) >= 254:
            out += b"\xff" + block[:254]
            block = block[254:]
        out += bytes((len(block) + 1,)) + block
    return bytes(out)


def uncobs(data: bytes) -> bytes | None:
    """What `cobs` was given, or None when the data are not its work."""
    out, at, end = bytearray(), 0, len(data)
    while at < end:
        code = data[at]
        if code == 0 or at + code > end:
            return None
        out += data[at + 1 : at + code]
        at += code
        if at < end and code < 255:
            out.append(0)
    return bytes(out)


def encode(payload: bytes) -> bytes:
    """The bytes that go on the line for a payload."""
    return cobs(payload + crc32(payload).to_bytes(CRC_BYTES, "little")) + b"\0"


def decode(frame: bytes) -> bytes | None:
    """The payload of what stood before a zero byte, or None when it is no frame or its CRC is
    wrong."""
    data = uncobs(frame)
    if data is None or len(data) <= CRC_BYTES:
        return None
    payload, crc = data[:-CRC_BYTES], data[-CRC_BYTES:]
    return payload if crc32(payload) == int.from_bytes(crc, "little") else None


class Deframer:
    """Cuts a stream of bytes into payloads; `bad` counts what came between zero bytes and was no
    frame."""

    def __init__(self) -> None:
        self.bad = 0
        self._rest = b""

    def feed(self, data: bytes) -> list[bytes]:
        """Take received bytes.

        Args:
            data: the bytes; a frame may be spread over several calls.

        Returns:
            The payloads of the good frames that they complete. `bad` counts the others.
        """
        *frames, rest = (self._rest + data).split(b"\0")
        self._rest = rest[-MAX_PENDING:]
        payloads = [(frame, decode(frame)) for frame in frames if frame]
        self.bad += sum(payload is None for _, payload in payloads)
        return [payload for _, payload in payloads if payload is not None]
