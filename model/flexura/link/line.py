"""The pieces of a link's line: what the equations need to know of each, as numbers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..robot import Link
from .modes import clamped_matrices, clamped_modes, orthogonal_shapes
from .quadrature import collocation, gauss, lagrange, lagrange_integrals, legendre, legendre_at
from .section import Material, material
from .shapes import ElementShapes, MeshShapes, WholeShapes

ELEMENT_POINTS = 3
MOST_SHAPES = 20  # polynomials of a link in modes
MOST_WHOLE = 16  # unknowns of a link that is one piece


class Place(NamedTuple):
    """Weights w_j / length (P,) and shapes b_k (m,) at xi, and derivatives by xi (4), (30)."""

    w: np.ndarray
    l: np.ndarray
    dl: np.ndarray
    b: np.ndarray
    db: np.ndarray
    ddb: np.ndarray


@dataclass(frozen=True)
class Piece:
    """A stretch of line on 0 <= xi <= 1 whose tangent's angle is linear in m unknowns (2).

    length [m]: of a sleeved link all of it. points: P. shapes: b(xi), (S,) -> (S, m). K (m,) (9) in
    N m, for modes in 1/s^2; of a sleeved link in modes that at the start's free length, else empty.
    mass_xi (G,), mass (G,) [kg]: points whose sums are the integrals (14).
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
        """The points of the angle, (P,)."""
        return gauss(self.points)[0]

    @cached_property
    def weights(self) -> np.ndarray:
        """Their weights on [0, 1], (P,): the tip's w_j over the length."""
        return gauss(self.points)[1]

    @cached_property
    def C(self) -> np.ndarray:
        """Integrals of Lagrange's polynomials to the points by xi (32): (P, P)."""
        return collocation(self.points)

    @cached_property
    def B(self) -> np.ndarray:
        """The shapes at the points (2): (P, m)."""
        return self.shapes(self.xi)

    def lagrange(self, xi: np.ndarray, derivative: int = 0) -> np.ndarray:
        """Lagrange's polynomials at xi (S,), or their derivatives by xi (13): (S, P)."""
        return lagrange(self.points, xi, derivative)

    def integrals(self, xi: np.ndarray) -> np.ndarray:
        """The weights w_j over the length at xi (S,) (13): (S, P)."""
        return lagrange_integrals(self.points, xi)

    def kept_integrals(self, xi: tuple[float, ...]) -> np.ndarray:
        """`integrals` at places that are asked for again."""
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
        """Weights and shapes at a place xi, quickly: a few times round-off."""
        sums, P, m = self._sums, self.points, self.count
        row = legendre_at(len(sums), xi) @ sums
        b = row[3 * P :]
        return Place(row[:P], row[P : 2 * P], row[2 * P : 3 * P], b[:m], b[m : 2 * m], b[2 * m :])

    @cached_property
    def _sums(self) -> np.ndarray:
        """What a Place has, one behind the other, as sums of Legendre's polynomials: (degree + 1, 3
        P + 3 m)."""
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
        """The shapes at the tip: (m,)."""
        return self.tip.b

    @cached_property
    def slopes(self) -> np.ndarray:
        """The shapes' derivatives by xi at the points: (P, m)."""
        return self.shapes(self.xi, 1)

    @cached_property
    def unit_stiffness(self) -> np.ndarray:
        """K of (35) for d = EI = 1, without the round-off between orthogonal shapes: (m, m)."""
        K = self.slopes.T @ (self.weights[:, None] * self.slopes)
        size = np.sqrt(np.diag(K))
        return np.where(np.abs(K) < 1e-14 * np.outer(size, size), 0.0, K)

    @cached_property
    def w(self) -> np.ndarray:
        """The weights w_j of the mass points (14): (G, P) [m]."""
        return self.length * self.integrals(self.mass_xi)

    @cached_property
    def s(self) -> np.ndarray:
        """First moments s_j, the integral of w_j dm (14): (P,) [kg m]."""
        return self.mass @ self.w

    @cached_property
    def W(self) -> np.ndarray:
        """Second moments W_jl, the integral of w_j w_l dm (14): (P, P) [kg m^2]."""
        return self.w.T @ (self.mass[:, None] * self.w)


def orders(link: Link, followed: bool) -> tuple[int, int]:
    """How many polynomials (12) and how many points a whole-link piece has."""
    mesh, sleeve = min(2 * link.elements, MOST_WHOLE), link.joint.type == "Pb"
    if link.modes is None:
        return mesh, mesh + 1
    few = min(link.modes, MOST_SHAPES - 5) + 5
    count = few if material(link).uniform else max(few, mesh)
    return count, count + (1 if followed or sleeve else 0)


def whole(link: Link, beyond: Link | None) -> bool:
    """Whether a link is one piece (12): it has modes or a sleeve, or `beyond` slides on it."""
    return (
        link.modes is not None
        or link.joint.type == "Pb"
        or (beyond is not None and beyond.joint.type == "Pa")
    )


def pieces(
    link: Link, beyond: Link | None = None, mass: float = 0.0, inertia: float = 0.0
) -> tuple[Piece, ...]:
    """The pieces of a flexible link that `beyond` follows (None: it carries the payload)."""
    law = material(link)
    if not whole(link, beyond):
        return mesh(law, link.elements)
    count, points = orders(link, beyond is not None)
    sleeve = link.joint.type == "Pb"
    if sleeve and link.modes is None:
        return (whole_piece(law, points, np.eye(count), np.zeros(0)),)
    free = link.joint.start if sleeve else link.length_m
    M, K, tip = clamped_matrices(law, free, count, points, mass, inertia)
    if link.modes is None:
        return (whole_piece(law, points, *orthogonal_shapes(K)),)
    kept = min(link.modes, count)
    return (whole_piece(law, points, *clamped_modes(M, K, tip, kept, beyond is not None)),)


def whole_piece(law: Material, points: int, coefficients: np.ndarray, K: np.ndarray) -> Piece:
    """A link as one piece with shapes (N, m) in the space (12) and diagonal stiffness (m,)."""
    s, ds = law.quadrature(0.0, law.length, points + 2)
    dm = law.mass_per_length(s) * ds
    return Piece(law.length, points, WholeShapes(coefficients), K, s / law.length, dm)


def mesh(law: Material, elements: int) -> tuple[Piece, ...]:
    """The pieces of a link of equal elements (10)."""
    ends = np.linspace(0, law.length, elements + 1)
    return tuple(_element(law, a, b) for a, b in pairwise(ends))


def _element(law: Material, a: float, b: float) -> Piece:
    """The piece of an element between a and b [m], with shapes that make K diagonal (10), (11)."""
    h = b - a
    s, ds = law.quadrature(a, b, ELEMENT_POINTS + 2)
    curvature, EI = ElementShapes()((s - a) / h, 1) / h, law.bending_stiffness(s) * ds
    (K11, K12), (_, K22) = curvature.T @ (EI[:, None] * curvature)
    if law.uniform:
        K11, K12, K22 = law.stiffness[0, 0] / h, 0.0, 12 * law.stiffness[0, 0] / h
    ratio = K12 / K22
    dm = law.mass_per_length(s) * ds
    return Piece(
        h, ELEMENT_POINTS, ElementShapes(ratio), np.array([K11 - ratio * K12, K22]), (s - a) / h, dm
    )
