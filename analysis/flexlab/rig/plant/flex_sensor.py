"""The flex sensor: resistance by the strip's bend over its active length, divider, noise, drift.

    alpha = integral of the curvature from s_0 to s_0 + l = difference of the slopes there
    R_s = R_0 + k_R alpha (1 + n alpha),   U = U_cc R_f / (R_s + R_f) + noise + drift

The noise is white. The drift is an Ornstein-Uhlenbeck process with the time constant T, exact for
any step: x' = x e^(-h/T) + sigma sqrt(1 - e^(-2h/T)) xi.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ..description import Flex
from ..emulation import EmulatedFlex

LOGIC_V = 5.0
BLOCK = 4096  # random numbers drawn at a time


class FlexSensor:
    """The sensor's voltage at A0, sampled once a step of the plant."""

    def __init__(
        self,
        flex: Flex,
        more: EmulatedFlex,
        random: np.random.Generator,
        step_s: float,
        gain: float = 1.0,
    ) -> None:
        """Set up the sensor.

        Args:
            flex: data of the sensor and its divider.
            more: its noise, drift and nonlinearity.
            random: source of noise and drift.
            step_s: the plant's step [s].
            gain: factor on the ohms for a radian.
        """
        self._straight, self._divider = flex.straight_ohm, flex.divider_ohm
        self._slope, self._nonlinearity = gain * flex.ohm_per_rad, more.nonlinearity_1_rad
        self._noise = more.noise_V
        self._decay = math.exp(-step_s / more.drift_s)
        self._drift_step = more.drift_V * math.sqrt(1 - self._decay**2)
        self._random = random
        self._numbers: Iterator[float] = iter(())
        self._drift = more.drift_V * self._next()

    def voltage(self, bend_rad: float) -> float:
        """The voltage for a bend [rad], without noise and drift."""
        sensor = self._straight + self._slope * bend_rad * (1 + self._nonlinearity * bend_rad)
        return LOGIC_V * self._divider / (max(sensor, 0.0) + self._divider)

    def sample(self, bend_rad: float) -> float:
        """The next sample of the voltage for a bend [rad]."""
        self._drift = self._drift * self._decay + self._drift_step * self._next()
        return self.voltage(bend_rad) + self._drift + self._noise * self._next()

    def _next(self) -> float:
        for number in self._numbers:
            return number
        self._numbers = iter(self._random.standard_normal(BLOCK).tolist())
        return next(self._numbers)
