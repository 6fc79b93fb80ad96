"""Gauss points, Legendre's polynomials, and Lagrange's through the points: (12), (13)."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.polynomial.legendre import legder, leggauss, legvander


@cache
def gauss(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss points xi and weights (count,) on [0, 1], exact to the degree 2 count - 1."""
    u, w = leggauss(count)
    return (u + 1) / 2, w / 2


def cells(breaks: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss points and weights between breaks.

    Args:
        breaks: (cells + 1,), ascending.
        count: points of each cell.

    Returns:
        Points and weights (cells * count,), in the unit of the breaks.
    """
    xi, w = gauss(count)
    widths = np.diff(breaks)[:, None]
    return (breaks[:-1, None] + widths * xi).ravel(), (widths * w).ravel()


def without_round_off(K: np.ndarray) -> np.ndarray:
    """A matrix of sums over points without what they leave between shapes that are orthogonal.

    Times the deflection of the lowest shapes it would be more than the highest ones carry.
    """
    size = np.sqrt(np.diag(K))
    return np.where(np.abs(K) < 1e-14 * np.outer(size, size), 0.0, K)


def legendre(count: int, xi: np.ndarray, derivative: int = 0) -> np.ndarray:
    """Legendre's P_0 ... P_(count-1) at u = 2 xi - 1, or their derivatives by u.

    Args:
        count: number of polynomials.
        xi: places (S,).
        derivative: its order.

    Returns:
        (S, count).
    """
    u = 2 * np.atleast_1d(xi) - 1.0
    lower = _derivatives(count, derivative)
    return legvander(u, len(lower) - 1) @ lower


def legendre_at(count: int, xi: float) -> np.ndarray:
    """P_0 ... P_(count-1) at u = 2 xi - 1 of one place (count,), faster than `legendre`."""
    u, out = 2 * xi - 1.0, [1.0, 2 * xi - 1.0]
    for k in range(1, count - 1):
        out.append(((2 * k + 1) * u * out[k] - k * out[k - 1]) / (k + 1))
    return np.array(out[:count])


@cache
def _derivatives(count: int, order: int) -> np.ndarray:
    """Derivatives of P_0 ... P_(count-1) as sums of Legendre's polynomials, in columns."""
    return legder(np.eye(max(count, order + 1)), order, axis=0)[:, :count]


def legendre_integrals(count: int, xi: np.ndarray) -> np.ndarray:
    """Integrals of P_0 ... P_(count-1) by u from -1 to 2 xi - 1, the shapes (12).

    Args:
        count: number of polynomials.
        xi: places (S,).

    Returns:
        (S, count).
    """
    P = legendre(count + 1, xi)
    out = np.empty((len(P), count))
    out[:, 0] = P[:, 1] + 1.0
    for k in range(1, count):
        out[:, k] = (P[:, k + 1] - P[:, k - 1]) / (2 * k + 1)
    return out


@cache
def _lagrange(points: int) -> np.ndarray:
    """Lagrange's polynomials as sums of Legendre's (13): (points, points), column j is l_j."""
    xi, w = gauss(points)
    return (2 * np.arange(points)[:, None] + 1) * legendre(points, xi).T * w


def lagrange(points: int, xi: np.ndarray, derivative: int = 0) -> np.ndarray:
    """Lagrange's l_j through the Gauss points, or their derivatives by xi (13).

    Args:
        points: number of points.
        xi: places (S,).
        derivative: its order.

    Returns:
        (S, points).
    """
    return 2.0**derivative * legendre(points, xi, derivative) @ _lagrange(points)


def lagrange_integrals(points: int, xi: np.ndarray) -> np.ndarray:
    """w_j(xi), the integrals of l_j from 0 to xi (13).

    Args:
        points: number of points.
        xi: places (S,).

    Returns:
        (S, points).
    """
    return 0.5 * legendre_integrals(points, xi) @ _lagrange(points)


def collocation(points: int) -> np.ndarray:
    """C, the integrals of l_j from 0 to Gauss point p (32), (points p, points j)."""
    return lagrange_integrals(points, gauss(points)[0])
