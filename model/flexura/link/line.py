"""The pieces of a link's line: the numbers that the equations of motion need of each."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..robot import Link, Payload
from .modes import ClampedBody, clamped_matrices, clamped_modes, orthogonal_shapes
from .quadrature import (
    collocation,
    gauss,
    lagrange,
    lagrange_integrals,
    legendre,
    legendre_at,
    without_round_off,
)
from .section import Material, material
from .shapes import ElementShapes, MeshShapes, WholeShapes

ELEMENT_POINTS = 3
MAX_SHAPES = 20  # polynomials of a link in modes
MAX_UNKNOWNS = 16  # unknowns of a link that is one piece


class Place(NamedTuple):
    """Weights and shapes at a place xi, with derivatives by xi (4), (30).

    w, l, dl: w_j / length, l_j and its derivative (P,). b, db, ddb: shapes b_k and derivatives
    (m,).
    """

    w: np.ndarray
    l: np.ndarray
    dl: np.ndarray
    b: np.ndarray
    db: np.ndarray
    ddb: np.ndarray


@dataclass(frozen=True)
class Piece:
    """A part of a line on 0 <= xi <= 1 whose tangent angle is linear in m unknowns (2).

    `length`: of a sleeved link the whole length [m]. `points`: number P of points. `shapes`: b(xi),
    (S,) -> (S, m). `K` (m,): stiffness (9) in N m, for modes in 1/s^2; of a sleeved link in modes
    that at the start's free length, else empty. `mass_xi` (G,), `mass` (G,) [kg]: points whose sums
    are the integrals (14).
    """

    length: float
    points: int
    shapes: ElementShapes | MeshShapes | WholeShapes
    K: np.ndarray
    mass_xi: np.ndarray
    mass: np.ndarray

    @property
    def count(self) -> int:
        """The number m of unknowns."""
        return self.shapes.count

    @cached_property
    def xi(self) -> np.ndarray:
        """The points of the angle (P,)."""
        return gauss(self.points)[0]

    @cached_property
    def weights(self) -> np.ndarray:
        """Weights of the points on [0, 1] (P,): the tip's w_j over the length."""
        return gauss(self.points)[1]

    @cached_property
    def C(self) -> np.ndarray:
        """Integrals of Lagrange's polynomials to the points by xi (32), (P, P)."""
        return collocation(self.points)

    @cached_property
    def B(self) -> np.ndarray:
        """The shapes at the points (2), (P, m)."""
        return self.shapes(self.xi)

    def lagrange(self, xi: np.ndarray, derivative: int = 0) -> np.ndarray:
        """Lagrange's polynomials, or their derivatives by xi (13).

        Args:
            xi: places (S,).
            derivative: its order.

        Returns:
            (S, P).
        """
        return lagrange(self.points, xi, derivative)

    def integrals(self, xi: np.ndarray) -> np.ndarray:
        """The weights w_j over the length at xi (S,) (13), (S, P)."""
        return lagrange_integrals(self.points, xi)

    def cached_integrals(self, xi: tuple[float, ...]) -> np.ndarray:
        """`integrals` at places that are used again."""
        if xi not in self._integrals:
            self._integrals[xi] = self.integrals(np.array(xi))
        return self._integrals[xi]

    @cached_property
    def _integrals(self) -> dict[tuple[float, ...], np.ndarray]:
        return {}

    def exactly_at(self, xi: float) -> Place:
        """Weights and shapes at a place xi, to round-off."""
        s = np.array([xi])
        lines = [self.integrals(s), *(self.lagrange(s, k) for k in (0, 1))]
        return Place(*(f[0] for f in lines), *(self.shapes(s, k)[0] for k in (0, 1, 2)))

    def at(self, xi: float) -> Place:
        """Weights and shapes at a place xi, fast: to a few times round-off."""
        sums, P, m = self._sums, self.points, self.count
        row = legendre_at(len(sums), xi) @ sums
        b = row[3 * P :]
        return Place(row[:P], row[P : 2 * P], row[2 * P : 3 * P], b[:m], b[m : 2 * m], b[2 * m :])

    @cached_property
    def _sums(self) -> np.ndarray:
        """The fields of a Place as sums of Legendre's polynomials, (degree + 1, 3 P + 3 m)."""
        count = self.points + 1
        xi, w = gauss(count)
        lines = [self.integrals(xi), *(self.lagrange(xi, k) for k in (0, 1))]
        values = np.hstack([*lines, *(self.shapes(xi, k) for k in (0, 1, 2))])
        return (2 * np.arange(count)[:, None] + 1) * legendre(count, xi).T * w @ values

    @cached_property
    def tip(self) -> Place:
        """Weights and shapes at the tip."""
        return self.exactly_at(1.0)

    @cached_property
    def B_tip(self) -> np.ndarray:
        """The shapes at the tip (m,)."""
        return self.tip.b

    @cached_property
    def slopes(self) -> np.ndarray:
        """Derivatives of the shapes by xi at the points (P, m)."""
        return self.shapes(self.xi, 1)

    @cached_property
    def unit_stiffness(self) -> np.ndarray:
        """K of (35) for d = EI = 1 (m, m), without round-off between orthogonal shapes."""
        return without_round_off(self.slopes.T @ (self.weights[:, None] * self.slopes))

    @cached_property
    def w(self) -> np.ndarray:
        """The weights w_j of the mass points (14), (G, P) [m]."""
        return self.length * self.integrals(self.mass_xi)

    @cached_property
    def s(self) -> np.ndarray:
        """First moments s_j, the integral of w_j dm (14), (P,) [kg m]."""
        return self.mass @ self.w

    @cached_property
    def W(self) -> np.ndarray:
        """Second moments W_jl, the integral of w_j w_l dm (14), (P, P) [kg m^2]."""
        return self.w.T @ (self.mass[:, None] * self.w)


