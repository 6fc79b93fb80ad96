"""What `flexura import` makes of a URDF: a robot file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import flexura as fx
from flexura.interchange import Imported, read_urdf

from ..runs.formatting import number
from ..runs.table import Table
from .output import message, print_results
from .results import file_result


def import_robot(
    file: Path,
    sections: Path | None,
    out: Path | None,
    *,
    look: bool,
    force: bool,
    json: bool,
) -> None:
    """Read a URDF as a robot, and write its file.

    Args:
        file: the URDF.
        sections: which links bend; None: none does.
        out: the new robot file; None: beside the URDF.
        look: only show what is understood.
        force: a file that is there may be replaced.
        json: print JSON.
    """
    target = out or file.with_suffix(".toml")
    with file_result(None if look else target, force=force, suffix=".toml") as draft:
        found = read_urdf(file, sections)
        if not look:
            fx.save(found.robot, draft, overwrite=True)
    about = data(found) | ({} if look else {"file": str(target)})
    print_results(json, lambda: table(found, file), lambda: about)
    if not look:
        message(json, f"stored {target}")


def table(found: Imported, file: Path) -> Table:
    """The joints of the file and what they are in the robot."""
    heads = ("joint", "URDF", "position")
    out = Table(f"{file.name}: {found.robot.structure}", heads, heads)
    for i, joint in enumerate(found.joints, 1):
        sign = "" if joint.sense > 0 else "-"
        shift = "" if joint.offset == 0 else f" {number(joint.offset, 6)}"
        shift = shift if not shift or joint.offset < 0 else f" +{shift}"
        out.add(f"{i} ({joint.type})", joint.name, f"{sign}{joint.name}{shift}")
    x, y, _ = found.axes
    for name, axis in (("x", x), ("y", y)):
        shown = ", ".join(number(value, 6) for value in axis)
        out.notes.append(f"{name} of the robot is ({shown}) in the base of the URDF")
    out.notes += [f"left out: {note}" for note in found.left_out] + found.notes
    return out


def data(found: Imported) -> dict[str, Any]:
    """The same for JSON."""
    return {
        "robot": found.robot.to_dict(),
        "joints": [joint._asdict() for joint in found.joints],
        "axes": found.axes,
        "left_out": found.left_out,
        "notes": found.notes,
    }
