"""A link of the robot file, with its section and damping."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, field_validator, model_validator

from ..errors import WrongValue
from .damping import Damping
from .joint import Joint
from .section import FORMS, Section, SectionAt, check_sections, dimensions_at, fibre, form_of
from .sensor import FORCE_KINDS, Sensor
from .table import BOUNDS, Table, name, quantity

MAX_ELEMENTS = 200


MOST_MODES = 14  # of one link: more would need more polynomials than double precision carries


LEAST_FREE = (
    0.02  # of its length that a flexible link keeps out of its sleeve: its mesh is that long
)


_STIFFNESS = BOUNDS["bending_stiffness_N_m2"]
MassPerLength = Annotated[float, Field(ge=0, le=BOUNDS["mass_per_length_kg_m"].high)]
BendingStiffness = Annotated[float, Field(ge=_STIFFNESS.low, le=_STIFFNESS.high)]
Pair = Annotated[tuple[float, float], Field(strict=False)]


class ValueAt(Table):
    """A value at a place along a link."""

    at_m: float = quantity("at_m", "the place of this value along the link in metres")
    value: float = Field(gt=0, description="a number above 0, in the unit of the key")


class Lump(Table):
    """A mass on the line of a link, with the inertia about its own centre (110)."""

    at_m: float = Field(ge=0, description="the place along the link in metres, 0 or more")
    mass_kg: float = Field(0.0, ge=0, description="a mass in kilograms, 0 or more")
    inertia_kg_m2: float = Field(
        0.0, ge=0, description="an inertia about the mass's own centre in kg m^2, 0 or more"
    )


_LINK_TEXT = {
    "section": (
        "a table { width_m, height_m } or a list of { at_m, width_m, height_m } in order of at_m; "
        f"other shapes: {FORMS}"
    ),
    "mass_per_length_kg_m": (
        f"mass per length in kg/m, a number {BOUNDS['mass_per_length_kg_m']} or a list of "
        "{ at_m, value } in order of at_m"
    ),
    "bending_stiffness_N_m2": (
        f"bending stiffness EI in N m^2, a number {BOUNDS['bending_stiffness_N_m2']} or a list of "
        "{ at_m, value } in order of at_m"
    ),
}


class Link(Table):
    """One link with the joint at its proximal side; rigid when `elements` is 0."""

    name: str = name("the link's")
    length_m: float = quantity(
        "length_m", "the link's length in metres", more=" (0 is for rigid links)"
    )
    elements: int = Field(
        0,
        ge=0,
        le=MAX_ELEMENTS,
        description=f"the number of beam elements, a whole number from 0 (rigid) to {MAX_ELEMENTS}",
    )
    modes: int | None = Field(
        None,
        ge=1,
        description="how many of the link's own modes to keep, a whole number of 1 or more",
    )
    section: Section | list[SectionAt] | None = Field(None, description=_LINK_TEXT["section"])
    young_modulus_Pa: float | None = quantity(
        "young_modulus_Pa", "Young's modulus in pascals", None, " (steel: 2.0e11, not 200)"
    )
    density_kg_m3: float | None = quantity(
        "density_kg_m3", "the density in kg/m^3", None, " (steel: 7850)"
    )
    mass_per_length_kg_m: MassPerLength | list[ValueAt] | None = Field(
        None, description=_LINK_TEXT["mass_per_length_kg_m"]
    )
    bending_stiffness_N_m2: BendingStiffness | list[ValueAt] | None = Field(
        None, description=_LINK_TEXT["bending_stiffness_N_m2"]
    )
    mass_kg: float | None = quantity("mass_kg", "a rigid link's mass in kilograms", None)
    centre_of_mass_m: float | Pair | None = Field(
        None,
        description="a rigid link's centre of mass from its origin in metres: a number along the "
        f"link, or two, [along, across], {BOUNDS['centre_of_mass_m']}",
    )
    inertia_kg_m2: float | None = quantity(
        "inertia_kg_m2", "a rigid link's inertia about its centre of mass in kg m^2", None
    )
    sensor: list[Sensor] = Field(
        default_factory=list, description="tables [[link.sensor]] { name, kind, at_m }"
    )
    mass: list[Lump] = Field(
        default_factory=list, description="tables [[link.mass]] { at_m, mass_kg, inertia_kg_m2 }"
    )
    damping: Damping = Field(
        default_factory=Damping,
        description="a table { alpha_1_s, beta_s }, { ratio } or { ratios }",
    )
    joint: Joint = Field(description='a table [link.joint] with at least type = "R", "Pa" or "Pb"')

    @property
    def flexible(self) -> bool:
        """Whether the link has beam elements."""
        return self.elements > 0

    @field_validator("section", "mass_per_length_kg_m", "bending_stiffness_N_m2")
    @classmethod
    def _ordered(cls, value: Any, info: Any) -> Any:
        if isinstance(value, list):
            at = [entry.at_m for entry in value]
            if len(at) < 2:
                raise WrongValue(info.field_name, at, "a list of at least two entries with at_m")
            if any(b <= a for a, b in pairwise(at)):
                raise WrongValue(info.field_name, at, "entries in ascending order of at_m")
            for k, entry in enumerate(value, 1):
                bounds = BOUNDS.get(info.field_name)
                if bounds is not None and not bounds.hold(entry.value):
                    key = f"{info.field_name}[{k}].value"
                    raise WrongValue(key, entry.value, f"a number {bounds}")
        return value

    @model_validator(mode="after")
    def _consistent(self) -> Link:
        if self.flexible:
            self._check_flexible()
        else:
            self._check_rigid()
        for k, lump in enumerate(self.mass, 1):
            if lump.at_m > self.length_m:
                expected = f"a place on the link, at most its length, {self.length_m:g}"
                raise WrongValue(f"mass[{k}].at_m", lump.at_m, expected)
        self._check_sensors()
        if self.mass and self.flexible and self.joint.type == "Pb":
            expected = (
                "none: masses on a flexible link that moves through a sleeve are not modelled"
            )
            raise WrongValue("mass[1].at_m", self.mass[0].at_m, expected)
        for key in ("section", "mass_per_length_kg_m", "bending_stiffness_N_m2"):
            value = getattr(self, key)
            if isinstance(value, list) and (
                value[0].at_m != 0 or abs(value[-1].at_m - self.length_m) > 1e-9 * self.length_m
            ):
                raise WrongValue(
                    key,
                    [e.at_m for e in value],
                    f"entries from at_m = 0 to the link's length, {self.length_m:g}",
                )
        if self.section is not None:
            check_sections(self.section, self.length_m)
        return self

    def _check_sensors(self) -> None:
        for k, sensor in enumerate(self.sensor, 1):
            if sensor.at_m > self.length_m:
                expected = f"a place on the link, at most its length, {self.length_m:g}"
                raise WrongValue(f"sensor[{k}].at_m", sensor.at_m, expected)
            if not self.flexible and sensor.kind not in ("acceleration", *FORCE_KINDS):
                expected = '"acceleration" or a force: a rigid link (elements = 0) does not bend'
                raise WrongValue(f"sensor[{k}].kind", sensor.kind, expected)
            if sensor.kind in FORCE_KINDS:
                self._check_force_sensor(k, sensor)
            if self.flexible and self.joint.type == "Pb":
                expected = "none: no sensors are on a flexible link that moves through a sleeve"
                raise WrongValue(f"sensor[{k}].at_m", sensor.at_m, expected)

    def _check_force_sensor(self, k: int, sensor: Sensor) -> None:
        if self.mass_kg and 0 < sensor.at_m < self.length_m:
            expected = (
                "a place at an end: how the mass of this rigid link is spread is not given by "
                "mass_kg; mass_per_length_kg_m gives it"
            )
            raise WrongValue(f"sensor[{k}].at_m", sensor.at_m, expected)
        if self.joint.type == "Pb":
            expected = (
                'none on a link that moves through a sleeve: simulate with "internal_forces", '
                "which has the forces on its free length"
            )
            raise WrongValue(f"sensor[{k}].at_m", sensor.at_m, expected)
        if sensor.kind == "stress" and self.section is None:
            expected = "missing: a stress needs the section; the bending stiffness alone gives none"
            raise WrongValue("section", None, expected)
        stressed = self.bending_stress(0.0, sensor.at_m, sensor.distance_m) is not None
        if sensor.kind == "stress" and not stressed:
            expected = (
                "missing: expected the distance of the fibre from the axis in metres; a section "
                "by area_m2 and second_moment_m4 has no height"
            )
            raise WrongValue(f"sensor[{k}].distance_m", None, expected)

    def _check_flexible(self) -> None:
        if self.length_m <= 0:
            raise WrongValue(
                "length_m", self.length_m, "a length above 0 for a flexible link (elements > 0)"
            )
        for key in ("mass_kg", "centre_of_mass_m", "inertia_kg_m2"):
            if getattr(self, key) is not None:
                raise WrongValue(
                    key,
                    getattr(self, key),
                    "absent for a flexible link: its mass comes from the section or "
                    "mass_per_length_kg_m",
                )
        by_section = (self.section, self.young_modulus_Pa, self.density_kg_m3)
        by_number = (self.mass_per_length_kg_m, self.bending_stiffness_N_m2)
        if all(v is None for v in by_section + by_number):
            raise WrongValue(
                "section",
                None,
                "missing: a flexible link needs section, young_modulus_Pa, density_kg_m3, "
                "or mass_per_length_kg_m, bending_stiffness_N_m2",
            )
        if any(v is not None for v in by_section) and any(v is not None for v in by_number):
            key = (
                "mass_per_length_kg_m"
                if self.mass_per_length_kg_m is not None
                else "bending_stiffness_N_m2"
            )
            raise WrongValue(
                key,
                getattr(self, key),
                "either section, young_modulus_Pa, density_kg_m3, or mass_per_length_kg_m, "
                "bending_stiffness_N_m2, "
                "not some of each",
            )
        names = (
            ("section", "young_modulus_Pa", "density_kg_m3")
            if self.section_given
            else ("mass_per_length_kg_m", "bending_stiffness_N_m2")
        )
        for key in names:
            if getattr(self, key) is None:
                raise WrongValue(key, None, f"missing: {type(self).model_fields[key].description}")
        if self.modes is not None and self.modes > 2 * self.elements:
            raise WrongValue(
                "modes", self.modes, f"at most {2 * self.elements}, twice the number of elements"
            )
        if self.modes is not None and self.modes > MOST_MODES:
            raise WrongValue(
                "modes",
                self.modes,
                f"at most {MOST_MODES}; a link without modes keeps all unknowns of its mesh",
            )

    def _check_rigid(self) -> None:
        for key in ("modes", "young_modulus_Pa", "bending_stiffness_N_m2"):
            if getattr(self, key) is not None:
                raise WrongValue(key, getattr(self, key), "absent for a rigid link (elements = 0)")
        spread = (
            self.section is not None
            or self.mass_per_length_kg_m is not None
            or self.density_kg_m3 is not None
        )
        if self.mass_per_length_kg_m == 0:
            raise WrongValue("mass_per_length_kg_m", 0.0, "a number above 0, or mass_kg = 0.0")
        if self.mass_kg is None and not spread:
            raise WrongValue(
                "mass_kg", None, "missing: a rigid link's mass in kilograms, 0 or more"
            )
        if spread:
            if self.mass_kg is not None:
                raise WrongValue(
                    "mass_kg",
                    self.mass_kg,
                    "either mass_kg, or section and density_kg_m3, or mass_per_length_kg_m",
                )
            if self.mass_per_length_kg_m is None and (
                self.section is None or self.density_kg_m3 is None
            ):
                missing = "density_kg_m3" if self.density_kg_m3 is None else "section"
                raise WrongValue(
                    missing, None, f"missing: {type(self).model_fields[missing].description}"
                )

    @property
    def section_given(self) -> bool:
        """Whether mass and stiffness come from the section and the material."""
        return (
            self.section is not None
            or self.young_modulus_Pa is not None
            or self.density_kg_m3 is not None
        )

    def mass_per_length(self, x: ArrayLike) -> np.ndarray:
        """Mass per length, linear between the given places.

        Args:
            x: places from the link's origin [m].

        Returns:
            As many values [kg/m].
        """
        if self.mass_per_length_kg_m is not None:
            return _spread(self.mass_per_length_kg_m, x)
        return _spread(self.density_kg_m3 * self._of_section("area", x), x)

    def bending_stiffness(self, x: ArrayLike) -> np.ndarray:
        """Bending stiffness EI.

        Args:
            x: places from the link's origin [m].

        Returns:
            As many values [N m^2].
        """
        if self.bending_stiffness_N_m2 is not None:
            return _spread(self.bending_stiffness_N_m2, x)
        return _spread(self.young_modulus_Pa * self._of_section("second_moment", x), x)

    def axial_stiffness(self, x: ArrayLike) -> np.ndarray | None:
        """Axial stiffness EA.

        Args:
            x: places from the link's origin [m].

        Returns:
            As many values [N]; None where the file gives EI only. The native model has no axial
            unknowns.
        """
        if self.section is None or self.young_modulus_Pa is None:
            return None
        return _spread(self.young_modulus_Pa * self._of_section("area", x), x)

    def bending_stress(self, moment: ArrayLike, x: ArrayLike, distance: float | None = None) -> Any:
        """The stress of a fibre under a bending moment, positive where it is drawn out (146).

        Args:
            moment: bending moments, positive to the left (S,) [N m].
            x: their places from the link's origin (S,) [m].
            distance: of the fibre, to the left of the tangent [m]; None: the outer one.

        Returns:
            Stresses (S,) [Pa]; None: the link has no section, or one without a height where no
            distance is given.
        """
        arm = None if self.section is None else fibre(self.section, x, distance)
        return None if arm is None else -np.asarray(moment) * arm

    def _of_section(self, what: str, x: ArrayLike) -> Any:
        """The area [m^2] or the second moment [m^4] of the section at x (8)."""
        assert self.section is not None
        return getattr(form_of(self.section), what)(*dimensions_at(self.section, x))

    def breaks(self) -> list[float]:
        """Places along the link [m] where a given property has a kink, the ends included."""
        places = {0.0, self.length_m}
        for value in (self.section, self.mass_per_length_kg_m, self.bending_stiffness_N_m2):
            if isinstance(value, list):
                places.update(entry.at_m for entry in value)
        return sorted(places)


def _spread(value: Any, x: Any) -> np.ndarray:
    """A list of values as an array at x, or one value for all of it."""
    if isinstance(value, list):
        return np.interp(x, [v.at_m for v in value], [v.value for v in value])
    return value if isinstance(value, np.ndarray) else np.full(np.shape(x), value)
