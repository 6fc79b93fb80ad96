"""How the cost of one evaluation of the equations of motion grows with links and elements."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from flexura.kernel import accelerate

import flexura as fx

LINKS = (1, 2, 4, 8, 16, 32, 64)
ELEMENTS = (1, 2, 4, 8, 16)
PART = 4  # elements of each part of a link that is cut
CALLS, ROUNDS = 20, 60  # many short rounds, each of all in turn: whatever else runs spoils some rounds, not one of the rows


def chain(links: int, elements: int) -> fx.System:
    """R joints between equal flexible links."""
    link = {
        "length_m": 0.5, "elements": elements, "mass_per_length_kg_m": 0.3, "bending_stiffness_N_m2": 2.0,
        "joint": {"type": "R", "hub_inertia_kg_m2": 1e-3},
    }  # fmt: skip
    return fx.assemble(fx.Robot.from_dict({"link": [link] * links}))


def timed(system: fx.System) -> Callable[[], float]:
    """A function that times one evaluation [s], the call from Python (about 8 microseconds) in it."""
    state = np.random.default_rng(0).uniform(-1e-3, 1e-3, (2, system.n))
    a, none = np.zeros(system.n), np.zeros(len(system.links))
    y, v, work = state[0], state[1], system._work()

    def once() -> float:
        begun = time.perf_counter()
        for _ in range(CALLS):
            accelerate(system.chain, work, y, v, y, v, 0.0, none, none, none, a)
        return (time.perf_counter() - begun) / CALLS

    return once


def measure() -> list[dict[str, Any]]:
    """Rows: what grows, how many of it, microseconds beyond the call, and how often the time of half as many."""
    whole = lambda count: chain(1, count)
    in_parts = lambda count: fx.assemble(fx.cut(whole(count).robot, 1, count // PART))
    cases = [
        (what, count, timed(made(count)))
        for what, counts, made in (
            ("links of 2 elements", LINKS, lambda count: chain(count, 2)),
            ("elements of a link", ELEMENTS, whole),
            (f"elements of a link, cut into parts of {PART}", [k for k in LINKS if k >= PART], in_parts),
        )
        for count in counts
    ]
    nothing = timed(fx.assemble(fx.Robot.from_dict({"link": [{"length_m": 0.0, "mass_kg": 1.0, "joint": {"type": "Pa"}}]})))
    rounds = np.array([[run() for run in (nothing, *(run for *_, run in cases))] for _ in range(ROUNDS)])
    best = rounds.min(axis=0)
    took = 1e6 * (best[1:] - best[0])
    rows: list[dict[str, Any]] = []
    for k, (what, count, _) in enumerate(cases):
        same = k > 0 and cases[k - 1][0] == what
        rows.append({"what": what, "count": count, "us": float(took[k]), "ratio": float(took[k] / took[k - 1]) if same else None})
    return rows
