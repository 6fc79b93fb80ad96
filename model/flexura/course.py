"""A run of the compiled loops: the method it takes, and how it is begun, advanced and ended."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from . import acting, exponential, loop
from .basis import basis
from .chain import Work
from .choice import choose, longest_step, quickest
from .control import Controller, replay
from .drive import Drive
from .errors import FlexuraError

from .past import past
from .record import limit_event
from .system import System

METHODS = {
    "explicit": loop.EXPLICIT, "implicit": loop.IMPLICIT, "explicit-3": loop.PAIR_3, "explicit-5": loop.PAIR_5,
    "exponential": exponential.EXPONENTIAL,
}  # fmt: skip
FIRST = 1e-4  # the first step, in whole runs
_STEPS_A_CALL = 400  # between two looks at the progress bar and the keyboard


def which(system: System, t: np.ndarray, drive: Any, rtol: float, method: str) -> int:
    """The method of a run: as asked, or chosen (`choice.py`); exponential steps are for drives that do not tick."""
    if method != "auto" and (method != "exponential" or isinstance(drive, Drive)):
        return METHODS[method]
    if isinstance(drive, Drive):
        return quickest(system, t[-1] - t[0], rtol, drive.gains)
    return choose(system, t[-1] - t[0], rtol, drive.rate_Hz if isinstance(drive, Controller) else 0.0)


class Course:
    """A run in progress from state (2n + 2,) along t (T,): `m.s` says how far it is, `out` (T, 2n + 2) holds what it has."""

    def __init__(self, system: System, t: np.ndarray, drive: Drive | Controller, state: np.ndarray, method: int) -> None:
        self.inputs, self.m = inputs_of(system, drive, t), loop.memory(len(system.robot.links), system.n)
        self.out = np.zeros((len(t), len(state)))
        self.m.z[:], self.out[0] = state, state
        s, longest = self.m.s, longest_step(system, method)
        s[loop.T], s[loop.OUT], s[loop.ERR] = t[0], 1, 1.0
        s[loop.LONGEST], s[loop.H] = longest, min(0.02 * longest, (t[-1] - t[0]) * FIRST)
        self._system, self._t, self._method = system, t, method
        self._robot = system.chain, following(system, drive), self.inputs, self.m
        self._modes = (basis(system.n), past(system.n)) if method == exponential.EXPONENTIAL else None

    def advance(self, rtol: float, steps: int) -> int:
        """At most so many steps further; the status, `loop.RUNNING` where it may go on."""
        if self._modes is not None:
            exponential.advance(*self._robot, *self._modes, rtol, self._t, self.out, steps)
            if self.m.s[loop.STATUS] == loop.STUCK:
                self._give_way(rtol)
        else:
            loop.advance(*self._robot, self._method, rtol, self._t, self.out, steps)
        return int(self.m.s[loop.STATUS])

    def _give_way(self, rtol: float) -> None:
        """Go on from here without exponential steps: what their basis leaves out can be too stiff for them."""
        s = self.m.s
        self._modes, self._method = None, choose(self._system, self._t[-1] - s[loop.T], rtol)
        s[loop.LONGEST] = longest_step(self._system, self._method)
        s[loop.H] = min(0.02 * s[loop.LONGEST], (self._t[-1] - self._t[0]) * FIRST)
        s[loop.STATUS], s[loop.FRESH], s[loop.ERR] = loop.RUNNING, 0.0, 1.0


def compiled(
    system: System,
    t: np.ndarray,
    drive: Drive | Controller,
    state: np.ndarray,
    rtol: float,
    method: int,
    progress: Callable[[float], None] | None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, acting.Inputs, dict[str, Any]]:
    """Times, states (T, 2n), work and loss (T, 2), the inputs with what a controller logged, and what the Run's metadata says of
    the solution."""
    n = system.n
    course = Course(system, t, drive, state, method)
    m, out = course.m, course.out
    events: list[dict[str, Any]] = []
    complete = len(t) == 1
    course.advance(rtol, 0)  # no step: compile before the clock starts
    begun = time.perf_counter()
    try:
        while not complete:
            status = course.advance(rtol, _STEPS_A_CALL)
            if progress is not None:
                progress((m.s[loop.T] - t[0]) / (t[-1] - t[0]))
            if status == loop.STUCK:
                raise FlexuraError(
                    f"the simulation got no further than t = {m.s[loop.T]:.6g} s with rtol = {rtol:g}: a link is bent "
                    "to a right angle, or a gain or force is too large"
                )
            if status == loop.LIMIT:
                joint, at, row = int(m.s[loop.FAULT]), float(m.s[loop.T]), int(m.s[loop.OUT])
                events.append(limit_event(system, joint, at, m.z[system.joint_rows]))
                if at > t[row - 1]:  # the last good state
                    t, out[row] = np.append(t[:row], at), m.z
                    m.s[loop.OUT] += 1
                break
            complete = status == loop.DONE
    except KeyboardInterrupt:
        events.append({"t": float(m.s[loop.T]), "level": "WARN", "text": "interrupted"})
    rows = int(m.s[loop.OUT])
    counts: dict[str, Any] = {
        name: int(m.s[k]) for name, k in (("steps", loop.STEPS), ("rejected", loop.REJECTED), ("evaluations", loop.EVALS))
    }
    counts["wall_s"] = time.perf_counter() - begun
    about = counts | {"complete": complete, "events": events, "drive": drive.spec()}
    return t[:rows], out[:rows, : 2 * n], out[:rows, 2 * n :], course.inputs, about


def inputs_of(system: System, drive: Drive | Controller, t: np.ndarray | None = None) -> acting.Inputs:
    """What acts on the robot; a controller's ticks begin at t[0] and are logged up to t[-1]."""
    segments, ranges, gains = drive.packed()
    limits = slack(system.limits)
    law = none()
    if isinstance(drive, Controller):
        start, end = (0.0, 0.0) if t is None else (t[0], t[-1])
        law = drive.law(system, ranges, start, int(np.ceil((end - start) * drive.rate_Hz - 1e-6)) + 1)
    return acting.Inputs(
        segments, ranges, gains[:, 0].copy(), gains[:, 1].copy(), drive.follows.astype(np.int64), limits[:, 0].copy(),
        limits[:, 1].copy(), drive.breaks, law,
    )  # fmt: skip


def slack(limits: np.ndarray) -> np.ndarray:
    """Limits (..., 2) a billionth wider: a motion may end on one, and does so up to round-off."""
    return limits + [-1e-9, 1e-9] * np.maximum(1.0, np.abs(np.where(np.isfinite(limits), limits, 0.0)))


def following(system: System, drive: Drive | Controller) -> Work:
    """A workspace in which the joints with a prescribed motion are held to it."""
    w = system._work()
    w.held[:] |= drive.follows
    return w


def applied(system: System, t: np.ndarray, states: np.ndarray, drive: Drive | Controller, inputs: acting.Inputs) -> np.ndarray:
    """The drive forces (T, N) at the states (T, 2n) of a run; what a controller held is replayed."""
    n, links = system.n, len(system.robot.links)
    if isinstance(drive, Controller):
        segments, ranges = replay(inputs.law, inputs.segments, inputs.ranges)
        inputs = inputs._replace(segments=segments, ranges=ranges, law=none())
    out = np.zeros((len(t), links))
    loop.forces(system.chain, following(system, drive), inputs, loop.memory(links, n), t, states, out)
    return out
