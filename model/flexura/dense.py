"""Simulations of robots that the compiled core does not have: the dissertation's linear line (12), by SciPy.

They are slow. Each evaluation assembles the dense equations (19) in NumPy: a third of a millisecond for one link. The fast
modes of an undamped mesh bound the steps of an explicit method: a second of motion of 8 elements may take a minute. Few
elements, `modes` or the implicit method are quicker.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from .drive import Drive
from .errors import InputError
from .record import limit_event, record
from .run import STATIONS, Run
from .sampled import Sampled, as_function
from .system import System
from .system.assembly import COULOMB_RATE

BEYOND = 1e-9  # m or rad that a joint is beyond a limit when it is found to be
STRICT = 0.1  # of the tolerance that is asked for: that of a step
TURNS = 2e4  # rad of the fastest mode in a run, beyond which "auto" is implicit
STUCK = "no step is short enough for rtol = {:g}; try another tolerance or method, look at gains and forces"


def simulate(
    system: System, t: np.ndarray, drive: Any, q: np.ndarray, qd: np.ndarray, rtol: float, method: str,
    progress: Callable[[float], None] | None,
) -> Run:  # fmt: skip
    """`forward.simulate` for a robot that is not `System.exact` and does not slide from node to node.

    Work, loss and strain energy are integrated beside the motion and under the same error control (29), (30).

    Args: as checked in `forward`; drive: a Drive, a Sampled, or a function of four arguments; method: "explicit" (DOP853) or
        "implicit" (Radau with the slope of the linear forces); "auto" and "exponential" are one of them by the fastest mode.

    Returns: the Run up to the end, a limit, an interruption, or where no step is short enough.

    Raises: InputError: the drive is a Controller, which runs in the compiled core alone.
    """
    return Course(system, t, drive, q, qd, rtol, method, progress).run()


class Course:
    """A run under way: the state z = (q, v, work, loss, rise of the strain energy) at the time `now`."""

    def __init__(
        self, system: System, t: np.ndarray, drive: Any, q: np.ndarray, qd: np.ndarray, rtol: float, method: str,
        progress: Callable[[float], None] | None,
    ) -> None:  # fmt: skip
        self.system, self.t, self.drive, self.rtol, self.progress = system, t, drive, rtol, progress
        self.n, self.rows, joints = system.n, system.joint_rows, len(system.joint_rows)
        self.motions: list[Any] = [None] * joints
        self.ticks, marks = np.zeros(0), np.zeros(0)
        self.held: np.ndarray | None = None  # forces of a sampled drive since the last tick
        if isinstance(drive, Drive):
            self.motions = [j.motion if follows else None for j, follows in zip(drive.joints, drive.follows)]
            marks = drive.breaks
        elif isinstance(drive, Sampled):
            self.sampled = as_function(drive.function, joints)
            self.ticks = marks = t[0] + np.arange(np.floor((t[-1] - t[0]) * drive.rate_Hz) + 1) / drive.rate_Hz
        elif not callable(drive):
            expected = "expected a Drive, a Sampled or a function: a Controller runs in the compiled core, which lacks this robot"
            raise InputError(expected, key="drive", value=type(drive).__name__)
        self.marks = [*np.unique(marks[(marks > t[0]) & (marks < t[-1])]), t[-1]]
        self.given = np.array([i for i, motion in enumerate(self.motions) if motion is not None], dtype=int)
        self.now, self.until, self.z = float(t[0]), float(t[-1]), np.concatenate([q, qd, np.zeros(3)])
        self.length: float | None = None  # of the last step
        self.steps, self.evaluations, self.jumped = 0, 0, 0.0
        self.found: list[tuple[Any, ...]] = []  # rows: time, state, accounts, forces, what is seen, jumps so far
        self.events: list[dict[str, Any]] = []
        self.method = self._method(method)

    def run(self) -> Run:
        """The whole run."""
        begun, complete = time.perf_counter(), False
        try:
            self.until = np.nextafter(self.marks[0], -np.inf)
            self._tick()
            self._show(self.t[:1], lambda s: self.z)
            complete = len(self.t) == 1 or self._go()
        except KeyboardInterrupt:
            self.events.append({"t": self.now, "level": "WARN", "text": "interrupted"})
        meta = {
            "steps": self.steps, "evaluations": self.evaluations, "wall_s": time.perf_counter() - begun, "complete": complete,
            "events": self.events, "drive": self.drive.spec() if hasattr(self.drive, "spec") else "Python function",
            "rtol": self.rtol, "method": self.method,
        }  # fmt: skip
        return self.recorded(meta)

    def recorded(self, meta: dict[str, Any]) -> Run:
        """The Run of what was computed."""
        times, states, accounts, forces, seen, jumps = (np.array(part) for part in zip(*self.found, strict=True))
        return record(self.system, times, states, accounts, forces, meta, seen, jumps)

    def bounds(self) -> np.ndarray:
        """Between which positions (N, 2) the joints may move."""
        return self.system.limits

    def crossed(self, joint: int, upwards: bool) -> bool:
        """What a joint (from 0) beyond its bounds does: it ends the run (false)."""
        self.events.append(limit_event(self.system, joint, self.now, self.position(self.now, self.z)))
        return False

    def position(self, t: float, z: np.ndarray) -> np.ndarray:
        """The joints' positions (N,) at t in the state z."""
        out = z[self.rows]
        for i in self.given:
            out[i] = self.motions[i](t)[0]
        return out

    def energy(self) -> float:
        """Kinetic, strain and potential energy now [J]."""
        return sum(self.system.assembly.energies(*self._state(self.now, self.z)[:2]))

    def _go(self) -> bool:
        """Go on to the end of the times; whether it is reached."""
        while self.marks:
            self.until = np.nextafter(self.marks[0], -np.inf)  # a drive's value there belongs to what follows
            beyond = self._solve(float(self.marks[0]))
            if beyond is None:
                del self.marks[0]
                self._tick()
            elif not (beyond and self.crossed(*beyond)):
                if self.now > self.found[-1][0]:
                    self._show([self.now], lambda s: self.z)
                return False
        return True

    def _solve(self, end: float) -> tuple[int, bool] | tuple[()] | None:
        """Steps to `end`: None; or to where a joint leaves its bounds: which, and whether upwards; () where no step is good."""
        solver, (far, *which) = self._solver(self.now, self.z, end, self.length), self._beyond(self.now, self.z)
        while far <= 0 and solver.status == "running":
            before, start = self.now, self.z
            try:
                solver.step()
            except np.linalg.LinAlgError:
                solver.status = "failed"
            self.steps += 1
            if solver.status == "failed":
                text = f"the simulation got no further than t = {self.now:.6g} s: {STUCK.format(self.rtol)}"
                self.events.append({"t": self.now, "level": "ERROR", "text": text})
                return ()
            line, self.now, self.z, self.length = solver.dense_output(), float(solver.t), solver.y, solver.step_size
            far, *which = self._beyond(self.now, self.z)
            if far > 0:
                self.now = self._when(line, before, self.now)
                far, *which = 1.0, *self._beyond(self.now, line(self.now))[1:]
                self.z = self._again(before, start, line(self.now), self.rows[which[0]])
            self._show(self.t[(self.t > before) & (self.t <= self.now)], line)
            if self.progress is not None:
                self.progress((self.now - self.t[0]) / (self.t[-1] - self.t[0]))
        return (which[0], bool(which[1])) if far > 0 else None

    def _again(self, before: float, start: np.ndarray, near: np.ndarray, row: int) -> np.ndarray:
        """The state now by steps from `before`: `near` is interpolated. The row that ended the step is as it was found."""
        solver = self._solver(before, start, self.now, self.now - before)
        while solver.status == "running":
            solver.step()
        z = solver.y.copy()
        z[row] = near[row]
        return z

    def _when(self, line: Callable[[float], np.ndarray], before: float, after: float) -> float:
        """When a joint leaves its bounds between two times."""
        from scipy.optimize import brentq

        far = lambda s: self._beyond(s, line(s))[0]
        return before if far(before) >= 0 else float(brentq(far, before, after, xtol=1e-15 * max(abs(after), 1e-3)))

    def _beyond(self, t: float, z: np.ndarray) -> tuple[float, int, bool]:
        """How far a joint is beyond its bounds, or a slider in its link's sleeve; which joint, and whether upwards."""
        x, bounds, moves = self.position(t, z), self.bounds(), ~self.system.locked
        out = [(-np.inf, 0, False)]
        for i, link in enumerate(self.system.robot.links):
            if moves[i]:
                out += [(x[i] - bounds[i, 1] - BEYOND, i, True), (bounds[i, 0] - x[i] - BEYOND, i, False)]
            if i and link.joint.type == "Pa" and (under := self.system.robot.links[i - 1]).joint.type == "Pb":
                if moves[i] or moves[i - 1]:
                    out.append((under.length_m - x[i - 1] - x[i] - BEYOND, i, False))
        return max(out)

    def _tick(self) -> None:
        """Ask a sampled drive for its forces, if it is time."""
        if np.any(np.abs(self.ticks - self.now) <= 1e-12 * max(abs(self.now), 1e-3)):
            q, v, _ = self._state(self.now, self.z)
            self.held = self.sampled(self.now, q[self.rows], v[self.rows], self._deflection(q))

    def _deflection(self, q: np.ndarray) -> float:
        found = self.system.assembly.tip_deflections(q)
        return float(found[-1]) if len(found) else 0.0

    def _state(self, t: float, z: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """q, qd and the accelerations that are prescribed (n,), with the joints that follow a motion on it."""
        q, v, a = z[: self.n].copy(), z[self.n : 2 * self.n].copy(), np.zeros(self.n)
        for i in self.given:
            row = self.rows[i]
            q[row], v[row], a[row] = self.motions[i](min(t, self.until))
        return q, v, a

    def _acted(self, t: float, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """dz/dt, and the forces of the drives (N,), those that a motion needs included (19), (29), (30)."""
        q, v, a = self._state(t, z)
        self.evaluations += 1
        if self.held is not None:
            force = self.held.copy()
        elif isinstance(self.drive, Drive):
            force = self.drive(min(t, self.until), q[self.rows], v[self.rows])
        else:
            force = self.drive(t, q[self.rows], v[self.rows], self._deflection(q)).copy()
        terms = self.system.assembly.terms(q, v)
        lost = terms.damping @ v + self.system.assembly.coulomb(v)
        left = -terms.forces - terms.elastic - lost - terms.mass @ a
        left[self.rows] += force
        free = self._free
        a[free] = np.linalg.solve(terms.mass[np.ix_(free, free)], left[free])
        if len(self.given):
            row = self.rows[self.given]
            force[self.given] = (terms.mass @ a + terms.forces + terms.elastic + lost)[row]
        return np.concatenate([v, a, [force @ v[self.rows], v @ lost, terms.elastic @ v]]), force

    def _slope(self, t: float, z: np.ndarray) -> np.ndarray:
        """The slope of dz/dt by z, of the linear forces alone: Newton's matrix of the implicit method."""
        q, v, _ = self._state(t, z)
        terms, n, out = self.system.assembly.terms(q, v), self.n, np.zeros((len(z), len(z)))
        K, D = self.system.assembly.stiffness_blocks(q), terms.damping.copy()
        rest = np.array([link.joint.coulomb_friction for link in self.system.robot.links]) / COULOMB_RATE
        D[self.rows, self.rows] += rest * (1 - np.tanh(v[self.rows] / COULOMB_RATE) ** 2)
        out[2 * n + 1, n : 2 * n], out[2 * n + 2, :n], out[2 * n + 2, n : 2 * n] = 2 * terms.damping @ v, K @ v, terms.elastic
        if isinstance(self.drive, Drive):
            K[self.rows, self.rows] += self.drive.gains[:, 0]
            D[self.rows, self.rows] += self.drive.gains[:, 1]
        free = self._free
        slopes = -np.linalg.solve(terms.mass[np.ix_(free, free)], np.hstack([K[free], D[free]]))
        out[:n, n : 2 * n] = np.eye(n)
        out[n + free, : 2 * n] = slopes
        return out

    @property
    def _free(self) -> np.ndarray:
        """Rows whose accelerations are unknown."""
        if not len(self.given):
            return self.system.free_rows
        return np.setdiff1d(self.system.free_rows, self.rows[self.given])

    def _solver(self, start: float, z: np.ndarray, end: float, length: float | None) -> Any:
        from scipy.integrate import DOP853, Radau

        first = None if length is None else min(length, end - start) or None
        keys = {"rtol": max(STRICT * self.rtol, 3e-14), "atol": self._atol, "first_step": first}
        rates = lambda t, y: self._acted(t, y)[0]
        if self.method == "explicit":
            return DOP853(rates, start, z, end, **keys)
        return Radau(rates, start, z, end, jac=self._slope, **keys)

    def _method(self, method: str) -> str:
        """The method by its name in `METHODS`; sets what a step may err by where a number is small."""
        from scipy.linalg import eigh


        assembly, joints = self.system.assembly, self.system.robot.links
        unit = np.ones(self.n)
        M, reach = assembly.mass(self.z[: self.n]), max(sum(link.length_m for link in joints), 1e-3)
        for i, link in enumerate(joints):
            unit[self.rows[i]] = 1.0 if link.joint.type == "R" else reach
            for piece, own in zip(assembly.structure.links[i], assembly.structure.own[i]):
                unit[own] = 1 / np.maximum(np.abs(piece.B).max(axis=0), 1e-9)
        energy = 1e-2 * float(np.max(np.diag(M)[self.rows] * unit[self.rows] ** 2))
        self._atol = STRICT * self.rtol * np.concatenate([1e-2 * unit, 1e-1 * unit, np.full(3, max(energy, 1e-12))])
        free, elastic = self.system.free_rows, len(self.system.elastic_rows)
        if method in ("explicit", "implicit") or not elastic or not len(free):
            return "implicit" if method == "implicit" else "explicit"
        pick = np.ix_(free, free)
        squares = eigh(assembly.stiffness_blocks(self.z[: self.n])[pick], M[pick], eigvals_only=True)
        return "implicit" if np.sqrt(max(squares[-1], 0.0)) * (self.t[-1] - self.t[0]) > TURNS else "explicit"

    def _show(self, times: Any, line: Callable[[float], np.ndarray]) -> None:
        """Keep a row for each of the times, with the state from `line` or, now, that of the run."""
        for t in times:
            z = self.z if t == self.now else line(t)
            q, v, _ = self._state(t, z)
            work, loss, strain = z[2 * self.n :]
            accounts, seen = np.array([work, loss, 0.0, strain]), self.system.assembly.observe(q, v, STATIONS)
            self.found.append((t, np.concatenate([q, v]), accounts, self._acted(t, z)[1], seen, self.jumped))
