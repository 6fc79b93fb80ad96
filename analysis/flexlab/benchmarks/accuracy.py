"""Accuracy and number of evaluations: python -m flexlab.benchmarks accuracy, and ... passes.

Errors are those of `problem.error`, relative to the converged motion on the problem's own mesh. A
pass is one evaluation of the equations of motion. The passes for an error are medians over nine
tolerances within 10 % of each other, because single runs scatter with their first steps.
"""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np

import flexura as fx

from . import native
from .native_search import RTOLS
from .problems.problem import Channels, Problem, error, scale

TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
ERRORS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
TIGHTER = (3e-9, 1e-9, 3e-10, 1e-10)  # tolerances that a small error takes
MAX_ERROR_OVER_RTOL, MAX_DEFAULT_ERROR = 20.0, 1e-4  # required
SCATTER = np.geomspace(1 / 1.1, 1.1, 9)  # times a tolerance
LIMIT_S, PATIENCE = 30.0, 4.0
# required of "auto": at most so many times those of the cheapest method, plus so many
MAX_PASS_RATIO, EXTRA_PASSES = 2.0, 100
Row = dict[str, Any]


def measured(
    problem: Problem,
    system: fx.System,
    exact: Channels,
    rtol: float,
    method: str = "auto",
    limit_s: float = LIMIT_S,
) -> tuple[float, int] | None:
    """Error and evaluations of one run.

    Args:
        problem: what is run.
        system: its assembled robot.
        exact: the converged channels.
        rtol: the tolerance.
        method: a method of `fx.simulate`.
        limit_s: processor time after which the run is given up [s].

    Returns:
        (error, evaluations): the error is infinite if the run fails. None if it takes too long.
    """
    try:
        answer = native.run(problem, system, rtol, method, limit_s=limit_s)
    except native.TooSlow:
        return None
    except (fx.FlexuraError, RuntimeError):
        return math.inf, 0
    return error(answer.channels, exact), answer.evaluations


def errors(problem: Problem) -> Row:
    """Errors of method "auto" at each tolerance and with default settings.

    Returns:
        A row: name, scale [m], undamped, errors and passes by rtol, the default's error.
    """
    system, exact = native.system(problem.robot), native.converged(problem)
    size = scale(exact)

    def at(rtol: float) -> Row:
        off, count = measured(problem, system, exact, rtol) or (math.inf, 0)
        done = math.isfinite(off)
        return {
            "rtol": rtol,
            "error": off if done else None,
            "passes": count if done else None,
        }

    return {
        "name": problem.name,
        "scale": size,
        "undamped": problem.undamped,
        "errors": [at(rtol) for rtol in TOLERANCES],
        "default": at(native.default_rtol()),
    }


def passes(problem: Problem) -> Row:
    """The fewest evaluations by which each method holds each error, its tolerance chosen by hand.

    Medians over nine tolerances near each other. A method is given up if a run takes PATIENCE times
    the longest run of "auto".

    Returns:
        A row: name, methods, and the passes of each method at each of `ERRORS`; None if it fails.
    """
    system, exact = native.system(problem.robot), native.converged(problem)
    methods = native.methods(problem)
    curves: dict[str, list[list[tuple[float, int]]]] = {method: [] for method in methods}
    limit = LIMIT_S
    for method in methods:
        longest = 0.0
        for share in SCATTER:
            runs = []
            for rtol in RTOLS + TIGHTER:
                begun = time.process_time()
                found = measured(problem, system, exact, float(share * rtol), method, limit)
                longest = max(longest, time.process_time() - begun)
                if found is None:
                    break
                runs.append(found)
                if found[0] <= min(ERRORS):
                    break
            curves[method].append(runs)
        if method == "auto":
            limit = min(LIMIT_S, max(0.2, PATIENCE * longest))
    fewest = lambda runs, target: min((count for off, count in runs if off <= target), default=None)
    rows: list[Row] = []
    for target in ERRORS:
        row: dict[str, int | None] = {}
        for method, curve in curves.items():
            counts = [fewest(runs, target) for runs in curve]
            reached = [count for count in counts if count is not None]
            row[method] = (
                int(np.median(reached)) if len(reached) == len(counts) and reached else None
            )
        rows.append({"error": target, "passes": row})
    return {"name": problem.name, "methods": list(methods), "passes": rows}


def beyond(rows: list[Row]) -> list[str]:
    """Sentences about problems whose error exceeds the limit; undamped ringing is exempt.

    Args:
        rows: rows of `errors`.
    """
    out = []
    for row in rows:
        if row["undamped"]:
            continue
        for each in row["errors"]:
            if each["error"] is None:
                out.append(f"{row['name']}: fails at rtol {each['rtol']:g}")
            elif each["error"] > MAX_ERROR_OVER_RTOL * each["rtol"]:
                out.append(
                    f"{row['name']}: {each['error'] / each['rtol']:.3g} rtol at {each['rtol']:g}, "
                    f"asked {MAX_ERROR_OVER_RTOL:g}"
                )
        usual = row["default"]["error"]
        if usual is None:
            out.append(f"{row['name']}: fails by default")
        elif usual > MAX_DEFAULT_ERROR:
            out.append(f"{row['name']}: {usual:.1e} by default, asked {MAX_DEFAULT_ERROR:g}")
    return out


def slower(rows: list[Row]) -> list[str]:
    """Sentences about errors for which "auto" takes more evaluations than the limit, or fails.

    Args:
        rows: rows of `passes`.
    """
    out = []
    for row in rows:
        for each in row["passes"]:
            counts = {
                method: count for method, count in each["passes"].items() if count is not None
            }
            auto, best = counts.pop("auto", math.inf), min(counts.values(), default=math.inf)
            if auto > MAX_PASS_RATIO * best + EXTRA_PASSES:
                out.append(
                    f"{row['name']}: {auto:g} evaluations for an error of {each['error']:g}, the "
                    f"cheapest method {best:g}"
                )
    return out
