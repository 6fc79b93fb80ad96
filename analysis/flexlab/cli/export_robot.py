"""What `flexura export` writes of a robot: its state space, an FMU, a URDF."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import flexura as fx
from flexura.errors import InputError
from flexura.interchange import fmu, fmu_lacks, urdf
from flexura.io import write_bytes

from ..runs.export import as_mat
from .output import message, print_results
from .results import file_result

ROBOT_FORMS = ("fmu", "urdf")  # that runs do not have


def export_robot(
    path: Path, to: str, out: Path | None, fmi: int, *, force: bool, json: bool
) -> None:
    """Write a robot in another program's format.

    Args:
        path: the robot file, or the name of a shipped one.
        to: "mat", "fmu" or "urdf".
        out: the new file; None: beside the robot's file.
        fmi: version of an FMU.
        force: a file that is there may be replaced.
        json: print JSON.
    """
    if to not in ("mat", *ROBOT_FORMS):
        expected = "expected mat (its state space), fmu or urdf: this is a robot"
        raise InputError(expected, key="--to", value=to)
    robot, target = fx.load(path), out or path.with_suffix(f".{to}")
    about: dict[str, Any] = {"file": str(target)}
    with file_result(target, force=force) as draft:
        try:
            content, line, notes = _content(robot, to, fmi, about)
        except InputError as error:
            raise error if error.file else error.in_file(str(path)) from None
        write_bytes(draft, content)
    if json:
        print_results(True, lambda: None, lambda: about | {"left_out": notes})
    message(json, line, *(f"left out: {note}" for note in notes), f"stored {target}")


def _content(
    robot: fx.Robot, to: str, fmi: int, about: dict[str, Any]
) -> tuple[bytes, str, list[str]]:
    """The file, a line that says what it is, and what of the robot it does not say."""
    if to == "fmu":
        about["fmi"] = fmi
        content = fmu(robot, fmi)
        return (
            content,
            f"FMU of FMI {fmi} for co-simulation, {len(content)} bytes",
            fmu_lacks(robot),
        )
    if to == "urdf":
        text, notes = urdf(robot)
        return text.encode(), f"URDF of {len(robot.links)} links", notes
    lin = fx.linearize(robot)
    about |= {"states": len(lin.states), "outputs": list(lin.outputs)}
    return as_mat.state_space(lin), f"state space: {len(lin.states)} states", []
