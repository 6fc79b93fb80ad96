"""A condition of the caller's that ends a run, looked at at the output times."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ..control import DriveFunction
from ..io import function_of, number
from ..signals import Drive
from .problem import Problem, Progress, Solution

EXPECTED = "expected a function of (t, position, velocity, tip_deflection) -> bool or number"
PARTS = 8  # that a bracket of the instant is cut into
SHARP = 1e-10  # of the time, or of a second: the width of the bracket at which the search ends

Solver = Callable[[Problem, Progress], Solution]


class StopCondition:
    """Where a function becomes true, or changes its sign.

    Args:
        function: of (t, position (N,), velocity (N,), tip_deflection [m]).
        problem: of the run.

    Raises:
        InputError: it is no such function, or gives anything but a bool or a finite number.
    """

    def __init__(self, function: Any, problem: Problem) -> None:
        function_of(function, "until", (4,), EXPECTED)
        self.function, self.system = function, problem.system
        self.problem = replace(problem, ends=self)
        self.looked = 0  # rows
        self.sign = 0.0  # of the number at the last row where it was not zero
        self.row: int | None = None  # the first row at which the condition holds

    def __call__(self, t: np.ndarray, states: np.ndarray) -> bool:
        """Whether the condition holds at one of the rows t (T,), states (T, 2 n) so far."""
        while self.row is None and self.looked < len(t):
            if self._holds(self.value(float(t[self.looked]), states[self.looked])):
                self.row = self.looked
            self.looked += 1
        return self.row is not None

    def value(self, t: float, z: np.ndarray) -> bool | float:
        """What the function gives at t [s] in the state z (2 n,)."""
        n, rows = self.system.n, self.system.joint_rows
        q = z[:n]
        bent = self.system.fixed(q).places(q)[0]
        given = self.function(t, q[rows], z[n:][rows], float(bent[-1]) if len(bent) else 0.0)
        if isinstance(given, bool | np.bool_):
            return bool(given)
        return number(given, "until", f"expected a bool or a finite number at t = {t:g} s")

    def _holds(self, value: bool | float) -> bool:
        if isinstance(value, bool):
            return value
        before, now = self.sign, float(np.sign(value))
        self.sign = now or before
        return before != 0.0 and now != before

    def run(self, solver: Solver, progress: Progress) -> Solution:
        """The solution up to the instant, with an event that says so; the whole without one."""
        found = solver(self.problem, progress)
        if not self(found.t, found.states):
            return found
        k = self.row
        assert k is not None
        last = _rows(found, k + 1)
        if k and isinstance(self.problem.drive, Drive | DriveFunction):
            last = self._refined(solver, found, k)
        at = float(last.t[-1])
        events = [event for event in found.meta["events"] if event["t"] < at]
        text = f"the condition until is met at t = {at:.6g} s: stopped"
        events.append({"t": at, "level": "INFO", "name": "until", "text": text})
        return replace(last, meta=found.meta | {"events": events, "complete": True})

    def _refined(self, solver: Solver, found: Solution, k: int) -> Solution:
        """The rows before row k and one at the instant, which lies after row k - 1: the bracket is
        integrated again, in parts, until it is narrow enough."""
        begin, end = float(found.t[k - 1]), float(found.t[k])
        z, accounts = found.states[k - 1], found.accounts[k - 1]
        sign = np.sign(float(self.value(begin, z)))
        part = found
        row = k
        while end - begin > SHARP * max(1.0, abs(end)):
            n = self.system.n
            t = np.linspace(begin, end, PARTS + 1)
            again = replace(self.problem, t=t, q=z[:n].copy(), qd=z[n:].copy(), ends=None)
            part = solver(again, None)
            part = replace(part, accounts=part.accounts + accounts)
            values = [self.value(float(s), x) for s, x in zip(part.t, part.states, strict=True)]
            row = next(
                (
                    j
                    for j, value in enumerate(values)
                    if j and (value if isinstance(value, bool) else sign * np.sign(value) < 0)
                ),
                len(values) - 1,
            )
            z, accounts = part.states[row - 1], part.accounts[row - 1]
            begin, end = float(part.t[row - 1]), float(part.t[row])
        return _joined(_rows(found, k), part, row)


def _rows(solution: Solution, count: int) -> Solution:
    """The first rows of a solution."""
    return replace(
        solution,
        t=solution.t[:count],
        states=solution.states[:count],
        accounts=solution.accounts[:count],
        forces=solution.forces[:count],
        seen=None if solution.seen is None else solution.seen[:count],
        jumps=solution.jumps if np.ndim(solution.jumps) == 0 else solution.jumps[:count],
    )


def _joined(first: Solution, part: Solution, row: int) -> Solution:
    """A solution with one row of another after its own."""
    add = lambda name: np.concatenate([getattr(first, name), getattr(part, name)[row : row + 1]])
    rows: dict[str, Any] = {name: add(name) for name in ("t", "states", "accounts", "forces")}
    rows["seen"] = None if first.seen is None else add("seen")
    if np.ndim(first.jumps):
        rows["jumps"] = np.append(first.jumps, first.jumps[-1] + part.jumps[row])
    return replace(first, **rows)
