"""How the cost of one evaluation of the equations of motion grows with links and elements."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

import flexura as fx
from flexura.kernel import accelerate

LINKS = (1, 2, 4, 8, 16, 32, 64)
ELEMENTS = (1, 2, 4, 8, 16)
PART = 4  # elements of each part of a link that is cut
CALLS, ROUNDS = 20, 70  # short rounds: a longer one is interrupted by whatever else runs


def chain(links: int, elements: int) -> fx.System:
    """R joints between equal flexible links."""
    link = {
        "length_m": 0.5, "elements": elements, "mass_per_length_kg_m": 0.3, "bending_stiffness_N_m2": 2.0,
        "joint": {"type": "R", "hub_inertia_kg_m2": 1e-3},
    }  # fmt: skip
    return fx.assemble(fx.Robot.from_dict({"link": [link] * links}))


def evaluation_s(system: fx.System) -> float:
    """Seconds for one evaluation, the call from Python (about 8 microseconds) in it; the quickest of several rounds."""
    state = np.random.default_rng(0).uniform(-1e-3, 1e-3, (2, system.n))
    a, none = np.zeros(system.n), np.zeros(len(system.links))
    y, v, work, best = state[0], state[1], system._work(), np.inf
    for _ in range(ROUNDS):
        begun = time.perf_counter()
        for _ in range(CALLS):
            accelerate(system.chain, work, y, v, y, v, 0.0, none, none, none, a)
        best = min(best, (time.perf_counter() - begun) / CALLS)
    return best


def measure() -> list[dict[str, Any]]:
    """Rows: what grows, how many of it, microseconds beyond the call, and how often the time of half as many."""
    rows: list[dict[str, Any]] = []
    call = evaluation_s(fx.assemble(fx.Robot.from_dict({"link": [{"length_m": 0.0, "mass_kg": 1.0, "joint": {"type": "Pa"}}]})))
    whole = lambda count: chain(1, count)
    in_parts = lambda count: fx.assemble(fx.cut(whole(count).robot, 1, count // PART))
    for what, counts, made in (
        ("links of 2 elements", LINKS, lambda count: chain(count, 2)),
        ("elements of a link", ELEMENTS, whole),
        (f"elements of a link, cut into parts of {PART}", [k for k in LINKS if k >= PART], in_parts),
    ):
        before = None
        for count in counts:
            took = evaluation_s(made(count)) - call
            rows.append({"what": what, "count": count, "us": 1e6 * took, "ratio": took / before if before else None})
            before = took
    return rows
