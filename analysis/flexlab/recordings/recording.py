"""What arrives from the board, on disk before anybody looks at it: an append-only file of the bytes
as they were on the line.

A recording is a folder: `session.json` is there before anything moves; `received.bin` grows with
every read, unbuffered, so that a killed program loses nothing; `events.jsonl` has what the host saw
and did, stamped with the board's tick. Frames carry their own ends and checksums, so a torn end is
seen as such. `rebuild` makes the Run from these three and nothing else.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flexura.errors import FlexuraError, InputError
from flexura.io import write_text

from ..board.base import Board

SESSION, RECEIVED, EVENTS = "session.json", "received.bin", "events.jsonl"


class RecordingError(FlexuraError):
    """What arrives can't be kept: the disk is full, or gone."""


class Recording:
    """The files of a recording under way, locked for this program; `failed` once one of them could
    not be written."""

    def __init__(self, folder: Path, session: dict[str, Any]) -> None:
        if (folder / SESSION).exists() or (folder / "run.parquet").exists():
            raise InputError(
                "holds a recording already: expected a new folder", key="--out", value=str(folder)
            )
        self.folder = folder
        self.failed: RecordingError | None = None
        self._session = session
        folder.mkdir(parents=True, exist_ok=True)
        self.know()
        flags = os.O_CREAT | os.O_WRONLY | os.O_APPEND
        self._received = os.open(folder / RECEIVED, flags, 0o644)
        self._events = os.open(folder / EVENTS, flags, 0o644)
        fcntl.flock(self._received, fcntl.LOCK_EX | fcntl.LOCK_NB)

    def know(self, **more: Any) -> None:
        """Put more into session.json; it is replaced as a whole."""
        self._session = self._session | more
        write_text(self.folder / SESSION, json.dumps(self._session, indent=1))

    def received(self, data: bytes) -> None:
        """Append bytes as they came. Raises RecordingError once; later bytes are let go: the motors
        must still be stopped."""
        self._append(self._received, RECEIVED, data)

    def event(self, text: str, level: str = "INFO", tick: int | None = None, **more: Any) -> None:
        """Append what happened; `tick` is the board's, None: before or after its reports."""
        line = json.dumps({"text": text, "level": level, "tick": tick} | more)
        self._append(self._events, EVENTS, line.encode() + b"\n")

    def _append(self, handle: int, name: str, data: bytes) -> None:
        if self.failed is not None and name == RECEIVED:
            return
        try:
            while data:
                data = data[os.write(handle, data) :]
        except OSError as error:
            if self.failed is None:
                self.failed = RecordingError(
                    f"{self.folder / name}: {error.strerror}; what had been received before is kept"
                )
                raise self.failed from None

    def close(self) -> None:
        """To the disk itself, and unlocked. May be called twice."""
        for handle in (self._received, self._events):
            if handle >= 0:
                # a full disk was told when it was written to; a pipe has nothing to sync
                with contextlib.suppress(OSError):
                    os.fsync(handle)
                os.close(handle)
        self._received = self._events = -1

    def discard(self) -> None:
        """Take the files away again: nothing moved, there is nothing to keep."""
        self.close()
        for name in (SESSION, RECEIVED, EVENTS):
            (self.folder / name).unlink(missing_ok=True)
        if not any(self.folder.iterdir()):
            self.folder.rmdir()


@dataclass
class Recorded:
    """A board (see `board.base.Board`) whose bytes are in the recording before they are anywhere
    else."""

    board: Board
    recording: Recording

    def __post_init__(self) -> None:
        self.label, self.emulated = self.board.label, self.board.emulated

    def read(self) -> bytes:
        data = self.board.read()
        if data:
            self.recording.received(data)
        return data

    def write(self, data: bytes) -> None:
        self.board.write(data)

    def wait(self, seconds: float) -> None:
        self.board.wait(seconds)

    def now(self) -> float:
        return self.board.now()

    def reset(self) -> None:
        self.board.reset()

    def close(self) -> None:
        self.board.close()


@dataclass(frozen=True)
class Kept:
    """A recording as read from its folder."""

    folder: Path
    session: dict[str, Any]
    received: bytes
    events: list[dict[str, Any]]


def read(folder: str | Path) -> Kept:
    """Read a recording's folder; a last line that was not finished is left out. Raises InputError
    where there is none."""
    path = Path(folder)
    try:
        session = json.loads((path / SESSION).read_text(encoding="utf-8"))
        received = (path / RECEIVED).read_bytes()
        lines = (path / EVENTS).read_bytes().split(b"\n")[:-1]
        events = [json.loads(line) for line in lines]
    except FileNotFoundError as error:
        raise InputError(
            f"no recording here: expected {Path(error.filename).name}", file=str(folder)
        ) from None
    except ValueError as error:
        raise InputError(f"a damaged recording ({error})", file=str(folder)) from None
    if not isinstance(session, dict):
        raise InputError(f"a damaged recording: {SESSION} is not a table", file=str(folder))
    return Kept(path, session, received, events)


def unfinished(logs: Path) -> list[Path]:
    """Folders in `logs` with a recording of which no Run was made, and that no program is
    writing."""
    found = []
    for session in sorted(logs.glob(f"*/{SESSION}")):
        folder = session.parent
        if (folder / "run.parquet").exists() or not (folder / RECEIVED).exists():
            continue
        with open(folder / RECEIVED, "rb") as stream:
            try:
                fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                continue
        found.append(folder)
    return found
