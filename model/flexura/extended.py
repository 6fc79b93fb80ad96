"""The extended assembly: one global mass matrix of the whole robot, from link matrices by an index map.

A link's matrix lives in (u, q_i): the velocity u = (vx, vy, omega) of its hub frame and its own elastic unknowns. The hub's
velocity depends on the joints and elastic unknowns of every link before it, u_i = U_i qd, so the link's matrix is scattered
into the rows of all of them, not only into those at a shared node: hence "extended" (dissertation, 2.4; `model/README.md`,
section 5).
"""

from __future__ import annotations

import numpy as np

from .chain import SLEEVE, Chain, Work
from .hubs import inertia_block
from .outward import outward


def mass_matrix(c: Chain, w: Work, y: np.ndarray) -> np.ndarray:
    """M(y) (n, n), symmetric positive definite: T = 1/2 qd^T M qd in the solver's coordinates."""
    hubs, _ = _jacobians(c, w, y)
    n = len(y)
    M = np.zeros((n, n))
    for i, hub in enumerate(hubs):
        e = c.first[i]
        own = slice(e + 1, c.first[i + 1])
        m = own.stop - own.start
        S0q, b, Jt = w.body[i, :3]
        Mrr = np.array([[c.mass[i], 0, -S0q], [0, c.mass[i], b], [-S0q, b, Jt]])
        scattered = hub.T @ w.terms[i, :m, :3].T
        M += hub.T @ Mrr @ hub
        M[:, own] += scattered
        M[own, :] += scattered.T
        M[e, e] += c.rotor[i]
        inertia_block(c, w, i)
        upper = np.triu(w.S[i, :m, :m])
        M[own, own] += upper + np.triu(upper, 1).T
        if c.kind[i] == SLEEVE:
            flowing = hub.T @ w.body[i, 6:9]
            M[:, e] += flowing
            M[e, :] += flowing
            M[e, e] += w.body[i, 9]
            M[own, e] += w.terms[i, :m, 7]
            M[e, own] += w.terms[i, :m, 7]
    return (M + M.T) / 2


def tip_jacobian(c: Chain, w: Work, y: np.ndarray) -> np.ndarray:
    """d (x, y, angle) of the last tip in the base frame / d y, (3, n)."""
    _, tip = _jacobians(c, w, y)
    angle = np.arctan2(w.sin, w.cos).sum()
    cs, sn = np.cos(angle), np.sin(angle)
    return np.array([[cs, -sn, 0], [sn, cs, 0], [0, 0, 1.0]]) @ tip


def _jacobians(c: Chain, w: Work, y: np.ndarray) -> tuple[list[np.ndarray], np.ndarray]:
    """Hub velocities per unit of each unknown, (3, n) a link, in the hub's axes; and the same for the last tip, in its link's."""
    n = len(y)
    outward(c, w, y, np.zeros(n))
    hubs = []
    attachment = np.zeros((3, n))
    for i in range(len(c.kind)):
        e = c.first[i]
        if c.kind[i] != SLEEVE:
            attachment[:, e] += w.slide[i]
        cs, sn = w.cos[i], w.sin[i]
        hub = np.array([[cs, sn, 0], [-sn, cs, 0], [0, 0, 1.0]]) @ attachment
        hubs.append(hub)
        rx, ry = w.place[i]
        attachment = np.array([[1, 0, -ry], [0, 1, rx], [0, 0, 1.0]]) @ hub
        own = slice(e + 1, c.first[i + 1])
        attachment[:, own] += w.terms[i, : own.stop - own.start, 4:7].T
        if c.kind[i] == SLEEVE:
            attachment[:, e] += w.flow[i]
    return hubs, attachment
