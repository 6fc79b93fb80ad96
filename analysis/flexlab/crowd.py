"""How fast a population is on this machine: many different robots of the benchmark manoeuvre, on all cores."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

import flexura as fx
from flexura.assembly import assemble_all
from flexura.engine import cores, engine
from flexura.forward import initial, to_state

from . import baseline

ROBOTS, ROUNDS = 1000, 3
RTOL, METHOD = 1e-3, "auto"


def batch(robots: int = ROBOTS) -> fx.Batch:
    """Type IV of 12 elements and 3 modes, length, payload and stiffness each 20 % up or down."""
    made, random = baseline.robot(12, 3), np.random.default_rng(0)
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
    """Rows: what is timed, and its shortest time a robot [us] of `rounds`, in turn."""
    many, drive, threads = batch(), fx.Drive.force(baseline.FORCE, baseline.TORQUE), cores()
    robots = [robot for robot, _ in many]
    systems = [system for system in assemble_all(robots) if isinstance(system, fx.System)]
    states = np.array([to_state(s, *initial(s, 0.0, drive, None, None)) for s in systems])
    whole: Callable[[], Any] = lambda: fx.simulate(many, baseline.T, drive, rtol=RTOL, method=METHOD)
    parts: dict[str, Callable[[], Any]] = {
        f"whole, from robots made anew to their channels, {threads} cores": whole,
        f"time loop alone, {threads} cores": lambda: engine(
            systems, baseline.T, [drive] * len(systems), states, RTOL, METHOD, threads
        ),
        "assembly alone, one core": lambda: assemble_all(robots),
        "making the robots alone, one core": lambda: list(many),
    }

    def timed(run: Callable[[], Any]) -> float:
        begun = time.perf_counter()
        run()
        return time.perf_counter() - begun

    took = np.array([[timed(run) for run in parts.values()] for _ in range(rounds)]).min(axis=0)
    return [{"what": name, "us": 1e6 * float(s) / ROBOTS} for name, s in zip(parts, took, strict=True)]
