"""The table `emulated` of a rig file: what the emulated rig has and a real one needs not be told.

Noise and drift of the sensor, and the factors by which the emulated rig differs from its files.
Nothing of it reaches a board or a simulation.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from pydantic import Field, model_validator

from flexura.errors import WrongValue

from .toml_table import Table, above, from_zero


class EmulatedSensor(Table):
    """Noise and drift of the sensor's voltage."""

    noise_V: float = from_zero(
        "volts", "the standard deviation of the noise at its pin, new in every step", 1
    )
    drift_V: float = from_zero("volts", "the standard deviation of the drift at its pin", 1)
    drift_s: float = above("seconds", "the time in which the drift forgets", 1e5)


FACTORS = ("stiffness", "damping", "payload", "friction", "backlash", "flex_gain")


def _factor(what: str) -> Any:
    return Field(
        1.0,
        gt=0,
        le=10,
        description=f"the emulated rig's {what} / what the files say, above 0 and at most 10",
    )


class TrueParameters(Table):
    """Factors by which the emulated rig differs from its files, for an identification to find."""

    stiffness: float = _factor("bending stiffness of the flexible links")
    damping: float = _factor("damping of the flexible links")
    payload: float = _factor("payload")
    friction: float = _factor("friction of motors, screw, rail and bearings")
    backlash: float = _factor("backlash")
    flex_gain: float = _factor("answer of the strip's sensor to its bend")


def _range(low: float, high: float) -> Any:
    return Field((low, high), strict=False, description="two factors above 0, the lower one first")


class Ranges(Table):
    """Ranges from which `random_true_parameters` draws: pairs of factors, the lower first."""

    stiffness: tuple[float, float] = _range(0.85, 1.15)
    damping: tuple[float, float] = _range(0.6, 2.0)
    payload: tuple[float, float] = _range(0.8, 1.25)
    friction: tuple[float, float] = _range(0.7, 1.5)
    backlash: tuple[float, float] = _range(0.5, 2.0)
    flex_gain: tuple[float, float] = _range(0.85, 1.15)

    @model_validator(mode="after")
    def _ordered(self) -> Ranges:
        for name in FACTORS:
            low, high = getattr(self, name)
            if not 0 < low <= high <= 10:
                raise WrongValue(
                    name, [low, high], "two factors above 0 and at most 10, the lower one first"
                )
        return self


class Emulated(Table):
    """The emulated rig."""

    sensor: EmulatedSensor | None = Field(None, description="a table [emulated.sensor]")
    truth: TrueParameters = Field(
        default_factory=TrueParameters, description="a table [emulated.truth] of factors"
    )
    ranges: Ranges = Field(
        default_factory=Ranges, description="a table [emulated.ranges] of pairs of factors"
    )


def random_true_parameters(seed: int, ranges: Ranges | None = None) -> TrueParameters:
    """Draw the true parameters of a rig at random, each factor log-uniform in its range.

    Args:
        seed: the same seed gives the same rig.
        ranges: by default those of `Ranges`.

    Returns:
        The parameters.
    """
    random, within = np.random.default_rng([seed, 1]), ranges or Ranges()
    return TrueParameters(
        **{name: float(np.exp(random.uniform(*np.log(getattr(within, name))))) for name in FACTORS}
    )
