"""Chains for the tests of the assembly, their states, and differences of energies."""

from __future__ import annotations

from typing import Any

import numpy as np

from flexura.robot import Robot
from flexura.system.assembly import Assembly
from robots import beam, rigid, robot

LOAD: dict[str, Any] = {"gravity": (1.0, -9.81), "payload": 0.3, "payload_inertia": 0.1}
HUB = {"hub_mass_kg": 0.7, "hub_inertia_kg_m2": 0.2, "rotor_inertia": 0.1, "viscous_friction": 0.2}
DAMPED = {"damping": {"alpha_1_s": 0.3, "beta_s": 0.01}}
TAPER = [{"at_m": 0.0, "value": 1.0}, {"at_m": 1.0, "value": 0.4}]
BROKEN = [{"at_m": 0.0, "value": 1.0}, {"at_m": 0.7, "value": 0.4}, {"at_m": 1.0, "value": 0.5}]
ARM = rigid(0.5, 1.0, 0.2, 0.1)
RIDER = rigid(0.5, 1.0, 0.2, 0.1, "Pa", angle_rad=0.3, start=0.4, **HUB)

SMALL = {
    "R": robot(beam(1.0, 1.0, 1.0, 2, **HUB), **LOAD),
    "R, taper": robot(beam(1.0, TAPER, TAPER, 2), **LOAD),
    "R, kink": robot(beam(1.0, BROKEN, BROKEN, 2, **DAMPED), **LOAD),
    "R, modes, R": robot(beam(1.0, TAPER, TAPER, 3, modes=2), beam(1.0, 1.0, 1.0, 1), **LOAD),
    "Pa, R": robot(rigid(0.5, 1.0, 0.2, 0.1, "Pa", angle_rad=0.3), beam(1.0, 1.0, 1.0, 2), **LOAD),
    "R, Pa on modes": robot(beam(1.0, 1.0, 1.0, 2, modes=3), RIDER, **LOAD),
    "R, Pa on all shapes": robot(beam(1.0, TAPER, 1.0, 2, **DAMPED), RIDER, **LOAD),
    "Pb": robot(beam(1.0, 1.0, 1.0, 2, "Pb", start=0.6, angle_rad=0.2, **HUB), **LOAD),
    "R, Pb, taper": robot(
        ARM, beam(1.0, TAPER, TAPER, 2, "Pb", start=0.6, **HUB, **DAMPED), **LOAD
    ),
    "R, Pb, modes": robot(ARM, beam(1.0, TAPER, TAPER, 2, "Pb", start=0.6, modes=2, **HUB), **LOAD),
    "R, Pb, Pa": robot(
        ARM,
        beam(1.0, TAPER, TAPER, 2, "Pb", start=0.6, angle_rad=0.2, **HUB),
        rigid(0.5, 1.0, 0.2, 0.1, "Pa", start=0.8, angle_rad=1.0, **HUB),
        **LOAD,
    ),
    "R, Pb, Pa, rigid": robot(
        ARM, rigid(0.5, 1.0, 0.2, 0.1, "Pb", start=0.3, **HUB), RIDER, **LOAD
    ),
}


def random_chain(rng: np.random.Generator, links: int = 3) -> Robot:
    """A chain of random joints, lengths from 0.01 to 10 m, a third of the hubs bare."""
    tables: list[dict[str, Any]] = []
    for _ in range(links):
        kind = str(rng.choice(["R", "Pa", "Pb"]))
        L, before = float(10 ** rng.uniform(-2, 1)), tables[-1]["length_m"] if tables else 1.0
        joint: dict[str, Any] = {"rotor_inertia": float(rng.uniform(0, 0.1))}
        if kind != "R":
            span = L if kind == "Pb" else before
            joint |= {
                "angle_rad": float(rng.uniform(-1, 1)),
                "start": float(span * rng.uniform(0.3, 0.9)),
            }
        if kind == "Pa" and tables and tables[-1]["joint"]["type"] == "Pb":
            low = before - tables[-1]["joint"]["start"]
            joint["start"] = float(low + (before - low) * rng.uniform(0.1, 0.9))
        if rng.random() < 0.6:
            joint |= {
                "hub_mass_kg": float(rng.uniform(0, 1)),
                "hub_inertia_kg_m2": float(rng.uniform(0, 0.1) * L**2),
            }
        if rng.random() < 0.25:
            tables.append(rigid(L, 1.0, 0.4 * L, 0.05 * L**2, kind, **joint))
            continue
        more = {"modes": int(rng.integers(1, 4))} if rng.random() < 0.3 else {}
        rho, EI = float(10 ** rng.uniform(-1, 1)), float(10 ** rng.uniform(-3, 6))
        tables.append(beam(L, rho, EI, int(rng.integers(2, 5)), kind, **more, **joint))
    return robot(
        *tables, gravity=(0.3, -9.81), payload=float(rng.uniform(0, 5)), payload_inertia=0.01
    )


def random_state(
    assembly: Assembly, rng: np.random.Generator, slope: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """q and qd (n,): joints at their start (R: anywhere), links bent by about `slope` rad."""
    q, qd = rng.normal(size=assembly.n), rng.normal(size=assembly.n)
    structure = assembly.structure
    for i, (row, link) in enumerate(zip(assembly.rows, assembly.robot.links, strict=True)):
        if link.joint.type != "R":
            q[row], qd[row] = link.joint.start, 0.3 * link.length_m * qd[row]
        for piece, own in zip(structure.links[i], structure.own[i], strict=True):
            size = (
                slope
                / len(structure.links[i])
                / piece.count
                / np.maximum(np.abs(piece.B).max(axis=0), 1e-9)
            )
            size = size / np.arange(1, piece.count + 1) ** 2
            q[own], qd[own] = size * q[own], size * qd[own]
    return q, qd


def slopes(function: Any, x: np.ndarray, h: float = 1e-5) -> np.ndarray:
    """d function / dx by central differences of fourth order, the last axis x."""
    columns = []
    for k in range(len(x)):
        e = np.zeros_like(x)
        e[k] = h
        near, far = function(x + e) - function(x - e), function(x + 2 * e) - function(x - 2 * e)
        columns.append((8 * near - far) / (12 * h))
    return np.stack(columns, axis=-1)


def lagrange(assembly: Assembly, q: np.ndarray, qd: np.ndarray, h: float = 1e-4) -> np.ndarray:
    """d/dt dT/dqd - dT/dq at qdd = 0 from the kinetic energy alone, by differences: (n,)."""
    kinetic = lambda x, v: assembly.energies(x, v).kinetic
    momentum = lambda x: assembly.mass(x) @ qd
    along = slopes(lambda t: momentum(q + t[0] * qd), np.zeros(1), h)[:, 0]
    return along - slopes(lambda x: np.array(kinetic(x, qd)), q, h)
