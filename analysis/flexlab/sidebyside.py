"""Programs timed side by side on the same work, the first of them being what the others are measured against.

Every round times each program in turn, so that whatever else the machine does hits all alike; a quick one is run several times in
a round, of which the shortest counts. Ratios are formed round by round.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import flexura as fx
from flexura.drive import Drive


@dataclass(frozen=True)
class Result:
    """Wall time of the solver alone [s], and the tip deflections of the flexible links (k, T) [m]."""

    wall_s: float
    deflections: np.ndarray


@dataclass(frozen=True)
class Case:
    """A program: its name, a run of it, its own converged model, the ratio asked of it and the runs in a round."""

    name: str
    run: Callable[[], Result]
    converged: Callable[[], np.ndarray]
    asked: float | None = None
    repeats: int = 5


def error(found: np.ndarray, converged: np.ndarray) -> float:
    """The largest difference of a tip deflection (k, T) from the converged model, relative to its largest value."""
    return float((np.abs(found - converged).max(axis=1) / np.abs(converged).max(axis=1)).max())


def native(system: fx.System, t: np.ndarray, drive: Drive, rtol: float, method: str = "auto") -> Result:
    """A run of the native solver."""
    run = fx.simulate(system, t, drive, rtol=rtol, method=method)
    bent = [f"link/{i}/tip_deflection" for i, link in enumerate(system.robot.links, 1) if link.flexible]
    return Result(run.meta["wall_s"], np.array([run[name] for name in bent]))


def measure(cases: list[Case], rounds: int) -> list[dict[str, Any]]:
    """One row a case: median wall time [s], error, median ratio to the first case, its quartiles over the rounds, and what is
    asked of it."""
    errors = [error(case.run().deflections, case.converged()) for case in cases]  # and by now all is compiled and loaded
    once = lambda case: min(case.run().wall_s for _ in range(case.repeats))
    walls = np.array([[once(case) for case in cases] for _ in range(rounds)])
    rows: list[dict[str, Any]] = []
    for k, case in enumerate(cases):
        low, middle, high = (float(x) for x in np.percentile(walls[:, 0] / walls[:, k], (25, 50, 75)))
        numbers = {"wall_s": float(np.median(walls[:, k])), "error": errors[k]}
        rows.append({"case": case.name} | numbers | {"ratio": middle, "low": low, "high": high, "asked": case.asked})
    return rows
