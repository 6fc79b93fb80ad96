"""Drives: what acts in the joints. Feedforward, and PD control of the joint along a motion.

    tau_i = f_i(t) + kp_i (r_i(t) - eta_i) + kd_i (dr_i/dt - d eta_i/dt)

with eta_i the joint's position [m or rad]; tau_i in N or N m. Drives are data, so that they run inside the compiled loop;
any Python function `(t) -> forces` or `(t, position, velocity, tip_deflection) -> forces` works in their place, slower.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from . import signals
from .errors import InputError
from .files import read_toml
from .signals import Signal

_NONE = np.zeros((0, signals.COLUMNS))


@dataclass(frozen=True)
class JointDrive:
    """One joint's drive: feedforward `force` [N or N m], and PD gains `kp`, `kd` on a `motion` [m or rad].

    With `prescribed` the joint follows its motion exactly, whatever force that takes (inverse dynamics).
    """

    force: Signal | None = None
    motion: Signal | None = None
    kp: float = 0.0
    kd: float = 0.0
    prescribed: bool = False

    def spec(self) -> dict[str, Any]:
        """This joint's table of a manoeuvre file."""
        out: dict[str, Any] = {}
        if self.force is not None:
            out["force"] = self.force.spec
        if self.motion is not None:
            out |= {"motion": self.motion.spec} | ({"prescribed": True} if self.prescribed else {"kp": self.kp, "kd": self.kd})
        return out


