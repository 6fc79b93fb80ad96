"""Files that are kept: each appears as a whole, and is on the disk before it takes its name.

A file is written under another name in the same folder and synchronised. Then it is renamed, and
the folder is synchronised. After a loss of power there is the old file or the new one.
"""

from __future__ import annotations

import errno
import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ..errors import InputError

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

DRAFT = ".flexura-"  # how names begin that no result has
# inside a folder: new results that are on their way to their places, and the old ones
FINISHED, REPLACED = ".flexura-finished", ".flexura-replaced"


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a file as a whole; see `write_bytes`.

    Args:
        path: of the file.
        text: its content.
    """
    write_bytes(path, text.encode())


def write_bytes(path: str | os.PathLike[str], data: bytes) -> None:
    """Write a file as a whole: a reader sees the old one or the new one.

    Args:
        path: of the file.
        data: its content.

    Raises:
        InputError: it cannot be written; the old one is still there.
    """
    with replaced(path) as draft, open(draft, "wb", buffering=0) as stream:
        rest = memoryview(data)
        while rest:
            rest = rest[stream.write(rest) :]


def path_of(given: object, key: str) -> Path:
    """The path that an argument is.

    Args:
        given: a text or a path.
        key: name of the argument, for the message.

    Returns:
        The path.

    Raises:
        InputError: it is something else.
    """
    if not isinstance(given, str | os.PathLike):
        raise InputError("expected a path", key=key, value=given)
    return Path(os.fspath(given))


def refuse_taken(path: Path) -> None:
    """Refuse to write where a file is already.

    Args:
        path: of the file to write.

    Raises:
        InputError: it is there.
    """
    if os.path.lexists(path):
        raise InputError(
            "a file is there: expected another place, or overwrite=True to replace it",
            file=os.fspath(path),
        )


@contextmanager
def replaced(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A new, empty file beside `path` with its extension, which takes its place in the end.

    Folders are made if need be. If the body fails, the draft is removed and `path` is as it was.

    Args:
        path: of the file to replace.

    Yields:
        The path of the draft.

    Raises:
        InputError: the file system refuses something.
    """
    target = Path(path)
    draft = target.with_name(
        f"{DRAFT}{target.stem[:40]}-{secrets.token_hex(4)}{target.suffix[:20]}"
    )
    try:
        if target.exists() and not target.is_file():
            raise OSError(0, "not a file")  # a device or a folder
        make_folder(target.parent)
        os.close(os.open(draft, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o644))
        try:
            yield draft
            sync(draft)
            os.replace(draft, target)
        except BaseException:
            with suppress(OSError):
                draft.unlink(missing_ok=True)
            raise
        sync(target.parent)
    except OSError as error:
        raise unwritable(target, error) from None


def leftovers(path: Path) -> Iterator[Path]:
    """Drafts of a file that a process left which was killed while it wrote.

    Args:
        path: of the file.

    Yields:
        The drafts.
    """
    yield from path.parent.glob(f"{DRAFT}{path.stem[:40]}-*{path.suffix[:20]}")


def move(source: Path, target: Path) -> None:
    """Rename a file or folder on one file system, and synchronise both parents.

    Args:
        source: its present path.
        target: its new path.

    Raises:
        OSError: the file system refuses it.
    """
    os.rename(source, target)
    sync(target.parent)
    if source.parent != target.parent:
        sync(source.parent)


def make_folder(folder: Path) -> list[Path]:
    """Make a folder and those above it, on the disk itself.

    Args:
        folder: the folder.

    Returns:
        The new ones, the outermost first.

    Raises:
        OSError: the file system refuses it; none of them is left.
    """
    new = [p for p in (folder, *folder.parents) if not os.path.lexists(p)]
    made: list[Path] = []
    try:
        for p in reversed(new):
            try:
                p.mkdir()
            except FileExistsError:  # another process was faster
                continue
            made.append(p)
            sync(p.parent)
        if not folder.is_dir():
            raise NotADirectoryError(0, "a file, not a folder", str(folder))
    except OSError:
        for p in reversed(made):
            with suppress(OSError):
                p.rmdir()
        raise
    return made


def sync(path: Path) -> None:
    """Write a file, or the names in a folder, to the disk itself.

    Some file systems cannot do that with folders; then it is theirs to keep the names.

    Args:
        path: of the file or folder.

    Raises:
        OSError: the disk fails.
    """
    folder = path.is_dir()
    try:
        handle = os.open(path, os.O_RDONLY if folder else os.O_RDWR)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
    except OSError as error:
        if not folder or error.errno not in (errno.EACCES, errno.EINVAL, errno.ENOTSUP):
            raise


def unwritable(path: str | os.PathLike[str], error: Exception, key: str = "") -> InputError:
    """The error that says which file or folder cannot be written, and why.

    Args:
        path: of the file or folder.
        error: of the file system.
        key: name of the argument that has the path.

    Returns:
        The error to raise.
    """
    why = getattr(error, "strerror", None) or str(error)
    text = f"cannot be written ({why})"
    if key:
        return InputError(text, key=key, value=os.fspath(path))
    return InputError(text, file=os.fspath(path))


def replace_results(draft: Path, folder: Path) -> None:
    """Move finished results into a folder that is there, over those of the same names.

    One rename decides: before it the old results hold, after it the new ones. If the process ends
    in between, `settle` goes on. At no moment do old and new results stand side by side.

    Args:
        draft: a folder in `folder`, with the results; it is gone afterwards.
        folder: where they go.

    Raises:
        OSError: the file system refuses something. The old results are there, or the new ones: in
            their places if the file system refused once, else in FINISHED, and it says so.
    """
    settle(folder)
    with _alone(draft):
        try:
            move(draft, folder / FINISHED)
            _settle(folder)
        except OSError as error:
            with suppress(OSError):
                _settle(folder)
            if not (folder / FINISHED).exists():
                raise
            where = f"the new results are whole in {FINISHED}: the next call with this folder "
            why = f"{error.strerror}; {where}moves them to their places"
            raise OSError(error.errno, why) from error


def settle(folder: Path) -> None:
    """End a replacement of results that was killed; does nothing where there is none.

    Args:
        folder: of the results.

    Raises:
        OSError: the file system refuses something.
    """
    if (folder / FINISHED).is_dir():
        with _alone(folder / FINISHED):
            _settle(folder)


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """No other process works on this folder, whatever its name becomes."""
    handle = -1
    with suppress(FileNotFoundError):  # another process has done it
        handle = -1 if fcntl is None else os.open(folder, os.O_RDONLY)
    try:
        if handle >= 0:
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        if handle >= 0:
            os.close(handle)


def _settle(folder: Path) -> None:
    finished, old = folder / FINISHED, folder / REPLACED
    try:
        entries = sorted(finished.iterdir())
    except FileNotFoundError:  # another process has done it
        return
    shutil.rmtree(old, ignore_errors=True)
    old.mkdir(exist_ok=True)
    for entry in entries:  # what is left here has not been moved: old results are in its place
        if os.path.lexists(folder / entry.name):
            os.rename(folder / entry.name, old / entry.name)
    sync(folder)
    for entry in entries:
        os.rename(entry, folder / entry.name)
    sync(folder)
    finished.rmdir()
    shutil.rmtree(old, ignore_errors=True)
    sync(folder)
