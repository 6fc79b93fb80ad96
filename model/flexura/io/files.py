"""Files that are kept: each appears as a whole, and is on the disk before it takes its name.

A file is written under another name in the same folder and synchronised. Then it is renamed, and
the folder is synchronised. After a loss of power there is the old file or the new one.
"""

from __future__ import annotations

import errno
import os
import secrets
import shutil
import stat
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


def write_text(path: str | os.PathLike[str], text: str, *, new: bool = False) -> None:
    """Write a file as a whole; see `write_bytes`.

    Args:
        path: of the file.
        text: its content.
        new: no file may be there.
    """
    write_bytes(path, text.encode(), new=new)


def write_bytes(path: str | os.PathLike[str], data: bytes, *, new: bool = False) -> None:
    """Write a file as a whole: a reader sees the old one or the new one.

    Args:
        path: of the file.
        data: its content.
        new: no file may be there, not even one that another process wrote meanwhile.

    Raises:
        InputError: it cannot be written; the old one is still there.
    """
    with replaced(path, new=new) as draft, open(draft, "wb", buffering=0) as stream:
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
        what = "a file is" if path.exists() else "a link to nothing is"
        raise InputError(
            f"{what} there: expected another place, or overwrite=True to replace it",
            file=os.fspath(path),
        )


@contextmanager
def replaced(path: str | os.PathLike[str], *, new: bool = False) -> Iterator[Path]:
    """A new, empty file beside `path` with its extension, which takes its place in the end.

    Folders are made if need be. If the body fails, the draft is removed and `path` is as it was. A
    link stays, and the file that it leads to is replaced; its permissions stay.

    Args:
        path: of the file to replace.
        new: no file may be there, not even one that another process wrote meanwhile.

    Yields:
        The path of the draft.

    Raises:
        InputError: the file system refuses something.
    """
    target = linked(path)
    draft = draft_of(target)
    try:
        if target.exists() and not target.is_file():
            raise OSError(0, "not a file")  # a device or a folder
        make_folder(target.parent)
        os.close(os.open(draft, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o644))
        try:
            yield draft
            put(draft, target, new=new)
        except BaseException:
            with suppress(OSError):
                draft.unlink(missing_ok=True)
            raise
    except FileExistsError:
        refuse_taken(Path(path))
        raise
    except OSError as error:
        raise unwritable(path, error) from None


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


def put(draft: Path, target: Path, *, new: bool) -> None:
    """Give a file or folder its name, on the disk itself; a file gets the permissions of the one
    it replaces.

    Args:
        draft: in the same folder.
        target: its name.
        new: nothing may have this name.

    Raises:
        FileExistsError: it is `new`, and something has this name.
        OSError: the file system refuses something.
    """
    if not new:
        with suppress(OSError):
            draft.chmod(stat.S_IMODE(target.stat().st_mode))
    sync(draft)
    with _alone(target.parent):
        if new and taken(target):
            raise FileExistsError(errno.EEXIST, "a file is there", os.fspath(target))
        os.replace(draft, target)
    sync(target.parent)


def leftovers(path: Path) -> Iterator[Path]:
    """Drafts of a file that a process left which was killed while it wrote.

    Args:
        path: of the file.

    Yields:
        The drafts.
    """
    yield from path.parent.glob(f"{DRAFT}{path.stem[:40]}-*{path.suffix[:20]}")


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


def replace_results(draft: Path, folder: Path, *, new: bool = False) -> None:
    """Move finished results into a folder that is there, over those of the same names.

    One rename decides: before it the old results hold, after it the new ones. If the process ends
    in between, `settle` goes on. At no moment do old and new results stand side by side.

    Args:
        draft: a folder in `folder`, with the results; it is gone afterwards.
        folder: where they go.
        new: there may be nothing else in the folder.

    Raises:
        FileExistsError: they are `new`, and other results are there.
        OSError: the file system refuses something. The old results are there, or the new ones: in
            their places if the file system refused once, else in FINISHED, and it says so.
    """
    settle(folder)
    with _alone(folder), _alone(draft):
        if new and taken(folder):
            raise FileExistsError(errno.EEXIST, "results are there", os.fspath(folder))
        try:
            os.rename(draft, folder / FINISHED)
            sync(folder)
            _settle(folder)
        except OSError as error:
            with suppress(OSError):
                _settle(folder)
            if not (folder / FINISHED).exists():
                raise
            where = f"the new results are whole in {FINISHED}: the next call with this folder "
            why = f"{error.strerror}; {where}moves them to their places"
            raise OSError(error.errno, why) from error


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
            with suppress(OSError):  # file systems that cannot lock
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
