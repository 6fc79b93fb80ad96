"""A robot's constants as rows of numbers, in the order in which the compiled core reads them
(model/core/bind/mechanics.cpp)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .. import core
from ..errors import InputError
from ..link.section import material
from ..robot import Link, Robot
from .structure import rigid_body

KINDS = ("R", "Pa", "Pb")


def equations(robot: Robot) -> Any:
    """The compiled equations of a robot.

    Args:
        robot: its description.

    Returns:
        A `core.Mechanics`.

    Raises:
        InputError: the core refuses the robot; the key is that of the robot file.
    """
    counts, numbers, parts = rows(robot)
    payload = np.array([robot.payload.mass_kg, robot.payload.inertia_kg_m2])
    try:
        return core.Mechanics(
            np.array(robot.gravity_m_s2, dtype=float), payload, counts, numbers, parts
        )
    except core.Fault as fault:
        link, key, expected = fault.args
        raise InputError(expected, key=key if link < 0 else f"link[{link + 1}].{key}") from None


def rows(robot: Robot) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Counts (N, 5), numbers (N, 15) and material (K, 10) of a robot's N links, K intervals of the
    flexible ones in all."""
    counts, numbers, parts = [], [], [np.zeros((0, 10))]
    for i, link in enumerate(robot.links):
        joint, own = link.joint, intervals(link) if link.flexible else np.zeros((0, 10))
        counts.append(
            (
                KINDS.index(joint.type),
                joint.locked,
                link.elements,
                -1 if link.modes is None else link.modes,
                len(own),
            )
        )
        mass, centre, inertia = (0.0, 0.0, 0.0) if link.flexible else rigid_body(robot, i)
        low, high = joint.limits or (-math.inf, math.inf)
        numbers.append(
            (
                link.length_m,
                mass,
                centre,
                inertia,
                link.damping.alpha_1_s,
                link.damping.beta_s,
                joint.angle_rad,
                joint.start,
                joint.hub_mass_kg,
                joint.hub_inertia_kg_m2,
                joint.rotor_inertia,
                joint.viscous_friction,
                joint.coulomb_friction,
                low,
                high,
            )
        )
        parts.append(own)
    return np.array(counts, dtype=np.int64), np.array(numbers, dtype=float), np.concatenate(parts)


def intervals(link: Link) -> np.ndarray:
    """The material of a link that bends, (K, 10): from, to [m], mass per length and bending
    stiffness by powers (8)."""
    own = material(link)
    return np.column_stack([own.breaks[:-1], own.breaks[1:], own.mass, own.stiffness])
