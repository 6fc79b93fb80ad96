"""Small changes of a motion: the equations of motion linearised along it, and integrated for many
changes at once.

About a motion q(t), M dq'' + G dq' + K dq = f (118), with the exact derivatives of the forces by
the core's dual numbers. Steps are those of Radau IIA of three stages, order 5: what is stiff fades.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...system import System

_ROOT = np.sqrt(6.0)
STAGES = np.array([(4 - _ROOT) / 10, (4 + _ROOT) / 10, 1.0])
# of Butcher's table; its last row gives the end of the step
TABLE = np.array(
    [
        [(88 - 7 * _ROOT) / 360, (296 - 169 * _ROOT) / 1800, (-2 + 3 * _ROOT) / 225],
        [(296 + 169 * _ROOT) / 1800, (88 + 7 * _ROOT) / 360, (-2 - 3 * _ROOT) / 225],
        [(16 - _ROOT) / 36, (16 + _ROOT) / 36, 1 / 9],
    ]
)
TWICE = TABLE @ TABLE


def stage_times(nodes: np.ndarray) -> np.ndarray:
    """The times of all stages (3 N,) of steps between nodes (N + 1,) [s]."""
    return np.asarray((nodes[:-1, None] + np.diff(nodes)[:, None] * STAGES).ravel())


@dataclass(frozen=True)
class Variation:
    """The linearised equations along a motion, at the stages of steps between `nodes` (N + 1,).

    `force` (3 N, n), `K`, `G`, `M` (3 N, n, n): the forces of the motion and their derivatives by
    q, q' and q''; `tip` (3 N, 2) and `tip_by_q` (3 N, 2, n). `rows`: those of q that are unknown.
    """

    nodes: np.ndarray
    force: np.ndarray
    K: np.ndarray
    G: np.ndarray
    M: np.ndarray
    tip: np.ndarray
    tip_by_q: np.ndarray
    rows: np.ndarray

    @cached_property
    def _matrices(self) -> np.ndarray:
        """Of each step's stage accelerations (N, 3 r, 3 r)."""
        count, r = len(self.nodes) - 1, len(self.rows)
        h = np.diff(self.nodes)
        pick = np.ix_(np.arange(3 * count), self.rows, self.rows)
        M, G, K = (x[pick].reshape(count, 3, r, r) for x in (self.M, self.G, self.K))
        out = np.zeros((count, 3, r, 3, r))
        for i in range(3):
            for k in range(3):
                out[:, i, :, k] = (
                    h[:, None, None] * TABLE[i, k] * G[:, i]
                    + (h * h)[:, None, None] * TWICE[i, k] * K[:, i]
                    + (M[:, i] if i == k else 0.0)
                )
        return out.reshape(count, 3 * r, 3 * r)

    def integrate(self, f: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Changes dq and dq' (3 N, r, P) at the stages, from none at the start, under f
        (3 N, r, P) in the rows."""
        h, r, P = np.diff(self.nodes), len(self.rows), f.shape[2]
        pick = np.ix_(np.arange(len(f)), self.rows, self.rows)
        G, K = self.G[pick], self.K[pick]
        x, v = np.zeros((r, P)), np.zeros((r, P))
        places, rates = np.zeros_like(f), np.zeros_like(f)
        for step, length in enumerate(h):
            own = slice(3 * step, 3 * step + 3)
            before = x + (STAGES * length)[:, None, None] * v
            left = f[own] - G[own] @ v - K[own] @ before
            a = np.linalg.solve(self._matrices[step], left.reshape(3 * r, P)).reshape(3, r, P)
            rates[own] = v + length * np.einsum("ik,krp->irp", TABLE, a)
            places[own] = before + length**2 * np.einsum("ik,krp->irp", TWICE, a)
            x, v = places[own][-1], rates[own][-1]
        return places, rates

    def transitions(self, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How each step's end depends on its start and on its forces.

        Args:
            force: columns of forces at a step's stages (N, 3, r, k).

        Returns:
            Derivatives of (dq, dq') at the step's end by those at its start (N, 2 r, 2 r), and by
            the columns (N, 2 r, k).
        """
        N, r = len(self.nodes) - 1, len(self.rows)
        h = np.diff(self.nodes)[:, None, None, None]
        pick = np.ix_(np.arange(3 * N), self.rows, self.rows)
        G, K = (x[pick].reshape(N, 3, r, r) for x in (self.G, self.K))
        left = np.concatenate([-K, -G - STAGES[:, None, None] * h * K, force], axis=3)
        a = np.linalg.solve(self._matrices, left.reshape(N, 3 * r, -1)).reshape(N, 3, r, -1)
        rates = h[:, 0] * np.einsum("k,nkrp->nrp", TABLE[2], a)
        places = h[:, 0] ** 2 * np.einsum("k,nkrp->nrp", TWICE[2], a)
        out = np.concatenate([places, rates], axis=1)
        diagonal = np.arange(r)
        out[:, diagonal, diagonal] += 1.0
        out[:, diagonal, r + diagonal] += h[:, 0, :, 0]
        out[:, r + diagonal, r + diagonal] += 1.0
        return out[:, :, : 2 * r], out[:, :, 2 * r :]


def variation(
    system: System, nodes: np.ndarray, q: np.ndarray, v: np.ndarray, a: np.ndarray, rows: np.ndarray
) -> Variation:
    """The linearised equations along a motion q, v, a (3 N, n) at the stages."""
    force, K, G, M, tip, tip_by_q = system.equations.force_derivatives(q, v, a)
    return Variation(nodes, force, K, G, M, tip, tip_by_q, rows)


def elastic_accelerations(
    system: System, q: np.ndarray, v: np.ndarray, joints: np.ndarray
) -> np.ndarray:
    """All accelerations (T, n) of motions q, v (T, n) whose joints have the accelerations `joints`
    (T, links)."""
    a = np.zeros_like(q)
    a[:, system.joint_rows] = joints
    elastic = system.elastic_rows
    if len(elastic):
        force, _, _, M, _, _ = system.equations.force_derivatives(q, v, a)
        pick = np.ix_(np.arange(len(q)), elastic, elastic)
        a[:, elastic] = -np.linalg.solve(M[pick], force[:, elastic, None])[:, :, 0]
    return a
