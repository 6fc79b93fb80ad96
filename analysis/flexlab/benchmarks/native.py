"""Runs of flexura through its public functions."""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import flexura as fx

from .problems.problem import Channels, Problem, Tables, Work

METHODS = ("auto", "explicit", "implicit", "exponential")


class TooSlow(Exception):
    """A run took longer than its limit."""


@dataclass(frozen=True)
class Answer:
    """Processor time of the time loop [s], evaluations, the method used, and the channels."""

    seconds: float
    evaluations: int
    method: str
    channels: Channels


def default_rtol() -> float:
    """The default tolerance of `fx.simulate`."""
    return float(inspect.signature(fx.simulate).parameters["rtol"].default)


def system(tables: Tables) -> fx.System:
    """Assemble the robot of these tables."""
    return fx.assemble(fx.Robot.from_dict(tables))


def drive(work: Work) -> Any:
    """The drive that `fx.simulate` takes for this work."""
    if work.of_time is not None or work.of_state is not None:
        return work.of_time or work.of_state
    if work.tick is not None:
        return fx.Sampled(work.tick(), work.rate_Hz)
    if work.rate_Hz:
        laws = [
            fx.PID(m, kp=p, kd=d, derivative_Hz=0.0)
            for m, p, d in zip(work.motion, work.kp, work.kd, strict=True)
        ]
        return fx.Controller(tuple(laws), rate_Hz=work.rate_Hz)
    if work.motion:
        return fx.Drive.pd(work.motion, work.kp, work.kd)
    if work.prescribed:
        return fx.Drive.prescribed(*work.prescribed)
    return fx.Drive.force(*work.force) if work.force else None


def methods(problem: Problem) -> tuple[str, ...]:
    """The methods that can run this problem."""
    return METHODS[:3] if problem.work.python else METHODS


def run(
    problem: Problem,
    made: fx.System,
    rtol: float,
    method: str = "auto",
    *,
    work: Work | None = None,
    limit_s: float = 0.0,
    **keys: Any,
) -> Answer:
    """Run a problem once, from the straight robot at its start.

    Args:
        problem: what is run.
        made: its assembled robot.
        rtol: the tolerance.
        method: a method of `fx.simulate`.
        work: replaces the problem's own work.
        limit_s: processor time after which the run is given up [s]; 0: none.
        keys: further arguments of `fx.simulate` or `fx.inverse`.

    Raises:
        TooSlow: the limit is exceeded.
        RuntimeError: the run does not reach its end.
        FlexuraError: as flexura raises it.
    """
    begun = time.process_time()

    def watch(fraction: float) -> None:
        if time.process_time() - begun > limit_s:
            raise TooSlow(f"{fraction:.0%} after {limit_s:g} s")

    keys["start"] = "straight"
    progress: Callable[[float], None] | None = watch if limit_s else None
    work = work or problem.work
    if problem.inverse:
        done = fx.inverse(
            made, problem.t, work.prescribed, rtol=rtol, method=method, progress=progress, **keys
        )
    else:
        done = fx.simulate(
            made, problem.t, drive(work), rtol=rtol, method=method, progress=progress, **keys
        )
    whole = time.process_time() - begun
    if not done.meta["complete"]:
        raise RuntimeError(
            "; ".join(event["text"] for event in done.meta["events"]) or "incomplete"
        )
    seconds = min(done.meta["wall_s"], whole)  # both are at least the processor time of the loop
    return Answer(
        seconds, int(done.meta["evaluations"]), done.meta["method"], channels(problem, done)
    )


def channels(problem: Problem, done: fx.Run) -> Channels:
    """The channels of a run that are compared."""
    names = problem.names
    if problem.inverse:
        names = names + [f"joint/{k}/drive" for k in range(1, len(problem.robot["link"]) + 1)]
    return {name: np.asarray(done[name]) for name in names}


def converged(problem: Problem, tables: Tables | None = None) -> Channels:
    """The motion at a tolerance far below what is compared.

    Python functions are replaced by signals, if the problem has an equivalent.

    Args:
        problem: what is run.
        tables: a robot with another mesh; by default the problem's own.
    """
    method, rtol = problem.exact
    if problem.work.rate_Hz and method == "implicit":
        method = "auto"
    return run(
        problem, system(tables or problem.robot), rtol, method, work=problem.same or problem.work
    ).channels
