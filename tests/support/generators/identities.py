"""Identities of any chain in any state: M(q) is positive definite, and the recursion of the core
solves the assembled equations."""

from __future__ import annotations

import numpy as np

import flexura as fx
from robots import bending


def random_state(
    sys: fx.System, rng: np.random.Generator, slope: float = 2.0
) -> tuple[np.ndarray, np.ndarray]:
    """q and qd (n,): tip slopes up to `slope` rad, and a ripple on every unknown."""
    q, qd = sys.start(), rng.normal(size=sys.n)
    for i, (row, link) in enumerate(zip(sys.joint_rows, sys.robot.links, strict=True)):
        if link.joint.type != "R":
            qd[row] *= 0.3 * link.length_m
        own = sys.link_rows(i)
        for z, size in ((q, slope), (qd, 3.0)):
            if i in sys.windup_rows:
                z[sys.windup_rows[i]] = 0.3 * rng.normal()
            if len(own):
                z[own] = bending(sys, i, size * rng.uniform(-1, 1, 3) / [1, 3, 9]) * (
                    1 + 0.1 * rng.normal(size=len(own))
                )
    return q, qd


def by_one_unit(rng: np.random.Generator, *states: np.ndarray) -> list[np.ndarray]:
    """The same numbers, each with its last place moved by one unit up or down."""
    way = lambda x: np.where(rng.random(len(x)) < 0.5, -np.inf, np.inf)
    return [np.nextafter(x, way(x)) for x in states]


def faults(sys: fx.System, rng: np.random.Generator) -> list[str]:
    """What is wrong at a random state: nothing, one hopes.

    The residual of a row is at most 1e-12 of its terms, or no more than it moves where the last
    places of q and q' move by four units. The rows of a sleeve's last shapes need the latter: their
    terms are sums that nearly vanish.
    """
    q, qd = random_state(sys, rng)
    M, out = sys.mass(q), []
    scale = np.sqrt(np.diag(M))
    if not (scale > 0).all():
        return ["a diagonal entry of M is not positive"]
    unit = M / np.outer(scale, scale)
    if np.linalg.cond(unit) < 1e13:
        try:
            np.linalg.cholesky(unit)
        except np.linalg.LinAlgError:
            out.append(
                f"M is not positive definite, smallest eigenvalue {np.linalg.eigvalsh(unit)[0]:.1e}"
            )
    force = np.zeros(sys.n)
    force[sys.joint_rows] = rng.normal(size=len(sys.joint_rows)) * (M @ np.abs(qd))[sys.joint_rows]
    a = sys.accelerations(q, qd, force)

    def residual(q: np.ndarray, qd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        terms = (sys.bias(q, qd), sys.elastic(q), sys.gravity(q), sys.damping_at(q) @ qd, -force)
        M = sys.mass(q)
        return M @ a + sum(terms), np.abs(M) @ np.abs(a) + sum(np.abs(x) for x in terms)

    left, size = residual(q, qd)
    size = np.where(size > 0, size, 1.0)
    share = np.abs(left / size)
    share[sys.joint_rows[sys.locked]] = 0.0  # these rows have the reactions
    row = int(np.argmax(share))
    if not share[row] <= 1e-12:
        own = np.random.default_rng(0)
        moved = [residual(*by_one_unit(own, q, qd))[0][row] - left[row] for _ in range(20)]
        if not share[row] <= 4.0 * max(np.abs(moved)) / size[row]:
            out.append(f"residual {share[row]:.1e} in {sys.labels[row]}")
    return out
