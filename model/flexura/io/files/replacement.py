"""Finished results that replace others in a folder: at no moment do both stand side by side."""

from __future__ import annotations

import errno
import os
import shutil
from contextlib import suppress
from pathlib import Path

from .places import FINISHED, REPLACED, alone, sync, taken


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
    with alone(folder), alone(draft):
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


def settle(folder: Path) -> None:
    """End a replacement of results that was killed; does nothing where there is none.

    Args:
        folder: of the results.

    Raises:
        OSError: the file system refuses something.
    """
    if (folder / FINISHED).is_dir():
        with alone(folder / FINISHED):
            _settle(folder)


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
