"""Accuracy and evaluations of the solver: python -m flexlab.benchmarks accuracy, and ... passes.

Errors are those of `problem.error`, from the converged motion on the problem's own mesh: what the
tolerance is to keep. Passes are evaluations of the equations of motion for an error, by each
method: medians over nine tolerances within a tenth of one, which scatter as runs with other first
steps do.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

import flexura as fx

from . import native
from .choose import RTOLS
from .problems.problem import Channels, Problem, error, scale

TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
ERRORS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
TIGHTER = (3e-9, 1e-9, 3e-10, 1e-10)  # tolerances that a small error takes
MOST_TIMES_RTOL, MOST_BY_DEFAULT = 20.0, 1e-4  # asked
SCATTER = np.geomspace(1 / 1.1, 1.1, 9)  # times a tolerance
LIMIT_S, PATIENCE = 30.0, 4.0
MOST_PASSES, MORE_PASSES = (
    2.0,
    100,
)  # asked of "auto": so many times those of the cheapest method, and so many more
Row = dict[str, Any]


def measured(
    problem: Problem,
    system: fx.System,
    exact: Channels,
    rtol: float,
    method: str = "auto",
    limit_s: float = LIMIT_S,
) -> tuple[float, int] | None:
    """Error and evaluations of a run, or None if it fails or takes too long."""
    try:
        answer = native.run(problem, system, rtol, method, limit_s=limit_s)
    except (native.TooSlow, fx.FlexuraError, RuntimeError):
        return None
    return error(answer.channels, exact), answer.evaluations


def errors(problem: Problem) -> Row:
    """Errors at each tolerance and with default settings, by method "auto"."""
    system, exact = native.system(problem.robot), native.converged(problem)
    size = scale(exact)
    rows: list[Row] = []
    for rtol in TOLERANCES:
        found = measured(problem, system, exact, rtol)
        rows.append(
            {
                "rtol": rtol,
                "error": None if found is None else found[0],
                "passes": None if found is None else found[1],
            }
        )
    usual = measured(problem, system, exact, native.default_rtol())
    default = {"error": None if usual is None else usual[0]}
    return {
        "name": problem.name,
        "scale": size,
        "undamped": problem.undamped,
        "errors": rows,
        "default": default,
    }


def passes(problem: Problem) -> Row:
    """The fewest evaluations by which each method holds each error, its tolerance chosen by hand.

    Medians over nine tolerances near each other. A method whose run takes PATIENCE times the
    longest one of "auto" is given up.
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
    """The problems, but the undamped ringing ones, whose error is more than is asked, in words."""
    out = []
    for row in rows:
        if row["undamped"]:
            continue
        for each in row["errors"]:
            if each["error"] is None:
                out.append(f"{row['name']}: fails at rtol {each['rtol']:g}")
            elif each["error"] > MOST_TIMES_RTOL * each["rtol"]:
                out.append(
                    f"{row['name']}: {each['error'] / each['rtol']:.3g} rtol at {each['rtol']:g}, "
                    f"asked {MOST_TIMES_RTOL:g}"
                )
        usual = row["default"]["error"]
        if usual is not None and usual > MOST_BY_DEFAULT:
            out.append(f"{row['name']}: {usual:.1e} by default, asked {MOST_BY_DEFAULT:g}")
    return out


def slower(rows: list[Row]) -> list[str]:
    """Where "auto" takes more evaluations than is asked, in words."""
    out = []
    for row in rows:
        for each in row["passes"]:
            counts = {
                method: count for method, count in each["passes"].items() if count is not None
            }
            auto, best = counts.pop("auto", None), min(counts.values(), default=None)
            if auto is not None and best is not None and auto > MOST_PASSES * best + MORE_PASSES:
                out.append(
                    f"{row['name']}: {auto} evaluations for an error of {each['error']:g}, the "
                    f"cheapest method {best}"
                )
    return out
