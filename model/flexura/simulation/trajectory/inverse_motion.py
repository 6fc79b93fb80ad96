"""The motion of a whole robot whose tip follows a path: a boundary value problem, by Newton's
method on the nonlinear equations."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from ...errors import FlexuraError
from ...system import System
from .collocation import POINTS, Band, Mesh
from .posture import postures
from .tip_output import TipPath
from .zero_dynamics import ZeroDynamics, zero_dynamics

MOST = 30  # steps of Newton's method on one mesh
CLOSE = 1e-9  # rad or m: a step that small is the last
STALLED = 1e-6  # rad or m: steps below that no longer shrink are round-off
LEAST = 0.1  # share of a step; below it Newton's method is given up


@dataclass(frozen=True)
class Rest:
    """A posture q (n,) at rest with the tip on the path, and the zero dynamics about it."""

    q: np.ndarray
    zeros: ZeroDynamics


@dataclass(frozen=True)
class TipMotion:
    """A motion as coefficients (count, n) on a mesh, and how many steps of Newton's method it
    took."""

    mesh: Mesh
    coefficients: np.ndarray
    iterations: int


class TipProblem:
    """Elastic rows of (25) and the tip on its path, at the points of Gauss; at both ends what would
    grow is 0 (116)."""

    def __init__(self, system: System, path: TipPath) -> None:
        self.system, self.path = system, path
        self.elastic = system.elastic_rows
        self.free = system.joint_rows[~system.locked]
        self.locked = system.joint_rows[system.locked]

    def rest(self, t: float, q: np.ndarray) -> Rest:
        """The robot at rest with its tip where the path is at t, found from q (n,) on."""
        at = postures(self.system, self.path, self.path.at(np.array([t])), q)[0]
        zero = np.zeros((1, self.system.n))
        _, K, G, M, tip, slope = self.system.equations.force_derivatives(at[None], zero, zero)
        output = self.path.deviation(tip, slope, self.path.at(np.array([t])))[1][0]
        try:
            return Rest(at, zero_dynamics(M[0], G[0], K[0], output, self.elastic, self.free))
        except np.linalg.LinAlgError:
            raise FlexuraError(
                f"at t = {t:.6g} s the joints cannot move the tip in every direction: a singular "
                f"posture"
            ) from None

    def along(self, times: np.ndarray, start: np.ndarray) -> np.ndarray:
        """Postures (T, n) with the tip on the path at times (T,), from q (n,) on."""
        places = self.path.at(times)
        moving = np.append(True, np.abs(np.diff(places, axis=0)).max(axis=1) > 0)
        found = postures(self.system, self.path, places[moving], start)
        return np.asarray(found[np.cumsum(moving) - 1])

    def slow(self, mesh: Mesh, start: np.ndarray) -> np.ndarray:
        """Coefficients of the motion without inertia: postures along the path, from q (n,) on."""
        t = np.concatenate([mesh.nodes[:1], mesh.t, mesh.nodes[-1:]])
        q = self.along(t, start)
        return mesh.through(q[1:-1], q[[0, -1]])

    def solve(self, mesh: Mesh, first: np.ndarray, start: Rest, end: Rest) -> TipMotion | None:
        """Newton's method from coefficients `first` (count, n) on; steps that overshoot are halved.
        None where it does not converge."""
        wanted = self.path.at(mesh.t)
        c, before, share, kept = first, np.inf, 1.0, (first, np.zeros_like(first))
        for count in range(1, MOST + 1):
            try:
                with np.errstate(over="ignore", invalid="ignore"):  # what overshoots is halved
                    step = self._step(mesh, c, wanted, start, end)
            except np.linalg.LinAlgError:
                step = np.full_like(c, np.nan)
            size = float(np.abs(step).max())
            if size < CLOSE or (before < STALLED and size > before / 4):
                return TipMotion(mesh, c - step, count)
            if not size <= 2 * before:
                share /= 2
                if share < LEAST:
                    break
                c = kept[0] - share * kept[1]
                continue
            kept, before = (c, step), size
            share = min(1.0, 2 * share)
            c = c - share * step
        return None

    def correction(self, motion: TipMotion, start: Rest, end: Rest, off: np.ndarray) -> np.ndarray:
        """The change of the coefficients (count, n) that takes deviations of the tip away, to first
        order.

        Args: off (T + 1, m): measured on another model, at the points of Gauss and at the end. Of
        what is measured where the motion begins nothing is taken: there the robot is at rest.
        """
        mesh, n = motion.mesh, self.system.n
        wanted = self.path.at(mesh.t)
        band, left = self._linear(mesh, motion.coefficients, wanted, start, end)
        begun = (mesh.t - mesh.nodes[0]) / (0.3 * (self.path.start - mesh.nodes[0]))
        share = np.clip(begun, 0.0, 1.0)
        body = np.zeros((len(mesh.t), n))
        body[:, self.free] = (share**3 * (10 - 15 * share + 6 * share**2))[:, None] * off[:-1]
        right = np.zeros_like(left)
        before = len(start.zeros.decaying) + len(self.system.joint_rows)
        right[before : before + body.size] = body.ravel()
        last = before + body.size + len(end.zeros.growing)
        right[last : last + off.shape[1]] = off[-1]
        return band.solve(right).reshape(-1, n)

    def _step(
        self, mesh: Mesh, c: np.ndarray, wanted: np.ndarray, start: Rest, end: Rest
    ) -> np.ndarray:
        band, left = self._linear(mesh, c, wanted, start, end)
        return band.solve(left).reshape(c.shape)

    def _linear(
        self, mesh: Mesh, c: np.ndarray, wanted: np.ndarray, start: Rest, end: Rest
    ) -> tuple[Band, np.ndarray]:
        """The matrix of Newton's method, and what must become 0."""
        system, n = self.system, self.system.n
        q, v, a = mesh.here(c)
        force, K, G, M, tip, slope = system.equations.force_derivatives(q, v, a)
        off, by_q = self.path.deviation(tip, slope, wanted)
        K[:, self.free], force[:, self.free] = by_q, off
        for part in (G, M):
            part[:, system.joint_rows] = 0.0
        if len(self.locked):
            K[:, self.locked] = np.eye(n)[self.locked]
            force[:, self.locked] = q[:, self.locked] - start.q[self.locked]
        sides, left = [], []
        for k, (rest, growing) in enumerate(((start, False), (end, True))):
            rows, values = self._side(mesh, c, rest, k, growing)
            sides.append(rows)
            left.append(values)
        band = mesh.band([K, G, M], *sides)
        return band, np.concatenate([left[0], force.ravel(), left[1]])

    def _side(
        self, mesh: Mesh, c: np.ndarray, rest: Rest, k: int, growing: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        """Rows and values of what must be 0 at the first (k = 0) or last (1) node."""
        n, count = self.system.n, len(self.elastic)
        values = mesh.ends[:, k]
        own = c[: POINTS + 2] if k == 0 else c[-(POINTS + 2) :]
        q, v = values[0] @ own, values[1] @ own
        bounded = rest.zeros.growing if growing else rest.zeros.decaying
        by_q, by_v = np.zeros((len(bounded), n)), np.zeros((len(bounded), n))
        by_q[:, self.elastic], by_v[:, self.elastic] = bounded[:, :count], bounded[:, count:]
        left = by_q @ (q - rest.q) + by_v @ v
        zero = np.zeros((1, n))
        _, _, _, _, tip, slope = self.system.equations.force_derivatives(q[None], zero, zero)
        off, tip_by_q = self.path.deviation(tip, slope, self.path.at(mesh.nodes[[-1 * k]]))
        fixed = np.eye(n)[self.locked]
        rows = np.vstack([by_q, tip_by_q[0], fixed])
        rates = np.vstack([by_v, np.zeros((len(rows) - len(by_v), n))])
        both = values[0][:, None] * rows[:, None, :] + values[1][:, None] * rates[:, None, :]
        gone = (q - rest.q)[self.locked]
        return both.reshape(len(rows), -1), np.concatenate([left, off[0], gone])


def mesh_between(start: float, end: float, breaks: np.ndarray, step: float) -> Mesh:
    """A mesh of steps of at most `step` [s] with nodes at all breaks."""
    inside = breaks[(breaks > start) & (breaks < end)]
    marks = np.unique(np.concatenate([[start], inside, [end]]))
    marks = marks[np.append(True, np.diff(marks) > 1e-9 * (end - start))]
    parts: list[Any] = [
        np.linspace(a, b, int(np.ceil((b - a) / step - 1e-9)) + 1)[:-1] for a, b in pairwise(marks)
    ]
    return Mesh(np.append(np.concatenate(parts), end))
