"""Motions from rest to rest in the least time, by a sequence of linear programs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...errors import FlexuraError
from ...signals import COLUMNS, Drive, Signal
from ...system import System
from ..dynamics import simulate
from .variation import stage_times, variation

STEPS = 8  # linear programs for one time, at most
LONGER = 12  # times by which the first guess may be too short
RTOL, METHOD = 1e-9, "implicit"
SUBSTEPS = 3  # of each interval, for derivatives
SETTLED = 1.5e-3  # of the time: how near to the least it comes
MET = 2e-4  # of the reference: what is left of the motion where nothing is to remain
NEAR = 1e-4  # what a change of all drives by their limit costs, in shares missed
MODES = 5  # that bend the robot and are brought to rest
RESOLVED = 1.6  # rad: a mode turns by less in an interval
SIDES = 16  # of the polygon in which a mode's state must end


@dataclass(frozen=True)
class Limits:
    """Largest drives and speeds of joints (links,) and deflection of tips [m]; infinity: none."""

    drive: np.ndarray
    speed: np.ndarray
    deflection_m: float


@dataclass(frozen=True)
class Plant:
    """A robot that a motion takes from `start` to `end` (n,), both at rest; `left`: how large the
    amplitude of a mode may be at the end, relative to `reference` (modes,) [m rad/s scaled]."""

    system: System
    start: np.ndarray
    end: np.ndarray
    left: float

    @cached_property
    def modes(self) -> tuple[np.ndarray, np.ndarray]:
        """omega (k,) [rad/s] ascending and X^T M (k, n) of the free robot at its end."""
        from scipy.linalg import eigh

        system, rows = self.system, self.system.free_rows
        pick = np.ix_(rows, rows)
        M, K = system.mass(self.end)[pick], system.tangent(self.end)[pick]
        squares, X = eigh((K + K.T) / 2, M)
        into = np.zeros((len(rows), system.n))
        into[:, rows] = X.T @ M
        omega = np.sqrt(np.maximum(squares, 0.0))
        omega[: len(rows) - len(system.elastic_rows)] *= float(any(system.robot.gravity_m_s2))
        return omega, into

    @cached_property
    def hold(self) -> tuple[np.ndarray, np.ndarray]:
        """The drives (links,) that hold the robot at its start and at its end."""
        rest, rows = np.zeros(self.system.n), self.system.joint_rows
        return (
            self.system.forces(self.start, rest, rest)[rows],
            self.system.forces(self.end, rest, rest)[rows],
        )


@dataclass(frozen=True)
class Answer:
    """What a plant does under drives: its state at the end (2 n,) and the derivative by the drives'
    nodes (2 n, P); speeds and tip deflections at the nodes, and theirs."""

    end: np.ndarray
    slope: np.ndarray
    speed: np.ndarray
    speed_slope: np.ndarray
    bend: np.ndarray
    bend_slope: np.ndarray


def linear_drive(times: np.ndarray, values: np.ndarray) -> Signal:
    """A drive that is linear between values (m + 1,) at times (m + 1,) [s], and stays at its last
    value."""
    rows = np.zeros((len(times), COLUMNS))
    rows[:, 0], rows[:, 1] = times, values
    rows[:-1, 2] = np.diff(values) / np.diff(times)
    return Signal(rows, {"kind": "drive"})


def answer(plant: Plant, u: np.ndarray, T: float, free: np.ndarray, bends: bool) -> Answer | None:
    """What a plant does under drives u (m + 1, links) in the time T; None where it cannot run.

    Args: free: the joints that move; bends: whether deflections are asked for.
    """
    system, m = plant.system, len(u) - 1
    nodes, fine = np.linspace(0.0, T, m + 1), np.linspace(0.0, T, SUBSTEPS * m + 1)
    t = stage_times(fine)
    drive = Drive.force(*(linear_drive(nodes, column) for column in u.T))
    run = simulate(system, np.append(0.0, t), drive, plant.start, rtol=RTOL, method=METHOD)
    if len(run) <= len(t) or run.states is None or not np.isfinite(run.states).all():
        return None
    n, rows = system.n, system.free_rows
    q, v = (np.ascontiguousarray(x) for x in (run.states[1:, :n], run.states[1:, n:]))
    force = np.zeros((len(t), n))
    force[:, system.joint_rows] = np.column_stack([np.interp(t, nodes, column) for column in u.T])
    a = np.array([system.accelerations(*x) for x in zip(q, v, force, strict=True)])
    along = variation(system, fine, q, v, a, rows)
    hats = np.column_stack([np.interp(t, nodes, e) for e in np.eye(m + 1)[1:-1]])  # (3 m, m - 1)
    f = np.zeros((len(t), n, (m - 1) * len(free)))
    for k, joint in enumerate(free):
        f[:, system.joint_rows[joint], k * (m - 1) : (k + 1) * (m - 1)] = hats
    places, rates = along.integrate(f[:, rows])
    at = slice(3 * SUBSTEPS - 1, None, 3 * SUBSTEPS)  # the last stage of each interval is its end
    slope = np.zeros((2 * n, f.shape[2]))
    slope[rows], slope[n + rows] = places[-1], rates[-1]
    index = np.searchsorted(rows, system.joint_rows[free])
    bend, bend_slope = (
        _deflections(system, q[at], rows, places[at])
        if bends
        else (np.zeros((m, 0)), np.zeros((m, 0, f.shape[2])))
    )
    return Answer(
        np.concatenate([q[-1], v[-1]]),
        slope,
        v[at][:, system.joint_rows[free]],
        rates[at][:, index],
        bend,
        bend_slope,
    )


def _deflections(
    system: System, q: np.ndarray, rows: np.ndarray, places: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Tip deflections (m, k) at q (m, n) and their change under changes of q (m, r, P)."""
    found, slopes = [], []
    for at, change in zip(q, places, strict=True):
        bends = system.places(at)[0]
        jacobian = np.zeros((len(bends), len(rows)))
        for k, row in enumerate(rows):
            if row in system.joint_rows:
                continue
            up, down = at.copy(), at.copy()
            up[row] += 1e-6
            down[row] -= 1e-6
            jacobian[:, k] = (system.places(up)[0] - system.places(down)[0]) / 2e-6
        found.append(bends)
        slopes.append(jacobian @ change)
    return np.array(found), np.array(slopes)


