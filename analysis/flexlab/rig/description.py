"""The rig file: a frozen, validated description of motors, drives and sensors.

The robot file has the strip's length and the carriage's limits. The protocol has names, ranges and
defaults of the board's settings. No constant stands in two places.
"""

from __future__ import annotations

import difflib
import math
import os
from dataclasses import dataclass
from typing import Any

from pydantic import Field, ValidationError, model_validator

import flexura as fx
from flexura.errors import InputError, WrongValue
from flexura.io import FORMAT, check_format, explain, find, is_name, read_toml

from ..board.protocol.declaration import CONFIG
from .emulation import Emulated
from .toml_table import Table, above, named_file, within

DERIVED_SETTINGS = (  # settings of the board that follow from the other tables
    "motor_counts_per_m",
    "stepper_steps_per_rad",
    "stepper_counts_per_rad",
    "supply_V",
    "supply_divider",
    "flex_zero",
    "flex_c1_m",
    "flex_c2_m",
    "flex_c3_m",
    "position_min_1_m",
    "position_max_1_m",
    "position_min_2_rad",
    "position_max_2_rad",
)


ONE_LINE = "the rig's name, one line of at most 200 characters without control codes"


class MotorSheet(Table):
    """Data sheet of joint 1's geared DC motor; torque and speed at the output shaft.

    Its encoder is on the motor's own shaft.
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


class Screw(Table):
    """The lead screw of joint 1."""

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


class Driver(Table):
    """The motor's bridge and supply."""

    supply_V: float = above("volts", "the motor's supply", 30)
    supply_divider: float = Field(
        ge=1, le=10, description="motor supply / voltage at A1, between 1 and 10"
    )
    current_max_A: float = above(
        "amperes", "the current that bridge, supply and fuse give for seconds", 200
    )


class StepperSheet(Table):
    """Data sheet of joint 2's stepper, on the joint's axis, and the joint's encoder."""

    full_steps_per_turn: int = Field(
        ge=4, le=10000, description="full steps in a turn, a whole number from 4 to 10000"
    )
    microsteps: int = Field(ge=1, le=256, description="microsteps in a full step: 1, 2, 4, ... 256")
    holding_torque_N_m: float = above("newton metres", "the holding torque", 100)
    encoder_pulses: int = Field(
        ge=1,
        le=100000,
        description=(
            "pulses of each encoder line in a turn of the joint, a whole number from 1 to 100000"
        ),
    )
    limits_rad: tuple[float, float] | None = Field(
        None,
        strict=False,
        description=(
            "two numbers in rad, the lower limit and a higher one, unless the robot file has them"
        ),
    )

    @model_validator(mode="after")
    def _consistent(self) -> StepperSheet:
        if self.microsteps & (self.microsteps - 1):
            raise WrongValue("microsteps", self.microsteps, "a power of two: 1, 2, 4, ... 256")
        if self.limits_rad is not None and not self.limits_rad[0] < self.limits_rad[1]:
            raise WrongValue(
                "limits_rad",
                list(self.limits_rad),
                "the lower limit first, then a higher upper limit",
            )
        return self


class Calibration(Table):
    """A measured calibration: tip deflection = c1 x + c2 x^2 + c3 x^3, x = reading - zero.

    Readings are fractions of 5 V.
    """

    zero: float = Field(
        gt=0,
        lt=1,
        description="the straight strip's reading, a fraction of full scale between 0 and 1",
    )
    c1_m: float = within("metres for x", 1e6)
    c2_m: float = within("metres for x^2", 1e6, 0.0)
    c3_m: float = within("metres for x^3", 1e6, 0.0)
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


class Flex(Table):
    """The flex sensor in its divider: straight_ohm + ohm_per_rad times the bend over its length."""

    length_m: float = above("metres", "the sensor's active length from the strip's root on", 1)
    straight_ohm: float = above("ohms", "the resistance on the straight strip", 1e7)
    ohm_per_rad: float = Field(
        gt=0,
        le=1e7,
        description="ohms for a radian of bend over its length, above 0 and at most 1e7",
    )
    divider_ohm: float = above("ohms", "the resistor from A0 to ground", 1e7)
    calibration: Calibration | None = Field(
        None, description="a table { zero, c1_m, c2_m, c3_m }, measured"
    )


