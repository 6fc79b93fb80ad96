"""A flexible link that slides through a sleeve (Pb): its mesh covers the free length (8), (9)."""

from __future__ import annotations

import numpy as np

from ..link.section import Material
from .kinematics import Frame, Line, ahead
from .masses import Masses, Part, dot, lump


def masses(line: Line, law: Material) -> list[Part]:
    """The masses of a sleeved link: free length, rod, and at the exit what the sums miss (9)."""
    assert line.row is not None
    free, rod = free_masses(line, law), rod_behind(line.start, line.free, line.row, law, line.qd)
    return [
        free,
        rod,
        lump(float(line.piece.mass.sum() - free.mass.sum() - rod.mass.sum()), line.start),
    ]


def free_masses(line: Line, law: Material) -> Masses:
    """The Gauss points on the free length, with the velocity of the material there (8), (9)."""
    d, piece, start = line.free, line.piece, line.start
    flow = piece.C + np.diag(1 - piece.xi)
    columns = start.velocity + d * piece.C @ line.E
    columns[:, line.row] += flow @ line.e
    rest = start.rest + d * piece.C @ line.N + line.rate * ((piece.C + flow) @ (line.E @ line.qd))
    return Masses(_mass(line, law)[0], start.place + d * piece.C @ line.e, columns, rest)


def _mass(line: Line, law: Material) -> tuple[np.ndarray, np.ndarray]:
    """mu = rho A d w of the Gauss points and d mu / dd at fixed xi (8): (P,), (P,)."""
    d, xi, w = line.free, line.piece.xi, line.piece.weights
    X = law.length - d + d * xi
    density, slope = law.mass_per_length(X), law.mass_per_length(X, 1)
    return density * d * w, (density - d * (1 - xi) * slope) * w


def flow_forces(line: Line, law: Material) -> np.ndarray:
    """The terms of (9) beside columns times mass times accelerations, without dU: (n,)."""
    d_rate, start, row = line.rate, line.start, line.row
    masses, (mu, mu_d) = free_masses(line, law), _mass(line, law)
    V, left = (masses.columns - start.velocity) @ line.qd, mu * (1 - line.piece.xi)
    exit_density = float(law.mass_per_length(law.length - line.free)[0])
    out = d_rate * (dot(masses.columns, mu_d * V) - dot(line.E, left * V))
    out -= exit_density * d_rate**2 * np.real(start.velocity.conj() * start.tangent)
    out[row] += float(
        np.real(np.sum(left * (line.E @ line.qd).conj() * V)) - 0.5 * mu_d @ np.abs(V) ** 2
    )
    out[row] -= 0.5 * exit_density * d_rate**2
    return out


def rod_behind(start: Frame, free: float, row: int, law: Material, qd: np.ndarray) -> Masses:
    """The masses of the straight rod inside and behind the sleeve, on its axis (9)."""
    s, ds = law.quadrature(0.0, law.length - free, 4)
    frames = [ahead(start, x, [row], qd) for x in s - law.length + free]
    return Masses(
        law.mass_per_length(s) * ds,
        np.array([f.place for f in frames]),
        np.array([f.velocity for f in frames]),
        np.array([f.rest for f in frames]),
    )


def stiffness(line: Line, law: Material, derivative: int = 0) -> np.ndarray:
    """K(d) [N m] of the free length, or its first or second derivative by d (17): (m, m)."""
    d, xi, w = line.free, line.piece.xi, line.piece.weights
    X, left = law.length - d + d * xi, 1 - xi
    EI, slope, bend = (law.bending_stiffness(X, k) for k in range(3))
    factor = (
        EI / d,
        -EI / d**2 - left * slope / d,
        2 * EI / d**3 + 2 * left * slope / d**2 + left**2 * bend / d,
    )[derivative]
    curvature = line.piece.shapes(xi, 1)
    K = curvature.T @ ((factor * w)[:, None] * curvature)
    size = np.sqrt(np.abs(np.diag(K)))
    return np.where(np.abs(K) < 1e-14 * np.outer(size, size), 0.0, K)  # round-off of orthogonal shapes
