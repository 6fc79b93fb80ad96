"""Drives: what acts in the joints. Feedforward, and PD control of the joint along a motion.

    tau_i = f_i(t) + kp_i (r_i(t) - eta_i) + kd_i (dr_i/dt - d eta_i/dt)

with eta_i the joint's position [m or rad]; tau_i in N or N m. Drives are data, so that they run
inside the compiled loop; any Python function `(t) -> forces` or `(t, position, velocity,
tip_deflection) -> forces` works in their place, slower.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..io import Tables, array, flag, number, summary, whole
from .conversion import FunctionSignal, SignalLike, as_signal, spline
from .signal import COLUMNS, Signal
from .smooth import check_smooth, up_to

_NONE = np.zeros((0, COLUMNS))


@dataclass(frozen=True)
class JointDrive:
    """One joint's drive: feedforward `force` [N or N m], and PD gains `kp`, `kd` on a `motion` [m
    or rad] (58).

    Force and motion are numbers, Signals or functions of time. With `prescribed` the joint follows
    its motion exactly, whatever force that takes (inverse dynamics (59)). Raises InputError for
    other arguments.
    """

    force: Signal | None = None
    motion: Signal | None = None
    kp: float = 0.0
    kd: float = 0.0
    prescribed: bool = False

    def __post_init__(self) -> None:
        for name in ("force", "motion"):
            object.__setattr__(self, name, as_signal(getattr(self, name), name))
        for name in ("kp", "kd"):
            object.__setattr__(self, name, number(getattr(self, name), name))
        object.__setattr__(self, "prescribed", flag(self.prescribed, "prescribed"))

    @property
    def has_unfollowed_motion(self) -> bool:
        """Whether it has a motion, but neither gains nor `prescribed`: nothing would follow it."""
        return self.motion is not None and not (self.prescribed or self.kp or self.kd)

    def force_at(self, t: float) -> float:
        """The feedforward at a time.

        Args:
            t: time [s].

        Returns:
            Force or torque [N or N m], 0 without a feedforward.
        """
        if self.force is None:
            return 0.0
        if isinstance(self.force, FunctionSignal):
            return self.force.value(t)
        return self.force(t)[0]

    def said(self) -> str:
        """What the joint does, in a line: "kp 100, kd 4 on cycloid(end=0.8, ...)"."""
        parts = [] if self.force is None else [f"force {self.force.said()}"]
        if self.motion is not None:
            how = "follows" if self.prescribed else f"kp {self.kp:g}, kd {self.kd:g} on"
            parts.append(f"{how} {self.motion.said()}")
        return "; ".join(parts) or "free"

    def spec(self) -> Tables:
        """This joint's table of a manoeuvre file."""
        out: dict[str, Any] = {}
        if self.force is not None:
            out["force"] = self.force.spec
        if self.motion is not None:
            out |= {"motion": self.motion.spec} | (
                {"prescribed": True} if self.prescribed else {"kp": self.kp, "kd": self.kd}
            )
        return out


