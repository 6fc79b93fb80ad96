"""Exact frequencies of a uniform Euler-Bernoulli beam with bodies and springs on it, from its
general solution: what a finite element mesh is held to."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq


class Body(NamedTuple):
    """A body on the beam: mass [kg], inertia about its centre [kg m^2], the centre along and across
    the beam from where it sits [m]."""

    mass: float = 0.0
    inertia: float = 0.0
    along: float = 0.0
    across: float = 0.0


class Beam(NamedTuple):
    """A beam: length [m], mass per length [kg/m], bending stiffness [N m^2]."""

    length: float
    mass: float
    stiffness: float


def roots(determinant: Callable[[float], float], most_Hz: float, count: int) -> np.ndarray:
    """The lowest frequencies [Hz] at which a determinant of the angular frequency vanishes."""
    grid = 2 * np.pi * np.linspace(1e-3, 1.0, 4001) ** 2 * most_Hz
    values = [determinant(w) for w in grid]
    changes = [
        (brentq(determinant, a, b, xtol=1e-13, rtol=1e-13), max(abs(x), abs(y)))
        for a, b, x, y in zip(grid, grid[1:], values, values[1:])
        if x * y < 0
    ]
    found = [w for w, size in changes if abs(determinant(w)) < 1e-3 * size]  # else a pole
    return np.array(found[:count]) / (2 * np.pi)


def advance(beam: Beam, length: float, w: float) -> np.ndarray:
    """Leads (deflection, slope, moment, shear) along a piece of the beam at the frequency w
    [rad/s]: the transfer matrix (Pestel and Leckie, Matrix Methods in Elastomechanics, 1963)."""
    b = (beam.mass * w**2 / beam.stiffness) ** 0.25
    shapes = [np.cos, np.sin, np.cosh, np.sinh]

    def rows(x: float) -> np.ndarray:
        c, s, C, S = (f(b * x) for f in shapes)
        EI = beam.stiffness
        return np.array(
            [
                [c, s, C, S],
                [-b * s, b * c, b * S, b * C],
                EI * b**2 * np.array([-c, -s, C, S]),
                EI * b**3 * np.array([s, -c, S, C]),
            ]
        )

    return rows(length) @ np.linalg.inv(rows(0.0))


def across_body(body: Body, w: float) -> np.ndarray:
    """The same across a body: its inertia makes moment and shear jump."""
    m, a = body.mass, body.along
    turning = body.inertia + m * (a**2 + body.across**2)
    out = np.eye(4)  # EI w'' = moment, EI w''' = shear
    out[2, :2] = -(w**2) * m * a, -(w**2) * turning
    out[3, :2] = w**2 * m, w**2 * m * a
    return out


def frequencies(
    beam: Beam,
    hinge: Callable[[float], float],
    bodies: list[tuple[float, Body]],
    most_Hz: float,
    count: int = 3,
    radius: float = 0.0,
) -> np.ndarray:
    """Frequencies [Hz] of a beam that begins `radius` from a hinge with the dynamic stiffness
    hinge(w) [N m/rad], inf: clamped; bodies (place, body) in order along it."""

    def determinant(w: float) -> float:
        k = hinge(w)
        # unknown: the hinge's angle (clamped: the moment) and the shear at the beam's beginning
        begin = np.array([[radius, 0.0], [1.0, 0.0], [k, radius], [0.0, 1.0]])
        if np.isinf(k):
            begin = np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
        at, state = 0.0, begin
        for place, body in bodies:
            state = across_body(body, w) @ advance(beam, place - at, w) @ state
            at = place
        state = advance(beam, beam.length - at, w) @ state if at < beam.length else state
        state = state / np.abs(state).max(axis=0)
        return float(np.linalg.det(state[2:]))

    return roots(determinant, most_Hz, count)


def rotating(beam: Beam, radius: float, rate: float, most_Hz: float, count: int = 2) -> np.ndarray:
    """Frequencies [Hz] in the plane of rotation of a beam clamped to a hub that turns at a rate
    [rad/s]: EI w'''' - (T w')' - m rate^2 w = m w^2 (Wright et al., J. Appl. Mech. 49, 1982)."""
    L, m, EI = beam

    def determinant(w: float) -> float:
        def slopes(x: float, z: np.ndarray) -> np.ndarray:
            z = z.reshape(4, 2)
            T = m * rate**2 * ((L**2 - x**2) / 2 + radius * (L - x))
            dT = -m * rate**2 * (x + radius)
            fourth = (T * z[2] + dT * z[1] + m * (rate**2 + w**2) * z[0]) / EI
            return np.concatenate([z[1], z[2], z[3], fourth])

        begin = np.array([[0, 0], [0, 0], [1, 0], [0, 1]], dtype=float).ravel()
        end = solve_ivp(slopes, (0, L), begin, rtol=1e-10, atol=1e-12, method="DOP853").y[:, -1]
        return float(np.linalg.det(end.reshape(4, 2)[2:] / np.abs(end.reshape(4, 2)).max(axis=0)))

    grid = 2 * np.pi * np.linspace(0.02, 1.0, 60) * most_Hz
    values = [determinant(w) for w in grid]
    found = [
        brentq(determinant, a, b, rtol=1e-9)
        for a, b, x, y in zip(grid, grid[1:], values, values[1:])
        if x * y < 0
    ]
    return np.array(found[:count]) / (2 * np.pi)
