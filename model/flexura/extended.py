"""The extended assembly: one global mass matrix of the whole robot, from link matrices by an index map.

A link's matrix lives in (u, q_i): the velocity u = (vx, vy, omega) of its hub frame and its own elastic unknowns. The hub's
velocity depends on the joints and elastic unknowns of every link before it, u_i = U_i qd, so the link's matrix is scattered
into the rows of all of them, not only into those at a shared node: hence "extended" (dissertation, 2.4; `model/README.md`,
section 4).
"""

from __future__ import annotations

import numpy as np

from .chain import PRISMATIC, REVOLUTE, Chain, Work
from .outward import outward


def mass_matrix(c: Chain, w: Work, y: np.ndarray) -> np.ndarray:
    """M(y) (n, n), symmetric positive definite: T = 1/2 qd^T M qd in the solver's coordinates."""
    hubs, _ = _jacobians(c, w, y)
    M = np.diag(np.where(np.isin(np.arange(len(y)), c.first[:-1]), 0.0, 1.0))
    for i, hub in enumerate(hubs):
        own = slice(c.first[i] + 1, c.first[i + 1])
        m = own.stop - own.start
        S0q, b, Jt = w.body[i, :3]
        Mrr = np.array([[c.mass[i], 0, -S0q], [0, c.mass[i], b], [-S0q, b, Jt]])
        scattered = hub.T @ np.vstack([-w.g1q[i, :m], c.S0[i, :m], w.mt[i, :m]])
        M += hub.T @ Mrr @ hub
        M[:, own] += scattered
        M[own, :] += scattered.T
        M[c.first[i], c.first[i]] += c.rotor[i]
        if c.stiffening:
            M[own, own] += (w.h[i, :, :m].T * c.point_mass[i]) @ w.h[i, :, :m]
            M[own, own] += c.tip_inertia[i] * (w.tilt[i] ** 2 - 1) * np.outer(c.SL[i, :m], c.SL[i, :m])
    return (M + M.T) / 2


def tip_jacobian(c: Chain, w: Work, y: np.ndarray) -> np.ndarray:
    """d (x, y, angle) of the last tip in the base frame / d y, (3, n)."""
    _, tip = _jacobians(c, w, y)
    last = len(c.kind) - 1
    own = slice(c.first[last] + 1, c.first[last + 1])
    m = own.stop - own.start
    tip[:, own] += np.vstack([-w.hq[last, :m], c.NL[last, :m], w.tilt[last] * c.SL[last, :m]])
    angle = np.arctan2(w.sin, w.cos).sum()
    cs, sn = np.cos(angle), np.sin(angle)
    return np.array([[cs, -sn, 0], [sn, cs, 0], [0, 0, 1.0]]) @ tip


def _jacobians(c: Chain, w: Work, y: np.ndarray) -> tuple[list[np.ndarray], np.ndarray]:
    """Hub velocities per unit of each unknown, (3, n) a link, in the hub's axes; and the same for the last tip, its own link
    rigid."""
    links, n = len(c.kind), len(y)
    outward(c, w, y, np.zeros(n))
    hubs = []
    attachment = np.zeros((3, n))
    for i in range(links):
        attachment[2 if c.kind[i] == REVOLUTE else 0, c.first[i]] += 1.0
        cs, sn = w.cos[i], w.sin[i]
        hub = np.array([[cs, sn, 0], [-sn, cs, 0], [0, 0, 1.0]]) @ attachment
        hubs.append(hub)
        rx, ry = w.place[i, :2]
        attachment = np.array([[1, 0, -ry], [0, 1, rx], [0, 0, 1.0]]) @ hub
        if i + 1 < links and c.kind[i + 1] != PRISMATIC:
            own = slice(c.first[i] + 1, c.first[i + 1])
            m = own.stop - own.start
            attachment[:, own] += np.vstack([-w.hq[i, :m], c.NL[i, :m], w.tilt[i] * c.SL[i, :m]])
    return hubs, attachment
