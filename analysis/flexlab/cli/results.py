"""Where a command leaves its results: tried before the work, and nothing overwritten.

The results are written into a folder beside their place, and moved there when they are whole. An
interruption leaves finished results as they are.
"""

from __future__ import annotations

import itertools
import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from flexura.errors import InputError
from flexura.io import (
    DRAFT,
    FINISHED,
    make_folder,
    move,
    replace_results,
    settle,
    unwritable,
)
from flexura.io.drawing import NoPicture

from ..runs.formatting import file_name

LOGS = Path("logs")
REPLACE = "or --force, which replaces files of the same names"


@dataclass(frozen=True)
class Draft:
    """A folder to write into, and the place of the results."""

    folder: Path
    target: Path
    counts: bool  # the place is a default, which counts up

    def keep(self, *, interrupted: bool = False) -> Path:
        """Move the results to their place, and return it.

        Interrupted work replaces no finished results: it stands in a folder beside.
        """
        try:
            return self._kept(interrupted)
        except OSError as error:
            raise unwritable(self.target, error, "--out") from None

    def _kept(self, interrupted: bool) -> Path:
        target = self.target
        if self.counts or (interrupted and taken(target)):
            stem = target if self.counts else target.with_name(f"{target.name}-interrupted")
            while True:
                target = counted(stem, folder=True)
                try:
                    move(self.folder, target)
                    return target
                except OSError:
                    if not os.path.lexists(target):  # else another process took this number
                        raise
        if not target.exists():
            move(self.folder, target)
            return target
        replace_results(self.folder, target)
        return target


@contextmanager
def results(out: Path | None, *names: str, force: bool = False) -> Iterator[Draft]:
    """A draft of the folder `out`, or by default of logs/NAME-NAME-1, -2, ...

    What has not been kept at the end is removed. Where a picture alone fails, all else is kept.

    Raises:
        InputError: `out` has something in it and `force` is false, or it cannot be written.
    """
    target = LOGS / "-".join(map(file_name, names)) if out is None else out
    refuse_taken(out, force)
    with _folder(target, out is None) as folder, _named(folder, target):
        draft = Draft(folder, target, out is None)
        try:
            yield draft
        except NoPicture as error:
            raise NoPicture(f"{error}; all else is stored in {draft.keep()}") from error


def refuse_taken(out: Path | None, force: bool) -> None:
    """Refuse a folder that has something in it.

    Args:
        out: the folder; None: a default that is not there yet.
        force: files of the same names may be replaced.

    Raises:
        InputError: `out` has something in it and `force` is false.
    """
    if out is not None and not force and taken(out):
        raise InputError(
            f"results are there: expected a new or empty folder, {REPLACE}",
            key="--out",
            value=str(out),
        )


@contextmanager
def replacing(folder: Path) -> Iterator[Path]:
    """A draft of results that in the end replace those of the same names in `folder`, together.

    Raises:
        InputError: the folder cannot be written; the old results are as they were.
    """
    failed: NoPicture | None = None
    with _folder(folder, False) as draft, _named(draft, folder):
        try:
            yield draft
        except NoPicture as error:
            failed = NoPicture(f"{error}; all else is stored in {folder}")
        try:
            replace_results(draft, folder)
        except OSError as error:
            raise unwritable(folder, error, "--out") from None
    if failed:
        raise failed


def continued(out: Path | None, *names: str, mark: str) -> Path:
    """The folder of a command that goes on where it was stopped: `out`, or logs/NAME-NAME.

    Raises:
        InputError: the folder cannot be written, or has files but no `mark` of such a command.
    """
    target = LOGS / "-".join(map(file_name, names)) if out is None else out
    if taken(target) and not (target / mark).exists():
        raise InputError(
            f"other files are there: expected a new or empty folder, or one with {mark} to go on",
            key="--out",
            value=str(target),
        )
    with _folder(target, False):
        return target


@contextmanager
def file_result(path: Path | None, key: str = "--out", *, force: bool = False) -> Iterator[None]:
    """Try a file before the work: it is not there, and can be written.

    Folders that were made for it are removed if it is not there at the end.

    Raises:
        InputError: the file is there and `force` is false, or it cannot be written.
    """
    if path is None:
        yield
        return
    if os.path.isdir(path):
        raise InputError("a folder: expected the name of a file", key=key, value=str(path))
    if os.path.lexists(path) and not force:
        raise InputError(
            "a file is there: expected another name, or --force to replace it",
            key=key,
            value=str(path),
        )
    made: list[Path] = []
    try:
        try:
            made = make_folder(path.parent)
            trial = path.parent / f"{DRAFT}{secrets.token_hex(4)}"
            trial.touch(exist_ok=False)
            trial.unlink()
        except (OSError, ValueError) as error:
            raise unwritable(path, error, key) from None
        yield
    finally:
        _remove_empty(made)


def counted(path: Path, *, folder: bool = False) -> Path:
    """The first of NAME-1.EXT, NAME-2.EXT, ... that is not there; a folder has no extension."""
    stem, extension = (path.name, "") if folder else (path.stem, path.suffix)
    places = (path.with_name(f"{stem}-{k}{extension}") for k in itertools.count(1))
    return next(place for place in places if not os.path.lexists(place))


def taken(path: Path) -> bool:
    """Whether something is there that results would stand on: a file, or a folder with entries."""
    try:
        if not path.is_dir():
            return os.path.lexists(path)
        # what a killed process had in work is no result; a replacement that was decided is one
        names = (entry.name for entry in path.iterdir())
        return any(not name.startswith(DRAFT) or name == FINISHED for name in names)
    except (OSError, ValueError):  # what cannot be read is refused where it is tried
        return False


@contextmanager
def _named(draft: Path, target: Path) -> Iterator[None]:
    """Errors name files where they would have been in the end."""
    try:
        yield
    except InputError as error:
        if error.file and Path(error.file).is_relative_to(draft):
            raise error.in_file(str(target / Path(error.file).relative_to(draft))) from None
        raise


@contextmanager
def _folder(target: Path, counts: bool) -> Iterator[Path]:
    """A new folder on the same file system as `target`: in it if it is there, else beside it."""
    made: list[Path] = []
    folder = Path()
    try:
        try:
            inside = not counts and target.is_dir()
            parent = target if inside else target.parent
            folder = parent / f"{DRAFT}{secrets.token_hex(4)}"
            made = make_folder(parent)
            settle(parent)
            if not inside and not counts and os.path.lexists(target):
                raise NotADirectoryError(0, "a file, not a folder")
            folder.mkdir()
            if not inside:
                (folder / target.name).mkdir()  # a name that the file system refuses
                (folder / target.name).rmdir()
        except (OSError, ValueError) as error:
            raise unwritable(target, error, "--out") from None
        yield folder
    finally:
        if folder.name:
            shutil.rmtree(folder, ignore_errors=True)
        _remove_empty(made)


def _remove_empty(folders: list[Path]) -> None:
    for folder in reversed(folders):
        with suppress(OSError):
            folder.rmdir()
