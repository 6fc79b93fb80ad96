"""A sensor on a link: what it measures, and where."""

from __future__ import annotations

import re
from typing import Literal

from pydantic import Field, model_validator

from ..errors import WrongValue
from .table import BOUNDS, Table, name

UNITS = {
    "deflection": "m",
    "slope": "rad",
    "strain": "1",
    "acceleration": "m/s^2",
    "bending_moment": "N m",
    "shear_force": "N",
    "axial_force": "N",
    "stress": "Pa",
}
FORCE_KINDS = ("bending_moment", "shear_force", "axial_force", "stress")
_NAME = re.compile(r"[A-Za-z0-9_.-]+")


class Sensor(Table):
    """A sensor at a place of a link: the channel `sensor/NAME` of a run.

    `deflection`: across the tangent at the link's hub. `slope`: the tangent's angle to that one.
    `strain`: -distance_m x curvature. `acceleration`: across the tangent at the place, to its
    left, without gravity. `bending_moment`, `shear_force`, `axial_force`: in the section there.
    `stress`: the bending stress there, at distance_m or at the outer fibre to the left.
    """

    name: str = name("the sensor's")
    kind: Literal[
        "deflection",
        "slope",
        "strain",
        "acceleration",
        "bending_moment",
        "shear_force",
        "axial_force",
        "stress",
    ] = Field(
        description='what it measures, "deflection", "slope", "strain", "acceleration", '
        '"bending_moment", "shear_force", "axial_force" or "stress"'
    )
    at_m: float = Field(ge=0, description="the place along the link in metres, 0 or more")
    distance_m: float | None = Field(
        None,
        ge=-BOUNDS["height_m"].high,
        le=BOUNDS["height_m"].high,
        description="of a strain or stress: how far from the line it is, in metres, to the left of "
        "the tangent",
    )

    @model_validator(mode="after")
    def _consistent(self) -> Sensor:
        if not _NAME.fullmatch(self.name):
            expected = "a name of letters, digits, _, . and -: the channel is sensor/NAME"
            raise WrongValue("name", self.name, expected)
        if self.kind == "strain" and self.distance_m is None:
            said = type(self).model_fields["distance_m"].description
            raise WrongValue("distance_m", None, f"missing: expected {said}")
        if self.kind not in ("strain", "stress") and self.distance_m is not None:
            raise WrongValue("distance_m", self.distance_m, f"none: a {self.kind} has no distance")
        return self

    @property
    def unit(self) -> str:
        """The channel's unit."""
        return UNITS[self.kind]
