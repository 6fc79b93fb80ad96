"""How fast a population is on this machine: many different robots of the benchmark manoeuvre, on all cores."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

import numpy as np
from flexura.assembly import assemble_all

import flexura as fx
from flexura.engine import cores, engine
from flexura.forward import initial, to_state
from flexura.population import BLOCK

from . import baseline

ROBOTS, ROUNDS, REPEATS = 1000, 5, 3
RTOL, METHOD, ASKED = 2e-3, "auto", 1000.0


def batch(robots: int = ROBOTS) -> fx.Batch:
    """Type IV of 12 elements and 2 modes, length, payload and stiffness each 20 % up or down."""
    made, random = baseline.robot(12, 2), np.random.default_rng(0)
    around = lambda value: value * random.uniform(0.8, 1.2, robots)
    return fx.Batch.vary(
        made,
        {
            "link.2.length_m": around(baseline.LENGTH_M),
            "payload.mass_kg": around(baseline.PAYLOAD_KG),
            "link.2.young_modulus_Pa": around(baseline.YOUNG_PA),
        },
    )


def measure(rounds: int = ROUNDS) -> list[dict[str, Any]]:
    """Rows: what is timed, its median time a robot [us], and how often one Exudyn run takes that, with the quartiles over
    `rounds`, in turn, of the shortest of REPEATS runs each, and what is asked."""
    many, drive, threads = batch(), fx.Drive.force(baseline.FORCE, baseline.TORQUE), cores()
    robots, stop = [robot for robot, _ in many], np.zeros(1, dtype=bool)
    blocks = [assemble_all(robots[k : k + BLOCK]) for k in range(0, ROBOTS, BLOCK)]
    states = [np.array([to_state(s, *initial(s, 0.0, drive, None, None)) for s in systems]) for systems in blocks]
    run = lambda systems, y: engine(systems, range(len(y)), baseline.T, [drive] * len(y), y, RTOL, METHOD, stop)
    pool = ThreadPoolExecutor(threads)
    parts: dict[str, Callable[[], Any]] = {
        f"whole, from robots made anew to their channels, {threads} cores": lambda: fx.simulate(
            many, baseline.T, drive, rtol=RTOL, method=METHOD
        ),
        f"time loop alone, {threads} cores": lambda: list(pool.map(run, blocks, states)),
        "assembly alone, one core": lambda: [assemble_all(robots[k : k + BLOCK]) for k in range(0, ROBOTS, BLOCK)],
        "making the robots alone, one core": lambda: list(many),
    }

    def timed(run: Callable[[], Any]) -> float:
        begun = time.perf_counter()
        run()
        return time.perf_counter() - begun

    shortest = lambda seconds: min(seconds() for _ in range(REPEATS))
    programs = [lambda: baseline.exudyn().wall_s, *(partial(lambda run: timed(run) / ROBOTS, run) for run in parts.values())]
    took = np.array([[shortest(seconds) for seconds in programs] for _ in range(rounds + 1)])[1:]  # the first round warms up
    rows: list[dict[str, Any]] = []
    for k, name in enumerate(parts, 1):
        low, middle, high = (float(x) for x in np.percentile(took[:, 0] / took[:, k], (25, 50, 75)))
        asked = ASKED if k <= 2 else None  # what simulates
        numbers = {"us": 1e6 * float(np.median(took[:, k])), "ratio": middle, "low": low, "high": high}
        rows.append({"what": name} | numbers | {"asked": asked})
    return rows
