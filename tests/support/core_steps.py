"""Steps of the core one by one, for tests that compute each of them again."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

import flexura as fx
from flexura import core


class Step(NamedTuple):
    """The state after a good step, and how many attempts were refused before."""

    t: float
    q: np.ndarray
    v: np.ndarray
    accounts: np.ndarray
    refused: int = 0


def simulation(
    system: fx.System,
    method: str,
    q: Any,
    qd: Any,
    end: float,
    rtol: float,
    first: float = 0.0,
    drive: fx.Drive | None = None,
) -> Any:
    """A run of the core from (q, qd) to `end`; `first` [s]: its first step."""
    n, joints = system.n, len(system.robot.links)
    segments, ranges, gains = (drive or fx.Drive.none(joints)).packed()
    none = np.zeros(joints, dtype=np.uint8)
    q, qd = (np.array(x, dtype=float).reshape(n) for x in (q, qd))
    return core.Simulation(
        robot=system.equations,
        t=np.array([0.0, end]),
        q=q,
        v=qd,
        rtol=rtol,
        method=method,
        segments=segments,
        ranges=ranges,
        gains=gains,
        prescribed=none,
        sampled=none,
        limits=np.tile([-np.inf, np.inf], (joints, 1)),
        function=None,
        sampler=None,
        rate_Hz=0.0,
        first_step=first,
        numerical_damping=True,
        most_steps=0,
    )


def steps(
    system: fx.System,
    method: str,
    q: Any,
    qd: Any,
    end: float,
    rtol: float,
    count: int = 60,
    **keys: Any,
) -> list[Step]:
    """The states after each good step, the start's first."""
    run, n = simulation(system, method, q, qd, end, rtol, **keys), system.n
    out = [Step(0.0, np.array(q, dtype=float), np.array(qd, dtype=float), np.zeros(4))]
    for _ in range(200):
        going = run.advance(1)
        about, z = run.progress(), np.array(run.state())
        if about["t"] > out[-1].t:
            out.append(Step(about["t"], z[:n], z[n : 2 * n], z[2 * n :], about["rejected"]))
        if not going or len(out) > count:
            break
    return out
