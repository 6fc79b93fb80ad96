"""The payload of a robot file."""

from __future__ import annotations

from pydantic import Field

from .table import Table, quantity


class Payload(Table):
    """A body at the tip of the last link."""

    mass_kg: float = quantity("mass_kg", "the payload's mass in kilograms", 0.0)
    inertia_kg_m2: float = quantity(
        "inertia_kg_m2", "the payload's inertia about its own centre in kg m^2", 0.0
    )
    centre_of_mass_m: tuple[float, float] = Field(
        (0.0, 0.0),
        strict=False,
        description="the payload's centre from the tip in metres, two numbers [along, across] the "
        "tip's tangent",
    )
