"""One row of the benchmark: a problem's two programs at equal error, timed side by side."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

import flexura as fx

from . import exudyn_search, native
from .exudyn_programs import run as exudyn_run
from .exudyn_search import TARGET
from .native_search import cheapest
from .problems.problem import Problem, error
from .problems.statics import StaticProblem
from .timing import ratio, run_times

DEFAULT_LIMIT_S = 60.0
Row = dict[str, Any]


def motion_row(problem: Problem, rounds: int) -> Row:
    """Compare Exudyn's stored settings with flexura's "auto" and its best setting by hand.

    Errors count from each program's own converged model; those of the default settings from the
    converged motion on the problem's own mesh.

    Args:
        problem: what is run.
        rounds: rounds in which the programs take turns.

    Returns:
        The row; it has "failed" if a program does not hold the error.
    """
    row: Row = {"name": problem.name, "what": problem.what, "asked": problem.required_ratio}
    if not problem.available:
        return row | {"failed": f"needs fx.{problem.needs}"}
    system = native.system(problem.robot)
    own = native.converged(problem)
    exact = native.converged(problem, problem.finer) if problem.finer else own
    best, auto = cheapest(problem, system, exact, TARGET)
    if best is None and problem.finer:
        best, auto = cheapest(problem, system, own, TARGET)
        row["note"] = "error from its own modes"
    row["default"] = _default(problem, system, own)
    entry = exudyn_search.stored().get(problem.name)
    if best is None or entry is None:
        return row | {
            "failed": "no setting of flexura holds the error"
            if entry
            else "Exudyn's settings were not searched"
        }
    choice = exudyn_search.choice(problem.name)
    settings = {"best": best, "auto": auto} if auto is not None else {"best": best}
    run = lambda s: lambda: native.run(problem, system, s.rtol, s.method).seconds
    seconds_run = run_times(
        [lambda: exudyn_run.run(problem, choice)[0]] + [run(s) for s in settings.values()], rounds
    )
    row["exudyn"] = entry["choice"] | {
        "error": entry["error"],
        "ms": 1e3 * float(np.median(seconds_run[:, 0])),
    }
    for k, (name, setting) in enumerate(settings.items(), 1):
        numbers = setting.to_dict() | {"ms": 1e3 * float(np.median(seconds_run[:, k]))}
        row[name] = numbers | {"ratio": asdict(ratio(seconds_run[:, 0], seconds_run[:, k]))}
    return row


def _default(problem: Problem, system: fx.System, own: dict[str, np.ndarray]) -> Row:
    """Time and error of flexura's default tolerance and "auto"."""
    try:
        answer = native.run(problem, system, native.default_rtol(), limit_s=DEFAULT_LIMIT_S)
    except (native.TooSlow, fx.FlexuraError, RuntimeError) as failed:
        return {"failed": str(failed)}
    return {
        "ms": 1e3 * answer.seconds,
        "error": error(answer.channels, own),
        "method": answer.method,
    }


def statics_row(problem: StaticProblem, rounds: int) -> Row:
    """Compare whole calls of both programs for statics or frequencies.

    Args:
        problem: what is computed.
        rounds: rounds in which the programs take turns.

    Returns:
        The row; it has "failed" if a program fails.
    """
    row: Row = {"name": problem.name, "what": problem.what, "asked": problem.required_ratio}
    try:
        ours, theirs = problem.ours()[1], problem.theirs()[1]
    except (fx.FlexuraError, RuntimeError) as failed:
        return row | {"failed": str(failed)}
    seconds_run = run_times([lambda: problem.theirs()[0], lambda: problem.ours()[0]], rounds)
    times = {"exudyn": {"ms": 1e3 * float(np.median(seconds_run[:, 0]))}}
    auto = {
        "ms": 1e3 * float(np.median(seconds_run[:, 1])),
        "ratio": asdict(ratio(seconds_run[:, 0], seconds_run[:, 1])),
    }
    return row | times | {"auto": auto | {"error": problem.difference(ours, theirs)}}
