"""The joint of a link in the robot file: its keys carry the unit of what the joint does, turn or
slide."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field, model_validator

from ..errors import WrongValue
from .table import BOUNDS, Table, quantity

# Quantities of a joint: the key of a joint that turns (R), and of one that slides (Pa, Pb).
KEYS = {
    "start": ("start_rad", "start_m"),
    "limits": ("limits_rad", "limits_m"),
    "rotor_inertia": ("rotor_inertia_kg_m2", "rotor_mass_kg"),
    "viscous_friction": ("viscous_friction_N_m_s_rad", "viscous_friction_N_s_m"),
    "coulomb_friction": ("coulomb_friction_N_m", "coulomb_friction_N"),
}


def key_of(quantity: str, type: object) -> str:
    """The key of a quantity for a joint of this type: `start` of a joint R is `start_rad`.

    Args:
        quantity: a name of `KEYS`, or any other, which is its own key.
        type: "R", "Pa" or "Pb".

    Returns:
        The key.
    """
    turning, sliding = KEYS.get(quantity, (quantity, quantity))
    return turning if type == "R" else sliding


def _limits(key: str, unit: str) -> Any:
    text = f"two numbers, the lower limit and a higher upper limit, in {unit}, {BOUNDS[key]}"
    return Field(None, strict=False, description=text)


class Spring(Table):
    """A spring beside a joint's drive (108)."""

    stiffness_N_m_rad: float = quantity(
        "stiffness_N_m_rad", "the stiffness of the spring of a joint R in N m/rad", 0.0
    )
    rest_rad: float = quantity("rest_rad", "where the spring of a joint R rests, in radians", 0.0)
    stiffness_N_m: float = quantity(
        "stiffness_N_m", "the stiffness of the spring of a joint Pa or Pb in N/m", 0.0
    )
    rest_m: float = quantity("rest_m", "where the spring of a joint Pa or Pb rests, in metres", 0.0)


class Transmission(Table):
    """What is between a rotor and its hub: a spring with a damper (109). All values are those at
    the joint, the rotor's inertia too."""

    stiffness_N_m_rad: float = Field(
        gt=0, le=1e12, description="the stiffness at the joint in N m/rad, above 0 and at most 1e12"
    )
    damping_N_m_s_rad: float = quantity(
        "damping_N_m_s_rad", "the damping at the joint in N m s/rad", 0.0
    )
    gear_ratio: float = quantity("gear_ratio", "turns of the motor in a turn of the joint", 1.0)


