"""The seal of a review: a digest of all bytes of the file, in the file.

Rerun's file (.rrd) is a head, messages of a kind and a length, and a footer that says where the
table of contents is. The seal stands in a field that no reader of Rerun's knows, at the end of a
second copy of the first message. Rerun's own library ends the process where some bytes are damaged:
a review is checked before it is read.
"""

from __future__ import annotations

import struct
from pathlib import Path

from flexura.errors import FlexuraError, InputError
from flexura.io import read_sealed, say_unsealed, sealed

HEAD = 12  # bytes: RRF2, the version, the options
MESSAGE = struct.Struct("<QQ")  # kind and length
FOOTER = struct.Struct("<QQI8sI")  # where the table begins, its length, its CRC, a mark, how many
MARK = b"RRF2FOOT"
SEAL = len(sealed(b""))
FIELD = b"\x82\x7d" + bytes([SEAL])  # of a message: number 2000, bytes, so many


def sealed_review(content: bytes) -> bytes:
    """Put a seal into a review.

    Raises:
        FlexuraError: Rerun has written another form of file than the one that is known here.
    """
    start, length, crc, mark, count = FOOTER.unpack(content[-FOOTER.size :])
    kind, size = MESSAGE.unpack_from(content, HEAD)
    known = content[:4] == b"RRF2" and mark == MARK and (kind, count) == (1, 1)
    at = start - MESSAGE.size
    if not known or start + length + FOOTER.size != len(content):
        raise FlexuraError("this version of Rerun writes files that flexura does not know")
    first = content[HEAD + MESSAGE.size :][:size] + FIELD
    message = MESSAGE.pack(kind, len(first) + SEAL) + first
    moved = FOOTER.pack(start + len(message) + SEAL, length, crc, mark, count)
    whole = content[:at] + message + content[at : -FOOTER.size] + moved
    return sealed(whole, at + len(message))


def check_review(path: Path) -> None:
    """See that a review is there, and that every byte is as it was written.

    One without a seal is of an older version, or of another program: one line says so.

    Raises:
        InputError: it is not there, or damaged.
    """
    if not path.is_file():
        raise InputError("no such file: expected a review (.rrd)", file=str(path))
    try:
        content, known = read_sealed(path, "write it again from its runs", "a damaged review")
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=str(path)) from None
    if not known and content[-FOOTER.size :][20:28] != MARK:
        raise InputError("not a Rerun recording, or cut off: expected a review", file=str(path))
    if not known:
        say_unsealed(path)
