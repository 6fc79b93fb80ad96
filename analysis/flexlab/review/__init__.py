"""The review: one Rerun file (.rrd) in which a run, or two of them, can be looked at; and pictures
of it.

All Rerun calls of the project are in this package. Rerun itself is imported when one of these
functions is called.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from flexura.errors import InputError

from .headless import draw, open_window
from .writer import write

if TYPE_CHECKING:
    import subprocess

    from flexura.io import Run

__all__ = ["open_viewer", "picture", "write_gallery", "write_review"]


def write_review(path: str | Path, runs: Sequence[Run]) -> Path:
    """Write one run, or several to compare, with the viewer's layout to one .rrd, as a whole or
    not at all.

    The first run is the reference: a deviation is another run minus the first.

    Args:
        path: of the file.
        runs: one to six.

    Returns:
        The path.

    Raises:
        InputError: no run, too many runs, or a run without samples.
    """
    return write(path, {"": runs})


def write_gallery(path: str | Path, groups: dict[str, Sequence[Run]]) -> Path:
    """Write the runs of several robots to one .rrd: all arms at a glance, and a page for each
    robot.

    Otherwise as `write_review`.

    Args:
        path: of the file.
        groups: one or two runs of each robot, by name.

    Returns:
        The path.

    Raises:
        InputError: there is no robot, or a group is not one or two runs with samples.
    """
    if not groups:
        raise InputError("one robot or more", key="groups", value=len(groups))
    return write(path, groups)


def picture(
    rrd: str | Path,
    png: str | Path,
    *,
    time_s: float | None = None,
    size: tuple[int, int] = (1600, 900),
) -> Path:
    """Draw the whole review, without a screen.

    Args:
        rrd: the review's file.
        png: file of the picture.
        time_s: of the time cursor [s]; None: where the tip deflection is largest.
        size: width and height [pixels].

    Returns:
        The PNG's path.

    Raises:
        InputError: the file is no review.
        FlexuraError: this machine has no Vulkan driver, or the viewer fails.
    """
    return draw(rrd, png, time_s=time_s, size=size)


def open_viewer(rrd: str | Path) -> subprocess.Popen[bytes]:
    """Open Rerun's viewer on a review, reachable from this machine only.

    Args:
        rrd: the review's file.

    Returns:
        The viewer's process, which outlives the caller.

    Raises:
        InputError: the file isn't there.
        FlexuraError: there is no display, or the viewer does not start.
    """
    return open_window(rrd)
