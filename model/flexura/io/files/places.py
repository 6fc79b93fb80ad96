"""Places of files and folders: their names, folders on the disk itself, and locks."""

from __future__ import annotations

import errno
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ...errors import InputError

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

DRAFT = ".flexura-"  # how names begin that no result has
# inside a folder: new results that are on their way to their places, and the old ones
FINISHED, REPLACED = ".flexura-finished", ".flexura-replaced"


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


def check_suffix(path: str | os.PathLike[str], suffix: str, key: str) -> None:
    """Refuse a file whose name says that it has another format.

    Args:
        path: of the file to write.
        suffix: how its name has to end.
        key: name of the argument, for the message.

    Raises:
        InputError: it ends with something else.
    """
    if Path(path).suffix.lower() != suffix:
        expected = f"expected a name that ends with {suffix}"
        raise InputError(expected, key=key, value=os.fspath(path))


def linked(path: str | os.PathLike[str]) -> Path:
    """The file that a link leads to, there or not.

    Args:
        path: a link, or any other path.

    Returns:
        The file; any other path as it is.
    """
    return Path(os.path.realpath(path)) if os.path.islink(path) else Path(path)


def draft_of(path: Path) -> Path:
    """A new name beside a file, with its extension.

    Args:
        path: of the file.

    Returns:
        The path with the new name.
    """
    return path.with_name(f"{DRAFT}{path.stem[:40]}-{secrets.token_hex(4)}{path.suffix[:20]}")


def taken(path: Path) -> bool:
    """Whether something is there that results would stand on.

    Args:
        path: of the results.

    Returns:
        True for a file, or a folder with entries other than drafts of killed processes.

    Raises:
        OSError: it cannot be looked into.
    """
    if not path.is_dir():
        return os.path.lexists(path)
    # what a killed process had in work is no result; a replacement that was decided is one
    names = (entry.name for entry in path.iterdir())
    return any(not name.startswith(DRAFT) or name == FINISHED for name in names)


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


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """No other process works on this folder, whatever its name becomes.

    Args:
        folder: the folder; where none is there, nothing is locked.

    Yields:
        Nothing.
    """
    handle = -1
    with suppress(FileNotFoundError):  # another process has done it
        handle = -1 if fcntl is None else os.open(folder, os.O_RDONLY)
    try:
        if handle >= 0:
            with suppress(OSError):  # file systems that cannot lock
                fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        if handle >= 0:
            os.close(handle)
