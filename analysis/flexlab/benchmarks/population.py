"""How fast a population is on this machine: many different robots of the problem `type4`, on all
cores, beside Exudyn."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np

import flexura as fx

from . import native, search
from .exudyn_programs import run as exudyn_run
from .problems.motions import all_motions
from .timing import ratio

ROBOTS, REPEATS = 1000, 3
RTOL = 2e-3
ASKED_LOOP, ASKED_WHOLE = 1300.0, 1000.0
VARIED = ("link.2.length_m", "payload.mass_kg", "link.2.young_modulus_Pa")
SPREAD = 0.2  # up or down


def batch(robots: int = ROBOTS) -> fx.Batch:
    """Type IV of 12 elements and 2 modes, length, payload and stiffness each 20 % up or down."""
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
    """Rows: what is timed, its median wall time a robot [us], how often one Exudyn run takes that
    with the quartiles over the rounds, and what is asked.

    The time loop is what a run takes beyond one of the same robots that ends where it begins. Wall
    time on all cores; Exudyn's is the processor time of one run.
    """
    problem, many = all_motions()["type4"], batch(robots)
    drive, choice = native.drive(problem.work), search.choice("type4")

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
    took = np.array([[shortest(run) for run in programs] for _ in range(rounds + 1)])[
        1:
    ]  # the first round warms up
    parts = [
        (
            f"from robots made anew to their channels, {os.cpu_count()} cores",
            took[:, 1],
            ASKED_WHOLE,
        ),
        ("time loop and channels, without making the robots", took[:, 1] - took[:, 2], ASKED_LOOP),
    ]
    numbers = lambda seconds: {
        "us": 1e6 * float(np.median(seconds)),
        "ratio": asdict(ratio(took[:, 0], seconds)),
    }
    return [{"what": what, "asked": asked} | numbers(seconds) for what, seconds, asked in parts]
