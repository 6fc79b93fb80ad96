"""A link's own clamped modes in the space of polynomials (12): (17) to (19)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .quadrature import gauss, lagrange_integrals, without_round_off
from .section import Material
from .shapes import legendre_shapes


class ClampedBody(NamedTuple):
    """A body on a link (110), (111).

    Place [m], mass [kg], inertia about its centre [kg m^2], and the centre along and across the
    tangent there [m].
    """

    at: float
    mass: float
    inertia: float
    along: float = 0.0
    across: float = 0.0


def clamped_matrices(
    properties: Material,
    free: float,
    count: int,
    points: int,
    bodies: Sequence[ClampedBody] = (),
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Matrices of a straight link whose last `free` metres are clamped at their start (17).

    The unknowns are the coefficients in the space (12).

    Args:
        properties: mass and stiffness of the link.
        free: the free length [m].
        count: number of polynomials.
        points: number of points.
        bodies: on the link, places from its proximal end.

    Returns:
        M [kg m^2] and K [N m], (count, count), and the tip's deflection and angle of each shape,
            (2, count) [m, rad].
    """
    L, ends = properties.length, np.ones(1)
    s, ds = properties.quadrature(L - free, L, max(count + 3, points + 2))
    xi, B = (s - L + free) / free, legendre_shapes(count, gauss(points)[0])
    deflection, slope = (
        free * lagrange_integrals(points, xi) @ B,
        legendre_shapes(count, xi, 1) / free,
    )
    tip = np.vstack([free * lagrange_integrals(points, ends) @ B, legendre_shapes(count, ends)])
    M = deflection.T @ ((properties.mass_per_length(s) * ds)[:, None] * deflection)
    for body in bodies:
        at = np.array([(body.at - L + free) / free])
        place = np.vstack([free * lagrange_integrals(points, at) @ B, legendre_shapes(count, at)])
        lever = place[0] + body.along * place[1]
        turning = body.inertia + body.mass * body.across**2
        M += body.mass * np.outer(lever, lever) + turning * np.outer(place[1], place[1])
    return M, slope.T @ ((properties.bending_stiffness(s) * ds)[:, None] * slope), tip


def clamped_modes(
    M: np.ndarray, K: np.ndarray, tip: np.ndarray, kept: int, statics: bool
) -> tuple[np.ndarray, np.ndarray]:
    """The lowest modes of a clamped link, mass-normalised (18).

    With `statics`, the static shapes of a tip force and a tip moment join them, and the modes of
    this space are returned (19). Each mode moves the tip to the left.

    Args:
        M: mass matrix (count, count) [kg m^2].
        K: stiffness matrix (count, count) [N m].
        tip: the tip's deflection and angle of each shape (2, count).
        kept: number of modes.
        statics: whether static shapes join them.

    Returns:
        The modes as columns (count, m), and omega^2 (m,) [1/s^2].
    """
    lam, V = _modes(M, K)
    if kept < len(K):
        lam, V = lam[:kept], V[:, :kept]
        if statics:
            V = np.column_stack([V, _static_shape_residuals(K, tip, lam, V)])
            lam, X = _modes(V.T @ M @ V, V.T @ K @ V)
            V = V @ X
    return V * np.where(tip[0] @ V < 0, -1.0, 1.0), lam


def orthogonal_shapes(K: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shapes with a diagonal stiffness.

    Each is one of the space (12) less its elastic part in those before it; for a uniform link they
    are the space's own. Round-off between orthogonal shapes is removed first.

    Args:
        K: stiffness matrix (count, count) [N m].

    Returns:
        The shapes (count, count), and the diagonal (count,) [N m].
    """
    from scipy.linalg import solve_triangular

    L = np.linalg.cholesky(without_round_off(K))
    return solve_triangular(L.T, np.diag(np.diag(L))), np.diag(L) ** 2


def _modes(M: np.ndarray, K: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """omega^2 (m,) ascending, and mass-normalised modes (m, m).

    M x = mu K x keeps the low ones exact.
    """
    from scipy.linalg import eigh

    mu, X = eigh(M, K)
    mu, X = np.maximum(mu[::-1], 1e-300), X[:, ::-1]
    return 1 / mu, X / np.sqrt(mu)


def _static_shape_residuals(
    K: np.ndarray, tip: np.ndarray, lam: np.ndarray, V: np.ndarray
) -> np.ndarray:
    """The static shapes of a tip force and moment, without their part in the modes V (19)."""
    from scipy.linalg import cho_factor, cho_solve

    free_columns = len(K) - len(lam)
    residual = cho_solve(cho_factor(K), tip.T[:, :free_columns])
    residual -= V @ ((V.T @ tip.T[:, :free_columns]) / lam[:, None])
    energy = np.einsum("ik,ij,jk->k", residual, K, residual)
    return residual * np.sqrt(lam[-1] / np.maximum(energy, 1e-300))
