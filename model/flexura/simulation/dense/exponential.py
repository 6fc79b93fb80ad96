"""The method "exponential": Adams' method in the robot's modes (predictor (91), corrector (92)), as
a solver like those of scipy.integrate.

A step costs one evaluation and may be long against the periods of all modes: the linear part is
solved in closed form (`propagator`), and the rest, N of (88), is a polynomial in time through its
last values. The accounts of work and loss are integrals of such polynomials too, under the same
error control. That of the strain energy is its own rise.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .equations import Equations
from .propagator import Modes

ORDER = 5  # values that a step looks back on
# modes that turn by more than FAST rad in a step look back on four: five would blow up sooner
FAST, FAST_ORDER = 1.0, 4
ACCOUNTS = 2  # that are integrated: work and loss
FIRST = 1e-4  # of the run: the first step
AGAIN = 6  # rungs that a step is shorter after a break
SETTLED = 8  # steps of one length before a longer one
LOOK = 4  # steps between two looks at the modes
SHORT = 4e-16  # of the time: no step is shorter
SAFETY = 0.85


class Look(NamedTuple):
    """The equations at a state: the time, (q, v, accounts) and (accelerations, rates of the
    accounts) of the free rows."""

    t: float
    state: np.ndarray
    rates: np.ndarray


class Plan(NamedTuple):
    """A step of length h by its last k values of N, the exponential predictor (91), and by its gap,
    the new value less what they lead to one expects, the corrector (92).

    Powers in t/h (powers, k, m) of the values' polynomials and (powers, m) of the gap's; y(h) =
    free y(0) + old (all values) + late gap; `end` (k, m) leads from the values to x = 1; an error
    is doubt gap, in (q, v, accounts).
    """

    h: float
    values: np.ndarray
    gap: np.ndarray
    free: np.ndarray
    old: np.ndarray
    late: np.ndarray
    end: np.ndarray
    doubt: np.ndarray


class Exponential:
    """Steps from `t` to `end`; the attributes are those of scipy.integrate.OdeSolver.

    The error of a step is good if the root of the mean square of error / `atol` (2n + 3,) is below
    1. `begin` starts at a state where what acts may have jumped. No step is longer than `longest`
    [s].
    """

    modes: Modes
    N: np.ndarray  # (ORDER, modes) the last values
    plan_of: float  # the length of the step that `plan` is for [s]
    since_look: int

    def __init__(self, equations: Equations, span: float, longest: float) -> None:
        self.equations, self.begun = equations, False
        self.rows = np.concatenate(
            [equations.free, equations.n + equations.free, 2 * equations.n + np.arange(ACCOUNTS)]
        )
        self.unit, self.rung, self.longest, self.status = FIRST * span, 0, longest, "running"

    def begin(self, t: float, z: np.ndarray, end: float, atol: np.ndarray) -> None:
        """Go on from the state z at t to `end`, with no past."""
        self.t, self.y, self.end, self.atol, self.status = t, z, end, atol, "running"
        self.strain = z[-1] - self.equations.strain(z)
        self.rung -= AGAIN if self.begun else 0
        self.past = [self._look(t, z)]
        self._take_modes()
        self._count_again()

    @property
    def wish(self) -> float:
        """The next length of a step by the tolerance [s]: `unit` times a power of the root of 2, of
        which many share tables."""
        return self.unit * 2.0 ** (self.rung // 2) * (math.sqrt(2.0) if self.rung % 2 else 1.0)

    def step(self) -> None:
        """One step, with as many attempts as it takes; `status` is "failed" if none is short
        enough."""
        for _ in range(100):
            wish = min(self.wish, self.longest)
            parts = math.ceil((self.end - self.t) / wish - 1e-6)
            h = wish if parts > 5 else (self.end - self.t) / parts
            if not h > SHORT * max(abs(self.t), 1e-3 * abs(self.end)):
                break
            error = self._attempt(h, self.end if parts == 1 else self.t + h)
            if error < 1:
                return self._lengthen(h, error)
            factor = SAFETY * error ** (-1 / (len(self.past) + 1)) if math.isfinite(error) else 0.1
            self.rung = math.floor(2 * math.log2(min(max(factor, 0.1), 0.9) * h / self.unit))
            self.settled, self.worst = 0, 0.0
        self.status = "failed"

    def dense_output(self) -> Callable[[float], np.ndarray]:
        """The state (2n + 3,) at a time in the last step."""
        return self._within

    def _attempt(self, h: float, end: float) -> float:
        """The error over the tolerance of a step, which is taken if it is below 1."""
        modes = self.modes
        if h != self.plan_of:
            self.plan_of, self.alike = h, 0
        if self.alike <= ORDER:
            self.plan = self._plan(h)
        plan, start = self.plan, modes.into @ (self.y[self.rows] - modes.origin)
        ahead = plan.free @ start + plan.old @ self.N.ravel()
        look = self._look(end, self._state(ahead, modes))
        new = self._force(look.rates, ahead)
        gap = new - (plan.end * self.N).sum(axis=0)
        error = float(np.linalg.norm(plan.doubt @ gap / self.atol[self.rows])) / math.sqrt(
            len(self.y)
        )
        if error < 1:
            self._within = Within(self, modes, self.t, plan, start, self.N, gap)
            self.y, self.t, self.step_size = self._state(ahead + plan.late @ gap, modes), end, h
            self.past, self.N = [look, *self.past][:ORDER], np.vstack([new, self.N[: ORDER - 1]])
        return error

    def _plan(self, h: float) -> Plan:
        modes, table, k = self.modes, self.modes.table(h), len(self.past)
        x = [(look.t - self.t) / h for look in self.past]
        fast = np.append(np.sqrt(modes.w2) * h > FAST, np.zeros(ACCOUNTS, dtype=bool))[None, :]
        values, gap, oldest = _powers(x)
        few = _powers(x[:FAST_ORDER])
        values, gap, oldest = (
            values[:, :, None] * ~fast,
            gap[:, None] * ~fast,
            oldest[:, None] * ~fast,
        )
        values[:, : few[0].shape[1]] += few[0][:, :, None] * fast
        gap, oldest = gap + few[1][:, None] * fast, oldest + few[2][:, None] * fast
        old = np.einsum("pij,pkj->ikj", table.forced, values).reshape(len(table.free), -1)
        late, doubt = (np.einsum("pij,pj->ij", table.forced, column) for column in (gap, oldest))
        assert values.shape[1] == k
        return Plan(h, values, gap, table.free, old, late, values.sum(axis=0), modes.out @ doubt)

    def _lengthen(self, h: float, error: float) -> None:
        """After a good step of length h: how long the next one is to be; the modes are looked
        at."""
        self.alike, self.settled, self.worst = (
            self.alike + 1,
            self.settled + 1,
            max(self.worst, error),
        )
        self.since_look, self.begun = self.since_look + 1, True
        if len(self.past) < ORDER or self.settled >= SETTLED:
            factor = SAFETY * max(self.worst, 1e-30) ** (-1 / (len(self.past) + 1))
            if self.wish < self.longest:
                self.rung += min(max(math.floor(2 * math.log2(factor * h / self.wish)), 0), 2)
            self.settled, self.worst = 0, 0.0
        if self.t >= self.end:
            self.status = "finished"
        elif self.since_look % LOOK == 0 and self._take_modes():
            self._count_again()

    def _take_modes(self) -> bool:
        """Modes at the last evaluation, if there are none or they are poor there."""
        M, K, D = self.equations.linear()
        if hasattr(self, "modes") and not self.modes.poor(M, K, D, 1 / self.wish):
            return False
        self.modes = Modes(M, K, D, self.y[self.equations.free], ORDER + 1, ACCOUNTS)
        return True

    def _count_again(self) -> None:
        """The past in the present modes, and counters of steps of one length."""
        self.N = np.array(
            [
                self._force(look.rates, self.modes.into @ (look.state - self.modes.origin))
                for look in self.past
            ]
        )
        self.alike = self.settled = self.since_look = 0
        self.plan_of, self.worst = -1.0, 0.0

    def _look(self, t: float, z: np.ndarray) -> Look:
        return Look(
            t, z[self.rows], self.equations.rates(t, z)[self.rows[len(self.equations.free) :]]
        )

    def _force(self, rates: np.ndarray, y: np.ndarray) -> np.ndarray:
        """N of (88), and the rates of the accounts, (m + 3,)."""
        m, out = self.modes.m, rates.copy()
        out[:m] = self.modes.rows @ rates[:m] + self.modes.linear @ y
        return out

    def _state(self, y: np.ndarray, modes: Modes) -> np.ndarray:
        """The state (2n + 3,) of a state of the modes."""
        z = self.y.copy()
        z[self.rows] = modes.origin + modes.out @ y
        z[-1] = self.strain + self.equations.strain(z)
        return z


class Within:
    """The states within a step of `plan` from y at t: by a half, a quarter, ... of the step, then
    by a series."""

    def __init__(
        self,
        steps: Exponential,
        modes: Modes,
        t: float,
        plan: Plan,
        y: np.ndarray,
        N: np.ndarray,
        gap: np.ndarray,
    ) -> None:
        self.steps, self.modes, self.t, self.plan, self.y, self.N, self.gap = (
            steps,
            modes,
            t,
            plan,
            y,
            N,
            gap,
        )

    def __call__(self, t: float) -> np.ndarray:
        """The state at a time of the step [s]."""
        plan, modes, y, x, at = self.plan, self.modes, self.y, (t - self.t) / self.plan.h, 0.0
        f = np.einsum("pkj,kj->pj", plan.values, self.N) + plan.gap * self.gap
        for level in range(1, modes.halvings(plan.h) + 1):
            part = 0.5**level
            if x - at >= part:
                table, scaled = modes.table(plan.h * part), f * part ** np.arange(len(f))[:, None]
                y, f, at = (
                    table.free @ y + np.einsum("pij,pj->i", table.forced, scaled),
                    _shifted(f, part),
                    at + part,
                )
        return self.steps._state(self._series(y, f, (x - at) * plan.h), modes)

    def _series(self, y: np.ndarray, f: np.ndarray, t: float) -> np.ndarray:
        """The motion after the short time t, by derivatives."""
        m, out, power = self.modes.m, y.copy(), 1.0
        for j in range(1, 20):
            force = (
                math.factorial(j - 1) * f[j - 1] / self.plan.h ** (j - 1)
                if j <= len(f)
                else np.zeros(m + ACCOUNTS)
            )
            y = np.concatenate([y[m : 2 * m], force[:m] - self.modes.linear @ y, force[m:]])
            power *= t / j
            out += power * y
        return out


def _shifted(f: np.ndarray, x: float) -> np.ndarray:
    """The powers (p, m) of a polynomial with the origin moved to x."""
    count = len(f)
    shift = np.array(
        [
            [math.comb(r, p) * x ** (r - p) if r >= p else 0.0 for r in range(count)]
            for p in range(count)
        ]
    )
    return shift @ f


def _powers(x: list[float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Polynomials in t/h by powers, values at x (k,), the newest first: Lagrange's (powers, k);
    what is 0 at x and 1 at the step's end (powers,); and this less the one that does without the
    oldest value.

    Products of roots keep the digits where the places lie far apart.
    """
    values, gap, oldest = np.zeros((ORDER + 1, len(x))), np.zeros(ORDER + 1), np.zeros(ORDER + 1)
    for j, place in enumerate(x):
        others = x[:j] + x[j + 1 :]
        values[: len(x), j] = _product(others) / math.prod(place - other for other in others)
    end = math.prod(1 - place for place in x)
    gap[: len(x) + 1], oldest[: len(x) + 1] = _product(x) / end, _product([*x[:-1], 1.0]) / end
    return values, gap, oldest


def _product(roots: list[float]) -> np.ndarray:
    """The powers of prod (x - root), lowest first."""
    out = [1.0]
    for root in roots:
        out = [a - root * b for a, b in zip([0.0, *out], [*out, 0.0])]
    return np.array(out)
