"""The joints as their drives move them: a motor on a screw or turning its joint, or a stepper.

A `MotorAxis` counts in the joint's unit: metres on a screw, radians where the motor turns the
joint. The transmission r is the joint's travel for a radian of the motor's output shaft: lead /
2 pi, or 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from flexura.errors import InputError

from .description import Rig
from .sheets import Bearing, Carriage, MotorSheet


@dataclass(frozen=True)
class Guide:
    """What a joint has by itself, in N and m or in N m and rad: friction, give, backlash."""

    coulomb: float
    viscous: float
    presliding: float
    backlash: float
    contact_stiffness: float
    contact_damping: float

    @classmethod
    def of(cls, table: Carriage | Bearing) -> Guide:
        """The values of a table, whose keys carry the units."""
        return cls(*table.model_dump().values())


class Friction(NamedTuple):
    """Factors on a joint's friction in the rig file: its motor's and screw's, and its own."""

    motor: float = 1.0
    own: float = 1.0


@dataclass(frozen=True)
class MotorAxis:
    """A joint with a geared DC motor. `number`: of the joint. `transmission`: r [m/rad or 1]."""

    number: int
    motor: MotorSheet
    guide: Guide
    transmission: float
    efficiency: float
    screw_coulomb_N_m: float
    screw_viscous_N_m_s: float
    table: str  # of the motor

    @property
    def turns(self) -> bool:
        """Whether the motor turns the joint; else it moves along a rail."""
        return self.transmission == 1.0

    @property
    def unit(self) -> str:
        """Of the joint's position: "m" or "rad"."""
        return "rad" if self.turns else "m"

    @property
    def force_unit(self) -> str:
        """Of the drive: "N" or "N m"."""
        return "N m" if self.turns else "N"


def motor_axes(rig: Rig) -> tuple[MotorAxis, ...]:
    """The joints of a rig that have motors.

    Raises:
        InputError: the friction and play of a joint are not in the rig file.
    """
    out = []
    for number, table, motor, guide in (
        (1, "motor", rig.motor, "carriage" if rig.screw else "bearing"),
        (2, "motor_2", rig.motor_2, "bearing_2"),
    ):
        if motor is None:
            continue
        values = getattr(rig, guide)
        if values is None:
            raise InputError(
                f"missing: a table [{guide}] with friction and backlash of joint {number}",
                key=guide,
            )
        screw = rig.screw if number == 1 else None
        out.append(
            MotorAxis(
                number,
                motor,
                Guide.of(values),
                screw.lead_m / (2 * math.pi) if screw else 1.0,
                screw.efficiency if screw else 1.0,
                screw.coulomb_friction_N_m if screw else 0.0,
                screw.viscous_friction_N_m_s if screw else 0.0,
                table,
            )
        )
    return tuple(out)
