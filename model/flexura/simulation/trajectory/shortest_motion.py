"""Motions from rest to rest in the least time, by a sequence of linear programs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import FlexuraError
from .limits import Limits
from .plant_motion import Answer, Plant, answer

STEPS = 10  # linear programs for one time, at most
QUICKER = 0.1  # by what share the first step shortens the time
SETTLED = 1e-3  # of the time: what another step may gain at the end
MET = 2e-4  # what is missed at the end, in shares
LESS = 0.6  # of what is missed: what a step may leave
WEIGHT = 3.0  # of what is missed, in shares, against the time, in shares
NEAR = 3e-4  # of the largest change of a drive, in shares of its limit


@dataclass(frozen=True)
class Conditions:
    """What a motion must meet, as values and derivatives by drives and time (P + 1,).

    `equal`, `equal_slope`: what must be 0. `below`, `below_slope`: what must not exceed `most`.
    """

    equal: np.ndarray
    equal_slope: np.ndarray
    below: np.ndarray
    below_slope: np.ndarray
    most: np.ndarray

    @property
    def missed(self) -> tuple[float, float]:
        """The sum of what is missed, which the programs lessen, and the largest of it."""
        over = float((self.below - self.most).max(initial=0.0))
        unequal = np.abs(self.equal)
        return float(unequal.sum()) + over, max(float(unequal.max(initial=0.0)), over)


class ShortestMotion:
    """The sequence of linear programs (122): least T over drives u that are linear in `m` equal
    intervals, so that every plant ends at rest."""

    def __init__(self, plants: list[Plant], limits: Limits, m: int, finer: int = 1) -> None:
        self.plants, self.limits, self.m, self.finer = plants, limits, m, finer
        self.programs = 0
        self.free = np.flatnonzero(~plants[0].system.locked)
        self.bound = np.repeat(limits.drive[self.free], m)

    def solve(
        self, u: np.ndarray, T: float, settled: float = SETTLED
    ) -> tuple[np.ndarray, float] | None:
        """The shortest motion from a first guess on: each step shortens the time, and then ends
        the motion as it must again. A step that fails is made shorter.

        Args:
            u: drives (m + 1, links) of the first guess.
            T: its time [s].
            settled: share of the time that another step may gain at the end.

        Returns:
            Drives and time, or None: no motion near the first guess keeps the limits and ends at
            rest.
        """
        found = self._corrected(np.clip(u, -self.limits.drive, self.limits.drive), T)
        if found is None:
            return None
        u, now = found
        quicker = QUICKER
        while quicker > settled:
            change, longer, _ = self._program(now, u, T, quicker * T)
            if -longer < settled * T:
                break
            found = self._corrected(u + change, T + longer)
            if found is None:
                quicker = -0.3 * longer / T
            else:
                (u, now), T, quicker = found, T + longer, min(2 * quicker, 0.3)
        return u, T

    def _corrected(self, u: np.ndarray, T: float) -> tuple[np.ndarray, Conditions] | None:
        """Drives near u with which a motion in the time T meets all conditions, or None."""
        now = self._conditions(u, T)
        for _ in range(STEPS):
            if now is None:
                return None
            missed, worst = now.missed
            if worst < MET:
                return u, now
            change, _, slack = self._program(now, u, T, 0.0)
            if slack > LESS * missed:
                return None
            for part in (1.0, 0.5, 0.25):
                then = self._conditions(u + part * change, T)
                if then is not None and then.missed[0] < (1 - (1 - LESS) * part) * missed:
                    break
            else:
                return None
            u, now = u + part * change, then
        return None

    def _conditions(self, u: np.ndarray, T: float) -> Conditions | None:
        """What the motion under the drives meets, or None where it does not run."""
        values, slopes, most = [], [], []
        for plant in self.plants:
            first = plant is self.plants[0]
            limits, finer = (self.limits, self.finer) if first else (None, 1)
            found = answer(plant, u, T, self.free, limits, finer)
            if found is None:
                return None
            if first:
                equal, equal_slope = self._rigid(plant, found, T)
                values.append(found.limited)
                slopes.append(found.limited_slope)
                most.append(np.ones(len(found.limited)))
            if len(plant.unshaped):
                away = np.concatenate([plant.end, np.zeros(plant.system.n)])
                values.append(plant.later @ (found.end - away))
                slopes.append(plant.later @ found.slope)
                most.append(np.full(len(values[-1]), plant.left))
        below, slope, limit = (np.concatenate(x) for x in (values, slopes, most))
        return Conditions(
            equal,
            equal_slope,
            np.concatenate([below, -below]),
            np.concatenate([slope, -slope]),
            np.tile(limit, 2),
        )

    def _rigid(self, plant: Plant, found: Answer, T: float) -> tuple[np.ndarray, np.ndarray]:
        """Places and rates (2 joints,) of the rigid robot's modes at the end in shares of the way,
        and derivatives (2 joints, P + 1)."""
        n, into = plant.system.n, plant.modes[1][: plant.joints]
        size = np.abs(into @ (plant.end - plant.start)).max()
        places, rates = into @ (found.end[:n] - plant.end) / size, into @ found.end[n:] * T / size
        rate_slopes = into @ found.slope[n:] * T / size
        rate_slopes[:, -1] += rates / T
        place_slopes = into @ found.slope[:n] / size
        return np.concatenate([places, rates]), np.concatenate([place_slopes, rate_slopes])

    def _program(
        self, now: Conditions, u: np.ndarray, T: float, quicker: float
    ) -> tuple[np.ndarray, float, float]:
        """The smallest change of the drives (m + 1, links), and that of the time, down to
        -quicker, after which time and what is missed are least; and what then is missed."""
        from scipy.optimize import linprog

        self.programs += 1
        P, R = len(self.bound), len(now.equal)
        # unknowns: the drives in shares of their limits, the time in shares, the largest change of
        # a drive, one slack for all inequalities, two for each equation
        time, largest, slack = P, P + 1, P + 2
        size = slack + 1 + 2 * R
        scale = np.append(self.bound, T)
        equal = np.zeros((R, size))
        equal[:, : P + 1] = now.equal_slope * scale
        equal[:, slack + 1 :] = np.hstack([np.eye(R), -np.eye(R)])
        below = np.zeros((len(now.below), size))
        below[:, : P + 1], below[:, slack] = now.below_slope * scale, -1.0
        small = np.zeros((2 * P, size))
        small[:P, :P], small[P:, :P], small[:, largest] = np.eye(P), -np.eye(P), -1.0
        cost = np.zeros(size)
        cost[time], cost[largest], cost[slack:] = 1.0, NEAR, WEIGHT
        own = u[:-1, self.free].T.ravel() / self.bound
        limits = [*zip(np.minimum(-1 - own, 0), np.maximum(1 - own, 0), strict=True)]
        limits += [(-quicker / T, 0.0)] + [(0.0, None)] * (size - P - 1)
        done = linprog(
            cost,
            A_ub=np.concatenate([small, below]),
            b_ub=np.concatenate([np.zeros(2 * P), now.most - now.below]),
            A_eq=equal,
            b_eq=-now.equal,
            bounds=limits,
            method="highs",
        )
        if done.x is None:
            raise FlexuraError(f"a linear program has no answer: {done.message}")
        x = np.asarray(done.x)
        change = np.zeros_like(u)
        change[:-1, self.free] = (x[:P] * self.bound).reshape(len(self.free), self.m).T
        return change, float(x[time]) * T, float(x[slack:].sum())
