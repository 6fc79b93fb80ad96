"""A run of the dense equations through time: breaks, ticks, limits, outputs, and how it ends."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from ...control import DriveFunction, Sampled
from ...errors import numerical_failure
from ...io import STATIONS, Tables, interruption
from ...signals import Drive
from ...system import System
from ..problem import Problem, Progress, Solution
from ..recorder import limit_event, recorded_channels
from .equations import Equations
from .exponential import Exponential
from .weights import Weights

BEYOND = 1e-9  # m or rad that a joint is beyond a limit when it is found to be
CAUTION = {"explicit": 1.0, "implicit": 0.5, "exponential": 1.0}  # of the tolerance: that of a step
ROUND_OFF = (
    3e-14  # the relative tolerance of SciPy's methods, beside an absolute one for each number
)
LOOK = 8  # steps between two looks at the energy
# no step is longer than this part of a signal's period, or of a run under a caller's function
PART, LEAST_STEPS = 0.15, 100
TURNS = 2e4  # rad or decays of a rigid robot in a run, beyond which "auto" is implicit
TICKS = 10.6  # rad of the fastest mode in a tick, below which "auto" is explicit under a Sampled
STUCK = (
    "no step is short enough for rtol = {:g}; try another tolerance or method, look at gains "
    "and forces"
)


def solve(problem: Problem, progress: Progress = None) -> Solution:
    """Integrate the dense equations of a robot that is not `System.exact` and does not slide from
    node to node.

    Work, loss and strain energy are integrated beside the motion and under the same error control
    (27), (28). Methods are "explicit" (DOP853), "implicit" (Radau with the slope of the linear
    forces), "exponential" (`exponential`), or "auto", one of them.

    Args:
        problem: the initial value problem.
        progress: called with the finished fraction.

    Returns:
        The solution up to the end, a limit, an interruption, or where no step is short enough.
    """
    return Integration(problem, progress).run()


class Integration:
    """A run under way: the state z = (q, v, work, loss, rise of the strain energy) at the time
    `now`."""

    def __init__(self, problem: Problem, progress: Progress) -> None:
        system, t, drive, rtol, method = (
            problem.system,
            problem.t,
            problem.drive,
            problem.rtol,
            problem.method,
        )
        self.t, self.drive, self.rtol, self.progress = t, drive, rtol, progress
        self.loads = problem.loads
        self.ends, self.ended, self.budget = problem.ends, False, problem.budget
        self.ticks, marks, self.span = np.zeros(0), np.zeros(0), float(t[-1] - t[0])
        self.longest = (
            self.span / LEAST_STEPS
            if isinstance(drive, DriveFunction)
            or (isinstance(drive, Drive) and drive.has_functions)
            else np.inf
        )
        if isinstance(drive, Drive):
            marks, self.longest = drive.breaks, min(self.longest, PART * drive.shortest_period)
        elif isinstance(drive, Sampled):
            self.sampled = DriveFunction(
                drive.function, len(system.joint_rows), system, problem.loads
            )
            self.ticks = marks = (
                t[0] + np.arange(np.floor(self.span * drive.rate_Hz) + 1) / drive.rate_Hz
            )
        self.longest = min(self.longest, PART * self.loads.shortest_period)
        marks = np.concatenate([marks, self.loads.breaks])
        self.marks = [*np.unique(marks[(marks > t[0]) & (marks < t[-1])]), t[-1]]
        self.now, self.z = float(t[0]), np.concatenate([problem.q, problem.qd, np.zeros(3)])
        self.length: float | None = None  # of the last step
        self.steps, self.jumped = 0, 0.0
        self.found: list[
            tuple[Any, ...]
        ] = []  # rows: time, state, accounts, forces, what is seen, jumps so far
        self.events: list[dict[str, Any]] = []
        self.evaluations = 0  # by equations that are no longer used
        self.equations: Equations = None  # type: ignore[assignment]
        self.use(system)
        self.weights = Weights(system, rtol, self.z)
        self.asked, self.method = method, method

    def use(self, system: System) -> None:
        """Go on with a robot that has the same unknowns and the same drives.

        Args:
            system: the robot.
        """
        self.evaluations += self.equations.evaluations if self.equations else 0
        self.system, self.rows = system, system.joint_rows
        slides = [link.joint.type != "R" for link in system.robot.links]
        stops = np.isfinite(system.limits).any(axis=1) | slides
        self._bounded = [i for i in range(len(self.rows)) if stops[i] and not system.locked[i]]
        drive = None if isinstance(self.drive, Sampled) else self.drive
        self.equations = Equations(system, drive, self.loads)
        self.exponential = Exponential(self.equations, self.span, self.longest)

    def run(self) -> Solution:
        """The whole run."""
        begun, complete = time.perf_counter(), False
        self.late = begun + self.budget.wall_s
        try:
            with np.errstate(all="ignore"):
                self._arrive()
                self.method = self._method(self.asked)
                self._show(self.t[:1], lambda s: self.z)
                complete = len(self.t) == 1 or self._go()
        except KeyboardInterrupt:
            self.events.append(interruption(self.now))
        except Exception as error:
            why = numerical_failure(error)
            if why is None:
                raise
            text = f"the simulation got no further than t = {self.now:.6g} s: {why}"
            self.events.append({"t": self.now, "level": "ERROR", "name": "diverged", "text": text})
        meta = {
            "steps": self.steps,
            "evaluations": self.evaluations + self.equations.evaluations,
            "wall_s": time.perf_counter() - begun,
            "complete": complete,
            "max_steps": self.budget.steps,
            "events": self.events,
            "drive": self.drive.spec() if hasattr(self.drive, "spec") else "Python function",
            "rtol": self.rtol,
            "method": self.method,
        }
        return self.solution(meta)

    def solution(self, meta: Tables) -> Solution:
        """What was computed.

        Args:
            meta: of the Solution.

        Returns:
            The Solution up to here.
        """
        widths = (2 * self.system.n, 4, len(self.rows), len(recorded_channels(self.system.robot)))
        empty = [np.zeros(0), *(np.zeros((0, width)) for width in widths), np.zeros(0)]
        times, states, accounts, forces, seen, jumps = [
            np.array(part) for part in zip(*self.found, strict=True)
        ] or empty
        return Solution(times, states, accounts, forces, meta, seen, jumps)

    def bounds(self) -> np.ndarray:
        """Between which positions (N, 2) the joints may move."""
        return self.system.limits

    def crossed(self, joint: int, upwards: bool) -> bool:
        """What happens when a joint is beyond its bounds.

        Args:
            joint: its number, from 0.
            upwards: whether it passed the upper bound.

        Returns:
            False: the run ends.
        """
        self.events.append(
            limit_event(self.system, joint, self.now, self.position(self.now, self.z))
        )
        return False

    def position(self, t: float, z: np.ndarray) -> np.ndarray:
        """The joints' positions in a state.

        Args:
            t: time [s].
            z: state (2 n,).

        Returns:
            Positions (N,) [m or rad].
        """
        return self.equations.state(t, z)[0][self.rows]

    def energy(self) -> float:
        """Kinetic, strain and potential energy now [J]."""
        return sum(self.system.assembly.energies(*self.equations.state(self.now, self.z)[:2]))

    def _go(self) -> bool:
        """Go on to the end of the times; whether it is reached."""
        while self.marks:
            beyond = self._solve(float(self.marks[0]))
            if self.ended:
                return True
            if beyond is None:
                del self.marks[0]
                self._arrive()
            elif not (beyond and self.crossed(*beyond)):
                if self.now > self.found[-1][0]:
                    self._show([self.now], lambda s: self.z)
                return False
            else:
                self._arrive()
        return True

    def _arrive(self) -> None:
        """At the start of a stretch without breaks: signals are read up to its end; a sampled drive
        is asked, if it is time."""
        if self.marks:
            # a drive's value there belongs to what follows
            self.equations.until = np.nextafter(self.marks[0], -np.inf)
        if np.any(np.abs(self.ticks - self.now) <= 1e-12 * max(abs(self.now), 1e-3)):
            q, v, _ = self.equations.state(self.now, self.z)
            self.equations.held = (
                np.asarray(self.sampled.function(self.now, q, v))
                if self.sampled.of_state
                else self.sampled(
                    self.now, q[self.rows], v[self.rows], self.equations.deflection(q)
                )
            )

    def _solve(self, end: float) -> tuple[int, bool] | tuple[()] | None:
        """Steps to `end`: None; or to where a joint leaves its bounds: which, and whether upwards;
        () where no step is good."""
        far, *which = self._beyond(self.now, self.z)
        solver = self._solver(self.now, self.z, end)
        while far <= 0 and self.now < end:
            before, start = self.now, self.z
            try:
                solver.step()
            except np.linalg.LinAlgError:
                solver.status = "failed"
            if solver.status == "failed":
                if self.asked == "auto" and self.method == "exponential":
                    self.method = "implicit"
                    solver = self._solver(self.now, self.z, end)
                    continue
                text = (
                    f"the simulation got no further than t = {self.now:.6g} s: "
                    f"{STUCK.format(self.rtol)}"
                )
                self.events.append({"t": self.now, "level": "ERROR", "name": "stuck", "text": text})
                return ()
            self.steps += 1
            over = "exhausted" if self.steps >= self.budget.steps else "wall_time"
            late = over == "exhausted" or time.perf_counter() > self.late
            if late and solver.t < self.t[-1]:
                told = self.budget.event(over, self.now, self.method, self.steps, float(self.t[0]))
                self.events.append(told)
                return ()
            line, self.now, self.z, self.length = (
                solver.dense_output(),
                float(solver.t),
                solver.y,
                float(solver.step_size),
            )
            far, *which = self._left(line, before, start)
            self._show(self.t[(self.t > before) & (self.t <= self.now)], line)
            self.weights.grow(self.z, self.equations.energy())
            solver.atol = self._atol()
            if self.ends is not None and self.ends(
                np.array([row[0] for row in self.found]), np.array([row[1] for row in self.found])
            ):
                self.ended = True
                return None
            if self.progress is not None:
                self.progress((self.now - self.t[0]) / self.span)
        return (which[0], bool(which[1])) if far > 0 else None

    def _left(
        self, line: Callable[[float], np.ndarray], before: float, start: np.ndarray
    ) -> tuple[float, int, bool]:
        """`_beyond` after a step from `before`; where a joint has left its bounds in it, the run
        goes back to that instant."""
        from scipy.optimize import brentq

        looks = [self.now]
        if self._bounded and np.any(
            (start * self.z)[self.equations.n + self.rows[self._bounded]] < 0
        ):  # a joint turns round
            looks = np.linspace(before, self.now, 9)[1:].tolist()
        inside, found = before, self._beyond(self.now, self.z)
        for at in looks:
            far, joint, upwards = self._beyond(at, line(at)) if at < self.now else found
            if far > 0:
                beyond = lambda s: self._beyond(s, line(s))[0]
                if beyond(inside) < 0:
                    at = float(brentq(beyond, inside, at, xtol=1e-15 * max(abs(at), 1e-3)))
                self.now, self.z = at, self._again(before, start, at, line(at), self.rows[joint])
                return far, joint, upwards
            inside = at
        return found

    def _again(
        self, before: float, start: np.ndarray, at: float, near: np.ndarray, row: int
    ) -> np.ndarray:
        """The state at a time in the last step: `near` is interpolated. Steps of SciPy's methods
        lead there more sharply."""
        if self.method == "exponential" or at <= before:
            return near
        solver = self._solver(before, start, at)
        while solver.status == "running":
            solver.step()
        z = solver.y.copy()
        z[row] = near[row]  # as it was found
        return z

    def _beyond(self, t: float, z: np.ndarray) -> tuple[float, int, bool]:
        """How far a joint is beyond its bounds, or a slider in its link's sleeve; which joint, and
        whether upwards."""
        out = [(-np.inf, 0, False)]
        if not self._bounded:
            return out[0]
        x, bounds, moves = self.position(t, z), self.bounds(), ~self.system.locked
        for i in self._bounded:
            out += [
                (x[i] - bounds[i, 1] - BEYOND, i, True),
                (bounds[i, 0] - x[i] - BEYOND, i, False),
            ]
            link, under = self.system.robot.links[i], self.system.robot.links[i - 1]
            if (
                i
                and link.joint.type == "Pa"
                and under.joint.type == "Pb"
                and (moves[i] or moves[i - 1])
            ):
                out.append((under.length_m - x[i - 1] - x[i] - BEYOND, i, False))
        return max(out)

    def _solver(self, start: float, z: np.ndarray, end: float) -> Any:
        from scipy.integrate import DOP853, Radau

        if self.method == "exponential":
            self.exponential.begin(start, z, end, self._atol())
            return self.exponential
        first = None if self.length is None else min(self.length, end - start) or None
        keys = {
            "rtol": ROUND_OFF,
            "atol": self._atol(),
            "first_step": first,
            "max_step": self.longest,
        }
        if self.method == "explicit":
            return DOP853(self.equations.rates, start, z, end, **keys)
        return Radau(self.equations.rates, start, z, end, jac=self.equations.slope, **keys)

    def _atol(self) -> np.ndarray:
        """What the numbers of a state may be wrong by in a step, for the root of the mean square
        (82)."""
        return CAUTION[self.method] * self.weights.tolerance / np.sqrt(len(self.z))

    def _method(self, asked: str) -> str:
        """The method by its name in `METHODS`."""
        equations = self.equations
        if asked in ("explicit", "implicit"):
            return asked
        if asked == "exponential" or not len(equations.free):
            return "exponential" if len(equations.free) else "explicit"
        friction = [link.joint.coulomb_friction for link in self.system.robot.links]
        sticks = np.any(np.isin(self.rows[np.array(friction) > 0], equations.free))
        if len(self.system.elastic_rows) and sticks:
            return "implicit"
        equations.rates(self.now, self.z)
        M, K, D = equations.linear()
        slopes, m = np.linalg.solve(M, np.hstack([-K, -D])), len(M)
        fastest = float(np.abs(np.linalg.eigvals(np.vstack([np.eye(m, 2 * m, m), slopes]))).max())
        if not len(self.system.elastic_rows):
            return "implicit" if fastest * self.span > TURNS else "explicit"
        return (
            "explicit"
            if len(self.ticks) and fastest < TICKS * self.drive.rate_Hz
            else "exponential"
        )

    def _show(self, times: Any, line: Callable[[float], np.ndarray]) -> None:
        """Keep a row for each of the times, with the state from `line` or, now, that of the run."""
        for t in times:
            z = self.z if t == self.now else line(t)
            q, v, _ = self.equations.state(t, z)
            work, loss, strain = z[-3:]
            accounts, seen = (
                np.array([work, loss, 0.0, strain]),
                self.system.assembly.observe(q, v, STATIONS),
            )
            self.found.append(
                (
                    t,
                    np.concatenate([q, v]),
                    accounts,
                    self.equations.acted(t, z)[1],
                    seen,
                    self.jumped,
                )
            )
