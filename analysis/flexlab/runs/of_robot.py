"""Whether the channels of a run can be those of a robot: its joints and links, and their units."""

from __future__ import annotations

import re

import flexura as fx
from flexura.errors import InputError
from flexura.io.quantities import channel

_NUMBERED = re.compile(r"(joint|link)/(\d+)/.+")
_DOES = {"R": "turns", "Pa": "slides", "Pb": "slides"}


def check_channels(run: fx.Run, robot: fx.Robot, file: str = "") -> None:
    """Refuse a run whose channels cannot be those of a robot.

    Args:
        run: the run.
        robot: the robot.
        file: of the run, for the message.

    Raises:
        InputError: a joint or link that the robot has not, or another unit than its joint has.
    """
    for name, unit in run.units.items():
        numbered = _NUMBERED.fullmatch(name)
        if numbered is None:
            continue
        what, number = numbered[1], int(numbered[2])
        if not 1 <= number <= len(robot.links):
            count = f"{len(robot.links)} {what}{'s' if len(robot.links) > 1 else ''}"
            raise InputError(f"the robot has {count}", key=f"channel {name}", file=file)
        units, type_ = channel(name).units, robot.links[number - 1].joint.type
        if not units:
            continue
        expected = units[0] if type_ == "R" else units[-1]
        if unit != expected:
            own = f"joint {number} of the robot {_DOES[type_]} ({type_}): " if units[1:] else ""
            raise InputError(
                f"{own}expected {expected}", key=f"unit of {name}", value=unit, file=file
            )


def check_own(run: fx.Run, file: str = "") -> None:
    """The same of the robot in a run's metadata, if it has one.

    Args:
        run: the run.
        file: of the run, for the message.

    Raises:
        InputError: as `check_channels`.
    """
    tables = run.meta.get("robot")
    if isinstance(tables, dict) and tables:
        check_channels(run, fx.Robot.from_dict(tables, file=file), file)
