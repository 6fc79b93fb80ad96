"""What an identification knows of the rig, and how surely."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..identification.identify_rig import Identified
from ..rig.axes import Friction, MotorAxis

EXTREME = 100.0  # logarithm of a factor: beyond any range
SURELY = 2.0  # standard deviations
MODEL = 0.01  # of the stiffness: what no interval has, the model's own error
NAMES = ("stiffness", "damping", "payload")


@dataclass(frozen=True)
class Knowledge:
    """Parameters of the strip, as factors on the file's, and the robots that may be meant.

    Attributes:
        values: factors, by name.
        others: the corners of the uncertainty: factors `stiffness`, `damping`, `payload`.
        friction: factors on the motors' friction, by joint.
    """

    values: dict[str, float]
    others: tuple[dict[str, float], ...]
    friction: dict[int, Friction]

    @classmethod
    def of(cls, found: Identified) -> Knowledge:
        """From an identification's estimates and their covariance.

        Along each principal axis of the covariance there are two robots, two standard deviations
        away. Stiffness and payload that keep the first frequency are thus seen together. No factor
        leaves the range in which it was sought.
        """
        strip = found.strip
        rows = [[u.name for u in strip.parameters].index(name) for name in NAMES]
        covariance = strip.covariance[np.ix_(rows, rows)] + np.diag([MODEL**2, 0.0, 0.0])
        spread, axes = np.linalg.eigh(covariance)
        least, most = np.transpose([strip.parameters[row].bounds for row in rows])
        centre = np.log([strip.values[name] for name in NAMES])
        others = []
        for size, axis in zip(np.sqrt(np.maximum(spread, 0.0)), axes.T, strict=True):
            for sign in (-1, 1):
                away = np.clip(centre + sign * SURELY * size * axis, -EXTREME, EXTREME)
                factors = np.clip(np.exp(away), least, most)
                others.append(dict(zip(NAMES, map(float, factors), strict=True)))
        return cls(dict(strip.values), tuple(others), dict(found.friction))

    def friction_of(self, axis: MotorAxis) -> Friction:
        """The factors on the friction of a joint with a motor."""
        return self.friction.get(axis.number, Friction())
