"""Forces of damping in proportion to the mass, alpha M_c q' of (26), at a cut of a link (143)."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...link.section import Material
from ...robot import Robot
from .inertia import Wrench, cross, stretches
from .motion import Lines, LinkMotion, column, mixed


def damping_beyond(
    robot: Robot, motion: LinkMotion, material: Material | None, s: Any, near: float
) -> Wrench:
    """What they exert on a link beyond the abscissa s, about the cut (143).

    They act on the straight link, clamped at its hub, where their reaction is. Those on the links
    after it are none.

    Args:
        robot: the robot.
        motion: the link.
        material: of the link; None: it is rigid, and has none.
        s: the abscissa, a number or (T,) [m].
        near: what is less than this before the cut is at it [m].

    Returns:
        Force in the base's axes and moment about the cut, (T,) each.
    """
    i, hub = motion.number, motion.hub
    alpha = robot.rayleigh(i)[0]
    if material is None or not alpha:
        return Wrench()
    zero = -motion.ahead.value  # the abscissa of the hub
    start, across = zero, 0.0 * hub.angle  # where a line begins, and how fast it moves across
    force, moment = 0j * hub.angle, 0.0 * hub.angle  # in the hub's axes
    starts = []
    for line in motion.lines:
        starts.append((start, across))
        turn = _turns(line, motion)
        end = start + line.free.value
        for X, dX in stretches(material, np.maximum(s, start), end, line.piece.points + 2):
            xi = np.clip((X - column(start)) / column(line.free.value), 0.0, 1.0)
            rate = column(across) + _rise(line, xi, turn)
            mass = material.mass_per_length(X.ravel()).reshape(X.shape) * dX
            force = force + 1j * (mass * rate).sum(axis=1)
            moment = moment + (mass * rate * (X - column(s))).sum(axis=1)
        across = across + _rise(line, np.ones(1), turn)[:, 0]
        start = end
    for at, mass, inertia, centre in _bodies(robot, i):
        velocity, turn = _body_rates(motion, starts, at)
        velocity = 1j * velocity + 1j * centre * turn
        own = mass * cross(at - s + centre, velocity) + inertia * turn
        force = force + np.where(at >= s - near, mass * velocity, 0.0)
        moment = moment + np.where(at >= s - near, own, 0.0)
    return Wrench(-alpha * force * hub.tangent, -alpha * moment)


def _turns(line: Lines, motion: LinkMotion) -> np.ndarray:
    """Rates of the tangent's angle against the hub's at a line's points (T, P) [rad/s]."""
    return column(line.start.spin - motion.hub.spin) + line.y[1] @ line.piece.B.T


def _rise(line: Lines, xi: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """How fast the straight line moves across, from its start to xi, (T, S) [m/s]."""
    weights = line.piece.integrals(xi.ravel()).reshape(*xi.shape, line.piece.points)
    return np.asarray(column(line.free.value) * mixed(weights, turn))


def _body_rates(motion: LinkMotion, starts: Any, at: float) -> tuple[np.ndarray, np.ndarray]:
    """Rates of deflection [m/s] and angle [rad/s] at the abscissa of a body."""
    k = max(n for n, (start, _) in enumerate(starts) if n == 0 or np.all(start < at))
    line, (start, across) = motion.lines[k], starts[k]
    xi = np.minimum(np.broadcast_to((at - start) / line.free.value, across.shape), 1.0)
    shapes = line.piece.shapes(xi)
    turn = line.start.spin - motion.hub.spin + np.einsum("tm,tm->t", shapes, line.y[1])
    return across + _rise(line, xi[:, None], _turns(line, motion))[:, 0], turn


def _bodies(robot: Robot, i: int) -> list[tuple[float, float, float, complex]]:
    """Abscissa [m], mass [kg], inertia [kg m^2] and centre [m] of what is fixed to a link."""
    link, load = robot.links[i], robot.payload
    out = [(each.at_m, each.mass_kg, each.inertia_kg_m2, 0j) for each in link.mass]
    if i + 1 == len(robot.links):
        out.append(
            (link.length_m, load.mass_kg, load.inertia_kg_m2, complex(*load.centre_of_mass_m))
        )
    return out
