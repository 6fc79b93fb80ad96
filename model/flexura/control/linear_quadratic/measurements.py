"""What a controller on a robot's sensors measures: values of a tick, and their derivatives."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...errors import InputError
from ...robot import FORCE_KINDS
from ...signals import Loads
from ...system import RunStates, StateSpace, System, sensor_channels
from ...system.system import jacobian

STEP = 1e-6  # of differences [m or rad]


class Measurements:
    """Chosen measurements of a robot, y = g(q) (127).

    A joint's position is that of its motor, where a transmission is between.

    Args:
        system: the robot.
        names: `joint/i/position` (`joint/i/motor_position` of a joint with a transmission),
            `link/i/tip_deflection`, `sensor/NAME`; None: all joints that are not locked, and the
            sensors of deflection, slope and strain, or without sensors the tip deflections.

    Raises:
        InputError: there is no such measurement.
    """

    def __init__(self, system: System, names: Sequence[str] | None = None) -> None:
        links = system.robot.links
        self.joints = {
            f"joint/{i + 1}/{'motor_' * (i in system.windup_rows)}position": i
            for i in range(len(links))
            if not links[i].joint.locked
        }
        flexible = [i for i, link in enumerate(links) if link.flexible]
        self.tips = {f"link/{i + 1}/tip_deflection": k for k, i in enumerate(flexible)}
        self.sensors = {
            f"sensor/{sensor.name}": sensor.name
            for link in links
            for sensor in link.sensor
            if sensor.kind not in ("acceleration", *FORCE_KINDS)
        }
        known = [*self.joints, *self.tips, *self.sensors]
        if not (names is None or isinstance(names, list | tuple)):
            raise InputError("expected a list of measurements", key="measure", value=names)
        asked = [*self.joints, *(self.sensors or self.tips)] if names is None else list(names)
        for name in asked:
            if name not in known:
                expected = f"expected one of {', '.join(known)}"
                if isinstance(name, str) and name.startswith("sensor/"):
                    expected += "; no estimator here takes accelerations or forces"
                raise InputError(expected, key="measure", value=name)
        if not asked or len(set(asked)) != len(asked):
            raise InputError("expected each measurement once", key="measure", value=asked)
        self.names, self.system = tuple(asked), system
        self._sensed = any(name in self.sensors for name in asked)
        self._tipped = any(name in self.tips for name in asked)
        self._still = np.zeros((1, system.n))

    def read(
        self, position: np.ndarray, tip_deflections: np.ndarray, sensors: Mapping[str, float]
    ) -> np.ndarray:
        """The values (p,) of what a Sampled is given at a tick."""
        return np.array(
            [self._pick(name, position, tip_deflections, sensors) for name in self.names]
        )

    def at(self, q: np.ndarray) -> np.ndarray:
        """The values g(q) (p,) at a configuration (n,)."""
        at, still = q[None], self._still
        sensors: dict[str, Any] = {}
        if self._sensed:
            force = np.zeros((1, len(self.system.robot.links)))
            states = RunStates(self.system, np.zeros(1), at, still, force, Loads())
            sensors = {
                name.removeprefix("sensor/"): x[0] for name, x in sensor_channels(states).items()
            }
        return self.read(q[self.system.joint_rows], self._bent(q), sensors)

    def _bent(self, q: np.ndarray) -> np.ndarray:
        """Tip deflections (flexible,), if they are measured."""
        return self.system.places(q)[0] if self._tipped else np.zeros(0)

    def derivatives(self, linear: StateSpace) -> np.ndarray:
        """C (p, 2m), the derivative of the values by the states of a linearised robot (127)."""
        by_q = jacobian(self.at, linear.q, np.full(self.system.n, STEP))[:, self.system.free_rows]
        return np.hstack([by_q, np.zeros_like(by_q)])

    def _pick(
        self, name: str, position: np.ndarray, tips: np.ndarray, sensors: Mapping[str, float]
    ) -> float:
        if name in self.joints:
            return float(position[self.joints[name]])
        if name in self.tips:
            return float(tips[self.tips[name]])
        return float(sensors[self.sensors[name]])


class MeasuredLaw(ABC):
    """A law with a memory that a Sampled calls: it begins anew with every run.

    Args:
        measured: what it measures.
    """

    def __init__(self, measured: Measurements) -> None:
        self.measured, self.before = measured, np.inf

    def __call__(
        self,
        t: float,
        position: np.ndarray,
        velocity: np.ndarray,
        tip_deflection: float,
        *,
        tip_deflections: np.ndarray,
        sensors: Mapping[str, float],
    ) -> np.ndarray:
        """The forces (links,) at a tick [N or N m]."""
        y = self.measured.read(position, tip_deflections, sensors)
        if t <= self.before:
            self.begin(position)
        self.before = t
        return self.tick(t, y)

    @abstractmethod
    def begin(self, position: np.ndarray) -> None:
        """A run begins with the joints at `position` (links,): at rest, as far as is known."""

    @abstractmethod
    def tick(self, t: float, y: np.ndarray) -> np.ndarray:
        """The forces (links,) from the measurements (p,) at time t [s]."""
