"""flexura's cheapest settings for a given error: every method over a row of tolerances."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import flexura as fx

from . import native
from .native import Answer, TooSlow
from .problems.problem import Channels, Problem, error

RTOLS = (3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7, 1e-7, 3e-8, 1e-8)
BETWEEN = (2.0, 1.4)  # times a tolerance that holds: tried before the next looser one is given up
LIMIT_S = 30.0  # processor time of a run while nothing better is known
PATIENCE = 4.0  # times the best so far: a longer run is given up
# runs shorter than REPEAT_BELOW_S are timed again so often
REPEAT_BELOW_S, REPEATS = 0.2, 3


@dataclass(frozen=True)
class Setting:
    """A method and a tolerance, with their error, evaluations and processor time [s]."""

    method: str
    rtol: float
    error: float
    evaluations: int
    seconds: float
    chosen: str  # what "auto" chose

    def to_dict(self) -> dict[str, Any]:
        """The setting as a row for JSON, without its time."""
        return {
            "method": self.method,
            "took": self.chosen,
            "rtol": self.rtol,
            "error": self.error,
            "evaluations": self.evaluations,
        }


def cheapest(
    problem: Problem,
    system: fx.System,
    exact: Channels,
    target: float,
    cost: Callable[[Setting], float] = lambda s: s.seconds,
) -> tuple[Setting | None, Setting | None]:
    """The cheapest setting that holds an error, and the setting of "auto".

    The next tighter tolerance must hold the error too, so that no lucky hit counts.

    Args:
        problem: what is run.
        system: its assembled robot.
        exact: the converged channels.
        target: the error to hold, as in `problem.error`.
        cost: what is compared, by default processor time [s].

    Returns:
        (best, auto); None for each that does not hold the error.
    """
    found: dict[str, Setting] = {}
    for method in native.methods(problem):
        limit = PATIENCE * min((s.seconds for s in found.values()), default=LIMIT_S / PATIENCE)
        setting = loosest_tolerance(problem, system, exact, target, method, max(limit, 0.05))
        if setting is not None:
            found[method] = setting
    best = min(found.values(), key=cost, default=None)
    return best, found.get("auto")


def loosest_tolerance(
    problem: Problem, system: fx.System, exact: Channels, target: float, method: str, limit_s: float
) -> Setting | None:
    """The loosest tolerance at which a method holds an error, the next tighter one included.

    Of `RTOLS`, and of two between that one and the next looser one.

    Args:
        problem: what is run.
        system: its assembled robot.
        exact: the converged channels.
        target: the error to hold.
        method: a method of `fx.simulate`.
        limit_s: processor time after which a run is given up [s].

    Returns:
        The setting, or None.
    """
    candidate: tuple[float, float, Answer] | None = None
    for rtol in RTOLS:
        try:
            answer = native.run(problem, system, rtol, method, limit_s=limit_s)
            error_found = error(answer.channels, exact)
        except TooSlow:
            break
        except (fx.FlexuraError, RuntimeError):
            candidate = None
            continue
        if error_found > target:
            candidate = None
        elif candidate is None:
            candidate = rtol, error_found, answer
        else:
            break
    if candidate is None:
        return None
    for factor in BETWEEN if candidate[0] < RTOLS[0] else ():
        rtol = factor * candidate[0]
        with suppress(TooSlow, fx.FlexuraError, RuntimeError):
            answer = native.run(problem, system, rtol, method, limit_s=limit_s)
            if (error_found := error(answer.channels, exact)) <= target:
                candidate = rtol, error_found, answer
                break
    rtol, error_found, answer = candidate
    repeats = REPEATS if answer.seconds < REPEAT_BELOW_S else 0
    seconds = min(
        [answer.seconds]
        + [native.run(problem, system, rtol, method).seconds for _ in range(repeats)]
    )
    return Setting(method, rtol, error_found, answer.evaluations, seconds, answer.method)
