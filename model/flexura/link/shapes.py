"""Shapes of the tangent's angle: two on an element, and polynomials on a whole link."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .quadrature import legendre, legendre_integrals


@dataclass(frozen=True)
class ElementShapes:
    """The two shapes of an element (6): a ramp less `ratio` bubbles, and a bubble."""

    ratio: float = 0.0

    @property
    def count(self) -> int:
        """How many there are."""
        return 2

    def __call__(self, xi: np.ndarray, derivative: int = 0) -> np.ndarray:
        """Their values at xi, or their derivatives by xi: (S, 2)."""
        x = np.atleast_1d(np.asarray(xi, dtype=float))
        ramp = (x, np.ones_like(x), np.zeros_like(x))[derivative]
        bubble = (6 * x * (1 - x), 6 - 12 * x, np.full_like(x, -12.0))[derivative]
        return np.column_stack([ramp - self.ratio * bubble, bubble])


@dataclass(frozen=True)
class MeshShapes:
    """The shapes of n equal elements on a whole link (6): those behind a place have turned it."""

    elements: tuple[ElementShapes, ...]

    @property
    def count(self) -> int:
        """How many there are."""
        return 2 * len(self.elements)

    def __call__(self, xi: np.ndarray, derivative: int = 0) -> np.ndarray:
        """Their values at xi, or their derivatives by xi: (S, 2 n)."""
        n, xi = len(self.elements), np.atleast_1d(np.asarray(xi, dtype=float))
        out, on = np.zeros((len(xi), n, 2)), element_of(n, xi)
        for k, shapes in enumerate(self.elements):
            out[on == k, k] = n**derivative * shapes(n * xi[on == k] - k, derivative)
            if derivative == 0:
                out[on > k, k] = shapes(np.ones(1))[0]
        return out.reshape(len(xi), 2 * n)


def element_of(n: int, xi: np.ndarray) -> np.ndarray:
    """Which of n equal elements a place xi (S,) on the link lies on, from 0."""
    return np.clip((n * xi).astype(int), 0, n - 1)


@dataclass(frozen=True)
class WholeShapes:
    """Shapes of a whole link: column k of `coefficients` (N, m) is one in the space (7)."""

    coefficients: np.ndarray

    @property
    def count(self) -> int:
        """How many there are."""
        return self.coefficients.shape[1]

    def __call__(self, xi: np.ndarray, derivative: int = 0) -> np.ndarray:
        """Their values at xi, or their derivatives by xi: (S, m)."""
        return legendre_shapes(len(self.coefficients), xi, derivative) @ self.coefficients


def legendre_shapes(count: int, xi: np.ndarray, derivative: int = 0) -> np.ndarray:
    """The space (7) at xi (S,), or its derivatives by xi: (S, count)."""
    if derivative == 0:
        return legendre_integrals(count, xi)
    return 2.0**derivative * legendre(count, xi, derivative - 1)


def of_legendre(sums: np.ndarray) -> np.ndarray:
    """Coefficients (N, m) in the space (7) of shapes given as sums of P_0 ... P_N, (N + 1, m)."""
    rest, out = sums.copy(), np.zeros((len(sums) - 1, sums.shape[1]))
    for k in range(len(out) - 1, 0, -1):
        out[k] = rest[k + 1] * (2 * k + 1)
        rest[k - 1] += rest[k + 1]
    out[0] = rest[1]
    return out
