"""The rig file: a frozen, validated description of motors, drives and sensors.

The robot file has the links and the joints' limits. The protocol has names, ranges and defaults of
the board's settings. No constant stands in two places.

Joint 1 has a [motor]: on a [screw] with a [carriage], or turning the joint with a [bearing]. Joint
2 has a [stepper], a [motor_2] with a [bearing_2], or is not there. The last flexible link has one
sensor or none: [flex], [strain_gauge] or [accelerometer].
"""

from __future__ import annotations

import logging
import os
from dataclasses import dataclass
from typing import Any

from pydantic import Field, ValidationError, model_validator

import flexura as fx
from flexura.errors import InputError, WrongValue
from flexura.io import FORMAT, check_format, explain, find, is_name, meant, read_toml

from ..board.protocol.declaration import CONFIG
from .emulation import Emulated
from .old_layout import with_constants_in_their_tables
from .sensors import Accelerometer, Flex, StrainGauge
from .sheets import Bearing, Carriage, Driver, MotorSheet, Screw, StepperSheet
from .toml_table import Table, named_file

log = logging.getLogger(__name__)

DERIVED_SETTINGS = (  # settings of the board that follow from the other tables
    "drive_1",
    "drive_2",
    "encoder_2",
    "motor_counts_per_m",
    "motor_1_counts_per_rad",
    "motor_2_counts_per_rad",
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
    "position_min_1_rad",
    "position_max_1_rad",
    "position_min_2_rad",
    "position_max_2_rad",
)
SENSORS = ("flex", "strain_gauge", "accelerometer")
ONE_LINE = "the rig's name, one line of at most 200 characters without control codes"


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
    screw: Screw | None = Field(None, description="a table [screw]")
    carriage: Carriage | None = Field(None, description="a table [carriage]")
    bearing: Bearing | None = Field(None, description="a table [bearing]")
    motor_2: MotorSheet | None = Field(None, description="a table [motor_2]")
    bearing_2: Bearing | None = Field(None, description="a table [bearing_2]")
    stepper: StepperSheet | None = Field(None, description="a table [stepper]")
    driver: Driver = Field(description="a table [driver]")
    flex: Flex | None = Field(None, description="a table [flex]")
    strain_gauge: StrainGauge | None = Field(None, description="a table [strain_gauge]")
    accelerometer: Accelerometer | None = Field(None, description="a table [accelerometer]")
    emulated: Emulated | None = Field(None, description="a table [emulated], for the emulated rig")
    board: dict[str, float] = Field(
        default_factory=dict,
        description="a table of the board's settings, numbers by their names in the protocol",
    )

    @model_validator(mode="after")
    def _fits_together(self) -> Rig:
        if self.stepper and self.motor_2:
            raise WrongValue("motor_2", "[motor_2]", "one drive of joint 2: [stepper] is there too")
        for table, wanted in (
            ("carriage", "screw"),
            ("bearing_2", "motor_2"),
        ):
            if getattr(self, table) and not getattr(self, wanted):
                raise WrongValue(table, f"[{table}]", f"absent, for there is no [{wanted}]")
        if self.bearing and self.screw:
            raise WrongValue("bearing", "[bearing]", "absent: the motor drives a [screw]")
        sensors = [name for name in SENSORS if getattr(self, name)]
        if len(sensors) > 1:
            raise WrongValue(
                sensors[1], f"[{sensors[1]}]", f"one sensor: [{sensors[0]}] is there too"
            )
        return self

    @model_validator(mode="after")
    def _settings(self) -> Rig:
        if not is_name(self.name):
            raise WrongValue("name", self.name, ONE_LINE)
        for name, value in self.board.items():
            if name in DERIVED_SETTINGS:
                raise WrongValue(f"board.{name}", value, "absent: it follows from the other tables")
            if name not in CONFIG:
                near = meant(name, [key for key in CONFIG if key not in DERIVED_SETTINGS])
                hint = f"did you mean {near}?" if near else "see firmware/protocol.toml"
                raise WrongValue(f"board.{name}", value, f"a setting of the board; {hint}")
            item = CONFIG[name]
            if not item.least <= value <= item.greatest:
                raise WrongValue(
                    f"board.{name}",
                    value,
                    f"between {item.least:g} and {item.greatest:g} ({item.text})",
                )
        return self

    @property
    def sensor(self) -> Flex | StrainGauge | Accelerometer | None:
        """The sensor of the last flexible link."""
        return self.flex or self.strain_gauge or self.accelerometer

    @property
    def joints(self) -> int:
        """How many joints the rig drives: 1 or 2."""
        return 2 if self.stepper or self.motor_2 else 1

    @property
    def structure(self) -> str:
        """The joints of the robot that fits: "PaR", "RR", "R"."""
        return ("Pa" if self.screw else "R") + ("R" if self.joints == 2 else "")


