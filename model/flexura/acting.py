"""What acts on a robot in a run, and where a run ends: drives, prescribed motions, powers, limits, compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .chain import COULOMB_SPEED, SLEEVE, SLIDER, Chain, Work
from .compiled import compiled, inlined, internal
from .law import Law
from .pinned import pinned
from .signal import evaluate, evaluated


class Inputs(NamedTuple):
    """What acts on a robot: packed signals (k, 10), their ranges (N, 4), gains and limits (N,), instants to step on."""

    segments: np.ndarray
    ranges: np.ndarray
    kp: np.ndarray
    kd: np.ndarray
    follows: np.ndarray  # (N,) int: joints whose motion is prescribed
    low: np.ndarray
    high: np.ndarray
    breaks: np.ndarray
    law: Law  # a sampled controller, which writes into the segments


@compiled
def drive(c: Chain, d: Inputs, t: float, y: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
    """Joint forces (N,) of the drives at time t."""
    for i in range(force.shape[0]):
        f0, f1, r0, r1 = d.ranges[i]
        total = 0.0
        if f1 > f0:
            total = evaluated(d.segments[f0:f1], t)[0]
        if r1 > r0:
            r, rd, _ = evaluate(d.segments[r0:r1], t)
            e = c.first[i]
            total += d.kp[i] * (r - y[e]) + d.kd[i] * (rd - v[e])
        force[i] = total


@inlined
def prescribe(c: Chain, w: Work, d: Inputs, t: float, y: np.ndarray, v: np.ndarray) -> None:
    """Put prescribed joints where their motion has them at t."""
    for i in range(d.follows.shape[0]):
        if d.follows[i]:
            e = c.first[i]
            y[e], v[e], w.given[i] = evaluate(d.segments[d.ranges[i, 2] : d.ranges[i, 3]], t)


@inlined
def found(c: Chain, w: Work, d: Inputs, v: np.ndarray, force: np.ndarray) -> None:
    """The drive forces that prescribed motions took in the pass just made, friction included."""
    for i in range(d.follows.shape[0]):
        if d.follows[i]:
            speed = v[c.first[i]]
            force[i] = w.reaction[i] + c.viscous[i] * speed + c.coulomb[i] * np.tanh(speed / COULOMB_SPEED)


@compiled
def powers(c: Chain, w: Work, v: np.ndarray, force: np.ndarray, dz: np.ndarray) -> None:
    """Power of the drives and power lost to friction and damping, into the last two entries of dz, after a pass."""
    n = v.shape[0]
    work, loss = 0.0, 0.0
    for i in range(force.shape[0]):
        e = c.first[i]
        work += force[i] * v[e]
        loss += c.viscous[i] * v[e] * v[e]
        if c.coulomb[i] > 0.0:
            loss += c.coulomb[i] * v[e] * np.tanh(v[e] / COULOMB_SPEED)
        for k in range(c.first[i + 1] - e - 1):
            if c.kind[i] == SLEEVE:
                for j in range(c.first[i + 1] - e - 1):
                    loss += (c.alpha[i] * w.M[i, k, j] + c.beta[i] * w.K[i, k, j]) * v[e + 1 + k] * v[e + 1 + j]
            else:
                loss += c.damp[i, k] * v[e + 1 + k] * v[e + 1 + k]
    dz[2 * n], dz[2 * n + 1] = work, loss


@internal
def beyond(c: Chain, d: Inputs, z: np.ndarray) -> int:
    """The first joint beyond its limits, or a slider that has run into the sleeve of the link it rides on; -1: none."""
    for i in range(c.kind.shape[0]):
        e = c.first[i]
        if not (d.low[i] <= z[e] <= d.high[i]):
            return i
        if i == 0 or c.kind[i] != SLIDER or c.locked[i]:
            continue
        under, at = i - 1, z[e]
        if i > 1 and c.kind[under] == SLIDER and c.locked[under] and c.angle[under] == 0.0:
            under, at = i - 2, at + z[c.first[under]]  # on a link cut in two there
        if c.kind[under] == SLEEVE and at + z[c.first[under]] < c.length[under]:
            return i
    return -1


@compiled
def outside(c: Chain, d: Inputs, z: np.ndarray) -> int:
    """`beyond` for Python."""
    return beyond(pinned(c), pinned(d), z)
