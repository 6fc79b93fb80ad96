"""A link's own clamped modes in the space of polynomials (12): (17) to (19)."""

from __future__ import annotations

import numpy as np

from .quadrature import gauss, lagrange_integrals
from .section import Material
from .shapes import legendre_shapes


def clamped_matrices(
    law: Material, free: float, count: int, points: int, mass: float = 0.0, inertia: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """M [kg m^2] and K [N m] (count, count) of a straight link's clamped last `free` metres (17).

    The unknowns are the coefficients in the space (12); a payload of `mass` and `inertia` is at the
    tip. The third array has the tip's deflection and angle of each shape, (2, count) [m, rad].
    """
    L, ends = law.length, np.ones(1)
    s, ds = law.quadrature(L - free, L, max(count + 3, points + 2))
    xi, B = (s - L + free) / free, legendre_shapes(count, gauss(points)[0])
    deflection, slope = (
        free * lagrange_integrals(points, xi) @ B,
        legendre_shapes(count, xi, 1) / free,
    )
    tip = np.vstack([free * lagrange_integrals(points, ends) @ B, legendre_shapes(count, ends)])
    M = deflection.T @ ((law.mass_per_length(s) * ds)[:, None] * deflection)
    M += tip.T @ (np.array([[mass], [inertia]]) * tip)
    return M, slope.T @ ((law.bending_stiffness(s) * ds)[:, None] * slope), tip


def clamped_modes(
    M: np.ndarray, K: np.ndarray, tip: np.ndarray, kept: int, statics: bool
) -> tuple[np.ndarray, np.ndarray]:
    """The lowest `kept` modes, mass-normalised, as columns (count, m), and omega^2 (m,) (18).

    With `statics` the static shapes of a tip force and a tip moment join them, and the modes of
    this smaller space are given. Each mode moves the tip to the left.
    """
    lam, V = _modes(M, K)
    if kept < len(K):
        lam, V = lam[:kept], V[:, :kept]
        if statics:
            V = np.column_stack([V, _rest_of_static_shapes(K, tip, lam, V)])
            lam, X = _modes(V.T @ M @ V, V.T @ K @ V)
            V = V @ X
    return V * np.where(tip[0] @ V < 0, -1.0, 1.0), lam


def orthogonal_shapes(K: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shapes (count, count) whose stiffness is diagonal, and that diagonal (count,) [N m].

    Each is one of the space (12) less what those before it would bend with it; of a uniform link
    the space's own. Round-off between orthogonal shapes is taken away first.
    """
    from scipy.linalg import solve_triangular

    size = np.sqrt(np.diag(K))
    L = np.linalg.cholesky(np.where(np.abs(K) < 1e-14 * np.outer(size, size), 0.0, K))
    return solve_triangular(L.T, np.diag(np.diag(L))), np.diag(L) ** 2


def _modes(M: np.ndarray, K: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """omega^2 (m,) ascending, mass-normalised modes (m, m); M x = mu K x keeps low ones exact."""
    from scipy.linalg import eigh

    mu, X = eigh(M, K)
    mu, X = np.maximum(mu[::-1], 1e-300), X[:, ::-1]
    return 1 / mu, X / np.sqrt(mu)


def _rest_of_static_shapes(
    K: np.ndarray, tip: np.ndarray, lam: np.ndarray, V: np.ndarray
) -> np.ndarray:
    """The static shapes of a tip force and moment without what the modes V have of them (19)."""
    from scipy.linalg import cho_factor, cho_solve

    room = len(K) - len(lam)
    rest = cho_solve(cho_factor(K), tip.T[:, :room])
    rest -= V @ ((V.T @ tip.T[:, :room]) / lam[:, None])
    energy = np.einsum("ik,ij,jk->k", rest, K, rest)
    return rest * np.sqrt(lam[-1] / np.maximum(energy, 1e-300))
