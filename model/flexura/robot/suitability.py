"""What a robot file may say and the equations do not suit: refused, with the reason."""

from __future__ import annotations

import numpy as np

from ..errors import WrongValue
from .link import Link
from .payload import Payload

STRETCH = 0.05  # of an inextensible line by the weight it carries


def check_masses(links: list[Link], payload: Payload) -> None:
    """Refuse masses on links whose shapes do not suit them, and links without mass.

    Raises: WrongValue: an inertia between the ends of a link in modes or under a slider; a flexible
    link without mass that keeps more modes than masses hang on it.
    """
    for i, link in enumerate(links):
        ridden = i + 1 < len(links) and links[i + 1].joint.type == "Pa"
        if link.flexible and (ridden or link.modes):
            _check_inertias(link, i, "under a slider" if ridden else "in modes")
        if link.flexible and link.mass_per_length_kg_m == 0:
            _check_massless(link, i, payload if i + 1 == len(links) else None)


def _check_inertias(link: Link, i: int, what: str) -> None:
    for k, lump in enumerate(link.mass, 1):
        if lump.inertia_kg_m2 and 0 < lump.at_m < link.length_m:
            raise WrongValue(
                f"link[{i + 1}].mass[{k}].inertia_kg_m2",
                lump.inertia_kg_m2,
                f"0 between the ends of a link {what}: its smooth shapes do not bend there as "
                f"sharply as an inertia makes it; a mesh without modes does",
            )


def _check_massless(link: Link, i: int, payload: Payload | None) -> None:
    """A link without mass has as many modes as masses and inertias hang on it."""
    key = f"link[{i + 1}].mass_per_length_kg_m"
    if payload is None or link.joint.type == "Pb":
        expected = "a mass above 0: only the last link, outside of a sleeve, may be without"
        raise WrongValue(key, 0.0, expected)
    hung = sum((lump.mass_kg > 0) + (lump.inertia_kg_m2 > 0) for lump in link.mass if lump.at_m > 0)
    turning = payload.inertia_kg_m2 > 0 or (payload.mass_kg > 0 and payload.centre_of_mass_m[1])
    hung += (payload.mass_kg > 0) + bool(turning)
    if not hung:
        raise WrongValue(key, 0.0, "a mass above 0: nothing with a mass hangs on this link")
    if link.modes is None or link.modes > hung:
        raise WrongValue(
            key,
            0.0,
            f"a mass above 0, or modes = {hung} or fewer: a link without mass bends in as many "
            f"ways as masses and inertias hang on it",
        )


def check_stretch(links: list[Link], payload: Payload, gravity: tuple[float, float]) -> None:
    """Refuse links that the weight they carry would stretch by more than `STRETCH`: the line is
    inextensible.

    Raises: WrongValue: there is one.
    """
    weight = payload.mass_kg * float(np.hypot(*gravity))
    for i in range(len(links) - 1, -1, -1):
        link = links[i]
        x = np.linspace(0.0, link.length_m, 33)
        lumps = sum(lump.mass_kg for lump in link.mass) + (link.mass_kg or 0.0)
        spread = 0.0
        if link.flexible or link.mass_kg is None:
            spread = float(np.trapezoid(link.mass_per_length(x), x))
        weight += (lumps + spread) * float(np.hypot(*gravity))
        stiffness = link.axial_stiffness(x) if link.flexible else None
        if stiffness is not None and weight > STRETCH * float(np.min(stiffness)):
            stretch = weight / float(np.min(stiffness))
            raise WrongValue(
                f"link[{i + 1}].young_modulus_Pa",
                link.young_modulus_Pa,
                f"a link that its load does not stretch: here {weight:.3g} N would by "
                f"{stretch:.0%}, and the line is inextensible",
            )
        weight += link.joint.hub_mass_kg * float(np.hypot(*gravity))
