"""Energies, gradients and accelerations of a System, for identities on random robots."""

from __future__ import annotations

import numpy as np

import flexura as fx
from flexura import signals
from flexura.system.assembly import COULOMB_RATE
from robots import state, turning


def close(a, b, tolerance: float, least: float = 1e-9) -> None:
    """Agreement of two arrays relative to the largest entry, or to `least`."""
    assert np.abs(np.asarray(a) - b).max() <= tolerance * max(
        np.abs(b).max(), np.abs(a).max(), least
    )


def energy(sys: fx.System, name: str, q: np.ndarray, qd: np.ndarray | None = None) -> float:
    return float(fx.simulate(sys, [0.0], q0=q, qd0=qd)[f"energy/{name}"][0])


def gradient(f, x: np.ndarray, step: np.ndarray | float) -> np.ndarray:
    """df/dx by central differences of order 4; `step` (n,) may differ from unknown to unknown."""
    out = []
    for e in np.diag(np.broadcast_to(step, x.shape)):
        size = e.max()
        out.append((8 * (f(x + e) - f(x - e)) - (f(x + 2 * e) - f(x - 2 * e))) / (12 * size))
    return np.array(out)


def steps(sys: fx.System, size: float) -> np.ndarray:
    """Steps for finite differences that change a slope by about `size`."""
    return size / turning(sys)


def acceleration(sys: fx.System, q: np.ndarray, qd: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """qdd from the assembled matrices; locked joints stay, Coulomb friction as in the kernel."""
    F = np.zeros(sys.n)
    rows = sys.joint_rows
    F[rows] = tau - friction(sys) * np.tanh(qd[rows] / COULOMB_RATE)
    F -= sys.bias(q, qd) + sys.gravity(q) + sys.elastic(q) + sys.damping_at(q) @ qd
    free, out = sys.free_rows, np.zeros(sys.n)
    # scaled, since slopes and deflections of short elements differ much in size
    M = sys.mass(q)[np.ix_(free, free)]
    s = 1 / np.sqrt(np.diag(M))
    out[free] = s * np.linalg.solve(M * s * s[:, None], s * F[free])
    return out


def recursion(sys: fx.System, q: np.ndarray, qd: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """qdd from the core's recursion along the chain."""
    F, rows = np.zeros(sys.n), sys.joint_rows
    F[rows] = tau - friction(sys) * np.tanh(qd[rows] / COULOMB_RATE)
    return sys.accelerations(q, qd, F)


def friction(sys: fx.System) -> np.ndarray:
    """Coulomb friction of the joints (N,) [N or N m]."""
    return np.array([link.joint.coulomb_friction for link in sys.robot.links])


def at_rest_if_locked(sys: fx.System, qd: np.ndarray) -> np.ndarray:
    out = qd.copy()
    out[np.setdiff1d(np.arange(sys.n), sys.free_rows)] = 0.0
    return out


def drives(sys: fx.System, seed: int) -> fx.Drive:
    """A smooth force or torque in every joint, 1 at most."""
    random = np.random.default_rng(seed + 2)
    return fx.Drive.force(
        *(
            signals.harmonic(random.uniform(-1, 1) * 0.3, random.uniform(0.5, 3), 1.0)
            for _ in sys.robot.links
        )
    )


def small_state(sys: fx.System, seed: int) -> dict[str, np.ndarray]:
    q, qd = state(sys, seed, slope=0.03, rate=0.5)
    return {"q0": q, "qd0": qd}
