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
    check_suffix,
    draft_of,
    linked,
    make_folder,
    put,
    replace_results,
    settle,
    unwritable,
)
from flexura.io import taken as in_use
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
    force: bool = False

    def keep(self, *, interrupted: bool = False) -> Path:
        """Move the results to their place, and return it.

        Interrupted work replaces no finished results: it stands in a folder beside.

        Raises:
            InputError: other results came there meanwhile, and these stand beside; or the file
                system refuses something.
        """
        try:
            if self.counts:
                return _counted(self.folder, self.target)
            if interrupted and taken(self.target):
                return _counted(self.folder, _named_beside(self.target, "-interrupted"))
            try:
                if self.target.is_dir():
                    replace_results(self.folder, self.target, new=not self.force)
                else:
                    put(self.folder, self.target, new=True)
            except FileExistsError:
                beside = _counted(self.folder, _named_beside(self.target))
                raise _late(self.target, beside, "results", "--out") from None
        except OSError as error:
            raise unwritable(self.target, error, "--out") from None
        return self.target


def _named_beside(target: Path, end: str = "") -> Path:
    """A name beside a place; that of the working folder is its full one."""
    target = target if target.name else Path(os.path.abspath(target))
    return target.with_name(f"{target.name}{end}")


def _counted(draft: Path, path: Path, *, folder: bool = True) -> Path:
    """Give a draft the first free name of NAME-1.EXT, NAME-2.EXT, ..., and return it."""
    while True:
        target = counted(path, folder=folder)
        try:
            put(draft, target, new=True)
            return target
        except FileExistsError:  # another process took this number
            continue


def _late(path: Path, beside: Path, what: str, key: str) -> InputError:
    """The error of a command that another one was faster than."""
    text = f"another command left {what} there meanwhile: what this one made is in {beside}"
    return InputError(text, key=key, value=str(path))


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
        draft = Draft(folder, target, out is None, force)
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
        wanted = "expected a new or empty folder"
        raise InputError(
            f"results are there: {wanted}, {REPLACE}"
            if out.exists()
            else f"a link to nothing: {wanted}",
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
def file_result(
    path: Path | None, key: str = "--out", *, force: bool = False, suffix: str = ""
) -> Iterator[Path]:
    """Try a file before the work: it is not there, and can be written.

    Folders that were made for it are removed if it is not there at the end.

    Yields:
        A draft: what is written there gets the file's name in the end. Without a path, none.

    Raises:
        InputError: the file is there and `force` is false, it has another suffix, or it cannot be
            written. If another command wrote it meanwhile, the new one stands beside.
    """
    if path is None:
        yield Path()
        return
    if suffix:
        check_suffix(path, suffix, key)
    if os.path.isdir(path):
        raise InputError("a folder: expected the name of a file", key=key, value=str(path))
    if os.path.lexists(path) and not force:
        what = "a file is there" if path.exists() else "a link to nothing"
        raise InputError(
            f"{what}: expected another name, or --force to replace it",
            key=key,
            value=str(path),
        )
    made: list[Path] = []
    target = linked(path)
    draft = draft_of(target)
    try:
        try:
            made = make_folder(target.parent)
            draft.touch(exist_ok=False)
            draft.unlink()
        except (OSError, ValueError) as error:
            raise unwritable(path, error, key) from None
        with _named(draft, path):
            yield draft
        try:
            if draft.exists():
                put(draft, target, new=not force)
        except FileExistsError:
            beside = _counted(draft, target, folder=False)
            raise _late(path, beside, "a file", key) from None
        except OSError as error:
            raise unwritable(path, error, key) from None
    finally:
        with suppress(OSError):
            draft.unlink(missing_ok=True)
        _remove_empty(made)


def counted(path: Path, *, folder: bool = False) -> Path:
    """The first of NAME-1.EXT, NAME-2.EXT, ... that is not there; a folder has no extension."""
    stem, extension = (path.name, "") if folder else (path.stem, path.suffix)
    places = (path.with_name(f"{stem}-{k}{extension}") for k in itertools.count(1))
    return next(place for place in places if not os.path.lexists(place))


def taken(path: Path) -> bool:
    """Whether something is there that results would stand on; what cannot be read is refused where
    it is tried."""
    try:
        return in_use(path)
    except (OSError, ValueError):
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
                what = "a file" if target.exists() else "a link to nothing"
                raise NotADirectoryError(0, f"{what}, not a folder")
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
