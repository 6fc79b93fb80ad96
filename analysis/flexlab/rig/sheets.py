"""Data sheets of the drives: geared DC motor, lead screw, bridge, stepper, and the joint's own
guide (a rail's carriage or a bearing)."""

from __future__ import annotations

from typing import TypeVar

from pydantic import Field, model_validator

from flexura.errors import WrongValue
from flexura.io.quantities import note_turns

from .toml_table import Table, above, from_zero


class MotorSheet(Table):
    """A geared DC motor; torque and speed at the output shaft.

    Its encoder is on the motor's own shaft. Rotor, inductance and starting voltage are needed where
    the motor is simulated.
    """

    rated_voltage_V: float = above("volts", "the voltage of the motor's data", 60)
    no_load_speed_rpm: float = above(
        "turns a minute", "the output shaft's speed without load at the rated voltage", 2e4
    )
    no_load_current_A: float = above("amperes", "the current without load", 50)
    stall_torque_N_m: float = above(
        "newton metres", "the output shaft's torque at rest at the rated voltage", 100
    )
    stall_current_A: float = above("amperes", "the current at rest at the rated voltage", 200)
    gear_ratio: float = Field(
        ge=1,
        le=1e4,
        description="turns of the motor for one of the output shaft, between 1 and 10000",
    )
    encoder_pulses: int = Field(
        ge=1,
        le=10000,
        description=(
            "pulses of each encoder line in a turn of the motor, a whole number from 1 to 10000"
        ),
    )
    limits_rad: tuple[float, float] | None = Field(
        None,
        strict=False,
        description=(
            "two numbers in rad, the lower limit and a higher one, unless the robot file has them"
        ),
    )
    rotor_inertia_kg_m2: float | None = Field(
        None,
        gt=0,
        le=1e-2,
        description="the rotor's inertia before the gear in kg m^2, above 0 and at most 0.01",
    )
    inductance_H: float | None = Field(
        None, gt=0, le=1, description="the inductance in henries, above 0 and at most 1"
    )
    starts_at_V: float | None = Field(
        None,
        gt=0,
        le=60,
        description=(
            "the voltage at which the motor starts to turn without load in volts, above 0 and at "
            "most 60"
        ),
    )

    @model_validator(mode="after")
    def _ordered(self) -> MotorSheet:
        return _with_ordered_limits(self)


class Screw(Table):
    """The lead screw of joint 1, with its friction in its bearings and in a nut without load."""

    lead_m: float = Field(
        gt=0,
        le=0.1,
        description=(
            "the carriage's travel in a turn of the screw in metres, above 0 and at most "
            "0.1 (0.008, not 8)"
        ),
    )
    efficiency: float = Field(
        gt=0, le=1, description="force x travel / work at the screw, above 0 and at most 1"
    )
    coulomb_friction_N_m: float = from_zero("newton metres", "the screw's Coulomb friction", 10, 0)
    viscous_friction_N_m_s: float = from_zero("N m s/rad", "the screw's viscous friction", 1, 0)


class Carriage(Table):
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


class Bearing(Table):
    """A joint that a motor turns: its own friction, and the backlash of the gear."""

    coulomb_friction_N_m: float = from_zero("newton metres", "the bearing's Coulomb friction", 10)
    viscous_friction_N_m_s_rad: float = from_zero("N m s/rad", "the bearing's viscous friction", 10)
    presliding_rad: float = above("radians", "how far the joint gives way before it slides", 0.1)
    backlash_rad: float = from_zero("radians", "the gear's play at the joint, flank to flank", 0.2)
    contact_stiffness_N_m_rad: float = above(
        "N m/rad", "the stiffness of the gear's teeth at the joint", 1e6
    )
    contact_damping_N_m_s_rad: float = from_zero(
        "N m s/rad", "the damping of the gear's teeth at the joint", 1e4
    )


class Driver(Table):
    """The motors' bridges and their supply."""

    supply_V: float = above("volts", "the motors' supply", 60)
    supply_divider: float = Field(
        ge=1, le=20, description="motor supply / voltage at pin supply, between 1 and 20"
    )
    current_max_A: float = above(
        "amperes", "the current that bridge, supply and fuse give for seconds", 200
    )
    dead_zone_V: float = from_zero(
        "volts", "what the bridge's dead time takes off the voltage", 5, 0
    )


class StepperSheet(Table):
    """A stepper on the axis of joint 2, and the joint's encoder if it has one."""

    full_steps_per_turn: int = Field(
        ge=4, le=10000, description="full steps in a turn, a whole number from 4 to 10000"
    )
    microsteps: int = Field(ge=1, le=256, description="microsteps in a full step: 1, 2, 4, ... 256")
    holding_torque_N_m: float = above("newton metres", "the holding torque", 100)
    encoder_pulses: int | None = Field(
        None,
        ge=1,
        le=100000,
        description=(
            "pulses of each encoder line in a turn of the joint, a whole number from 1 to 100000; "
            "without it the joint's position is the counted pulses"
        ),
    )
    limits_rad: tuple[float, float] | None = Field(
        None,
        strict=False,
        description=(
            "two numbers in rad, the lower limit and a higher one, unless the robot file has them"
        ),
    )
    detent_torque_N_m: float = from_zero(
        "newton metres", "the detent torque, without current too", 10, 0
    )
    damping_N_m_s: float = from_zero(
        "N m s/rad", "the rotor's damping: eddy currents, bearings", 1, 0
    )

    @model_validator(mode="after")
    def _consistent(self) -> StepperSheet:
        if self.microsteps & (self.microsteps - 1):
            raise WrongValue("microsteps", self.microsteps, "a power of two: 1, 2, 4, ... 256")
        return _with_ordered_limits(self)


_Sheet = TypeVar("_Sheet", MotorSheet, StepperSheet)


def _with_ordered_limits(sheet: _Sheet) -> _Sheet:
    limits = sheet.limits_rad
    if limits is not None and not limits[0] < limits[1]:
        expected = "the lower limit first, then a higher upper limit"
        raise WrongValue("limits_rad", list(limits), expected)
    note_turns("limits_rad", *(limits or (0.0,)))
    return sheet
