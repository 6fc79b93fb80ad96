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


def faults(sys: fx.System, rng: np.random.Generator) -> list[str]:
    """What is wrong at a random state: nothing, one hopes."""
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
    # in extended precision: in double the assembly's own round-off is up to 1e-11 of a row
    dense, at, rates = sys.assembly, q.astype(np.longdouble), qd.astype(np.longdouble)
    damping = dense.damping(at) @ rates
    terms = (dense.bias(at, rates), dense.elastic(at), dense.gravity(at), damping, -force)
    M = dense.mass(at)
    residual = M @ a + sum(terms)
    size = np.abs(M) @ np.abs(a) + sum(np.abs(x) for x in terms)
    share = np.abs(residual / np.where(size > 0, size, 1.0))
    share[sys.joint_rows[sys.locked]] = 0.0  # these rows have the reactions
    if not share.max() <= 1e-12:
        out.append(f"residual {share.max():.1e} in {sys.labels[np.argmax(share)]}")
    return out
