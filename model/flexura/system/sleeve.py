"""A flexible link that slides through a sleeve (Pb), its mesh on the free length: (32) to (37)."""

from __future__ import annotations

import numpy as np

from ..link.line import Piece
from ..link.quadrature import without_round_off
from ..link.section import Material
from .kinematics import Frame, Line
from .masses import Masses, Part, dot, point_mass


def masses(line: Line, material: Material) -> list[Part]:
    """The masses of a sleeved link: free length (33), rod (34), and at the exit what sums miss."""
    assert line.row is not None
    free, rod = (
        free_masses(line, material),
        rod_behind(line.start, line.free, line.row, material, line.qd),
    )
    missed = line.piece.mass.sum() - free.mass.sum() - rod.mass.sum()
    return [free, rod, point_mass(missed, line.start)]


def free_masses(line: Line, material: Material) -> Masses:
    """The Gauss points on the free length, with the velocity of the material there (32), (33)."""
    d, piece, start = line.free, line.piece, line.start
    C = d * piece.C
    columns = start.velocity + C @ line.E
    columns[:, line.row] += piece.C @ line.e + (1 - piece.xi) * line.e
    rest = (
        start.rest
        + C @ line.N
        + line.rate * (2 * piece.C @ line.rates + (1 - piece.xi) * line.rates)
    )
    mass = d * piece.weights * material.mass_per_length(material.length - d + d * piece.xi)
    return Masses(mass, start.place + C @ line.e, columns, rest)


def flow_forces(line: Line, material: Material, free: Masses) -> np.ndarray:
    """The terms of (37) beside columns times mass times accelerations, without dU: (n,). free:
    `free_masses`."""
    d, d_rate, start, row, mu = line.free, line.rate, line.start, line.row, free.mass
    V, behind = (free.columns - start.velocity) @ line.qd, 1 - line.piece.xi
    left, mu_d = mu * behind, mu / d  # mu_d: d mu / dd at fixed xi (33)
    if not material.uniform:
        mu_d = mu_d - d * behind * line.piece.weights * material.mass_per_length(
            material.length - d * behind, 1
        )
    exit_density = material.mass_per_length(material.length - d)[0]
    out = d_rate * (dot(free.columns, mu_d * V) - dot(line.E, left * V))
    out -= exit_density * d_rate**2 * np.real(start.velocity.conj() * start.tangent)
    out[row] += np.real(np.sum(left * line.rates.conj() * V)) - 0.5 * mu_d @ np.abs(V) ** 2
    out[row] -= 0.5 * exit_density * d_rate**2
    return out


def rod_behind(start: Frame, free: float, row: int, material: Material, qd: np.ndarray) -> Masses:
    """The masses of the straight rod inside and behind the sleeve, on its axis (34)."""
    s, ds = material.quadrature(0.0, material.length - free, 4)
    t, spin, x = start.tangent, start.turning @ qd, s - material.length + free
    columns = start.velocity + (1j * t * x)[:, None] * start.turning
    columns[:, row] += t
    rest = start.rest + 2j * t * spin * qd[row] + x * (t * (1j * start.rest_turning - spin**2))
    return Masses(material.mass_per_length(s) * ds, start.place + t * x, columns, rest)


def stiffness(piece: Piece, d: float, material: Material, derivative: int = 0) -> np.ndarray:
    """K(d) [N m] of the free length d, or its first or second derivative by d (35): (m, m)."""
    if material.uniform:
        return (
            material.stiffness[0, 0]
            * (1 / d, -1 / d**2, 2 / d**3)[derivative]
            * piece.unit_stiffness
        )
    X, left = material.length - d + d * piece.xi, 1 - piece.xi
    factor = material.bending_stiffness(X) * (1 / d, -1 / d**2, 2 / d**3)[derivative]
    if derivative > 0:
        factor += left * material.bending_stiffness(X, 1) * (-1 / d, 2 / d**2)[derivative - 1]
    if derivative > 1:
        factor += left**2 / d * material.bending_stiffness(X, 2)
    K = piece.slopes.T @ ((factor * piece.weights)[:, None] * piece.slopes)
    return K if derivative else without_round_off(K)
