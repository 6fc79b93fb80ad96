"""How the cost of one evaluation of the equations of motion grows with links and elements."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

import flexura as fx

from . import native
from .problems.robots import beam, robot, turning

LINKS = (1, 2, 4, 8, 16, 32, 64)
ELEMENTS = (1, 2, 4, 8, 16, 32)
MAX_GROWTH = 2.2  # required: at most, for twice the links or elements
T_S, RTOL = 1e-3, 1e-6  # a run of so many seconds, whose evaluations are counted


def chain_of(links: int, elements: int) -> fx.System:
    """A chain of equal flexible links with joints R.

    Args:
        links: number of links.
        elements: elements of each link.
    """
    return native.system(
        robot([beam(0.5, 2.0, 0.3, elements, turning(hub_inertia_kg_m2=1e-3))] * links)
    )


def timed(system: fx.System) -> Callable[[], float]:
    """A function that measures one evaluation of the equations of motion [us].

    It divides the time of a run's loop by the run's evaluations.
    """
    start = 1e-3 * np.random.default_rng(0).uniform(-1, 1, system.n)

    def once() -> float:
        run = fx.simulate(system, [0.0, T_S], None, qd0=start, rtol=RTOL, method="explicit")
        return 1e6 * float(run.meta["wall_s"]) / int(run.meta["evaluations"])

    return once


def measure(
    rounds: int, links: tuple[int, ...] = LINKS, elements: tuple[int, ...] = ELEMENTS
) -> list[dict[str, Any]]:
    """Time one evaluation for growing numbers of links and of elements.

    Args:
        rounds: repetitions, of which the shortest counts.
        links: numbers of links of 2 elements each.
        elements: numbers of elements of one link.

    Returns:
        Rows: what grows, its count, the time of an evaluation [us], and its ratio to the row
            before.
    """
    cases = [("links of 2 elements", n, timed(chain_of(n, 2))) for n in links]
    cases += [("elements of a link", n, timed(chain_of(1, n))) for n in elements]
    best = np.array([[run() for _, _, run in cases] for _ in range(rounds + 1)]).min(axis=0)
    rows: list[dict[str, Any]] = []
    for k, (what, count, _) in enumerate(cases):
        same = k > 0 and cases[k - 1][0] == what
        rows.append(
            {
                "what": what,
                "count": count,
                "us": float(best[k]),
                "times": float(best[k] / best[k - 1]) if same else None,
            }
        )
    return rows