@dataclass(frozen=True)
class Drive:
    """The drives of all joints, one `JointDrive` a joint; `drive(t, position, velocity,
    tip_deflection)` gives (n,)."""

    joints: tuple[JointDrive, ...]
    meta: Tables = field(default_factory=dict)

    def __post_init__(self) -> None:
        joints = self.joints
        if not isinstance(joints, Sequence) or not all(isinstance(j, JointDrive) for j in joints):
            raise InputError("expected a JointDrive for each joint", key="joints", value=joints)
        if not isinstance(self.meta, dict):
            raise InputError("expected a dictionary", key="meta", value=self.meta)
        object.__setattr__(self, "joints", tuple(joints))

    def __repr__(self) -> str:
        return summary.text(*self._summary())

    def _repr_html_(self) -> str:
        return summary.html(*self._summary())

    def _summary(self) -> tuple[str, list[tuple[str, str]]]:
        rows = self.rows()
        return f"Drive of {len(rows)} {'joint' if len(rows) == 1 else 'joints'}", rows

    def rows(self) -> list[tuple[str, str]]:
        """What each joint does: pairs of "joint 1" and a line."""
        return [(f"joint {i}", joint.said()) for i, joint in enumerate(self.joints, 1)]

    @staticmethod
    def none(joints: int) -> Drive:
        """No drive at all: every joint is free.

        Args:
            joints: how many the robot has.

        Returns:
            The Drive.
        """
        return Drive((JointDrive(),) * whole(joints, "joints", 0))

    @staticmethod
    def force(*signals: SignalLike, t_s: ArrayLike | None = None) -> Drive:
        """Open loop: a force or torque [N or N m] a joint.

        Args:
            signals: one entry a joint: a number, a Signal, a function of t [s], an array (T,) of
                values at the times `t_s`, or None for a free joint.
            t_s: the times of arrays (T,) [s].

        Returns:
            The Drive.

        Raises:
            InputError: an argument is not what is expected.
        """
        return Drive(tuple(JointDrive(force=s) for s in _waves("force", signals, t_s)))

    @staticmethod
    def pd(
        motions: Sequence[SignalLike] | np.ndarray,
        kp: ArrayLike,
        kd: ArrayLike,
        t_s: ArrayLike | None = None,
    ) -> Drive:
        """Joint PD control along motions.

        Args:
            motions: one entry a joint, as in `force` [m or rad].
            kp: gains of the position, (joints,) or one for all [N/m or N m/rad].
            kd: gains of the rate, (joints,) or one for all [N s/m or N m s/rad].
            t_s: the times of arrays (T,) [s].

        Returns:
            The Drive.

        Raises:
            InputError: an argument is not what is expected.
        """
        if isinstance(motions, Signal | str | bytes | dict) or not np.iterable(motions):
            raise InputError("expected motions, one a joint", key="motions", value=motions)
        waves = _waves("motions", list(motions), t_s)
        gains = [_gains(value, len(waves), key) for key, value in (("kp", kp), ("kd", kd))]
        return Drive(
            tuple(
                JointDrive(motion=m, kp=float(p), kd=float(d))
                for m, p, d in zip(waves, *gains, strict=True)
            )
        )

    @staticmethod
    def prescribed(*motions: SignalLike, t_s: ArrayLike | None = None) -> Drive:
        """Joints that follow their motions exactly.

        A motion whose position or velocity jumps inside a run is refused when the run begins.

        Args:
            motions: one entry a joint, as in `force` [m or rad]; None: the joint is free.
            t_s: the times of arrays (T,) [s].

        Returns:
            The Drive.

        Raises:
            InputError: an argument is not what is expected.
        """
        return Drive(
            tuple(
                JointDrive() if m is None else JointDrive(motion=m, prescribed=True)
                for m in _waves("motion", motions, t_s)
            )
        )

    @property
    def follows(self) -> np.ndarray:
        """Which joints follow a prescribed motion, (n,) bool."""
        return np.array([joint.prescribed and joint.motion is not None for joint in self.joints])

    @property
    def has_functions(self) -> bool:
        """Whether a force is a Python function."""
        return any(isinstance(j.force, FunctionSignal) for j in self.joints)

    def function_forces(self, t: float) -> np.ndarray:
        """The forces of those joints whose force is a Python function.

        Args:
            t: time [s].

        Returns:
            Forces (n,) [N or N m], 0 for the other joints.
        """
        return np.array(
            [j.force.value(t) if isinstance(j.force, FunctionSignal) else 0.0 for j in self.joints]
        )

    def within(self, start: float, end: float) -> Drive:
        """The same drive for a run between two times: its motions are Signals.

        Functions become splines. A prescribed motion that jumps at `end` keeps to the end what it
        was before.

        Args:
            start: begin of the run [s].
            end: end of the run [s].

        Returns:
            The Drive.

        Raises:
            InputError: a joint has a motion that nothing follows; a prescribed motion's position or
                velocity jumps inside the run, or a function's that is followed.
        """
        joints = []
        for i, joint in enumerate(self.joints, 1):
            motion, key = joint.motion, f"motion of joint {i}"
            if joint.has_unfollowed_motion:
                raise InputError(
                    f"joint {i} has a motion, but neither gains nor prescribed: give kp and kd, "
                    f"prescribe it (Drive.prescribed, manoeuvre.prescribed()), or take a "
                    f"controller",
                    key="drive",
                )
            if isinstance(motion, FunctionSignal):
                motion = spline(replace(motion, key=key), start, end)
            if motion is not None and joint.prescribed:
                check_smooth(motion, key, start, end)
                motion = up_to(motion, end)
            joints.append(joint if motion is joint.motion else replace(joint, motion=motion))
        same = all(a is b for a, b in zip(joints, self.joints, strict=True))
        return self if same else replace(self, joints=tuple(joints))

    def __call__(
        self, t: float, position: np.ndarray, velocity: np.ndarray, tip_deflection: float = 0.0
    ) -> np.ndarray:
        """The forces in a state.

        Args:
            t: time [s].
            position: of the joints (n,) [m or rad].
            velocity: of the joints (n,) [m/s or rad/s].
            tip_deflection: not used.

        Returns:
            Forces (n,) [N or N m].
        """
        out = np.zeros(len(self.joints))
        for i, joint in enumerate(self.joints):
            out[i] = joint.force_at(t)
            if joint.motion is not None and not joint.prescribed:
                r, rd, _ = joint.motion(t)
                out[i] += joint.kp * (r - position[i]) + joint.kd * (rd - velocity[i])
        return out

    def spec(self) -> list[Tables]:
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
        rows = np.concatenate(
            [
                _NONE,
                *(s.segments for j in self.joints for s in (j.force, j.motion) if s is not None),
            ]
        )
        w = np.abs(rows[rows[:, 7] != 0, 8]).max(initial=0.0)
        return 2 * np.pi / w if w > 0 else np.inf

    @cached_property
    def gains(self) -> np.ndarray:
        """Of position and rate, (n, 2); 0 where a joint follows no motion, or follows it
        exactly."""
        return np.array(
            [
                (j.kp, j.kd) if j.motion is not None and not j.prescribed else (0.0, 0.0)
                for j in self.joints
            ]
        ).reshape(-1, 2)

    def packed(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Segments (k, 10) of all signals, their index (n, 4) [force from, to; motion from, to],
        gains (n, 2)."""
        parts, index, row = [_NONE], np.zeros((len(self.joints), 4), dtype=np.int64), 0
        for i, joint in enumerate(self.joints):
            for k, s in enumerate((joint.force, joint.motion)):
                index[i, 2 * k] = row
                if s is not None:
                    parts.append(s.segments)
                    row += len(s.segments)
                index[i, 2 * k + 1] = row
        return np.ascontiguousarray(np.concatenate(parts)), index, self.gains.copy()


def _waves(key: str, given: Sequence[Any], t_s: ArrayLike | None) -> list[Signal | None]:
    expected = "expected ascending finite times in seconds"
    t = None if t_s is None else array(t_s, "t_s", expected, (None,))
    if t is not None and not np.all(np.diff(t) > 0):
        raise InputError(expected, key="t_s", value=t_s)
    return [as_signal(value, f"{key} {i}", t) for i, value in enumerate(given, 1)]


def _gains(value: Any, joints: int, key: str) -> np.ndarray:
    found = array(value, key, f"expected a number, or {joints} of them, one a joint")
    if found.shape not in ((), (1,), (joints,)):
        raise InputError(f"expected {joints} numbers, one a joint", key=key, value=value)
    return np.broadcast_to(found, (joints,))
