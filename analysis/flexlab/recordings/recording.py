"""A recording: bytes from the board, on disk before anything else is done with them.

A recording is a folder. `session.json` is written before anything moves. `received.bin` grows with
every read, unbuffered, so that a killed program loses nothing. `events.jsonl` has what the host saw
and did, with the board's tick. Frames carry their own ends and checksums, so that a torn end is
recognised. `run_from_recording` makes the Run from these three files only.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flexura.errors import FlexuraError, InputError
from flexura.io import write_text

from ..board.base import Board

if sys.platform == "win32":  # not tried
    import msvcrt
else:
    import fcntl

SESSION, RECEIVED, EVENTS = "session.json", "received.bin", "events.jsonl"
RUN = "run.parquet"


class RecordingError(FlexuraError):
    """Received bytes cannot be stored: the disk is full, or gone."""


class Recording:
    """The files of a recording in progress, locked for this program.

    `failed` is set once a file cannot be written.
    """

    def __init__(self, folder: Path, session: dict[str, Any], *, replace: bool = False) -> None:
        """Open a new recording.

        Args:
            folder: made if missing.
            session: content of session.json.
            replace: whether a recording in the folder, with its Run, is removed.

        Raises:
            InputError: the folder holds a recording already, and `replace` is false.
        """
        if ((folder / SESSION).exists() or (folder / RUN).exists()) and not replace:
            raise InputError(
                "holds a recording already: expected a new folder", key="--out", value=str(folder)
            )
        for name in (SESSION, RECEIVED, EVENTS, RUN):
            (folder / name).unlink(missing_ok=True)
        self.folder = folder
        self.failed: RecordingError | None = None
        self._session = session
        folder.mkdir(parents=True, exist_ok=True)
        self.write_session()
        flags = os.O_CREAT | os.O_WRONLY | os.O_APPEND
        self._received_file = os.open(folder / RECEIVED, flags, 0o644)
        self._events_file = os.open(folder / EVENTS, flags, 0o644)
        _lock(self._received_file)

    def write_session(self, **more: Any) -> None:
        """Add entries to session.json, which is replaced as a whole."""
        self._session = self._session | more
        write_text(self.folder / SESSION, json.dumps(self._session, indent=1))

    def received(self, data: bytes) -> None:
        """Append bytes as they came.

        Raises:
            RecordingError: at the first failure; later bytes are dropped, so that the motors can be
                stopped.
        """
        self._append(self._received_file, RECEIVED, data)

    def event(self, text: str, level: str = "INFO", tick: int | None = None, **more: Any) -> None:
        """Append an event.

        Args:
            text: what happened.
            level: "INFO", "WARN" or "ERROR".
            tick: the board's tick; None: before or after its reports.
            more: further entries of the line.
        """
        line = json.dumps({"text": text, "level": level, "tick": tick} | more)
        self._append(self._events_file, EVENTS, line.encode() + b"\n")

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
        """Write to the disk itself and unlock. May be called twice."""
        for handle in (self._received_file, self._events_file):
            if handle >= 0:
                # a full disk was reported by the write; a pipe has nothing to sync
                with contextlib.suppress(OSError):
                    os.fsync(handle)
                os.close(handle)
        self._received_file = self._events_file = -1

    def discard(self) -> None:
        """Remove the files: nothing moved."""
        self.close()
        for name in (SESSION, RECEIVED, EVENTS):
            (self.folder / name).unlink(missing_ok=True)
        if not any(self.folder.iterdir()):
            self.folder.rmdir()


@dataclass
class RecordingBoard:
    """A board (`board.base.Board`) whose received bytes are recorded before they are returned."""

    board: Board
    recording: Recording

    def __post_init__(self) -> None:
        self.label, self.emulated = self.board.label, self.board.emulated

    def read(self) -> bytes:
        """Read from the board, and record what came."""
        data = self.board.read()
        if data:
            self.recording.received(data)
        return data

    def write(self, data: bytes) -> None:
        """Write to the board."""
        self.board.write(data)

    def wait(self, seconds: float) -> None:
        """Wait by the board's clock [s]."""
        self.board.wait(seconds)

    def now(self) -> float:
        """The board's clock [s]."""
        return self.board.now()

    def reset(self) -> None:
        """Reset the board."""
        self.board.reset()

    def close(self) -> None:
        """Close the board."""
        self.board.close()


@dataclass(frozen=True)
class StoredRecording:
    """A recording as read from its folder."""

    folder: Path
    session: dict[str, Any]
    received: bytes
    events: list[dict[str, Any]]


def read(folder: str | Path) -> StoredRecording:
    """Read a recording's folder; an unfinished last line of events is left out.

    Raises:
        InputError: there is no recording, or it is damaged.
    """
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
    return StoredRecording(path, session, received, events)


def unfinished(logs: Path) -> list[Path]:
    """Folders in `logs` with a recording that has no Run and that no program is writing."""
    found = []
    for session in sorted(logs.glob(f"*/{SESSION}")):
        folder = session.parent
        if (folder / RUN).exists() or not (folder / RECEIVED).exists():
            continue
        with open(folder / RECEIVED, "rb") as stream:
            if not _lock(stream.fileno()):
                continue
        found.append(folder)
    return found


def _lock(file: int) -> bool:
    """Lock an open file for this program; false if another program has it."""
    try:
        if sys.platform == "win32":
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
        else:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
