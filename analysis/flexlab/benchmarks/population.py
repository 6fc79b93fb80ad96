"""Speed of a population: many different robots of `type4` on all cores, beside Exudyn."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np

import flexura as fx

from . import exudyn_search, native
from .exudyn_programs import run as exudyn_run
from .problems.motions import all_motions
from .timing import ratio

ROBOTS, REPEATS = 1000, 3
RTOL = 2e-3
REQUIRED_LOOP_RATIO, REQUIRED_WHOLE_RATIO = 1300.0, 1000.0
VARIED = ("link.2.length_m", "payload.mass_kg", "link.2.young_modulus_Pa")
SPREAD = 0.2  # up or down


def batch(robots: int = ROBOTS) -> fx.Batch:
    """Robots of type IV, 12 elements and 2 modes; length, payload and stiffness vary by 20 %.

    Args:
        robots: their number.
    """
    problem, random = all_motions()["type4"], np.random.default_rng(0)
    tables = problem.robot
    middle = (
        tables["link"][1]["length_m"],
        tables["payload"]["mass_kg"],
        tables["link"][1]["young_modulus_Pa"],
    )
    around = lambda value: value * random.uniform(1 - SPREAD, 1 + SPREAD, robots)
    return fx.Batch.vary(
        fx.Robot.from_dict(tables),
        {key: around(value) for key, value in zip(VARIED, middle, strict=True)},
    )


def measure(rounds: int, robots: int = ROBOTS) -> list[dict[str, Any]]:
    """Wall time a robot of a population, and its ratio to one run of Exudyn.

    The time loop is the time of the whole call less that of a call whose runs end where they begin.
    flexura's time is wall time on all cores, Exudyn's the processor time of one run.

    Args:
        rounds: rounds in which the programs take turns.
        robots: size of the population.

    Returns:
        Rows: what is timed, the required ratio, the median time a robot [us], the ratio's
            quartiles.
    """
    problem, many = all_motions()["type4"], batch(robots)
    drive, choice = native.drive(problem.work), exudyn_search.choice("type4")

    def whole(t: np.ndarray) -> float:
        begun = time.perf_counter()
        fx.simulate(many, t, drive, rtol=RTOL, channels=["tip/x", "tip/y", "link/2/tip_deflection"])
        return time.perf_counter() - begun

    shortest: Callable[[Callable[[], float]], float] = lambda run: min(
        run() for _ in range(REPEATS)
    )
    programs = [
        lambda: exudyn_run.run(problem, choice)[0],
        lambda: whole(problem.t) / robots,
        lambda: whole(problem.t[:1]) / robots,
    ]
    # the first round warms up
    took = np.array([[shortest(run) for run in programs] for _ in range(rounds + 1)])[1:]
    parts = [
        (
            f"from robots made anew to their channels, {os.cpu_count()} cores",
            took[:, 1],
            REQUIRED_WHOLE_RATIO,
        ),
        (
            "time loop and channels, without making the robots",
            took[:, 1] - took[:, 2],
            REQUIRED_LOOP_RATIO,
        ),
    ]
    numbers = lambda seconds: {
        "us": 1e6 * float(np.median(seconds)),
        "ratio": asdict(ratio(took[:, 0], seconds)),
    }
    return [{"what": what, "asked": asked} | numbers(seconds) for what, seconds, asked in parts]
