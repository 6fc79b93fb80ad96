"""flexura's cheapest settings for a given error: every method over a row of tolerances."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import flexura as fx

from . import native
from .native import Answer, TooSlow
from .problems.problem import Channels, Problem, error

RTOLS = (3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7, 1e-7, 3e-8, 1e-8)
LIMIT_S = 30.0  # processor time of a run while nothing better is known
PATIENCE = 4.0  # times the best so far: what takes longer is given up
AGAIN_S, AGAIN = 0.2, 3  # runs shorter than this are timed again so often before they are compared


@dataclass(frozen=True)
class Setting:
    """A method and a tolerance, the error they give, the evaluations and the processor time they
    take."""

    method: str
    rtol: float
    error: float
    evaluations: int
    seconds: float
    took: str  # what "auto" chose

    def to_dict(self) -> dict[str, Any]:
        return {
            "method": self.method,
            "took": self.took,
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
    """The cheapest setting that holds the target, and that of "auto"; the next tighter tolerance
    must hold it too, so that no lucky hit counts. None where there is none."""
    found: dict[str, Setting] = {}
    for method in native.methods(problem):
        limit = PATIENCE * min((s.seconds for s in found.values()), default=LIMIT_S / PATIENCE)
        setting = loosest(problem, system, exact, target, method, max(limit, 0.05))
        if setting is not None:
            found[method] = setting
    best = min(found.values(), key=cost, default=None)
    return best, found.get("auto")


def loosest(
    problem: Problem, system: fx.System, exact: Channels, target: float, method: str, limit_s: float
) -> Setting | None:
    """The loosest tolerance at which a method holds the target, and at the next tighter one too."""
    held: tuple[float, float, Answer] | None = None
    for rtol in RTOLS:
        try:
            answer = native.run(problem, system, rtol, method, limit_s=limit_s)
            off = error(answer.channels, exact)
        except TooSlow:
            break
        except (fx.FlexuraError, RuntimeError):
            held = None
            continue
        if off > target:
            held = None
        elif held is None:
            held = rtol, off, answer
        else:
            break
    if held is None:
        return None
    rtol, off, answer = held
    repeats = AGAIN if answer.seconds < AGAIN_S else 0
    seconds = min(
        [answer.seconds]
        + [native.run(problem, system, rtol, method).seconds for _ in range(repeats)]
    )
    return Setting(method, rtol, off, answer.evaluations, seconds, answer.method)
