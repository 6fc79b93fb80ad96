"""Sensors of the flexible link: flex sensor, strain gauge, accelerometer; at most one of them.

The board reads one voltage U (0 to 5 V) and knows x = U / 5 V - zero only. A deflection sensor has
a calibration, w = c1 x + c2 x^2 + c3 x^3. An accelerometer has none: its channel is recorded, and
the board's controllers get no deflection.
"""

from __future__ import annotations

from pydantic import Field, model_validator

from flexura.errors import WrongValue

from .toml_table import Table, above, from_zero

LOGIC_V = 5.0


class Calibration(Table):
    """A measured calibration: tip deflection = c1 x + c2 x^2 + c3 x^3, x = reading - zero.

    Readings are fractions of 5 V.
    """

    zero: float = Field(
        gt=0,
        lt=1,
        description="the straight strip's reading, a fraction of full scale between 0 and 1",
    )
    c1_m: float = Field(description="metres for x, a finite number")
    c2_m: float = Field(0.0, description="metres for x^2, a finite number")
    c3_m: float = Field(0.0, description="metres for x^3, a finite number")
    covariance: list[list[float]] | None = Field(
        None, description="four rows of four numbers: the covariance of zero, c1_m, c2_m, c3_m"
    )

    @model_validator(mode="after")
    def _square(self) -> Calibration:
        if self.covariance is not None and [len(row) for row in self.covariance] != [4] * 4:
            raise WrongValue(
                "covariance",
                self.covariance,
                "four rows of four numbers, of zero, c1_m, c2_m, c3_m",
            )
        return self


def _calibration() -> Calibration | None:
    return Field(None, description="a table { zero, c1_m, c2_m, c3_m }, measured")  # type: ignore[no-any-return]


class Flex(Table):
    """The flex sensor in its divider: straight_ohm + ohm_per_rad times the bend over its length."""

    length_m: float = above("metres", "the sensor's active length", 1)
    from_m: float = from_zero("metres", "where on the strip the active length begins", 1, 0)
    straight_ohm: float = above("ohms", "the resistance on the straight strip", 1e7)
    ohm_per_rad: float = Field(
        gt=0,
        le=1e7,
        description="ohms for a radian of bend over its length, above 0 and at most 1e7",
    )
    nonlinearity_1_rad: float = Field(
        0.0,
        ge=-10,
        le=10,
        description=(
            "by what part a radian of bend changes the ohms for a radian, between -10 and 10"
        ),
    )
    divider_ohm: float = above("ohms", "the resistor from pin flex to ground", 1e7)
    inverted: bool = Field(
        False,
        description="true if a counter-clockwise bend lowers the resistance: the sensor is on the "
        "other side of the strip",
    )
    calibration: Calibration | None = _calibration()

    @property
    def sign(self) -> float:
        """1 if a counter-clockwise bend raises the resistance, else -1."""
        return -1.0 if self.inverted else 1.0

    def ohms(self, bend_rad: float, gain: float = 1.0) -> float:
        """Resistance for a counter-clockwise bend [rad]; `gain`: factor on ohm_per_rad."""
        bend = self.sign * bend_rad
        return self.straight_ohm + gain * self.ohm_per_rad * bend * (
            1 + self.nonlinearity_1_rad * bend
        )


class StrainGauge(Table):
    """A strain gauge in a bridge with an amplifier: U = zero_V + V_per_strain x strain."""

    at_m: float = from_zero("metres", "where on the strip the gauge is", 1)
    distance_m: float = Field(
        gt=-1,
        lt=1,
        description=(
            "the gauge's distance from the neutral line in metres, to the left of the strip seen "
            "from its root; below 0 on the right"
        ),
    )
    zero_V: float = Field(
        2.5, gt=0, lt=LOGIC_V, description="volts of the straight strip, between 0 and 5"
    )
    V_per_strain: float = above("volts", "the amplifier's output for a strain of 1", 1e7)
    calibration: Calibration | None = _calibration()


class Accelerometer(Table):
    """An analogue accelerometer at the strip's tip, across it: U = zero_V + V_s2_per_m x a."""

    zero_V: float = Field(2.5, gt=0, lt=LOGIC_V, description="volts at rest, between 0 and 5")
    V_s2_per_m: float = above("volts", "the output for 1 m/s^2", 10)
