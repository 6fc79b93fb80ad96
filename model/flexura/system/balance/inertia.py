"""What masses take against inertia and gravity at T times: sums of mu (r'' - g) over parts of a
robot (139), (140)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from ...link.quadrature import gauss
from ...link.section import Material
from .motion import Frames, Lines, LinkMotion, column, mixed


class Wrench(NamedTuple):
    """Forces x + iy [N] in the base's axes and moments [N m] about a point, (T,) each."""

    force: Any = 0j
    moment: Any = 0.0

    def plus(self, other: Wrench) -> Wrench:
        """The sum of two about one point."""
        return Wrench(self.force + other.force, self.moment + other.moment)

    def less(self, other: Wrench) -> Wrench:
        """The difference of two about one point."""
        return Wrench(self.force - other.force, self.moment - other.moment)

    def about(self, place: np.ndarray) -> Wrench:
        """The same one about a place (T,), if this is about the origin."""
        return Wrench(self.force, self.moment - cross(place, self.force))

    def where(self, holds: Any) -> Wrench:
        """This one where something holds, (T,) or for all times; else none."""
        return Wrench(np.where(holds, self.force, 0j), np.where(holds, self.moment, 0.0))


def total(parts: Sequence[Wrench], count: int) -> Wrench:
    """The sum of parts about one point, for `count` times."""
    out = Wrench(np.zeros(count, dtype=complex), np.zeros(count))
    for part in parts:
        out = out.plus(part)
    return out


def cross(place: Any, force: Any) -> Any:
    """Moments of forces at places about the origin [N m]."""
    return (np.conj(place) * force).imag


def body(mass: float, inertia: float, centre: Frames, gravity: complex) -> Wrench:
    """Of a body with its centre in a frame's origin, about the origin of the base."""
    force = mass * (centre.acceleration - gravity)
    return Wrench(force, cross(centre.place, force) + inertia * centre.spin_rate)


def points(mass: np.ndarray, place: np.ndarray, acceleration: np.ndarray, gravity: complex) -> Any:
    """Of mass points (G,) or (T, G) at places (T, G), about the origin."""
    force = mass * (acceleration - gravity)
    return Wrench(force.sum(axis=1), cross(place, force).sum(axis=1))


def line(own: Lines, gravity: complex) -> Wrench:
    """Of the material of a piece of constant length, by the points of its integrals (14)."""
    return points(own.piece.mass, *own.points(own.piece.mass_xi), gravity)


def line_beyond(own: Lines, material: Material, s: Any, start: Any, gravity: complex) -> Wrench:
    """Of the material of a line beyond the abscissa s; its xi = 0 is at the abscissa `start` [m],
    numbers or (T,)."""
    d, out = own.free.value, Wrench()
    for X, dX in stretches(material, np.maximum(s, start), start + d, own.piece.points + 2):
        xi = np.clip((X - column(start)) / column(d), 0.0, 1.0)
        mass = _density(material, X) * dX
        out = out.plus(points(mass, *own.points(xi), gravity))
    return out


def straight(motion: LinkMotion, material: Material, low: Any, high: Any, gravity: complex) -> Any:
    """Of the material of a rigid link, or of a rod in its sleeve, between two abscissas, numbers or
    (T,) [m] (34)."""
    hub, out = motion.hub, Wrench()
    t, spin = column(hub.tangent), column(hub.spin)
    ahead, rate, more = (column(x) for x in motion.ahead)
    for X, dX in stretches(material, low, high, 4):
        x = X + ahead
        own = x * (1j * column(hub.spin_rate) - spin**2) + 2j * spin * rate + more
        place = column(hub.place) + x * t
        acceleration = column(hub.acceleration) + own * t
        out = out.plus(points(_density(material, X) * dX, place, acceleration, gravity))
    return out


def sleeved(motion: LinkMotion, material: Material, gravity: complex) -> Wrench:
    """Of a flexible link in a sleeve: free length, rod, what sums miss, and the flow (33), (34),
    (37)."""
    own = motion.lines[0]
    piece, start, t = own.piece, own.start, motion.hub.tangent
    d, d_rate, d_more = (column(x) for x in own.free)
    left, weights = 1 - piece.xi, piece.weights
    X = material.length - d + d * piece.xi
    density = _density(material, X)
    mass = d * weights * density
    reach, turning = mixed(piece.C, own.e), mixed(piece.C, own.rates)
    flow = reach + left * own.e
    V = d * turning + d_rate * flow
    A = d * mixed(piece.C, own.more) + d_more * flow + d_rate * (2 * turning + left * own.rates)
    place, acceleration = column(start.place) + d * reach, column(start.acceleration) + A
    free = points(mass, place, acceleration, gravity)
    rod = straight(motion, material, 0.0, -motion.ahead.value, gravity)
    rod_mass = sum(
        (_density(material, X) * dX).sum(axis=-1)
        for X, dX in stretches(material, 0.0, -motion.ahead.value, 4)
    )
    missed = body(piece.mass.sum() - mass.sum(axis=1) - rod_mass, 0.0, start, gravity)
    slope = _density(material, X, 1)
    change = mass / d - d * left * weights * slope  # d mu / dd at fixed xi (33)
    momentum = d_rate * change * V
    exit_density = _density(material, material.length - own.free.value)
    through = momentum.sum(axis=1) - exit_density * own.free.rate**2 * t
    turn = (cross(d * reach, momentum) - d_rate * mass * left * cross(own.e, V)).sum(axis=1)
    moved = Wrench(through, turn + cross(start.place, through))
    return total([free, rod, missed, moved], len(t))


def stretches(
    material: Material, low: Any, high: Any, count: int
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Gauss points and weights [m] between two abscissas, on each smooth part: (G,) for numbers,
    (T, G) for (T,)."""
    xi, w = gauss(count)
    for a, b in pairwise(material.breaks):
        start, width = np.maximum(low, a), np.minimum(high, b) - np.maximum(low, a)
        if np.any(width > 0):
            width = np.maximum(width, 0.0)
            yield column(start) + column(width) * xi, column(width) * w


def _density(material: Material, X: Any, derivative: int = 0) -> np.ndarray:
    """Mass per length at abscissas of any shape [kg/m], or its derivative."""
    inside = np.clip(X, 0.0, material.length)
    return material.mass_per_length(np.ravel(inside), derivative).reshape(np.shape(X))