class Joint(Table):
    """The joint at the proximal side of a link: R, Pa or Pb (dissertation, table 2.1).

    `start`, `limits`, `rotor_inertia`, `viscous_friction` and `coulomb_friction` are the values in
    the joint's own unit, whichever key holds them.
    """

    type: Literal["R", "Pa", "Pb"] = Field(description='the joint type, "R", "Pa" or "Pb"')
    angle_rad: float = quantity("angle_rad", "the fixed angle gamma of a Pa or Pb in radians", 0.0)
    start_rad: float = quantity(
        "start_rad", "the position of a joint R at the start in radians, a finite number", 0.0
    )
    start_m: float = quantity(
        "start_m",
        "the position of a joint Pa or Pb at the start in metres (Pb: the free length), a finite "
        "number",
        0.0,
    )
    limits_rad: tuple[float, float] | None = _limits("limits_rad", "radians, of a joint R")
    limits_m: tuple[float, float] | None = _limits("limits_m", "metres, of a joint Pa or Pb")
    hub_mass_kg: float = quantity("hub_mass_kg", "the hub's mass in kilograms", 0.0)
    hub_inertia_kg_m2: float = quantity("hub_inertia_kg_m2", "the hub's inertia in kg m^2", 0.0)
    rotor_inertia_kg_m2: float = quantity(
        "rotor_inertia_kg_m2", "the rotor's inertia reflected to a joint R in kg m^2", 0.0
    )
    rotor_mass_kg: float = quantity(
        "rotor_mass_kg", "the rotor's inertia reflected to a joint Pa or Pb in kg", 0.0
    )
    viscous_friction_N_m_s_rad: float = quantity(
        "viscous_friction_N_m_s_rad", "viscous friction of a joint R in N m s/rad", 0.0
    )
    viscous_friction_N_s_m: float = quantity(
        "viscous_friction_N_s_m", "viscous friction of a joint Pa or Pb in N s/m", 0.0
    )
    coulomb_friction_N_m: float = quantity(
        "coulomb_friction_N_m", "Coulomb friction of a joint R in N m", 0.0
    )
    coulomb_friction_N: float = quantity(
        "coulomb_friction_N", "Coulomb friction of a joint Pa or Pb in N", 0.0
    )
    hub_radius_m: float = quantity(
        "hub_radius_m", "how far from the axis of a joint R its link begins, in metres", 0.0
    )
    spring: Spring | None = Field(
        None,
        description="a table { stiffness_N_m_rad, rest_rad }, of a joint Pa or Pb { stiffness_N_m, "
        "rest_m }",
    )
    transmission: Transmission | None = Field(
        None, description="a table { stiffness_N_m_rad, damping_N_m_s_rad, gear_ratio }"
    )
    locked: bool = Field(False, description="true (the joint is clamped at its start) or false")

    @classmethod
    def keys_beside(cls, given: Mapping[str, Any]) -> list[str]:
        """The keys that a joint may have.

        Args:
            given: its table; with a type, keys of the other joints are left out.

        Returns:
            The keys.
        """
        pairs = KEYS.values() if given.get("type") in ("R", "Pa", "Pb") else ()
        wrong = {sliding if given["type"] == "R" else turning for turning, sliding in pairs}
        return [key for key in cls.model_fields if key not in wrong]

    @model_validator(mode="after")
    def _consistent(self) -> Joint:
        for name, (turning, sliding) in KEYS.items():
            wrong = sliding if self.type == "R" else turning
            value = getattr(self, wrong)
            if wrong in self.model_fields_set and value != type(self).model_fields[wrong].default:
                right = key_of(name, self.type)
                raise WrongValue(wrong, value, f"none: a joint {self.type} has {right}")
        self._check_spring()
        if self.type != "R":
            for key in ("hub_radius_m", "transmission"):
                if getattr(self, key):
                    expected = f"none: a joint {self.type} slides; only a joint R has one"
                    raise WrongValue(key, getattr(self, key), expected)
        if self.transmission and not self.rotor_inertia > 0:
            expected = "an inertia above 0: behind a transmission the rotor moves by itself"
            raise WrongValue(self.key("rotor_inertia"), self.rotor_inertia, expected)
        if self.type == "R" and self.angle_rad != 0:
            raise WrongValue(
                "angle_rad",
                self.angle_rad,
                "no fixed angle: a joint R turns; use start_rad for its first position",
            )
        if self.limits is not None:
            key, given = self.key("limits"), list(self.limits)
            if not self.limits[0] < self.limits[1]:
                raise WrongValue(key, given, "the lower limit first, then a higher upper limit")
            if not self.limits[0] <= self.start <= self.limits[1]:
                raise WrongValue(
                    key, given, f"limits that contain the start position, {self.start:g}"
                )
        return self

    def _check_spring(self) -> None:
        if self.spring is None:
            return
        turning, sliding = ("stiffness_N_m_rad", "rest_rad"), ("stiffness_N_m", "rest_m")
        wrong, right = (sliding, turning) if self.type == "R" else (turning, sliding)
        for key, instead in zip(wrong, right, strict=True):
            if key in self.spring.model_fields_set and getattr(self.spring, key) != 0.0:
                expected = f"none: the spring of a joint {self.type} has {instead}"
                raise WrongValue(f"spring.{key}", getattr(self.spring, key), expected)

    @property
    def spring_stiffness(self) -> float:
        """Stiffness of the spring beside the drive [N m/rad, N/m]; 0: none."""
        if self.spring is None:
            return 0.0
        return self.spring.stiffness_N_m_rad if self.type == "R" else self.spring.stiffness_N_m

    @property
    def spring_rest(self) -> float:
        """Where that spring rests [rad, m]."""
        if self.spring is None:
            return 0.0
        return self.spring.rest_rad if self.type == "R" else self.spring.rest_m

    @property
    def windup_stiffness(self) -> float:
        """Stiffness of the transmission at the joint [N m/rad]; 0: none."""
        return 0.0 if self.transmission is None else self.transmission.stiffness_N_m_rad

    @property
    def windup_damping(self) -> float:
        """Damping of the transmission at the joint [N m s/rad]."""
        return 0.0 if self.transmission is None else self.transmission.damping_N_m_s_rad

    def key(self, quantity: str) -> str:
        """The key that holds a quantity of this joint.

        Args:
            quantity: for example "start".

        Returns:
            The key, for example "start_rad".
        """
        return key_of(quantity, self.type)

    @property
    def start(self) -> float:
        """The position at the start [rad, m]; Pb: the free length."""
        return self.start_rad if self.type == "R" else self.start_m

    @property
    def limits(self) -> tuple[float, float] | None:
        """The lower and the upper limit [rad, m], or None."""
        return self.limits_rad if self.type == "R" else self.limits_m

    @property
    def rotor_inertia(self) -> float:
        """The rotor's inertia reflected to the joint [kg m^2, kg]."""
        return self.rotor_inertia_kg_m2 if self.type == "R" else self.rotor_mass_kg

    @property
    def viscous_friction(self) -> float:
        """Viscous friction [N m s/rad, N s/m]."""
        return self.viscous_friction_N_m_s_rad if self.type == "R" else self.viscous_friction_N_s_m

    @property
    def coulomb_friction(self) -> float:
        """Coulomb friction [N m, N]."""
        return self.coulomb_friction_N_m if self.type == "R" else self.coulomb_friction_N
