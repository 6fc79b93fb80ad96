"""The payload of a robot file."""

from __future__ import annotations

from pydantic import Field

from .table import Table


class Payload(Table):
    """A body at the tip of the last link."""

    mass_kg: float = Field(0.0, ge=0, description="the payload's mass in kilograms, 0 or more")
    inertia_kg_m2: float = Field(
        0.0,
        ge=0,
        description="the payload's inertia about its own centre in kg m^2, 0 or more",
    )
    centre_of_mass_m: tuple[float, float] = Field(
        (0.0, 0.0),
        strict=False,
        description="the payload's centre from the tip in metres, two numbers [along, across] the "
        "tip's tangent",
    )
