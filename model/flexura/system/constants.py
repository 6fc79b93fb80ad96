"""A robot's constants as rows of numbers, in the order in which the compiled core reads them
(model/core/bind/mechanics.cpp)."""

from __future__ import annotations

import math

import numpy as np

from .. import core
from ..errors import InputError
from ..link.section import material
from ..robot import Link, Robot
from .structure import rigid_body

KINDS = ("R", "Pa", "Pb")
# summands of the columns "hub" and "centres" of counts: OfHub, OffLine of robot_table.hpp
HUB_RADIUS, HUB_TRANSMISSION = 1, 2
OFF_LINK, OFF_PAYLOAD = 1, 2


def equations(robot: Robot) -> core.Mechanics:
    """The compiled equations of a robot.

    Args:
        robot: its description.

    Returns:
        A `core.Mechanics`.

    Raises:
        InputError: the core refuses the robot; the key is that of the robot file.
    """
    counts, numbers, parts, lumps = rows(robot)
    try:
        return core.Mechanics(
            np.array(robot.gravity_m_s2, dtype=float),
            payload(robot),
            counts,
            numbers,
            parts,
            lumps,
        )
    except core.Fault as fault:
        link, key, expected = fault.args
        raise InputError(expected, key=key if link < 0 else f"link[{link + 1}].{key}") from None


def payload(robot: Robot) -> np.ndarray:
    """Mass [kg], inertia about its own centre [kg m^2], and the centre along and across the tip's
    tangent [m] (4,)."""
    load = robot.payload
    return np.array([load.mass_kg, load.inertia_kg_m2, *load.centre_of_mass_m])


def rows(robot: Robot) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Counts (N, 8), numbers (N, 21), material (K, 10) and lumped masses (J, 3) of a robot's N
    links, K intervals of the flexible ones and J masses in all."""
    counts, numbers, parts = [], [], [np.zeros((0, 10))]
    lumps = [[each.at_m, each.mass_kg, each.inertia_kg_m2] for k in robot.links for each in k.mass]
    for i, link in enumerate(robot.links):
        joint, own = link.joint, intervals(link) if link.flexible else np.zeros((0, 10))
        counts.append(
            (
                KINDS.index(joint.type),
                joint.locked,
                link.elements,
                -1 if link.modes is None else link.modes,
                len(own),
                len(link.mass),
                HUB_RADIUS * (joint.hub_radius_m > 0)
                + HUB_TRANSMISSION * (joint.transmission is not None),
                OFF_LINK * (not link.flexible and isinstance(link.centre_of_mass_m, tuple))
                + OFF_PAYLOAD * (link is robot.links[-1] and any(robot.payload.centre_of_mass_m)),
            )
        )
        mass, centre, inertia = (0.0, 0j, 0.0) if link.flexible else rigid_body(robot, i)
        low, high = joint.limits or (-math.inf, math.inf)
        numbers.append(
            (
                link.length_m,
                mass,
                centre.real,
                inertia,
                *robot.rayleigh(i),
                joint.angle_rad,
                joint.start,
                joint.hub_mass_kg,
                joint.hub_inertia_kg_m2,
                joint.rotor_inertia,
                joint.viscous_friction,
                joint.coulomb_friction,
                low,
                high,
                joint.spring_stiffness,
                joint.spring_rest,
                joint.hub_radius_m,
                joint.windup_stiffness,
                joint.windup_damping,
                centre.imag,
            )
        )
        parts.append(own)
    return (
        np.array(counts, dtype=np.int64),
        np.array(numbers, dtype=float),
        np.concatenate(parts),
        np.array(lumps, dtype=float).reshape(-1, 3),
    )


def intervals(link: Link) -> np.ndarray:
    """The material of a link that bends, (K, 10): from, to [m], mass per length and bending
    stiffness by powers (8)."""
    own = material(link)
    return np.column_stack([own.breaks[:-1], own.breaks[1:], own.mass, own.stiffness])
