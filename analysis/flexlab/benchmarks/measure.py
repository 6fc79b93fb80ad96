"""One row of the benchmark: a problem's two programs at equal error, timed side by side."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

import flexura as fx

from . import native, search
from .choose import cheapest
from .exudyn_programs import run as exudyn_run
from .problems.problem import Problem, error
from .problems.still import Still
from .search import TARGET
from .timing import ratio, walls

DEFAULT_LIMIT_S = 60.0
Row = dict[str, Any]


def motion(problem: Problem, rounds: int) -> Row:
    """Exudyn's cheapest stored choice beside flexura's "auto" and its best setting by hand, and
    what the default settings give.

    Errors count from each program's own converged model. The defaults' error counts on the
    problem's own mesh.
    """
    row: Row = {"name": problem.name, "what": problem.what, "asked": problem.asked}
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
    entry = search.stored().get(problem.name)
    if best is None or entry is None:
        return row | {
            "failed": "no setting of flexura holds the error"
            if entry
            else "Exudyn's settings were not searched"
        }
    choice = search.choice(problem.name)
    settings = {"best": best, "auto": auto} if auto is not None else {"best": best}
    run = lambda s: lambda: native.run(problem, system, s.rtol, s.method).seconds
    took = walls(
        [lambda: exudyn_run.run(problem, choice)[0]] + [run(s) for s in settings.values()], rounds
    )
    row["exudyn"] = entry["choice"] | {
        "error": entry["error"],
        "ms": 1e3 * float(np.median(took[:, 0])),
    }
    for k, (name, setting) in enumerate(settings.items(), 1):
        numbers = setting.to_dict() | {"ms": 1e3 * float(np.median(took[:, k]))}
        row[name] = numbers | {"ratio": asdict(ratio(took[:, 0], took[:, k]))}
    return row


def _default(problem: Problem, system: fx.System, own: dict[str, np.ndarray]) -> Row:
    """What a user gets who sets nothing: flexura's own rtol and "auto"."""
    try:
        answer = native.run(problem, system, native.default_rtol(), limit_s=DEFAULT_LIMIT_S)
    except (native.TooSlow, fx.FlexuraError, RuntimeError) as failed:
        return {"failed": str(failed)}
    return {
        "ms": 1e3 * answer.seconds,
        "error": error(answer.channels, own),
        "method": answer.method,
    }


def still(problem: Still, rounds: int) -> Row:
    """Statics or frequencies: whole calls of both programs."""
    row: Row = {"name": problem.name, "what": problem.what, "asked": problem.asked}
    try:
        ours, theirs = problem.ours()[1], problem.theirs()[1]
    except (fx.FlexuraError, RuntimeError) as failed:
        return row | {"failed": str(failed)}
    took = walls([lambda: problem.theirs()[0], lambda: problem.ours()[0]], rounds)
    times = {"exudyn": {"ms": 1e3 * float(np.median(took[:, 0]))}}
    auto = {
        "ms": 1e3 * float(np.median(took[:, 1])),
        "ratio": asdict(ratio(took[:, 0], took[:, 1])),
    }
    return row | times | {"auto": auto | {"error": problem.apart(ours, theirs)}}
