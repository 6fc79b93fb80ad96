"""The system: a robot assembled. Constant; the workspace of a solver is apart from it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .. import extended
from ..beam import LinkIntegrals, shape
from ..chain import SLEEVE, Chain, Work, workspace
from ..errors import InputError
from ..modes import eigh
from ..newton_euler import inverse
from ..outward import outward
from ..robot import Robot
from ..run import STATIONS


@dataclass(frozen=True)
class System:
    """A robot's equations M(q) qdd + bias(q, qd) + damping qd + elastic(q) + gravity(q) = F.

    q (n,) is numbered [eta_1, u_1, eta_2, u_2, ...]: each joint, then the elastic unknowns of its link: deflection [m] and
    slope [rad] of nodes 1 ... n_i, or, for a link with `modes`, mass-normalised modal coordinates [kg^(1/2) m]. `labels` says
    which is which. F has entries in the joints' rows. The solver works in modal coordinates y throughout, q = transform @ y
    (exact for a full mesh).
    """

    robot: Robot
    chain: Chain
    links: tuple[LinkIntegrals, ...]
    transform: np.ndarray
    to_solver: np.ndarray
    labels: tuple[str, ...]

    @property
    def n(self) -> int:
        return len(self.labels)

    @property
    def joint_rows(self) -> np.ndarray:
        """Rows of the joints in q, (links,)."""
        return self.chain.first[:-1]

    @cached_property
    def elastic_rows(self) -> np.ndarray:
        """Rows of the elastic unknowns in q."""
        return np.setdiff1d(np.arange(self.n), self.joint_rows)

    @cached_property
    def free_rows(self) -> np.ndarray:
        """Rows of q that can move: all but locked joints."""
        return np.setdiff1d(np.arange(self.n), self.joint_rows[self.chain.locked.astype(bool)])

    @cached_property
    def limits(self) -> np.ndarray:
        """Lower and upper limits of the joints (links, 2) [m or rad]: those of the file, and the ends of the links that slide."""
        return limits([self.robot])[0]

    @cached_property
    def spectrum(self) -> np.ndarray:
        """Natural frequencies at the start, joints free, gravity left out, ascending [rad/s]; [0]: nothing moves."""
        free, y = np.ix_(self.free_rows, self.free_rows), self.start()
        if y[self.free_rows].size == 0:
            return np.zeros(1)
        K = np.diag(self._diagonal(self.chain.lam, np.zeros(len(self.links))))
        values, _ = eigh(K[free][None], extended.mass_matrix(self.chain, self._work(), y)[free][None])
        return np.sqrt(np.maximum(values[0], 0.0))

    def start(self) -> np.ndarray:
        """The configuration at the start (n,): joints at their `start`, links straight."""
        q = np.zeros(self.n)
        q[self.joint_rows] = self.robot.start
        return q

    def mass(self, q: np.ndarray) -> np.ndarray:
        """M(q) (n, n) by the extended assembly."""
        M = extended.mass_matrix(self.chain, self._work(), self.to_solver @ self._check(q))
        return self.to_solver.T @ M @ self.to_solver

    def stiffness(self, q: np.ndarray | None = None) -> np.ndarray:
        """K (n, n), at the start (it depends on the free length of a sleeved link, on nothing else); with q the tangent stiffness
        there, d (elastic + gravity) / dq."""
        if q is None:
            self._check(self.start())
            K = np.diag(self._diagonal(self.chain.lam, np.zeros(len(self.links))))
        else:
            y, still = self.to_solver @ self._check(q), np.zeros(self.n)
            K = self.modal_stiffness + self.differences(lambda y: self.residual(y, still), y)
        return self.to_solver.T @ K @ self.to_solver

    @cached_property
    def modal_stiffness(self) -> np.ndarray:
        """The constant part of K (n, n) in the solver's coordinates, which `residual` leaves out: omega^2 of each link's own
        modes, 0 for links behind a sleeve."""
        fixed = np.where(self.chain.kind == SLEEVE, 0.0, 1.0)[:, None]
        return np.diag(self._diagonal(self.chain.lam * fixed, np.zeros(len(self.links))))

    @cached_property
    def damping(self) -> np.ndarray:
        """D (n, n) at the start: Rayleigh damping of the elastic unknowns and viscous friction of the joints."""
        return self.damping_at(self.start())

    def damping_at(self, q: np.ndarray) -> np.ndarray:
        """D (n, n) at q: it depends on the free length of a sleeved link, on nothing else."""
        c, w, y = self.chain, self._work(), self.to_solver @ self._check(q)
        D = np.diag(self._diagonal(c.damp, c.viscous))
        if SLEEVE in c.kind:
            outward(c, w, y, np.zeros(self.n))
        for i in np.flatnonzero(c.kind == SLEEVE):
            own = slice(c.first[i] + 1, c.first[i + 1])
            m = own.stop - own.start
            D[own, own] = c.alpha[i] * w.M[i, :m, :m] + c.beta[i] * w.K[i, :m, :m]
        return self.to_solver.T @ D @ self.to_solver

    def _diagonal(self, elastic: np.ndarray, joint: np.ndarray) -> np.ndarray:
        """A diagonal (n,) from its values per link (N, m) and per joint (N,)."""
        parts = [np.concatenate([[joint[i]], elastic[i, : len(info.S0)]]) for i, info in enumerate(self.links)]
        return np.concatenate(parts)

    def elastic(self, q: np.ndarray) -> np.ndarray:
        """Elastic forces (n,), on the left-hand side: K q, and with stiffening the strain energy's terms of higher order."""
        zero = np.zeros(self.n)
        return self._constant_stiffness @ self._check(q) + self._inverse(q, zero, zero, np.zeros(2))

    def gravity(self, q: np.ndarray) -> np.ndarray:
        """Generalised gravity forces (n,), on the left-hand side."""
        zero = np.zeros(self.n)
        return self._inverse(q, zero, zero, self.chain.gravity) - self._inverse(q, zero, zero, np.zeros(2))

    def bias(self, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
        """Coriolis and centrifugal forces (n,), on the left-hand side."""
        zero = np.zeros(self.n)
        return self._inverse(q, qd, zero, np.zeros(2)) - self._inverse(q, zero, zero, np.zeros(2))

    def forces(self, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
        """Generalised forces (n,) that the motion needs: the whole left-hand side (Coulomb friction left out), by
        Newton-Euler."""
        moving = self._inverse(q, qd, qdd, self.chain.gravity) + self.damping_at(q) @ np.asarray(qd)
        return moving + self._constant_stiffness @ np.asarray(q)

    @cached_property
    def _constant_stiffness(self) -> np.ndarray:
        return self.to_solver.T @ self.modal_stiffness @ self.to_solver

    def residual(self, y: np.ndarray, v: np.ndarray) -> np.ndarray:
        """bias + gravity and the strain energy's higher terms (n,), on the left-hand side, in the solver's coordinates."""
        out = np.zeros(self.n)
        inverse(self.chain, self._work(), y, v, np.zeros(self.n), self.chain.gravity, out)
        return out

    def differences(self, function: Callable[[np.ndarray], np.ndarray], y: np.ndarray, scale: float = 1.0) -> np.ndarray:
        """d function / dy (m, n) in the solver's coordinates; each step turns a link by about 1e-4 rad, times `scale`."""
        steep = stack([np.abs(info.slope_d1).max(axis=0, initial=0.0) for info in self.links])
        return jacobian(function, y, scale * 1e-4 / self._diagonal(steep, np.ones(len(self.links))))

    def _inverse(self, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray, gravity: np.ndarray) -> np.ndarray:
        out = np.zeros(self.n)
        y, v, a = (self.to_solver @ self._check(z) for z in (q, qd, qdd))
        inverse(self.chain, self._work(), y, v, a, gravity, out)
        return self.to_solver.T @ out

    def _check(self, q: np.ndarray) -> np.ndarray:
        if self.robot.nodal:
            text = 'expected "continuous": sliding from node to node has other matrices between every two nodes'
            raise InputError(text, key="sliding", value="nodal")
        q = np.asarray(q, dtype=float)
        if q.shape != (self.n,):
            raise InputError(f"expected an array of shape ({self.n},), in the order of system.labels", key="q", value=q.shape)
        return q

    def _work(self) -> Work:
        return workspace(self.chain)

    def deflections(self, link: int, y: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """The deflection [m] at the places where a Run holds it, (STATIONS, T), of states y (T, m) of a link (from 0) and
        positions eta (T,) of its joint: 0 for what is inside or behind a sleeve."""
        info, elements = self.links[link], self.robot.links[link].elements
        x = np.linspace(0, info.length, STATIONS)
        if self.chain.kind[link] != SLEEVE:
            return shape(info.length, elements, x).T @ info.basis @ y.T
        out = np.zeros((STATIONS, len(eta)))
        for k in range(1, STATIONS):
            ahead = np.maximum(x[k] - info.length + eta, 0.0) / eta  # xi
            out[k] = np.einsum("kt,kt->t", shape(info.length, elements, ahead * info.length), info.basis @ y.T)
        return out


def limits(robots: Sequence[Robot]) -> np.ndarray:
    """`System.limits` of robots with equally many links, (B, links, 2)."""
    endless = (-np.inf, np.inf)
    own = np.array([[link.joint.limits or endless for link in robot.links] for robot in robots])
    ends = np.array([[robot.travel(i) for i in range(len(robot.links))] for robot in robots])
    return np.stack([np.maximum(own[..., 0], ends[..., 0]), np.minimum(own[..., 1], ends[..., 1])], axis=-1)


def jacobian(function: Callable[[np.ndarray], np.ndarray], x: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """d function / d x, (m, n), by central differences with the given steps (n,)."""
    shifts = np.diag(steps)
    return np.column_stack([(function(x + e) - function(x - e)) / (2 * h) for e, h in zip(shifts, steps, strict=True)])


def stack(arrays: list[np.ndarray], empty: float = 0.0) -> np.ndarray:
    """Arrays of the links as one, padded to the largest."""
    shape_ = np.max([a.shape for a in arrays], axis=0)
    out = np.full((len(arrays), *shape_), empty)
    for target, a in zip(out, arrays, strict=True):
        target[tuple(slice(k) for k in a.shape)] = a
    return out
