"""A link's own clamped modes in the space of polynomials (7)."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

from .section import Material
from .shapes import legendre_deflections, legendre_shapes


def clamped_matrices(
    material: Material, free: float, count: int, mass: float = 0.0, inertia: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """M [kg m^2] and K [N m] (count, count) of small bending of a straight link's last `free` metres, clamped at their start (8).

    `mass` and `inertia` belong to a payload at the tip. The unknowns are the coefficients in the space (7).
    """
    L = material.length
    s, ds = material.quadrature(L - free, L, count + 3)
    xi, end = (s - L + free) / free, np.ones(1)
    deflection, slope = free * legendre_deflections(count, xi), legendre_shapes(count, xi, 1) / free
    tip, turn = free * legendre_deflections(count, end), legendre_shapes(count, end)
    M = deflection.T @ ((material.mass_per_length(s) * ds)[:, None] * deflection) + mass * tip.T @ tip + inertia * turn.T @ turn
    return M, slope.T @ ((material.bending_stiffness(s) * ds)[:, None] * slope)


def clamped_modes(
    material: Material, free: float, count: int, kept: int, statics: bool, mass: float = 0.0, inertia: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """The lowest `kept` clamped modes in the space (7), mass-normalised, and their omega^2 [1/s^2] (9): (count, m), (m,).

    With `statics` the shapes of a tip force and a tip moment join them, and the modes of this smaller space are given.
    """
    M, K = clamped_matrices(material, free, count, mass, inertia)
    lam, V = eigh(K, M)
    tip = legendre_deflections(count, np.ones(1))[0]
    if kept < count:
        V, lam = V[:, :kept], lam[:kept]
        if statics:
            V = np.column_stack([V, np.linalg.solve(K, np.column_stack([tip, legendre_shapes(count, np.ones(1))[0]]))])
            V = V / np.sqrt(np.einsum("ik,ij,jk->k", V, M, V))
            lam, X = eigh(V.T @ K @ V, V.T @ M @ V)
            V = V @ X
    return V * np.where(tip @ V < 0, -1.0, 1.0), lam
