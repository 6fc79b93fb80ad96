"""Moving masses with their columns: their sums are M(q), the bias and gravity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .kinematics import Frame, Line


@dataclass(frozen=True)
class Masses:
    """Point masses and their motion (13).

    mass (G,) [kg], place (G,) [m]; columns (G, n) of their velocities; rest (G,): accelerations at
    zero accelerations of the unknowns.
    """

    mass: np.ndarray
    place: np.ndarray
    columns: np.ndarray
    rest: np.ndarray


@dataclass(frozen=True)
class Turning:
    """A moment of inertia [kg m^2] that turns with a frame, with columns (n,) (13)."""

    inertia: float
    columns: np.ndarray
    rest: float


Part = Masses | Turning


def lump(mass: float, frame: Frame) -> Masses:
    """A point mass in a frame's origin."""
    return Masses(
        np.array([mass]), np.array([frame.place]), frame.velocity[None], np.array([frame.rest])
    )


def turning(inertia: float, frame: Frame) -> Turning:
    """A moment of inertia that turns with a frame."""
    return Turning(inertia, frame.turning, frame.rest_turning)


def line_masses(line: Line) -> Masses:
    """The mass points of a piece of constant length (2)."""
    start, w = line.start, line.piece.w
    return Masses(
        line.piece.mass,
        start.place + w @ line.e,
        start.velocity + w @ line.E,
        start.rest + w @ line.N,
    )


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Scalar products of columns a (G, n) with b (G,) or (G, k), summed over the points."""
    return np.real(a.conj().T @ b)


def mass_matrix(n: int, parts: list[Part]) -> np.ndarray:
    """M (n, n), the sum of J^T m J (14)."""
    M = np.zeros((n, n))
    for p in parts:
        if isinstance(p, Masses):
            M += dot(p.columns, p.mass[:, None] * p.columns)
        else:
            M += p.inertia * np.outer(p.columns, p.columns)
    return M


def kinetic(parts: list[Part], qd: np.ndarray) -> float:
    """The kinetic energy of the masses [J] (14)."""
    total = 0.0
    for p in parts:
        square = np.abs(p.columns @ qd) ** 2
        total += 0.5 * float(p.mass @ square if isinstance(p, Masses) else p.inertia * square)
    return total


def inertia_forces(n: int, parts: list[Part]) -> np.ndarray:
    """The sum of J^T m a, a the accelerations at zero ones of the unknowns (15): (n,)."""
    h = np.zeros(n)
    for p in parts:
        h += (
            dot(p.columns, p.mass * p.rest)
            if isinstance(p, Masses)
            else p.inertia * p.rest * p.columns
        )
    return h


def weight(n: int, parts: list[Part], gravity: complex) -> np.ndarray:
    """Generalised gravity forces on the left-hand side, (n,) (16)."""
    return -sum(
        (dot(p.columns, p.mass * gravity) for p in parts if isinstance(p, Masses)), np.zeros(n)
    )


def potential(parts: list[Part], gravity: complex) -> float:
    """The potential energy of gravity [J] (16)."""
    return -sum(
        float(np.real(np.conj(gravity) * (p.mass @ p.place)))
        for p in parts
        if isinstance(p, Masses)
    )
