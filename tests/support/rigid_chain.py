"""A chain of rigid links with joints R, Pa and Pb from Lagrange's equations, written straight from
the definitions: an oracle.

T = 1/2 sum w (df/dt)^2 over the places of masses, angles of inertias and joint positions of rotors,
f(q), with weights w. Hence J^T W J q'' = F + J^T W (g - J' q'), J = df/dq by complex steps.
Flexible links count as rigid uniform bars.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import flexura as fx

U, V = np.polynomial.legendre.leggauss(3)
STEP = 1e-30


def _axis(angle: Any) -> np.ndarray:
    return np.array([np.cos(angle), np.sin(angle)])


def quantities(
    robot: fx.Robot, q: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Quantities f, weights w, their gravity g, all (k,), and the tip (2,); q may be complex."""
    origin, angle, length = np.zeros(2, dtype=complex), 0j, 0.0
    rows: list[tuple[Any, float, float]] = []

    def add(mass: float, place: np.ndarray, inertia: float = 0.0) -> None:
        rows.extend((x, mass, g) for x, g in zip(place, robot.gravity_m_s2, strict=True))
        rows.append((angle, inertia, 0.0))

    for link, x in zip(robot.links, q, strict=True):
        joint, tip = link.joint, origin + length * _axis(angle)
        if joint.type == "Pb":  # the sleeve is on the link before
            add(joint.hub_mass_kg, tip, joint.hub_inertia_kg_m2)
        origin = origin + x * _axis(angle) if joint.type == "Pa" else tip
        angle = angle + (x if joint.type == "R" else joint.angle_rad)
        length = link.length_m
        if joint.type == "Pb":
            origin = tip + (x - length) * _axis(angle)
        else:
            add(joint.hub_mass_kg, origin, joint.hub_inertia_kg_m2)
        if link.flexible:
            for u, v in zip(U, V, strict=True):
                add(
                    float(link.mass_per_length(0.0)) * length * v / 2,
                    origin + length * (u + 1) / 2 * _axis(angle),
                )
        else:
            add(
                link.mass_kg or 0.0,
                origin + (link.centre_of_mass_m or 0.0) * _axis(angle),
                link.inertia_kg_m2 or 0.0,
            )
        rows.append((x, joint.rotor_inertia, 0.0))
    tip = origin + length * _axis(angle)
    add(robot.payload.mass_kg, tip, robot.payload.inertia_kg_m2)
    values, weights, gravity = zip(*rows, strict=True)
    return np.array(values), np.array(weights), np.array(gravity), tip


def simulate(
    robot: fx.Robot, t: np.ndarray, force: Any, speeds: Any
) -> tuple[np.ndarray, np.ndarray]:
    """Joint positions (n, T) and the tip (2, T) under constant forces, from the robot's start at
    `speeds`."""
    n = len(robot.links)
    unit = STEP * 1j * np.eye(n)

    def jacobian(q: np.ndarray) -> np.ndarray:
        return np.array([quantities(robot, q + row)[0].imag / STEP for row in unit]).T

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        q, v, e = y[:n], y[n:], 1e-5
        _, w, g, _ = quantities(robot, q + 0j)
        J = jacobian(q)
        centripetal = (jacobian(q + e * v) - jacobian(q - e * v)) @ v / (2 * e)
        return np.concatenate(
            [v, np.linalg.solve(J.T @ (w[:, None] * J), force + J.T @ (w * (g - centripetal)))]
        )

    start = np.concatenate([robot.start, speeds])
    q = solve_ivp(rates, (0.0, t[-1]), start, method="DOP853", t_eval=t, rtol=1e-9, atol=1e-10).y[
        :n
    ]
    return q, np.array([quantities(robot, column + 0j)[3].real for column in q.T]).T
