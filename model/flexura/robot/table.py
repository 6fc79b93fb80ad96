"""What all tables of a robot file have in common: no unknown keys, and the plausible bounds of
every physical value."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydantic_core import PydanticUndefined

from ..errors import WrongValue
from ..io import MOST_LETTERS, is_name


@dataclass(frozen=True)
class Bounds:
    """What is plausible of a quantity: magnitudes from `low` to `high`; `zero`: 0 is good too;
    `signed`: so are negative values."""

    low: float
    high: float
    zero: bool = False
    signed: bool = False

    def hold(self, value: float) -> bool:
        """Whether a value lies within.

        Args:
            value: the value, in the unit of its key.

        Returns:
            True if it does.
        """
        size = abs(value) if self.signed else value
        return self.low <= size <= self.high or (self.zero and value == 0)

    def __str__(self) -> str:
        if self.signed:
            return f"between -{_short(self.high)} and {_short(self.high)}"
        zero = "0 or " if self.zero else ""
        return f"{zero}between {_short(self.low)} and {_short(self.high)}"


def _short(value: float) -> str:
    """2e12, not 2e+12."""
    return f"{value:g}".replace("e+", "e").replace("e0", "e").replace("e-0", "e-")


MASS = Bounds(1e-15, 1e9, zero=True)
INERTIA = Bounds(1e-24, 1e13, zero=True)

# In the unit of the key. The bounds refuse what is absurd, not what is unusual: robots have from
# 1 mm to 100 m, and are made of silicone (1e3 Pa) or diamond.
BOUNDS = {
    "length_m": Bounds(1e-5, 1000, zero=True),
    "width_m": Bounds(1e-7, 10),
    "height_m": Bounds(1e-7, 10),
    "diameter_m": Bounds(1e-7, 10),
    "outer_diameter_m": Bounds(1e-7, 10),
    "wall_m": Bounds(1e-9, 10),
    "flange_m": Bounds(1e-9, 10),
    "web_m": Bounds(1e-9, 10),
    "area_m2": Bounds(1e-16, 100),
    "second_moment_m4": Bounds(1e-32, 1000),
    "young_modulus_Pa": Bounds(1e3, 2e12),
    "density_kg_m3": Bounds(10, 25000),
    "mass_per_length_kg_m": Bounds(1e-12, 1e6, zero=True),
    "bending_stiffness_N_m2": Bounds(1e-18, 1e13),
    "mass_kg": MASS,
    "hub_mass_kg": MASS,
    "rotor_mass_kg": MASS,
    "inertia_kg_m2": INERTIA,
    "hub_inertia_kg_m2": INERTIA,
    "rotor_inertia_kg_m2": INERTIA,
    "centre_of_mass_m": Bounds(0, 1000, signed=True),
    "at_m": Bounds(0, 1000),
    "alpha_1_s": Bounds(1e-9, 1e6, zero=True),
    "ratio": Bounds(1e-12, 0.99),
    "beta_s": Bounds(1e-15, 10, zero=True),
    "angle_rad": Bounds(0, 7, signed=True),
    "start_rad": Bounds(0, 1e6, signed=True),
    "start_m": Bounds(0, 1e4, signed=True),
    "limits_rad": Bounds(0, 1e6, signed=True),
    "limits_m": Bounds(0, 1e6, signed=True),
    "viscous_friction_N_m_s_rad": Bounds(1e-20, 1e10, zero=True),
    "viscous_friction_N_s_m": Bounds(1e-15, 1e9, zero=True),
    "coulomb_friction_N_m": Bounds(1e-20, 1e10, zero=True),
    "coulomb_friction_N": Bounds(1e-15, 1e9, zero=True),
    "hub_radius_m": Bounds(0, 1000),
    "stiffness_N_m_rad": Bounds(1e-20, 1e15, zero=True),
    "stiffness_N_m": Bounds(1e-15, 1e15, zero=True),
    "damping_N_m_s_rad": Bounds(1e-20, 1e10, zero=True),
    "rest_rad": Bounds(0, 1e6, signed=True),
    "rest_m": Bounds(0, 1e4, signed=True),
    "gear_ratio": Bounds(1e-6, 1e6),
    "gravity_m_s2": Bounds(0, 1e4, signed=True),
}


def quantity(key: str, what: str, default: Any = PydanticUndefined, more: str = "") -> Any:
    """The field of a physical value: its bounds are those of `BOUNDS`.

    Args:
        key: the field's name.
        what: it is, with the unit, as messages say it.
        default: the value of an absent key; without it the key is required.
        more: said after the bounds.
    """
    bounds = BOUNDS[key]
    low = -bounds.high if bounds.signed else 0.0 if bounds.zero else bounds.low
    return Field(default, ge=low, le=bounds.high, description=f"{what}, {bounds}{more}")


def name(whose: str) -> Any:
    """The field of a name: one line without control characters, "" if the key is absent."""
    text = f"{whose} name, one line of at most {MOST_LETTERS} characters without control codes"
    return Field("", max_length=MOST_LETTERS, description=text)


class Table(BaseModel):
    """A table of the robot file: frozen, and no key that it does not know."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    @model_validator(mode="after")
    def _plausible(self) -> Table:
        for key in self.model_fields_set:
            value = getattr(self, key)
            if key == "name" and not is_name(value):
                raise WrongValue(key, value, type(self).model_fields[key].description or "")
            if key not in BOUNDS or value is None or isinstance(value, list):
                continue
            if not all(map(BOUNDS[key].hold, value if isinstance(value, tuple) else (value,))):
                said = type(self).model_fields[key].description or str(BOUNDS[key])
                raise WrongValue(key, list(value) if isinstance(value, tuple) else value, said)
        return self
