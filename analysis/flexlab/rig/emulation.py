"""The table `emulated` of a rig file: properties of the emulated rig beyond the data sheets.

Nothing of it reaches a board. A simulation of the nominal rig may use all but the true parameters,
which belong to the plant of the emulated board.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from pydantic import Field, model_validator

from flexura.errors import WrongValue

from .toml_table import Table, above, from_zero


class EmulatedMotor(Table):
    """The motor itself, before its gear."""

    rotor_inertia_kg_m2: float = above(
        "kg m^2", "the inertia of the motor's rotor, before the gear", 1e-2
    )
    inductance_H: float = above("henries", "the inductance of the motor", 1)
    starts_at_V: float = above(
        "volts", "the voltage at which the motor starts to turn without load", 60
    )


class EmulatedDriver(Table):
    """The motor's bridge."""

    dead_zone_V: float = from_zero("volts", "what the bridge's dead time takes off the voltage", 5)


class EmulatedScrew(Table):
    """Friction of the lead screw in its bearings and in a nut without load, at the screw."""

    coulomb_friction_N_m: float = from_zero("newton metres", "the screw's Coulomb friction", 10)
    viscous_friction_N_m_s: float = from_zero("N m s/rad", "the screw's viscous friction", 1)


class EmulatedCarriage(Table):
    """The carriage on its rail, and the nut's backlash on the screw."""

    coulomb_friction_N: float = from_zero("newtons", "the rail's Coulomb friction", 1e3)
    viscous_friction_N_s_m: float = from_zero("N s/m", "the rail's viscous friction", 1e4)
    presliding_m: float = above("metres", "how far the carriage gives way before it slides", 1e-3)
    backlash_m: float = from_zero(
        "metres", "the play between the nut and the screw, from flank to flank", 0.01
    )
    contact_stiffness_N_m: float = above(
        "N/m", "the stiffness of the nut on a flank of the screw", 1e7
    )
    contact_damping_N_s_m: float = from_zero(
        "N s/m", "the damping of the nut on a flank of the screw", 1e5
    )


class EmulatedStepper(Table):
    """Detent torque and damping of the stepper."""

    detent_torque_N_m: float = from_zero(
        "newton metres", "the detent torque, without current too", 10
    )
    damping_N_m_s: float = from_zero("N m s/rad", "the rotor's damping: eddy currents, bearings", 1)


class EmulatedFlex(Table):
    """Position, nonlinearity, noise and drift of the flex sensor."""

    from_m: float = from_zero("metres", "where on the strip the active length begins", 1)
    nonlinearity_1_rad: float = Field(
        ge=-10,
        le=10,
        description=(
            "by what part a radian of bend changes the ohms for a radian, between -10 and 10"
        ),
    )
    noise_V: float = from_zero(
        "volts", "the standard deviation of the noise at A0, new in every step", 1
    )
    drift_V: float = from_zero("volts", "the standard deviation of the drift at A0", 1)
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

    stiffness: float = _factor("bending stiffness of the strip")
    damping: float = _factor("damping of the strip")
    payload: float = _factor("payload")
    friction: float = _factor("friction of motor, screw and rail")
    backlash: float = _factor("backlash")
    flex_gain: float = _factor("ohms of the flex sensor for a radian")


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

    motor: EmulatedMotor = Field(description="a table [emulated.motor]")
    driver: EmulatedDriver = Field(description="a table [emulated.driver]")
    screw: EmulatedScrew = Field(description="a table [emulated.screw]")
    carriage: EmulatedCarriage = Field(description="a table [emulated.carriage]")
    stepper: EmulatedStepper = Field(description="a table [emulated.stepper]")
    flex: EmulatedFlex = Field(description="a table [emulated.flex]")
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