class ShortestMotion:
    """The sequence of linear programs (120): least T over drives u that are linear in `m` equal
    intervals, so that every plant ends at rest."""

    def __init__(self, plants: list[Plant], limits: Limits, m: int) -> None:
        self.plants, self.limits, self.m = plants, limits, m
        self.free = np.flatnonzero(~plants[0].system.locked)
        self.bound = limits.drive[self.free]
        self.programs = 0

    def residuals(self, plant: Plant, found: Answer, T: float) -> tuple[np.ndarray, np.ndarray]:
        """What must be 0 or small at a plant's end, (r,) in shares of what is let through or of the
        way, and its derivative (r, P)."""
        system, n = plant.system, plant.system.n
        omega, into = plant.modes
        joints = len(system.free_rows) - len(system.elastic_rows)
        away = np.concatenate([found.end[:n] - plant.end, found.end[n:]])
        way = np.abs(into[:joints] @ (plant.end - plant.start)).max()
        rows, values = [], []
        for k in range(min(joints + MODES, len(omega))):
            if k >= joints and omega[k] * T / self.m > RESOLVED:
                break
            pace = omega[k] if k >= joints else 1.0 / T
            place = np.concatenate([pace * into[k], np.zeros(n)])
            rate = np.concatenate([np.zeros(n), into[k]])
            size = way / T if k < joints else self.reference(plant, k)
            for row in (place, rate):
                rows.append(row @ found.slope / size)
                values.append(row @ away / size)
        return np.array(values), np.array(rows)

    def reference(self, plant: Plant, k: int) -> float:
        """The rate of mode k's coordinate after a step of the largest drives."""
        omega, into = plant.modes
        system = plant.system
        # X^T M = into, hence X^T = into M^-1 in the free rows
        rows = system.free_rows
        M = system.mass(plant.end)[np.ix_(rows, rows)]
        X = np.linalg.solve(M, into[k][rows])
        own = X[np.searchsorted(rows, system.joint_rows[self.free])]
        return float(np.abs(own) @ self.bound / omega[k])

    def solve(self, u: np.ndarray, T: float) -> tuple[np.ndarray, float, int]:
        """Drives (m + 1, links), time and the number of programs, from a first guess on.

        The time is halved in, between one that is too short and one that is long enough.

        Raises: FlexuraError: no motion was found that keeps the limits and ends at rest.
        """
        self.programs = 0
        for _ in range(LONGER):
            good = self._in_time(u, T)
            if good is not None:
                break
            T *= 1.15
        if good is None:
            raise FlexuraError(
                "no motion was found that keeps the limits and ends at rest: expected higher limits"
            )
        short, long = 0.0, T
        while long - short > SETTLED * long:
            middle = (short + long) / 2 if short else 0.9 * long
            tried = self._in_time(good, middle)
            if tried is None:
                short = middle
            else:
                good, long = tried, middle
        return good, long, self.programs

    def _in_time(self, u: np.ndarray, T: float) -> np.ndarray | None:
        """Drives for a motion in the time T, or None: linear programs, each about the motion under
        the drives of the one before."""
        before = np.inf
        for k in range(STEPS):
            found = self._answers(u, T)
            if found is None:
                return None
            missed = self._missed(found, T)
            if missed < MET:
                return u
            if k and missed > 0.7 * before:
                return None
            before = missed
            change, slack = self._program(found, u, T)
            self.programs += 1
            if k and slack > 3 * MET:
                return None
            u = u.copy()
            u[1:-1, self.free] += change.reshape(len(self.free), self.m - 1).T
        return None

    def _answers(self, u: np.ndarray, T: float) -> list[Answer] | None:
        out = []
        for plant in self.plants:
            one = answer(plant, u, T, self.free, bool(np.isfinite(self.limits.deflection_m)))
            if one is None:
                return None
            out.append(one)
        return out

    def _missed(self, found: list[Answer], T: float) -> float:
        """The largest share by which an end or a limit is missed."""
        worst = 0.0
        for plant, one in zip(self.plants, found, strict=True):
            values, _ = self.residuals(plant, one, T)
            joints = len(plant.system.free_rows) - len(plant.system.elastic_rows)
            if plant is self.plants[0]:
                worst = max(worst, float(np.abs(values).max()))
            else:
                pairs = values[2 * joints :].reshape(-1, 2)
                size = np.hypot(*pairs.T)
                worst = max(worst, float((size - self.allowed(plant, len(size))).max()))
        over = [np.abs(found[0].speed) / self.limits.speed[self.free] - 1]
        if np.isfinite(self.limits.deflection_m):
            over.append(np.abs(found[0].bend) / self.limits.deflection_m - 1)
        return max([worst, *(float(x.max(initial=0.0)) for x in over)])

    def allowed(self, plant: Plant, count: int) -> np.ndarray:
        """How large the modes' amplitudes may be (count,), in shares of `reference`: the first one
        may keep nearly all that is left, the others little."""
        share = np.full(count, 0.1 * plant.left)
        share[:1] = 0.85 * plant.left
        return share

    def _program(self, found: list[Answer], u: np.ndarray, T: float) -> tuple[np.ndarray, float]:
        """The change of the drives' inner nodes (P,) after which least is missed, and how much."""
        from scipy.optimize import linprog

        P = (self.m - 1) * len(self.free)
        above: list[np.ndarray] = []
        bounds: list[np.ndarray] = []
        equal, zero = np.zeros((0, P)), np.zeros(0)
        angles = np.pi * np.arange(SIDES // 2) / (SIDES // 2)
        for plant, one in zip(self.plants, found, strict=True):
            values, rows = self.residuals(plant, one, T)
            joints = len(plant.system.free_rows) - len(plant.system.elastic_rows)
            if plant is self.plants[0]:
                equal, zero = rows, -values
                continue
            allowed = self.allowed(plant, len(values) // 2 - joints) * np.cos(np.pi / SIDES)
            for k, most in enumerate(allowed):
                pair = slice(2 * (joints + k), 2 * (joints + k) + 2)
                for angle in angles:
                    way = np.array([np.cos(angle), np.sin(angle)])
                    row, value = way @ rows[pair], way @ values[pair]
                    above += [row, -row]
                    bounds += [np.array([most - value]), np.array([most + value])]
        for value, slope, most in self._ways(found[0]):
            above += [*slope, *-slope]
            bounds += [most - value, most + value]
        # one slack for all inequalities, two for each equation
        R = len(equal)
        # of all answers the nearest: a change is what is added less what is taken away
        near = np.tile(NEAR / (P * np.repeat(self.bound, self.m - 1)), 2)
        cost = np.concatenate([near, np.ones(1 + 2 * R)])
        A_eq = np.hstack([equal, -equal, np.zeros((R, 1)), np.eye(R), -np.eye(R)])
        A_ub = np.array(above).reshape(-1, P)
        A_ub = np.hstack([A_ub, -A_ub, -np.ones((len(A_ub), 1)), np.zeros((len(A_ub), 2 * R))])
        own = u[1:-1, self.free].T.ravel()
        bound = np.repeat(self.bound, self.m - 1)
        room = np.maximum(np.concatenate([bound - own, bound + own]), 0.0)
        limits = [*((0.0, x) for x in room), *[(0, None)] * (2 * R + 1)]
        b_ub = np.concatenate(bounds) if bounds else np.zeros(0)
        done = linprog(
            cost,
            A_ub=A_ub if len(A_ub) else None,
            b_ub=b_ub if len(A_ub) else None,
            A_eq=A_eq,
            b_eq=zero,
            bounds=limits,
            method="highs",
        )
        if done.x is None:
            raise FlexuraError(f"a linear program has no answer: {done.message}")
        x = np.asarray(done.x)
        return x[:P] - x[P : 2 * P], float(x[2 * P :].sum())

    def _ways(self, found: Answer) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Values, slopes and limits of speeds and deflections that may reach their limits."""
        out = []
        for k, joint in enumerate(self.free):
            most = self.limits.speed[joint]
            if np.isfinite(most):
                out.append((found.speed[:, k] / most, found.speed_slope[:, k] / most, 1.0))
        if np.isfinite(most := self.limits.deflection_m):
            for k in range(found.bend.shape[1]):
                out.append((found.bend[:, k] / most, found.bend_slope[:, k] / most, 1.0))
        return out  # type: ignore[return-value]
