"""A mesh as one piece: the sums of (2) and (4) run over the points of all its elements."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .line import Piece, Place
from .shapes import MeshShapes, element_of


@dataclass(frozen=True)
class Mesh(Piece):
    """Equal elements one behind another; equal to the chain of them, and fast in NumPy."""

    elements: tuple[Piece, ...] = ()

    @cached_property
    def xi(self) -> np.ndarray:
        """The points of the angle (P,)."""
        return np.concatenate([k + e.xi for k, e in enumerate(self.elements)]) / len(self.elements)

    @cached_property
    def weights(self) -> np.ndarray:
        """Weights of the points on [0, 1] (P,)."""
        return np.concatenate([e.weights for e in self.elements]) / len(self.elements)

    def at(self, xi: float) -> Place:
        """Weights and shapes at a place xi; mostly a node, so that they are kept."""
        if xi not in self._places:
            self._places[xi] = self.exactly_at(xi)
        return self._places[xi]

    @cached_property
    def _places(self) -> dict[float, Place]:
        return {}

    def lagrange(self, xi: np.ndarray, derivative: int = 0) -> np.ndarray:
        """Lagrange's polynomials of the element at each place, or their derivatives by xi.

        Args:
            xi: places (S,).
            derivative: its order.

        Returns:
            (S, P).
        """
        factor = len(self.elements) ** derivative
        return self._on(xi, lambda e, x: factor * e.lagrange(x, derivative), lambda e: 0.0)

    def integrals(self, xi: np.ndarray) -> np.ndarray:
        """The weights w_j over the length at xi (S,) (13), (S, P)."""
        n = len(self.elements)
        return self._on(xi, lambda e, x: e.integrals(x) / n, lambda e: e.weights / n)

    def _on(self, xi: np.ndarray, here, behind) -> np.ndarray:  # type: ignore[no-untyped-def]
        """Values (S, P): `here` in the element of each place, `behind` in those before it."""
        n, on = len(self.elements), element_of(len(self.elements), xi)
        out = np.zeros((len(xi), n, self.points // n))
        for k, element in enumerate(self.elements):
            out[on > k, k] = behind(element)
            out[on == k, k] = here(element, n * xi[on == k] - k)
        return out.reshape(len(xi), self.points)


def joined(elements: tuple[Piece, ...]) -> Piece:
    """The elements of a mesh as one piece."""
    n = len(elements)
    if n == 1:
        return elements[0]
    return Mesh(
        sum(e.length for e in elements),
        sum(e.points for e in elements),
        MeshShapes(tuple(e.shapes for e in elements)),  # type: ignore[misc]
        np.concatenate([e.K for e in elements]),
        np.concatenate([k + e.mass_xi for k, e in enumerate(elements)]) / n,
        np.concatenate([e.mass for e in elements]),
        elements,
    )
