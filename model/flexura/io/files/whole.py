"""Files that are kept: each appears as a whole, and is on the disk before it takes its name.

A file is written under another name in the same folder and synchronised. Then it is renamed, and
the folder is synchronised. After a loss of power there is the old file or the new one.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ...errors import InputError
from .places import DRAFT, alone, draft_of, linked, make_folder, sync, taken, unwritable


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
    with alone(target.parent):
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
