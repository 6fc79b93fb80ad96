"""How accurate the solver is, and in how many evaluations: python -m flexlab.bench accuracy, and ... passes.

Errors are those of `problem.error`, from the converged motion on the problem's own mesh: what the tolerance is to keep. Passes
are evaluations of the equations of motion for an error, by each method: the median over nine first steps where `fx.simulate`
takes a first step.
"""

from __future__ import annotations

import inspect
from typing import Any

import numpy as np

import flexura as fx

from . import native
from .choose import RTOLS
from .problem import Channels, Problem, error, scale

TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
ERRORS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
TIGHTER = (3e-9, 1e-9, 3e-10, 1e-10)  # tolerances that a small error takes
MOST_TIMES_RTOL, MOST_BY_DEFAULT = 20.0, 1e-4  # asked
FIRST_STEPS = np.geomspace(0.25, 4.0, 9)  # times FIRST_S
FIRST_S = 1e-5
LIMIT_S = 30.0
Row = dict[str, Any]


def measured(
    problem: Problem, system: fx.System, exact: Channels, rtol: float, method: str = "auto", **keys: Any
) -> tuple[float, int] | None:
    """Error and evaluations of a run, or None if it fails or takes too long."""
    try:
        answer = native.run(problem, system, rtol, method, limit_s=LIMIT_S, **keys)
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
        rows.append({"rtol": rtol, "error": None if found is None else found[0], "passes": None if found is None else found[1]})
    usual = measured(problem, system, exact, native.default_rtol())
    default = {"error": None if usual is None else usual[0]}
    return {"name": problem.name, "scale": size, "undamped": problem.undamped, "errors": rows, "default": default}


def first_steps() -> list[dict[str, float]]:
    """What to hand to `fx.simulate` for nine first steps; nothing, once, where it takes none."""
    takes = "first_step_s" in inspect.signature(fx.simulate).parameters
    return [{"first_step_s": float(FIRST_S * k)} for k in FIRST_STEPS] if takes else [{}]


def passes(problem: Problem) -> Row:
    """The fewest evaluations by which each method holds each error, its tolerance chosen by hand; medians over first steps."""
    system, exact = native.system(problem.robot), native.converged(problem)
    methods = native.methods(problem)
    curves: dict[str, list[list[tuple[float, int]]]] = {method: [] for method in methods}
    for method in methods:
        for keys in first_steps():
            runs = []
            for rtol in RTOLS + TIGHTER:
                found = measured(problem, system, exact, rtol, method, **keys)
                if found is None:
                    break
                runs.append(found)
                if found[0] <= min(ERRORS):
                    break
            curves[method].append(runs)
    fewest = lambda runs, target: min((count for off, count in runs if off <= target), default=None)
    rows: list[Row] = []
    for target in ERRORS:
        row: dict[str, int | None] = {}
        for method, curve in curves.items():
            counts = [fewest(runs, target) for runs in curve]
            reached = [count for count in counts if count is not None]
            row[method] = int(np.median(reached)) if len(reached) == len(counts) and reached else None
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
                    f"{row['name']}: {each['error'] / each['rtol']:.3g} rtol at {each['rtol']:g}, asked {MOST_TIMES_RTOL:g}"
                )
        usual = row["default"]["error"]
        if usual is not None and usual > MOST_BY_DEFAULT:
            out.append(f"{row['name']}: {usual:.1e} by default, asked {MOST_BY_DEFAULT:g}")
    return out