@dataclass(frozen=True)
class RigSetup:
    """A rig file with the files that it names.

    `limits`: of each joint [m or rad], from the rig file or the robot file.
    """

    file: str
    rig: Rig
    robot: fx.Robot
    manoeuvre: fx.Manoeuvre
    limits: tuple[tuple[float, float], ...]

    @property
    def emulated(self) -> Emulated:
        """The rig file's table [emulated]; without one nothing is noisy and nothing differs."""
        return self.rig.emulated or Emulated()

    @property
    def strip(self) -> int:
        """The number of the last flexible link, which has the sensor."""
        return strip_of(self.robot)


def strip_of(robot: fx.Robot) -> int:
    """The number of the last flexible link (from 1), which has the sensor."""
    return max(i for i, link in enumerate(robot.links, 1) if link.flexible)


def rig_of_recording(tables: Any) -> Rig:
    """The rig in a run's metadata.

    Args:
        tables: the rig file's tables.

    Raises:
        InputError: they are not valid.
    """
    try:
        return Rig.model_validate(with_constants_in_their_tables(tables)[0])
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
    data, moved = with_constants_in_their_tables(read_toml(found))
    check_format(data, name)
    try:
        rig = Rig.model_validate(data)
    except ValidationError as error:
        raise explain(error, Rig, data, name) from None
    for line in moved:
        log.warning("%s: %s", name, line)
    robot = fx.load(named_file(found, rig.robot))
    _check_robot(rig, robot, name)
    _check_sensor(rig, robot, name)
    manoeuvre = fx.load_manoeuvre(named_file(found, rig.manoeuvre), rig.joints)
    return RigSetup(name, rig, robot, manoeuvre, _limits(rig, robot, name))


def _check_robot(rig: Rig, robot: fx.Robot, file: str) -> None:
    wanted = rig.structure
    fits = robot.structure == wanted and robot.links[-1].flexible
    if fits and (not rig.screw or not robot.links[0].flexible):
        return
    words = {
        "PaR": "a robot of type IV: a rigid link with joint Pa, a flexible one with joint R",
        "RR": "a robot of two links with joints R, the last one flexible",
        "R": "a robot of one flexible link with joint R",
    }[wanted]
    raise InputError(
        f"expected {words}; that is what these drives move", key="robot", value=rig.robot, file=file
    )


def _check_sensor(rig: Rig, robot: fx.Robot, file: str) -> None:
    length = robot.links[-1].length_m
    if rig.flex and rig.flex.from_m + rig.flex.length_m > length:
        raise InputError(
            f"expected a sensor that ends on the strip of {length:g} m",
            key="flex.length_m",
            value=rig.flex.length_m,
            file=file,
        )
    if rig.strain_gauge and rig.strain_gauge.at_m >= length:
        raise InputError(
            f"expected a place on the strip of {length:g} m",
            key="strain_gauge.at_m",
            value=rig.strain_gauge.at_m,
            file=file,
        )


def _limits(rig: Rig, robot: fx.Robot, file: str) -> tuple[tuple[float, float], ...]:
    out: list[tuple[float, float]] = []
    sheets = (
        ("motor", rig.motor),
        ("motor_2" if rig.motor_2 else "stepper", rig.motor_2 or rig.stepper),
    )
    for (table, sheet), link in zip(sheets, robot.links, strict=False):
        here, there = getattr(sheet, "limits_rad", None), link.joint.limits
        key = f"{table}.limits_rad"
        if here and there:
            expected = "expected limits in one place: the robot file has them too"
            raise InputError(expected, key=key, value=list(here), file=file)
        if here and link.joint.type != "R":
            expected = "absent: a screw's limits are those of the robot file"
            raise InputError(expected, key=key, value=list(here), file=file)
        found = here or there
        if found is None and link.joint.type != "R":
            raise InputError(
                "expected a robot whose carriage has limits",
                key="robot",
                value=rig.robot,
                file=file,
            )
        if found is None:
            raise InputError(
                f"missing: the limits of joint {len(out) + 1} in rad, here or in the robot file",
                key=key,
                file=file,
            )
        out.append(found)
    return tuple(out)