@dataclass(frozen=True)
class Drive:
    """The drives of all joints, one `JointDrive` a joint; `drive(t, position, velocity, tip_deflection)` gives (n,)."""

    joints: tuple[JointDrive, ...]
    meta: dict[str, Any] = field(default_factory=dict)

    @staticmethod
    def none(joints: int) -> Drive:
        return Drive((JointDrive(),) * joints)

    @staticmethod
    def force(*signals: Signal | None) -> Drive:
        """Open loop: a force or torque signal a joint (None: free)."""
        return Drive(tuple(JointDrive(force=s) for s in signals))

    @staticmethod
    def pd(motions: Sequence[Signal], kp: Sequence[float], kd: Sequence[float]) -> Drive:
        """Joint PD control along `motions`."""
        return Drive(tuple(JointDrive(motion=m, kp=p, kd=d) for m, p, d in zip(motions, kp, kd, strict=True)))

    @staticmethod
    def prescribed(*motions: Signal | None) -> Drive:
        """Joints that follow their motions exactly (None: free). Raises InputError for a motion that jumps or kinks."""
        for i, motion in enumerate(motions, 1):
            if motion is not None:
                _smooth(motion, f"motion {i}")
        return Drive(tuple(JointDrive() if m is None else JointDrive(motion=m, prescribed=True) for m in motions))

    @property
    def follows(self) -> np.ndarray:
        """Which joints follow a prescribed motion, (n,) bool."""
        return np.array([joint.prescribed and joint.motion is not None for joint in self.joints])

    def __call__(self, t: float, position: Any, velocity: Any, tip_deflection: float = 0.0) -> np.ndarray:
        out = np.zeros(len(self.joints))
        for i, joint in enumerate(self.joints):
            if joint.force is not None:
                out[i] = joint.force(t)[0]
            if joint.motion is not None and not joint.prescribed:
                r, rd, _ = joint.motion(t)
                out[i] += joint.kp * (r - position[i]) + joint.kd * (rd - velocity[i])
        return out

    def spec(self) -> list[dict[str, Any]]:
        """The joints' tables of a manoeuvre file."""
        return [joint.spec() for joint in self.joints]

    @property
    def breaks(self) -> np.ndarray:
        """Instants at which a drive isn't smooth, ascending [s]."""
        all_breaks = [s.breaks for j in self.joints for s in (j.force, j.motion) if s is not None]
        return np.unique(np.concatenate(all_breaks)) if all_breaks else np.zeros(0)

    @property
    def shortest_period(self) -> float:
        """The shortest period of the waves in the signals [s]; infinity without waves."""
        rows = np.concatenate([_NONE, *(s.segments for j in self.joints for s in (j.force, j.motion) if s is not None)])
        w = np.abs(rows[rows[:, 7] != 0, 8]).max(initial=0.0)
        return 2 * np.pi / w if w > 0 else np.inf

    @cached_property
    def gains(self) -> np.ndarray:
        """Of position and rate, (n, 2); 0 where a joint follows no motion, or follows it exactly."""
        return np.array([(j.kp, j.kd) if j.motion is not None and not j.prescribed else (0.0, 0.0) for j in self.joints])

    def packed(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Segments (k, 10) of all signals, their index (n, 4) [force from, to; motion from, to], gains (n, 2)."""
        parts, index, row = [_NONE], np.zeros((len(self.joints), 4), dtype=np.int64), 0
        for i, joint in enumerate(self.joints):
            for k, s in enumerate((joint.force, joint.motion)):
                index[i, 2 * k] = row
                if s is not None:
                    parts.append(s.segments)
                    row += len(s.segments)
                index[i, 2 * k + 1] = row
        return np.ascontiguousarray(np.concatenate(parts)), index, self.gains.copy()


def _smooth(motion: Signal, key: str) -> None:
    """Refuse a motion whose position or velocity jumps: no finite force follows it."""
    for at in motion.breaks[1:]:
        before = np.array(motion(np.nextafter(at, -np.inf))[:2])
        after = np.array(motion(at)[:2])
        if not np.allclose(before, after, rtol=1e-7, atol=1e-9):
            raise InputError(f"expected a motion without jumps in position and velocity; it has one at t = {at:g} s", key=key)


@dataclass(frozen=True)
class Manoeuvre:
    """What a robot is asked to do: a drive, for how long, and how often the result is stored. Read from a TOML file."""

    name: str
    duration_s: float
    output_step_s: float
    drive: Drive

    @property
    def t(self) -> np.ndarray:
        """Times of the result [s], from 0 to the duration."""
        return np.linspace(0.0, self.duration_s, round(self.duration_s / self.output_step_s) + 1)

    def spec(self) -> dict[str, Any]:
        """The tables of a manoeuvre file, every key given."""
        own = {"name": self.name, "duration_s": self.duration_s, "output_step_s": self.output_step_s}
        return own | {"joint": self.drive.spec()}


_KEYS = ("name", "duration_s", "output_step_s", "joint")
_JOINT_KEYS = ("force", "motion", "kp", "kd", "prescribed")


def load_manoeuvre(path: str | os.PathLike[str], joints: int) -> Manoeuvre:
    """Read a manoeuvre file for a robot with that many joints. Raises InputError, naming file, key and value."""
    try:
        return _manoeuvre(read_toml(path), joints)
    except InputError as error:
        raise error if error.file else error.in_file(os.fspath(path)) from None


def _manoeuvre(data: dict[str, Any], joints: int) -> Manoeuvre:
    _known(data, _KEYS, "")
    duration = _number(data, "duration_s", "a duration above 0 in seconds", low=0.0)
    step = _number(data, "output_step_s", "a time above 0 in seconds, at most the duration", low=0.0, default=duration / 200)
    if step > duration:
        raise InputError(f"expected at most the duration, {duration:g} s", key="output_step_s", value=step)
    if duration / step > 1e7:
        raise InputError("expected at most 10 million output steps", key="output_step_s", value=step)
    tables = data.get("joint", [])
    if not isinstance(tables, list) or len(tables) != joints:
        count = len(tables) if isinstance(tables, list) else tables
        raise InputError(f"expected {joints} tables [[joint]], one for each joint of the robot", key="joint", value=count)
    drives = []
    for i, entry in enumerate(tables, 1):
        key = f"joint[{i}]"
        if not isinstance(entry, dict):
            raise InputError("expected a table", key=key, value=entry)
        _known(entry, _JOINT_KEYS, key + ".")
        force = signals.from_spec(entry["force"], key=f"{key}.force") if "force" in entry else None
        motion = signals.from_spec(entry["motion"], key=f"{key}.motion") if "motion" in entry else None
        gains = [
            _number(entry, k, "a gain of 0 or more", key=f"{key}.", low=-0.0, default=0.0, closed=True) for k in ("kp", "kd")
        ]
        if motion is None and any(gains):
            raise InputError("missing: gains kp and kd need a motion to follow", key=f"{key}.motion")
        drives.append(JointDrive(force, motion, kp=gains[0], kd=gains[1], prescribed=_prescribed(entry, motion, key)))
    name = data.get("name", "")
    if not isinstance(name, str):
        raise InputError("expected a text", key="name", value=name)
    return Manoeuvre(name, duration, step, Drive(tuple(drives)))


def _prescribed(entry: dict[str, Any], motion: Signal | None, key: str) -> bool:
    """Does this joint follow its motion exactly? Such a motion must not jump, and leaves no room for a force of one's own."""
    value = entry.get("prescribed", False)
    if not isinstance(value, bool):
        raise InputError("expected true or false", key=f"{key}.prescribed", value=value)
    if not value:
        return False
    if motion is None:
        raise InputError("missing: a prescribed joint needs a motion to follow", key=f"{key}.motion")
    for name in ("force", "kp", "kd"):
        if name in entry:
            expected = "expected none: a prescribed joint takes the force that its motion needs"
            raise InputError(expected, key=f"{key}.{name}", value=entry[name])
    _smooth(motion, f"{key}.motion")
    return True


def _known(data: dict[str, Any], keys: Sequence[str], prefix: str) -> None:
    for key, value in data.items():
        if key not in keys:
            raise InputError(f"an unknown key; known here: {', '.join(keys)}", key=prefix + key, value=value)


def _number(
    data: dict[str, Any],
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
    if not signals.finite(value) or not (value >= low if closed else value > low):
        raise InputError(f"expected {expected}", key=key + name, value=value)
    return float(value)
