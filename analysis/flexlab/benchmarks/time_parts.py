"""What the time of a motion goes into: evaluations of the equations of motion, the caller's own
Python function, and the rest of a step.

An evaluation alone is timed by explicit steps of order 8, which add little to it. How fast a method
could be at most, if all but its evaluations and the caller's function took no time, follows.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

import flexura as fx

from . import exudyn_search, native
from .exudyn_programs import run as exudyn_run
from .exudyn_search import TARGET
from .native_search import loosest_tolerance
from .problems.problem import Problem, Work

EVALUATIONS, REPEATS, EXUDYN_REPEATS = 10_000, 5, 3
LIMIT_S = 60.0  # processor time of a run of the search


def of_motion(problem: Problem) -> dict[str, Any]:
    """Time the parts of a motion at the setting of "auto" for the benchmark's error.

    Args:
        problem: what is run.

    Returns:
        The row: evaluations; times in milliseconds of the run, its evaluations alone and the
            caller's function; how much faster than Exudyn the run is, and would be if nothing else
            took time. Only "name" where "auto" does not hold the error.
    """
    made = native.system(problem.robot)
    setting = loosest_tolerance(problem, made, native.converged(problem), TARGET, "auto", LIMIT_S)
    if setting is None or problem.name not in exudyn_search.stored():
        return {"name": problem.name}
    choice = exudyn_search.choice(problem.name)
    exudyn = min(exudyn_run.run(problem, choice)[0] for _ in range(EXUDYN_REPEATS))
    once = lambda work=None: native.run(problem, made, setting.rtol, work=work).seconds
    whole = min(once() for _ in range(REPEATS))
    function = function_s(problem, once) if problem.work.python else 0.0
    alone = setting.evaluations * evaluation_s(made)
    least = alone + function
    return {
        "name": problem.name,
        "method": setting.chosen,
        "evaluations": setting.evaluations,
        "ms": 1e3 * whole,
        "evaluations_ms": 1e3 * alone,
        "function_ms": 1e3 * function,
        "ratio": exudyn / whole,
        "ratio_at_most": exudyn / least,
    }


def evaluation_s(system: fx.System) -> float:
    """Processor time of one evaluation of the equations of motion [s]."""
    start = 1e-3 * np.random.default_rng(0).uniform(-1, 1, system.n)
    end = 1e-4
    while True:
        make = lambda end=end: fx.simulate(
            system, [0.0, end], None, qd0=start, start="straight", rtol=1e-6, method="explicit"
        )
        if int(make().meta["evaluations"]) > EVALUATIONS:
            break
        end *= 2.0

    def timed() -> float:
        begun = time.process_time()
        meta = make().meta
        seconds = min(float(meta["wall_s"]), time.process_time() - begun)
        return seconds / int(meta["evaluations"])

    return min(timed() for _ in range(REPEATS))


def function_s(problem: Problem, run: Callable[[Work], Any]) -> float:
    """Processor time that a problem's own function takes in a run [s]: its calls are repeated.

    Args:
        problem: what is run, with a function.
        run: runs it with other work.
    """
    work = problem.work
    calls: list[tuple[Any, ...]] = []

    def heard(function: Any, of_time: bool = False) -> Any:
        def of_state(t: float, position: Any, velocity: Any, tip_deflection: Any) -> Any:
            calls.append((t, np.array(position), np.array(velocity), tip_deflection))
            return function(*calls[-1])

        def of_t(t: float) -> Any:
            calls.append((t,))
            return function(t)

        return of_t if of_time else of_state

    if work.tick is not None:
        make: Callable[[], Any] = work.tick
        run(replace(work, tick=lambda: heard(make())))
    elif work.of_time is not None:
        make = lambda: work.of_time
        run(replace(work, of_time=heard(work.of_time, of_time=True)))
    else:
        make = lambda: work.of_state
        run(replace(work, of_state=heard(work.of_state)))

    def repeated() -> float:
        function = make()
        begun = time.process_time()
        for each in calls:
            function(*each)
        return time.process_time() - begun

    return min(repeated() for _ in range(REPEATS))
