"""The law of nonlinear model predictive control, once a tick: estimate, linearise, solve, apply."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ... import core
from ...signals import Signal, evaluate_many
from ...system import static
from ..linear_quadratic.measurements import MeasuredLaw, Measurements
from .prediction import Prediction
from .quadratic_program import FREE, QuadraticProgram


@dataclass(frozen=True)
class Problem:
    """What a predictive controller minimises, and within which bounds.

    Attributes:
        T: length of a tick [s].
        h: lengths of the intervals ahead (N,) [s], the first a tick.
        weights: W (p, 2m): the cost is |W (x - x_r)|^2 h, and
        effort: |(u - u_r) / effort|^2 h for the forces (inputs,),
        end: (2m, 2m) with the last state's deviation as a quadratic form.
        limit: of the forces (inputs,) [N or N m].
        rows: (r, 2m), of the states of every interval, and
        bound: their limits (r,).
        process: covariance of what acts at the drives in a tick (inputs, inputs).
        noise: covariance of the measurements (p, p).
        covariance: of the first estimate (2m, 2m).
        spread: ticks over which the intervals are linearised and the program is condensed.
        price: of the square of what breaks a bound of `rows`.
    """

    T: float
    h: np.ndarray
    weights: np.ndarray
    effort: np.ndarray
    end: np.ndarray
    limit: np.ndarray
    rows: np.ndarray
    bound: np.ndarray
    process: np.ndarray
    noise: np.ndarray
    covariance: np.ndarray
    spread: int
    price: float


class NonlinearPredictive(MeasuredLaw):
    """Real-time iteration: one step of Newton's method a tick on the motion ahead (132).

    The program's matrices come from the linearised intervals; its vectors are new in every tick.
    With `spread` ticks a part of the intervals is linearised in each but the last of them, in which
    the matrices are made; until then those before are used.

    `failures` counts programs without a solution, at which the motion of the tick before goes on;
    `iterations` has those of the last program.
    """

    def __init__(
        self,
        prediction: Prediction,
        problem: Problem,
        measured: Measurements,
        C: np.ndarray,
        references: list[Signal],
        driven: list[int],
        q: np.ndarray,
    ) -> None:
        super().__init__(measured)
        self.prediction, self.problem, self.C = prediction, problem, C
        self.references, self.driven, self.links = references, driven, len(references)
        self.q = q
        N, m = len(problem.h), len(driven)
        self.failures, self.iterations = 0, 0
        self.program = QuadraticProgram(N * m, N * len(problem.rows), problem.price)
        root = np.sqrt(problem.h)
        self.ahead = np.cumsum(problem.h)
        self.W = root[:, None, None] * problem.weights
        values, vectors = np.linalg.eigh((problem.end + problem.end.T) / 2)
        self.end = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
        self.R = np.repeat(problem.h, m) * np.tile(1 / problem.effort**2, N)
        self.costs = self.W, self.end, problem.rows
        bounds = np.concatenate([np.tile(problem.limit, N), np.tile(problem.bound, N)])
        self.bounds = np.minimum(bounds, FREE)
        self.one = np.eye(C.shape[1])

    def tick(self, t: float, y: np.ndarray) -> np.ndarray:
        """One step of Newton's method (132).

        Args:
            t: the time [s].
            y: the measurements (p,).

        Returns:
            The forces (links,) [N or N m].
        """
        x = self._corrected(y)
        self._prepared()
        self._solved(t, x)
        self._predicted(x)
        force = np.zeros(self.links)
        force[self.driven] = self.u[0]
        self._shifted()
        return force

    def begin(self, position: np.ndarray) -> None:
        """Begin a run: the motion ahead is rest.

        Args:
            position: of the joints (links,) [m or rad].
        """
        p, N = self.prediction, len(self.problem.h)
        rest, hold = self._equilibrium(tuple(position))
        self.x, self.u = np.tile(rest, (N + 1, 1)), np.tile(hold, (N, 1))
        self.a = np.zeros((N, p.count))
        self.guess, self.S = rest.copy(), self.problem.covariance
        self.coming = self._steps(slice(None))
        self._condensed()
        self.turn = 0
        self.sampled: list[tuple[float, np.ndarray]] = []

    def _equilibrium(self, joints: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
        """The state (2m,) at rest with the joints somewhere, and the forces (inputs,) that hold."""
        system, p = self.prediction.system, self.prediction
        q = np.array(self.q)
        q[system.joint_rows] = joints
        if any(system.robot.gravity_m_s2):
            q = static(system, joints=list(joints))
        still = np.zeros(system.n)
        forces = np.asarray(system.equations.forces(q, still, still, True, True, True))
        x = np.concatenate([q[p.free], np.zeros(p.count)])
        return x, forces[system.joint_rows][self.driven]

    def _corrected(self, y: np.ndarray) -> np.ndarray:
        """Kalman's estimate from the measurements of a tick, its covariance with it (76)."""
        C, S = self.C, self.S
        gain = np.linalg.solve(C @ S @ C.T + self.problem.noise, C @ S).T
        left = self.one - gain @ C
        self.S = left @ S @ left.T + gain @ self.problem.noise @ gain.T
        return self.guess + gain @ (y - self.measured.at(self.prediction.full(self.guess)))

    def _steps(self, rows: slice) -> tuple[np.ndarray, ...]:
        """R, G, d of some intervals along the predicted motion (131)."""
        p, h = self.prediction, self.problem.h
        x, u = self.x[:-1], self.u
        R, G, d, self.a[rows] = p.steps(x[rows], u[rows], self.a[rows], h[rows])
        return R, G, d

    def _condensed(self) -> None:
        """The program's matrices, from the intervals as they are linearised now (132)."""
        self.known, self.coming = self.coming, tuple(part.copy() for part in self.coming)
        found = core.condensed_program(*self.known, *self.costs)
        self.H, self.A, self.by_force = (np.asarray(part) for part in found)
        self.H.flat[:: len(self.R) + 1] += self.R

    def _prepared(self) -> None:
        """A tick's share of the linearisation, and the interval in which it is itself."""
        N, spread = len(self.problem.h), self.problem.spread
        parts, part = max(spread - 1, 1), self.turn
        self.turn = (self.turn + 1) % spread
        if part < parts:
            rows = slice(part * N // parts, (part + 1) * N // parts)
            for old, new in zip(self.coming, self._steps(rows), strict=True):
                old[rows] = new
        if self.turn == 0:
            self._condensed()
        first = self.known if spread == 1 else self._steps(slice(0, 1))
        self.first = tuple(each[0] for each in first)

    def _solved(self, t: float, x: np.ndarray) -> None:
        """One step of Newton's method: the program about the predicted motion (132)."""
        problem, N, m = self.problem, len(self.problem.h), len(self.driven)
        wanted, hold = self._wanted(t)
        ahead, g, at = core.renewed_program(
            *self.known, *self.costs, self.by_force, x, self.u, wanted
        )
        g = g + self.R * (self.u - hold).ravel()
        about = np.concatenate([self.u.ravel(), at])
        low, high = -self.bounds - about, self.bounds - about
        U, solved, self.iterations = self.program.solve(self.H, g, self.A, low, high)
        if not solved:
            self.failures += 1
            return
        self.x[0] = x
        by_force = self.by_force.reshape(-1, len(U))
        self.x[1:] = ahead + (by_force @ U).reshape(ahead.shape)
        self.u = np.clip(self.u + U.reshape(N, m), -problem.limit, problem.limit)

    def _wanted(self, t: float) -> tuple[np.ndarray, np.ndarray]:
        """The states at the intervals' ends (N, 2m) and forces (N, inputs) to be near.

        The references of `spread` ticks are evaluated together.
        """
        p = self.prediction
        N, T = len(self.ahead), self.problem.T
        if not self.sampled or abs(self.sampled[0][0] - t) > 0.1 * T:
            ticks = t + T * np.arange(self.problem.spread)
            times = (ticks[:, None] + self.ahead).ravel()
            found = [evaluate_many(wave.segments, times) for wave in self.references]
            r = np.array(found).reshape(self.links, 2, len(ticks), N)
            self.sampled = [(float(at), r[:, :, k]) for k, at in enumerate(ticks)]
        _, now = self.sampled.pop(0)
        rest, hold = self._equilibrium_at(tuple(now[:, 0, -1].tolist()))
        wanted = np.tile(rest, (N, 1))
        wanted[:, p.joint_columns] = now[self.driven, 0].T
        wanted[:, p.count + p.joint_columns] = now[self.driven, 1].T
        return wanted, hold

    def _equilibrium_at(self, joints: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
        """The equilibrium at the end of what is ahead, kept while that does not change."""
        if getattr(self, "_at", None) != joints:
            self._at, self._found = joints, self._equilibrium(joints)
        return self._found

    def _predicted(self, x: np.ndarray) -> None:
        """The estimate of the next tick from this one and the forces, and its covariance (76)."""
        R, G, d = self.first
        self.guess = R @ x + G @ self.u[0] + d
        self.S = R @ self.S @ R.T + G @ self.problem.process @ G.T

    def _shifted(self) -> None:
        """The motion ahead as the next tick sees it, one tick later."""
        part = (self.problem.T / self.problem.h)[:, None]
        self.x[:-1] += part * (self.x[1:] - self.x[:-1])
        self.u[:-1] += part[:-1] * (self.u[1:] - self.u[:-1])
        self.a[:-1] += part[:-1] * (self.a[1:] - self.a[:-1])