class Rig(Table):
    """The rig file of one robot. Frozen; SI units."""

    format: int = Field(
        FORMAT, ge=1, le=FORMAT, description=f"the file's format, a whole number up to {FORMAT}"
    )
    name: str = Field("", max_length=200, description=ONE_LINE)
    robot: str = Field(
        description="the path of the robot file from the rig file's folder, or a shipped name"
    )
    manoeuvre: str = Field(
        description=(
            "the path of the manoeuvre file that this rig must be able to follow, or a shipped name"
        )
    )
    motor: MotorSheet = Field(description="a table [motor]")
    screw: Screw = Field(description="a table [screw]")
    driver: Driver = Field(description="a table [driver]")
    stepper: StepperSheet = Field(description="a table [stepper]")
    flex: Flex = Field(description="a table [flex]")
    emulated: Emulated | None = Field(None, description="a table [emulated], for the emulated rig")
    board: dict[str, float] = Field(
        default_factory=dict,
        description="a table of the board's settings, numbers by their names in the protocol",
    )

    @model_validator(mode="after")
    def _settings(self) -> Rig:
        if not is_name(self.name):
            raise WrongValue("name", self.name, ONE_LINE)
        for name, value in self.board.items():
            if name in DERIVED_SETTINGS:
                raise WrongValue(f"board.{name}", value, "absent: it follows from the other tables")
            if name not in CONFIG:
                near = difflib.get_close_matches(name, CONFIG, 1, 0.6)
                hint = f"did you mean {near[0]}?" if near else "see firmware/protocol.toml"
                raise WrongValue(f"board.{name}", value, f"a setting of the board; {hint}")
            item = CONFIG[name]
            if not item.least <= value <= item.greatest:
                raise WrongValue(
                    f"board.{name}",
                    value,
                    f"between {item.least:g} and {item.greatest:g} ({item.text})",
                )
        return self


@dataclass(frozen=True)
class RigSetup:
    """A rig file with the files that it names.

    `limits`: of both joints [m, rad], from the rig file or the robot file.
    """

    file: str
    rig: Rig
    robot: fx.Robot
    manoeuvre: fx.Manoeuvre
    limits: tuple[tuple[float, float], tuple[float, float]]

    @property
    def emulated(self) -> Emulated:
        """The rig file's table [emulated].

        Raises:
            InputError: there is none.
        """
        if self.rig.emulated is None:
            raise InputError(
                "missing: the emulated rig is described in a table [emulated]",
                key="emulated",
                file=self.file,
            )
        return self.rig.emulated


def rig_of_recording(tables: Any) -> Rig:
    """The rig in a run's metadata.

    Args:
        tables: the rig file's tables.

    Raises:
        InputError: they are not valid.
    """
    try:
        return Rig.model_validate(tables)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise InputError(
            f"expected the rig file's tables ({first['msg']})",
            key=f"rig.{where}",
            value=first["input"],
        ) from None