def piece_orders(link: Link, followed: bool) -> tuple[int, int]:
    """Numbers of polynomials (12) and of points of a link that is one piece.

    Args:
        link: the link.
        followed: whether another link follows.
    """
    mesh, sleeve = min(2 * link.elements, MAX_UNKNOWNS), link.joint.type == "Pb"
    if link.modes is None:
        return mesh, mesh + 1
    if link.mass:  # their forces bend the modes sharply
        return MAX_SHAPES, MAX_SHAPES + (1 if followed or sleeve else 0)
    few = min(link.modes, MAX_SHAPES - 5) + 5
    count = few if material(link).uniform else max(few, mesh)
    return count, count + (1 if followed or sleeve else 0)


def is_one_piece(link: Link, beyond: Link | None) -> bool:
    """Whether a flexible link is one piece (12).

    It is one if it has modes or a sleeve, or if the next link slides on it.

    Args:
        link: the link.
        beyond: the next link, or None.
    """
    return (
        link.modes is not None
        or link.joint.type == "Pb"
        or (beyond is not None and beyond.joint.type == "Pa")
    )


def pieces(
    link: Link, beyond: Link | None = None, load: Payload | None = None
) -> tuple[Piece, ...]:
    """The pieces of a flexible link.

    Args:
        link: the link.
        beyond: the next link; None: the link carries the payload.
        load: the payload.
    """
    properties = material(link)
    if not is_one_piece(link, beyond):
        return mesh(properties, nodes(link))
    count, points = piece_orders(link, beyond is not None)
    sleeve = link.joint.type == "Pb"
    if sleeve and link.modes is None:
        return (whole_piece(properties, points, np.eye(count), np.zeros(0)),)
    free = link.joint.start if sleeve else link.length_m
    bodies = [ClampedBody(each.at_m, each.mass_kg, each.inertia_kg_m2) for each in link.mass]
    if load is not None:
        centre = load.centre_of_mass_m
        bodies.append(ClampedBody(link.length_m, load.mass_kg, load.inertia_kg_m2, *centre))
    M, K, tip = clamped_matrices(properties, free, count, points, bodies)
    if link.modes is None:
        return (whole_piece(properties, points, *orthogonal_shapes(K)),)
    kept = min(link.modes, count)
    return (whole_piece(properties, points, *clamped_modes(M, K, tip, kept, beyond is not None)),)


def whole_piece(
    properties: Material, points: int, coefficients: np.ndarray, K: np.ndarray
) -> Piece:
    """A link as one piece.

    Args:
        properties: its mass and stiffness.
        points: number of points.
        coefficients: shapes in the space (12), (N, m).
        K: diagonal stiffness (m,).
    """
    s, ds = properties.quadrature(0.0, properties.length, points + 2)
    dm = properties.mass_per_length(s) * ds
    return Piece(properties.length, points, WholeShapes(coefficients), K, s / properties.length, dm)


def nodes(link: Link) -> np.ndarray:
    """Where the elements of a link end (elements + 1,) [m] (110).

    They are of equal length between the ends of the link and its lumped masses, where the curvature
    or its slope jumps. Masses within a quarter of an element of an end or of one another get no
    node.
    """
    length, count = link.length_m, link.elements
    least, ends = 0.25 * length / count, [0.0]
    for x in sorted(each.at_m for each in link.mass):
        if x - ends[-1] >= least and length - x >= least and len(ends) < count:
            ends.append(x)
    spans, each = np.diff([*ends, length]), np.ones(len(ends), dtype=int)
    for _ in range(count - len(each)):
        each[np.argmax(spans / each)] += 1
    inner = [
        np.linspace(a, b, n, endpoint=False) for a, b, n in zip(ends, [*ends[1:], length], each)
    ]
    return np.append(np.concatenate(inner), length)


def mesh(properties: Material, ends: np.ndarray) -> tuple[Piece, ...]:
    """The pieces of a link of elements (10).

    Args:
        properties: its mass and stiffness.
        ends: where the elements end (elements + 1,) [m].
    """
    return tuple(_element(properties, a, b) for a, b in pairwise(ends))


def _element(properties: Material, a: float, b: float) -> Piece:
    """The piece of an element between a and b [m], with shapes that make K diagonal (10), (11)."""
    h = b - a
    s, ds = properties.quadrature(a, b, ELEMENT_POINTS + 2)
    curvature, EI = ElementShapes()((s - a) / h, 1) / h, properties.bending_stiffness(s) * ds
    (K11, K12), (_, K22) = curvature.T @ (EI[:, None] * curvature)
    if properties.uniform:
        K11, K12, K22 = properties.stiffness[0, 0] / h, 0.0, 12 * properties.stiffness[0, 0] / h
    ratio = K12 / K22
    dm = properties.mass_per_length(s) * ds
    return Piece(
        h, ELEMENT_POINTS, ElementShapes(ratio), np.array([K11 - ratio * K12, K22]), (s - a) / h, dm
    )
