"""The robot ahead of a predictive controller: exact derivatives along a motion, and steps that damp
fast modes."""

from __future__ import annotations

import numpy as np

from ... import core
from ...system import System


class Prediction:
    """Steps about states along a predicted motion, over intervals of their own lengths (131).

    Args:
        system: the robot.
        driven: its free joints, from 0.
    """

    def __init__(self, system: System, driven: list[int]) -> None:
        self.system, self.free = system, system.free_rows
        self.count, self.inputs = len(self.free), len(driven)
        columns = [int(np.flatnonzero(self.free == system.joint_rows[i])[0]) for i in driven]
        self.joint_columns = np.array(columns)
        self._core = core.PredictedMotion(system.equations, [int(i) for i in self.free], columns)
        self._rest = system.start()

    def full(self, x: np.ndarray) -> np.ndarray:
        """The unknowns (n,) of a state (2m,) of what moves."""
        q = self._rest.copy()
        q[self.free] = x[: self.count]
        return q

    def steps(
        self, x: np.ndarray, u: np.ndarray, guess: np.ndarray, h: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Steps of Radau IIA of order 3 on the equations linearised by the core's dual numbers, the
        forces held (131).

        The derivatives are exact where `guess` is the acceleration itself.

        Args:
            x: states (T, 2m).
            u: forces of the drives (T, inputs) [N or N m].
            guess: accelerations (T, m), nearly.
            h: lengths of the intervals (T,) [s].

        Returns:
            R (T, 2m, 2m), G (T, 2m, inputs), d (T, 2m): R x + G u + d after the step; and the
            accelerations (T, m).
        """
        found = self._core.steps(x, u, guess, h)
        return tuple(np.asarray(part) for part in found)  # type: ignore[return-value]
