"""The strip's sensor at its pin: flex sensor, strain gauge or accelerometer, with noise and drift.

    flex       alpha = integral of the curvature from s_0 to s_0 + l, the difference of the slopes
               R_s = R_0 + g k alpha (1 + n alpha),   U = U_cc R_f / (R_s + R_f)
    gauge      strain = -distance x curvature,        U = U_0 + g k strain
    acceleration across the tip                       U = U_0 + g k a

g: the rig's own gain. The noise is white. The drift is an Ornstein-Uhlenbeck process with the time
constant T, exact for any step: x' = x e^(-h/T) + sigma sqrt(1 - e^(-2h/T)) xi.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ..emulation import EmulatedSensor
from ..sensors import LOGIC_V, Accelerometer, Flex, StrainGauge
from .mechanics import Mechanics

BLOCK = 4096  # random numbers drawn at a time
OPEN_V = 0.0  # where no sensor is connected: the divider's resistor pulls the pin down


class StripSensor:
    """The sensor's voltage at its pin, sampled once a step of the plant."""

    def __init__(
        self,
        sensor: Flex | StrainGauge | Accelerometer | None,
        more: EmulatedSensor | None,
        random: np.random.Generator,
        step_s: float,
        gain: float = 1.0,
    ) -> None:
        """Set up the sensor.

        Args:
            sensor: its data; None: nothing is connected.
            more: its noise and drift, or None.
            random: source of noise and drift.
            step_s: the plant's step [s].
            gain: factor on its answer.
        """
        self._sensor, self._gain = sensor, gain
        more = more or EmulatedSensor(noise_V=0.0, drift_V=0.0, drift_s=1.0)
        self._noise = more.noise_V
        self._decay = math.exp(-step_s / more.drift_s)
        self._drift_step = more.drift_V * math.sqrt(1 - self._decay**2)
        self._random = random
        self._numbers: Iterator[float] = iter(())
        self._drift = more.drift_V * self._next()

    def measure(self, mechanics: Mechanics) -> float:
        """What the sensor feels now: bend [rad], curvature [1/m] or acceleration [m/s^2]."""
        if isinstance(self._sensor, Flex):
            return mechanics.bend_rad
        if isinstance(self._sensor, StrainGauge):
            return mechanics.curvature(self._sensor.at_m)
        return mechanics.tip_acceleration if self._sensor else 0.0

    def voltage(self, measured: float) -> float:
        """The voltage for what the sensor feels, without noise and drift."""
        sensor, gain = self._sensor, self._gain
        if sensor is None:
            return OPEN_V
        if isinstance(sensor, Flex):
            ohms = max(sensor.ohms(measured, gain), 0.0)
            return LOGIC_V * sensor.divider_ohm / (ohms + sensor.divider_ohm)
        if isinstance(sensor, StrainGauge):
            return sensor.zero_V - gain * sensor.V_per_strain * sensor.distance_m * measured
        return sensor.zero_V + gain * sensor.V_s2_per_m * measured

    def sample(self, measured: float) -> float:
        """The next sample of the voltage for what the sensor feels."""
        if self._sensor is None:
            return OPEN_V
        self._drift = self._drift * self._decay + self._drift_step * self._next()
        return self.voltage(measured) + self._drift + self._noise * self._next()

    def _next(self) -> float:
        for number in self._numbers:
            return number
        self._numbers = iter(self._random.standard_normal(BLOCK).tolist())
        return next(self._numbers)
