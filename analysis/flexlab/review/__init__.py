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
    """Write one run, or two to compare, with the layout of the viewer to one .rrd, as a whole or
    not at all; returns its path.

    The first run is the reference: a deviation is second minus first. Raises InputError for no run,
    more than two runs, or a run without samples.
    """
    return write(path, {"": runs})


def write_gallery(path: str | Path, groups: dict[str, Sequence[Run]]) -> Path:
    """Write the runs of several robots, one or two each, by name, to one .rrd: all arms at a
    glance, and a page for each robot.

    Otherwise as `write_review`.
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
    """Draw the whole review, without a screen, with the time cursor at `time_s` [s]; returns the
    PNG's path.

    `size` is in pixels. By default the cursor is where the tip deflection is largest. Raises
    InputError for a file that is no review, FlexuraError when this machine has no Vulkan driver or
    the viewer fails.
    """
    return draw(rrd, png, time_s=time_s, size=size)


def open_viewer(rrd: str | Path) -> subprocess.Popen[bytes]:
    """Open Rerun's viewer on a review, reachable from this machine only; returns its process, which
    outlives the caller.

    Raises InputError for a file that isn't there, FlexuraError when there is no display or the
    viewer does not start.
    """
    return open_window(rrd)
