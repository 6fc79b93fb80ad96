"""Moving masses with their columns: their sums are M(q), the bias and gravity."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .kinematics import Frame, Line


class Masses(NamedTuple):
    """Point masses and their motion (39).

    mass (G,) [kg], place (G,) [m]; columns (G, n) of their velocities; rest (G,): accelerations at
    zero accelerations of the unknowns.
    """

    mass: np.ndarray
    place: np.ndarray
    columns: np.ndarray
    rest: np.ndarray


class RotaryInertia(NamedTuple):
    """A moment of inertia [kg m^2] that turns with a frame, with columns (n,) (39)."""

    inertia: float
    columns: np.ndarray
    rest: float


Part = Masses | RotaryInertia


class Sum(NamedTuple):
    """What (40) to (42) sum over, a row for x, y of each mass and each angle: weights, columns (R,
    n), accelerations (R,)."""

    weight: np.ndarray
    columns: np.ndarray
    rest: np.ndarray

    @property
    def mass(self) -> np.ndarray:
        """M (n, n), the sum of J^T m J (40)."""
        return self.columns.T @ (self.weight[:, None] * self.columns)

    @property
    def forces(self) -> np.ndarray:
        """The sum of J^T m a, a the accelerations at zero ones of the unknowns (41), (42): (n,)."""
        return (self.weight * self.rest) @ self.columns


def total(parts: list[Part], gravity: complex = 0j) -> Sum:
    """The rows of all parts; gravity is an acceleration of the base (42)."""
    points = [p for p in parts if isinstance(p, Masses)]
    angles = [p for p in parts if isinstance(p, RotaryInertia)]
    mass, J = np.concatenate([p.mass for p in points]), np.concatenate([p.columns for p in points])
    a = np.concatenate([p.rest for p in points]) - gravity
    return Sum(
        np.concatenate([mass, mass, [p.inertia for p in angles]]),
        np.concatenate([J.real, J.imag, *(p.columns[None] for p in angles)]),
        np.concatenate([a.real, a.imag, [p.rest for p in angles]]),
    )


def point_mass(mass: float, frame: Frame) -> Masses:
    """A point mass in a frame's origin."""
    return Masses(
        np.array([mass]), np.array([frame.place]), frame.velocity[None], np.array([frame.rest])
    )


def turning(inertia: float, frame: Frame) -> RotaryInertia:
    """A moment of inertia that turns with a frame."""
    return RotaryInertia(inertia, frame.turning, frame.rest_turning)


def line_masses(line: Line) -> Masses:
    """The mass points of a piece of constant length (4), (5)."""
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


def potential(parts: list[Part], gravity: complex) -> float:
    """The potential energy of gravity [J] (23)."""
    return -sum(
        float(np.real(np.conj(gravity) * (p.mass @ p.place)))
        for p in parts
        if isinstance(p, Masses)
    )
