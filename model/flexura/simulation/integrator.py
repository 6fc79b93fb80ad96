"""The compiled integrator: a problem through time, with progress, interruption, and what ended
it."""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import numpy as np

from .. import core
from ..control import Backlash, Controller, DriveFunction, Sampled
from ..io import Tables, interruption
from ..signals import Drive
from .problem import Problem, Progress, Solution
from .recorder import limit_event

STEPS_A_CALL = 400  # between two looks at the progress bar and the keyboard
STEPS_A_LOOK = 20  # between two looks at the condition that ends a run


def solve(problem: Problem, progress: Progress = None) -> Solution:
    """Integrate in the core (docs/theory/10-time-integration.md)."""
    return _Integration(problem).run(progress)


class _Acting(NamedTuple):
    """What acts in a run, as `core.Simulation` takes it by these names: a Drive's signals, gains
    and flags; a function of the state; a sampled controller and its rate."""

    segments: np.ndarray
    ranges: np.ndarray
    gains: np.ndarray
    prescribed: np.ndarray
    sampled: np.ndarray
    function: Any = None
    sampler: Any = None
    rate_Hz: float = 0.0

    @staticmethod
    def of(problem: Problem) -> _Acting:
        system, drive = problem.system, problem.drive
        joints = len(system.robot.links)
        none = np.zeros(joints, dtype=np.uint8)
        if isinstance(drive, Controller):
            parts = drive.core_drives()
            return _Acting(*parts, sampler=drive.sampler(system), rate_Hz=float(drive.rate_Hz))
        if isinstance(drive, Drive):
            function = DriveFunction(drive.function_forces, joints) if drive.has_functions else None
            return _Acting(*drive.packed(), drive.follows.astype(np.uint8), none, function)
        free = _Acting(*Drive.none(joints).packed(), none, none)
        if isinstance(drive, Sampled):
            called = DriveFunction(drive.function, joints, system, problem.loads)
            sampler = core.PythonSampler(system.equations, called)
            return free._replace(sampler=sampler, rate_Hz=float(drive.rate_Hz))
        own = drive.function
        return free._replace(function=own.packed() if isinstance(own, Backlash) else drive)


class _Integration:
    """A run of the core in progress."""

    def __init__(self, problem: Problem) -> None:
        self.problem, self.system, self.drive = problem, problem.system, problem.drive
        self.t, self.rtol = problem.t, problem.rtol
        acting = _Acting.of(problem)
        self.sampler = acting.sampler
        self.core = core.Simulation(
            robot=self.system.equations,
            t=self.t,
            q=problem.q,
            v=problem.qd,
            rtol=self.rtol,
            method=problem.method,
            limits=np.ascontiguousarray(self.system.limits),
            first_step=0.0,
            numerical_damping=problem.numerical_damping,
            most_steps=problem.budget.steps,
            loads=problem.loads.packed() if problem.loads else None,
            **acting._asdict(),
        )

    def run(self, progress: Progress) -> Solution:
        begun, t, ends = time.perf_counter(), self.t, self.problem.ends
        interrupted = late = False
        try:
            while len(t) > 1 and self.core.advance(STEPS_A_CALL if ends is None else STEPS_A_LOOK):
                if time.perf_counter() - begun > self.problem.budget.wall_s:
                    late = True
                    break
                if ends is not None and ends(*(np.asarray(a) for a in self.core.rows()[:2])):
                    break
                if progress is not None:
                    progress((self.core.progress()["t"] - t[0]) / (t[-1] - t[0]))
            if len(t) == 1:
                self.core.advance(1)
            if progress is not None and self.core.progress()["status"] == "done":
                progress(1.0)
        except KeyboardInterrupt:
            interrupted = True
        about = self.core.progress()
        times, states, accounts, forces = (np.asarray(a) for a in self.core.rows())
        events = [] if interrupted else self._events(about)
        if late:
            events = [self._budget_event("wall_time", about)]
        if interrupted or about["status"] == "interrupted":
            events = [interruption(about["t"])]
        meta: Tables = {
            "steps": about["steps"],
            "rejected": about["rejected"],
            "evaluations": about["passes"],
            "wall_s": time.perf_counter() - begun,
            "complete": about["status"] == "done" and not interrupted,
            "max_steps": self.problem.budget.steps,
            "events": events,
            "drive": self.drive.spec() if hasattr(self.drive, "spec") else "Python function",
            "rtol": self.rtol,
            "method": about["method"],
        }
        return Solution(times, states, accounts, forces, meta, sampler=self.sampler)

    def _events(self, about: dict[str, Any]) -> list[dict[str, Any]]:
        """What ended the run, if it is not its time."""
        status, at = about["status"], float(about["t"])
        if status in ("done", "running"):  # running: a condition ends it
            return []
        z = np.asarray(self.core.state())
        if status == "limit":
            return [limit_event(self.system, int(about["joint"]), at, z[self.system.joint_rows])]
        if status == "exhausted":
            return [self._budget_event(status, about)]
        i = int(about["joint"]) + 1
        where = (
            "" if i == 0 else f" in {'the bending of link' if about['elastic'] else 'joint'} {i}"
        )
        what = {
            "stuck": f"no step is short enough for rtol = {self.rtol:g}{where}; "
            "try another tolerance or method, look at gains and forces",
            "diverged": f"the state is not a number any more{where}; "
            "a gain, a force or a start value is too large",
        }[status]
        return [
            {
                "t": at,
                "level": "ERROR",
                "name": status,
                "text": f"the simulation got no further than t = {at:.6g} s: {what}",
            }
        ]

    def _budget_event(self, name: str, about: dict[str, Any]) -> dict[str, Any]:
        """What is said of a run whose budget is used up."""
        steps = int(about["steps"]) + int(about["rejected"])
        return self.problem.budget.event(
            name, float(about["t"]), about["method"], steps, float(self.t[0])
        )
