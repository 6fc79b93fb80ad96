"""Joints behind backlash: a contact that acts where a joint is off its drive by half of the play.

    tau_i = -k_i (e_i -+ b_i / 2) - c_i e_i'     |e_i| > b_i / 2,   e_i = eta_i - r_i(t)
    tau_i = 0                                    |e_i| <= b_i / 2

r_i is the driving side's motion, as of a gear's output shaft.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..io import Tables, number
from ..signals import COLUMNS, Signal, as_signal


@dataclass(frozen=True)
class Contact:
    """One joint's backlash.

    `motion`: of the driving side [m or rad]. `play`: from flank to flank [m or rad]. `stiffness`
    [N/m or N m/rad] and `damping` [N s/m or N m s/rad] of the contact.

    Raises:
        InputError: a value is negative or no number, or the motion is no Signal.
    """

    motion: Signal
    play: float
    stiffness: float
    damping: float = 0.0

    def __post_init__(self) -> None:
        motion = as_signal(self.motion, "motion")
        if type(motion) is not Signal:
            raise InputError("expected a Signal", key="motion", value=self.motion)
        object.__setattr__(self, "motion", motion)
        for name in ("play", "stiffness", "damping"):
            value = number(getattr(self, name), name)
            if value < 0:
                raise InputError("expected 0 or more", key=name, value=value)
            object.__setattr__(self, name, value)

    def force(self, t: float, position: float, velocity: float) -> float:
        """What the contact does to the joint.

        Args:
            t: time [s].
            position: of the joint [m or rad].
            velocity: of the joint [m/s or rad/s].

        Returns:
            Force or torque [N or N m].
        """
        r, rate, _ = self.motion(t)
        e, half = position - r, 0.5 * self.play
        if abs(e) <= half:
            return 0.0
        return -self.stiffness * (e - np.copysign(half, e)) - self.damping * (velocity - rate)


@dataclass(frozen=True)
class Backlash:
    """A drive of joints behind backlash, one `Contact` a joint; None: the joint is free.

    It is a function of (t, position, velocity, tip_deflection), that the core computes without
    Python.
    """

    contacts: tuple[Contact | None, ...]

    def __call__(
        self, t: float, position: np.ndarray, velocity: np.ndarray, tip_deflection: float
    ) -> np.ndarray:
        """The forces (joints,) [N or N m] in a state; `tip_deflection` is not used."""
        return np.array(
            [
                0.0 if c is None else c.force(t, float(x), float(v))
                for c, x, v in zip(self.contacts, position, velocity, strict=True)
            ]
        )

    def packed(self) -> tuple[np.ndarray, np.ndarray]:
        """Segments (k, 10) of the motions; a row (contacts, 6) each: joint (from 0), motion from,
        to, play, stiffness, damping."""
        parts, rows, count = [np.zeros((0, COLUMNS))], [], 0
        for i, c in enumerate(self.contacts):
            if c is None:
                continue
            parts.append(c.motion.segments)
            end = count + len(c.motion.segments)
            rows.append([i, count, end, c.play, c.stiffness, c.damping])
            count = end
        return np.concatenate(parts), np.array(rows, dtype=float).reshape(-1, 6)

    def spec(self) -> list[Tables]:
        """The joints' tables for a Run's metadata."""
        return [
            {}
            if c is None
            else {
                "motion": c.motion.spec,
                "play": c.play,
                "stiffness": c.stiffness,
                "damping": c.damping,
            }
            for c in self.contacts
        ]