def load(path: str | os.PathLike[str]) -> RigSetup:
    """Read a rig file and the files it names.

    Args:
        path: the file's path, or the name of a rig that comes with flexura, for example "rig".

    Returns:
        The rig with its robot and manoeuvre.

    Raises:
        InputError: no such file, or a wrong value; it names file, key, value and what was expected.
    """
    found = find(path, "rigs")
    name = os.fspath(found)
    data = read_toml(found)
    check_format(data, name)
    try:
        rig = Rig.model_validate(data)
    except ValidationError as error:
        raise explain(error, Rig, data, name) from None
    robot = fx.load(named_file(found, rig.robot))
    carriage, strip = (robot.links * 2)[:2]
    if robot.structure != "PaR" or carriage.flexible or not strip.flexible:
        expected = (
            "expected a robot of type IV: a rigid link with joint Pa, a flexible one with joint R"
        )
        raise InputError(expected, key="robot", value=rig.robot, file=name)
    if carriage.joint.limits is None:
        raise InputError(
            "expected a robot whose carriage has limits", key="robot", value=rig.robot, file=name
        )
    here, there = rig.stepper.limits_rad, strip.joint.limits
    turn = here or there
    if turn is None:
        raise InputError(
            "missing: the limits of joint 2 in rad, here or in the robot file",
            key="stepper.limits_rad",
            file=name,
        )
    if here and there:
        expected = "expected limits in one place: the robot file has them too"
        raise InputError(expected, key="stepper.limits_rad", value=list(here), file=name)
    return RigSetup(
        name,
        rig,
        robot,
        fx.load_manoeuvre(named_file(found, rig.manoeuvre), 2),
        (carriage.joint.limits, turn),
    )


def configuration(setup: RigSetup) -> dict[str, float]:
    """All settings of the board, by name, in the protocol's order.

    d = lead counts / (4 pulses ratio), theta = 2 pi steps / (full steps x microsteps).

    Args:
        setup: the rig.

    Returns:
        Settings in SI units.

    Raises:
        InputError: a derived setting is outside the board's range.
    """
    rig = setup.rig
    (low_1, high_1), (low_2, high_2) = setup.limits
    turn = 2 * math.pi
    derived = {
        "motor_counts_per_m": 4
        * rig.motor.encoder_pulses
        * rig.motor.gear_ratio
        / rig.screw.lead_m,
        "stepper_steps_per_rad": rig.stepper.full_steps_per_turn * rig.stepper.microsteps / turn,
        "stepper_counts_per_rad": 4 * rig.stepper.encoder_pulses / turn,
        "supply_V": rig.driver.supply_V,
        "supply_divider": rig.driver.supply_divider,
        **{
            f"flex_{key}": value
            for key, value in calibration(setup).model_dump(exclude={"covariance"}).items()
        },
        "position_min_1_m": low_1,
        "position_max_1_m": high_1,
        "position_min_2_rad": low_2,
        "position_max_2_rad": high_2,
    }
    assert set(derived) == set(DERIVED_SETTINGS)
    for name, value in derived.items():
        item = CONFIG[name]
        if not item.least <= value <= item.greatest:
            expected = (
                f"a rig whose {name} lies between {item.least:g} and {item.greatest:g} "
                f"({item.text})"
            )
            raise InputError(expected, key=name, value=value, file=setup.file)
    return {name: (derived | rig.board).get(name, item.default) for name, item in CONFIG.items()}


def tip_per_bend(setup: RigSetup) -> float:
    """Tip deflection for a radian of bend under the sensor [m/rad], of a strip loaded at its tip.

    alpha = (P / EI)(L s - s^2 / 2), w = P L^3 / (3 EI), so w / alpha = L^3 / (3 (L s - s^2 / 2))
    (Euler-Bernoulli).

    Args:
        setup: the rig.
    """
    length, sensor = setup.robot.links[1].length_m, setup.rig.flex.length_m
    return length**3 / (3 * (length * sensor - sensor**2 / 2))


def calibration(setup: RigSetup) -> Calibration:
    """The measured calibration, or that of the sensor's data sheet.

    With the reading r = R_f / (R_s + R_f), and z that of the straight strip, the bend is (R_f /
    k)(1 / r - 1 / z). Its expansion to third order in x = r - z, times the tip deflection for a
    radian, is the calibration.

    Args:
        setup: the rig.

    Returns:
        The calibration.
    """
    flex = setup.rig.flex
    if flex.calibration is not None:
        return flex.calibration
    z = flex.divider_ohm / (flex.straight_ohm + flex.divider_ohm)
    scale = tip_per_bend(setup) * flex.divider_ohm / flex.ohm_per_rad
    return Calibration(zero=z, c1_m=-scale / z**2, c2_m=scale / z**3, c3_m=-scale / z**4)
