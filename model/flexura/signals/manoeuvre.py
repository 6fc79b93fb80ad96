"""Manoeuvre files: what a robot is asked to do, and for how long."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..errors import InputError
from ..io import Tables, check_format, choice, find, is_name, read_toml, summary, whole
from .drive import Drive, JointDrive
from .load import Load, load_from_table
from .parsing import from_spec, is_plausible
from .payload_change import PayloadChange, as_payloads, payload_from_table
from .signal import Signal
from .smooth import check_smooth


@dataclass(frozen=True)
class Manoeuvre:
    """What a robot is asked to do: a drive, for how long, and how often the result is stored. Read
    from a TOML file.

    `start`: "static" or "straight", as in `simulate`; None leaves it to gravity. `loads`: forces
    and moments on links. `payloads`: what is taken up and let go. `file`: the file that it was read
    from, for messages.
    """

    name: str
    duration_s: float
    output_step_s: float
    drive: Drive
    start: str | None = None
    loads: tuple[Load, ...] = ()
    payloads: tuple[PayloadChange, ...] = ()
    file: str = field(default="", compare=False)

    def __repr__(self) -> str:
        return summary.text(*self._summary())

    def _repr_html_(self) -> str:
        return summary.html(*self._summary())

    def _summary(self) -> tuple[str, list[tuple[str, str]]]:
        rows = [("t", f"0 to {self.duration_s:g} s, each {self.output_step_s:g} s")]
        rows += self.drive.rows()
        rows += [] if self.start is None else [("start", self.start)]
        for name, parts in (("loads", self.loads), ("payloads", self.payloads)):
            rows += [(name, str(len(parts)))] if parts else []
        return f"Manoeuvre: {self.name}", rows

    @property
    def t(self) -> np.ndarray:
        """Times of the result [s], from 0 to the duration."""
        return np.linspace(0.0, self.duration_s, round(self.duration_s / self.output_step_s) + 1)

    def prescribed(self) -> Manoeuvre:
        """The same manoeuvre with its motions followed exactly, in place of gains and forces on
        these joints.

        Raises:
            InputError: no joint has a motion; a motion jumps within the duration.
        """
        joints = self.drive.joints
        if all(joint.motion is None for joint in joints):
            raise InputError("missing: no joint has a motion to follow", key="motion")
        for i, joint in enumerate(joints, 1):
            if joint.motion is not None:
                check_smooth(joint.motion, f"joint[{i}].motion", 0.0, self.duration_s)
        exact = [
            j if j.motion is None else JointDrive(None, j.motion, 0.0, 0.0, True) for j in joints
        ]
        return replace(self, drive=Drive(tuple(exact)))

    def spec(self) -> Tables:
        """The tables of a manoeuvre file, every key given."""
        own: dict[str, Any] = {
            "name": self.name,
            "duration_s": self.duration_s,
            "output_step_s": self.output_step_s,
        }
        if self.start is not None:
            own["start"] = self.start
        own |= {"joint": self.drive.spec()}
        if self.loads:
            own["load"] = [load.spec() for load in self.loads]
        if self.payloads:
            own["payload"] = [change.spec() for change in self.payloads]
        return own

    def refuse_loads(self, why: str) -> None:
        """Refuse loads on links where they would be left out.

        Args:
            why: the reason, for the message.

        Raises:
            InputError: the manoeuvre has some; it names its file.
        """
        if self.loads:
            text = f"expected no [[load]]: {why}"
            raise InputError(text, key="load", value=len(self.loads), file=self.file)

    def refuse_payloads(self, why: str) -> None:
        """Refuse payloads that change where they would be left out.

        Args:
            why: the reason, for the message.

        Raises:
            InputError: the manoeuvre has some; it names its file.
        """
        if self.payloads:
            text = f"expected no [[payload]]: {why}"
            raise InputError(text, key="payload", value=len(self.payloads), file=self.file)


LONGEST = 1e8  # of a manoeuvre [s]: three years
STARTS = ("static", "straight")
_KEYS = ("name", "duration_s", "output_step_s", "start", "joint", "load", "payload", "format")
_JOINT_KEYS = ("force", "motion", "kp", "kd", "prescribed")


def load_manoeuvre(path: str | os.PathLike[str], joints: int) -> Manoeuvre:
    """Read a manoeuvre file.

    Args:
        path: the file's path, or the name of a manoeuvre that comes with flexura.
        joints: how many the robot has.

    Returns:
        The Manoeuvre.

    Raises:
        InputError: no such file, or a wrong value; it names file, key and value.
    """
    joints = whole(joints, "joints", 1, "expected how many joints the robot has")
    found = find(path, "manoeuvres")
    try:
        return replace(_manoeuvre(read_toml(found), joints), file=os.fspath(found))
    except InputError as error:
        raise error if error.file else error.in_file(os.fspath(found)) from None


def _manoeuvre(data: Tables, joints: int) -> Manoeuvre:
    check_format(data)
    if "link" in data and "duration_s" not in data:
        raise InputError("a robot file: expected a manoeuvre file")
    _check_keys(data, _KEYS, "")
    duration, step = _times(data)
    drive = _drive(data, joints, duration)
    name = data.get("name", "")
    if not is_name(name):
        raise InputError(
            "expected one line of at most 200 characters without control codes",
            key="name",
            value=name,
        )
    start = data.get("start")
    if start is not None:
        choice(start, "start", STARTS)
    return Manoeuvre(
        name,
        duration,
        step,
        drive,
        start,
        _loads(data, joints),
        _payloads(data, duration),
    )


def _times(data: Tables) -> tuple[float, float]:
    """Duration and step of the rows [s]."""
    duration = _number(
        data, "duration_s", f"a duration above 0 in seconds, at most {LONGEST:g}", low=0.0
    )
    if duration > LONGEST:
        expected = f"expected a duration above 0 in seconds, at most {LONGEST:g}"
        raise InputError(expected, key="duration_s", value=duration)
    step = _number(
        data,
        "output_step_s",
        "a time above 0 in seconds, at most the duration",
        low=0.0,
        default=duration / 200,
    )
    if step > duration:
        raise InputError(
            f"expected at most the duration, {duration:g} s", key="output_step_s", value=step
        )
    if duration / step > 1e7:
        raise InputError(
            "expected at most 10 million output steps", key="output_step_s", value=step
        )
    return duration, step


def _drive(data: Tables, joints: int, duration: float) -> Drive:
    """The tables [[joint]]."""
    tables = data.get("joint", [])
    if not isinstance(tables, list) or len(tables) != joints:
        count = len(tables) if isinstance(tables, list) else tables
        raise InputError(
            f"expected a table [[joint]] for each joint of the robot, {joints} in all; an empty "
            "one is a joint without a drive",
            key="joint",
            value=count,
        )
    drives = []
    for i, entry in enumerate(tables, 1):
        key = f"joint[{i}]"
        if not isinstance(entry, dict):
            raise InputError("expected a table", key=key, value=entry)
        _check_keys(entry, _JOINT_KEYS, key + ".")
        force = from_spec(entry["force"], key=f"{key}.force") if "force" in entry else None
        motion = from_spec(entry["motion"], key=f"{key}.motion") if "motion" in entry else None
        gains = [
            _number(
                entry, k, "a gain from 0 to 1e12", key=f"{key}.", low=-0.0, default=0.0, closed=True
            )
            for k in ("kp", "kd")
        ]
        if motion is None and any(gains):
            raise InputError(
                "missing: gains kp and kd need a motion to follow", key=f"{key}.motion"
            )
        drives.append(
            JointDrive(
                force,
                motion,
                kp=gains[0],
                kd=gains[1],
                prescribed=_prescribed(entry, motion, key, duration),
            )
        )
    return Drive(tuple(drives))


def _payloads(data: dict[str, Any], duration: float) -> tuple[PayloadChange, ...]:
    """The tables [[payload]]."""
    tables = data.get("payload", [])
    if not isinstance(tables, list):
        raise InputError("expected tables [[payload]]", key="payload", value=tables)
    return as_payloads([payload_from_table(x, i) for i, x in enumerate(tables, 1)], 0.0, duration)


def _loads(data: dict[str, Any], joints: int) -> tuple[Load, ...]:
    """The tables [[load]]."""
    tables = data.get("load", [])
    if not isinstance(tables, list):
        raise InputError("expected tables [[load]]", key="load", value=tables)
    loads = tuple(load_from_table(entry, i) for i, entry in enumerate(tables, 1))
    for i, load in enumerate(loads, 1):
        if load.link > joints:
            text = f"expected a link from 1 to {joints}"
            raise InputError(text, key=f"load[{i}].link", value=load.link)
    return loads


def _prescribed(entry: dict[str, Any], motion: Signal | None, key: str, duration: float) -> bool:
    """Does this joint follow its motion exactly? Such a motion must not jump in its `duration` [s],
    and leaves no room for a force of one's own."""
    value = entry.get("prescribed", False)
    if not isinstance(value, bool):
        raise InputError("expected true or false", key=f"{key}.prescribed", value=value)
    if not value:
        return False
    if motion is None:
        raise InputError(
            "missing: a prescribed joint needs a motion to follow", key=f"{key}.motion"
        )
    for name in ("force", "kp", "kd"):
        if name in entry:
            expected = "expected none: a prescribed joint takes the force that its motion needs"
            raise InputError(expected, key=f"{key}.{name}", value=entry[name])
    check_smooth(motion, f"{key}.motion", 0.0, duration)
    return True


def _check_keys(data: Tables, keys: Sequence[str], prefix: str) -> None:
    for key, value in data.items():
        if key not in keys:
            raise InputError(
                f"an unknown key; known here: {', '.join(keys)}", key=prefix + key, value=value
            )


def _number(
    data: Tables,
    name: str,
    expected: str,
    *,
    key: str = "",
    low: float,
    default: float | None = None,
    closed: bool = False,
) -> float:
    value = data.get(name, default)
    if value is None:
        raise InputError(f"missing: expected {expected}", key=key + name)
    if not is_plausible(value) or not (value >= low if closed else value > low):
        raise InputError(f"expected {expected}", key=key + name, value=value)
    return float(value)
