"""Drives: what acts in the joints. Feedforward, and PD control of the joint along a motion.

    tau_i = f_i(t) + kp_i (r_i(t) - eta_i) + kd_i (dr_i/dt - d eta_i/dt)

with eta_i the joint's position [m or rad]; tau_i in N or N m. Drives are data, so that they run
inside the compiled loop; any Python function `(t) -> forces` or `(t, position, velocity,
tip_deflection) -> forces` works in their place, slower.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import InputError
from .signal import COLUMNS, Signal

_NONE = np.zeros((0, COLUMNS))


@dataclass(frozen=True)
class JointDrive:
    """One joint's drive: feedforward `force` [N or N m], and PD gains `kp`, `kd` on a `motion` [m
    or rad] (58).

    With `prescribed` the joint follows its motion exactly, whatever force that takes (inverse
    dynamics (59)).
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
            out |= {"motion": self.motion.spec} | (
                {"prescribed": True} if self.prescribed else {"kp": self.kp, "kd": self.kd}
            )
        return out


@dataclass(frozen=True)
class Drive:
    """The drives of all joints, one `JointDrive` a joint; `drive(t, position, velocity,
    tip_deflection)` gives (n,)."""

    joints: tuple[JointDrive, ...]
    meta: dict[str, Any] = field(default_factory=dict)

    @staticmethod
    def none(joints: int) -> Drive:
        """No drive at all: every joint is free."""
        return Drive((JointDrive(),) * joints)

    @staticmethod
    def force(*signals: Signal | None) -> Drive:
        """Open loop: a force or torque signal a joint (None: free)."""
        return Drive(tuple(JointDrive(force=s) for s in signals))

    @staticmethod
    def pd(motions: Sequence[Signal], kp: Sequence[float], kd: Sequence[float]) -> Drive:
        """Joint PD control along `motions`."""
        return Drive(
            tuple(JointDrive(motion=m, kp=p, kd=d) for m, p, d in zip(motions, kp, kd, strict=True))
        )

    @staticmethod
    def prescribed(*motions: Signal | None) -> Drive:
        """Joints that follow their motions exactly (None: free). Raises InputError for a motion
        that jumps or kinks."""
        for i, motion in enumerate(motions, 1):
            if motion is not None:
                check_smooth(motion, f"motion {i}")
        return Drive(
            tuple(
                JointDrive() if m is None else JointDrive(motion=m, prescribed=True)
                for m in motions
            )
        )

    @property
    def follows(self) -> np.ndarray:
        """Which joints follow a prescribed motion, (n,) bool."""
        return np.array([joint.prescribed and joint.motion is not None for joint in self.joints])

    def __call__(
        self, t: float, position: Any, velocity: Any, tip_deflection: float = 0.0
    ) -> np.ndarray:
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
        )

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


def check_smooth(motion: Signal, key: str) -> None:
    """Refuse a motion whose position or velocity jumps: no finite force follows it."""
    for at in motion.breaks[1:]:
        before = np.array(motion(np.nextafter(at, -np.inf))[:2])
        after = np.array(motion(at)[:2])
        if not np.allclose(before, after, rtol=1e-7, atol=1e-9):
            raise InputError(
                f"expected a motion without jumps in position and velocity; it has one at t = "
                f"{at:g} s",
                key=key,
            )
