"""Properties of a link for Exudyn: values of its beam elements, or its rigid inertia."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from ...robot import Link, Payload

# EA L^2/EI where the robot file gives no section: axial strains of 1e-5, far below what bending
# does
AXIAL_RATIO = 1e5
SHEAR_CORRECTION = 5 / 6  # rectangular section
POISSON = 0.3
# mass and inertia of a rigid link without any, relative to the robot's total and to total * reach^2
NEGLIGIBLE = 1e-9

_GAUSS_X, _GAUSS_W = np.polynomial.legendre.leggauss(5)


@dataclass(frozen=True)
class BeamValues:
    """A flexible link as equal elements of `length` [m]; other values (elements,) in SI units.

    `mass` [kg/m] and the stiffnesses `bending` [N m^2], `axial` [N], `shear` [N] are means over the
    element: its integrals are right, and the error of a tapering link is of second order in the
    elements' length. `rotary` [kg m] is the section's moment of inertia, rhoA EI/EA. The bending
    damping is beta EI, so that D = beta K; the axial damping is `stretch` EA [s].
    """

    length: float
    mass: np.ndarray
    bending: np.ndarray
    axial: np.ndarray
    shear: np.ndarray
    rotary: np.ndarray
    beta: float
    stretch: float = 0.0

    def __len__(self) -> int:
        return len(self.mass)


def beam_values(link: Link, elements: int, beta: float) -> BeamValues:
    """Values of a flexible link's elements (104).

    Args:
        link: the link.
        elements: their number.
        beta: the stiffness-proportional damping [s].

    Returns:
        The values.
    """
    ends = np.linspace(0.0, link.length_m, elements + 1)
    kinks = np.array(link.breaks())
    mass = _means(link.mass_per_length, ends, kinks)
    bending = _means(link.bending_stiffness, ends, kinks)
    if link.axial_stiffness(0.0) is None:
        axial = np.full(elements, AXIAL_RATIO * bending.mean() / link.length_m**2)
        shear = axial
    else:
        axial = _means(link.axial_stiffness, ends, kinks)
        shear = axial * SHEAR_CORRECTION / (2 * (1 + POISSON))
    return BeamValues(
        link.length_m / elements,
        mass,
        bending,
        axial,
        shear,
        mass * bending / axial,
        beta,
    )


def without_ringing(values: BeamValues) -> BeamValues:
    """The values with the damping that ends axial vibration as it begins (105)."""
    ratio = float(values.mass.mean() / values.axial.mean())
    return replace(values, stretch=2 * values.length * len(values) * np.sqrt(ratio))


def uniform(link: Link) -> bool:
    """Whether section, mass per length and stiffness are constant along the link."""
    return not any(
        isinstance(v, list)
        for v in (link.section, link.mass_per_length_kg_m, link.bending_stiffness_N_m2)
    )


def _means(function: Any, ends: np.ndarray, kinks: np.ndarray) -> np.ndarray:
    """Means of a function of x between consecutive ends, integrated apart between kinks.

    Args:
        function: of x [m].
        ends: (K + 1,) [m].
        kinks: where the function is not smooth [m].

    Returns:
        (K,).
    """
    out = np.empty(len(ends) - 1)
    for k, (a, b) in enumerate(pairwise(ends)):
        edges = np.concatenate([[a], kinks[(kinks > a) & (kinks < b)], [b]])
        middle, half = (edges[1:] + edges[:-1]) / 2, (edges[1:] - edges[:-1]) / 2
        values = function(middle[:, None] + half[:, None] * _GAUSS_X)
        out[k] = np.sum(half[:, None] * _GAUSS_W * values) / (b - a)
    return out


class Inertia(NamedTuple):
    """Mass [kg], its centre along + i across the link [m], inertia about the centre [kg m^2]."""

    mass: float
    centre: complex
    inertia: float

    def plus(self, mass: float, at: complex, inertia: float) -> Inertia:
        """Both together, by the parallel-axis theorem.

        Args:
            mass: to be added [kg].
            at: where it is, along + i across the link [m].
            inertia: about its own centre [kg m^2].
        """
        total = self.mass + mass
        if total == 0:
            return Inertia(0.0, self.centre, self.inertia + inertia)
        centre = (self.mass * self.centre + mass * at) / total
        about = (
            self.inertia
            + inertia
            + self.mass * abs(self.centre - centre) ** 2
            + mass * abs(at - centre) ** 2
        )
        return Inertia(total, centre, about)


def link_inertia(link: Link) -> Inertia:
    """Inertia of a rigid link, without hub and payload.

    Args:
        link: the link.

    Returns:
        Mass [kg], centre [m] and inertia [kg m^2].
    """
    if link.mass_kg is not None:
        return Inertia(link.mass_kg, _centre(link), link.inertia_kg_m2 or 0.0)
    return _spread_inertia(link)


def _centre(link: Link) -> complex:
    given = link.length_m / 2 if link.centre_of_mass_m is None else link.centre_of_mass_m
    return complex(*given) if isinstance(given, tuple) else complex(given)


def _spread_inertia(link: Link) -> Inertia:
    """Inertia of a rigid link with a mass per length; its section's own inertia is left out."""
    edges = np.array(link.breaks())
    middle, half = (edges[1:] + edges[:-1]) / 2, (edges[1:] - edges[:-1]) / 2
    x = middle[:, None] + half[:, None] * _GAUSS_X
    mass = link.mass_per_length(x) * half[:, None] * _GAUSS_W
    total = float(mass.sum())
    if total == 0:
        return Inertia(0.0, 0.0, 0.0)
    centre = float((mass * x).sum()) / total
    return Inertia(total, centre, float((mass * (x - centre) ** 2).sum()))


def total_mass(links: list[Link], payload: Payload) -> float:
    """Total mass of a robot [kg], the scale for negligible masses.

    Args:
        links: of the robot.
        payload: of the robot.
    """
    total = payload.mass_kg
    for link in links:
        total += link.joint.hub_mass_kg + sum(each.mass_kg for each in link.mass)
        if link.flexible:
            ends, kinks = np.array([0.0, link.length_m]), np.array(link.breaks())
            total += float(_means(link.mass_per_length, ends, kinks)[0]) * link.length_m
        else:
            total += link_inertia(link).mass
    return total
