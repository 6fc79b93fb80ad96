"""Inverse dynamics by Newton-Euler: forces from accelerations, outward and back, without the condensation of `kernel`."""

from __future__ import annotations

import numpy as np

from .chain import SLEEVE, Chain, Work, of_many
from .compiled import compiled, internal
from .hubs import formed_block
from .outward import passed_outward
from .pinned import pinned


@compiled
def inverse(c: Chain, w: Work, y: np.ndarray, v: np.ndarray, a: np.ndarray, gravity: np.ndarray, out: np.ndarray) -> None:
    """Generalised forces out (n,) = M(y) a + bias(y, v) + gravity, without damping and friction, and without the constant
    stiffness: that of a sleeved link depends on d and is in `out`.

    Exact and independent of the condensation in `accelerate`: the check of one against the other is a test.
    """
    c, w = pinned(c), pinned(w)
    _prepare(c, w, y, v)
    _inverse(c, w, y, a, gravity, out)


@internal
def _prepare(c: Chain, w: Work, y: np.ndarray, v: np.ndarray) -> None:
    """What does not depend on the accelerations."""
    passed_outward(c, w, y, v)
    for i in range(c.kind.shape[0]):
        formed_block(c, w, i, 0.0)


@internal
def _inverse(c: Chain, w: Work, y: np.ndarray, a: np.ndarray, gravity: np.ndarray, out: np.ndarray) -> None:
    """`inverse` after `_prepare`."""
    links = c.kind.shape[0]
    t0, t1, t2 = -gravity[0], -gravity[1], 0.0
    for i in range(links):
        e, end = c.first[i], c.first[i + 1]
        cs, sn = w.cos[i], w.sin[i]
        if c.kind[i] != SLEEVE:
            t0 += w.slide[i, 0] * a[e]
            t1 += w.slide[i, 1] * a[e]
            t2 += w.slide[i, 2] * a[e]
        u0, u1, u2 = cs * t0 + sn * t1, cs * t1 - sn * t0, t2
        w.u[i, 0], w.u[i, 1], w.u[i, 2] = u0, u1, u2
        t0, t1, t2 = u0 - w.place[i, 1] * u2 + w.beta[i, 0], u1 + w.place[i, 0] * u2 + w.beta[i, 1], u2 + w.beta[i, 2]
        if c.kind[i] == SLEEVE:
            t0 += w.flow[i, 0] * a[e]
            t1 += w.flow[i, 1] * a[e]
            t2 += w.flow[i, 2] * a[e]
        for k in range(end - e - 1):
            t0 += w.terms[i, k, 4] * a[e + 1 + k]
            t1 += w.terms[i, k, 5] * a[e + 1 + k]
            t2 += w.terms[i, k, 6] * a[e + 1 + k]
    f0, f1, f2 = 0.0, 0.0, 0.0
    for i in range(links - 1, -1, -1):
        e, end = c.first[i], c.first[i + 1]
        m = end - e - 1
        u0, u1, u2 = w.u[i, 0], w.u[i, 1], w.u[i, 2]
        body = w.body[i]
        F0 = c.mass[i] * u0 - body[0] * u2 + body[3] + f0
        F1 = c.mass[i] * u1 + body[1] * u2 + body[4] + f1
        F2 = -body[0] * u0 + body[1] * u1 + body[2] * u2 + body[5] - w.place[i, 1] * f0 + w.place[i, 0] * f1 + f2
        for k in range(m):
            qdd = a[e + 1 + k]
            F0 += w.terms[i, k, 0] * qdd
            F1 += w.terms[i, k, 1] * qdd
            F2 += w.terms[i, k, 2] * qdd
            out[e + 1 + k] = w.terms[i, k, 0] * u0 + w.terms[i, k, 1] * u1 + w.terms[i, k, 2] * u2 + w.terms[i, k, 3]
            out[e + 1 + k] += w.terms[i, k, 4] * f0 + w.terms[i, k, 5] * f1 + w.terms[i, k, 6] * f2
        for k in range(m):
            for j in range(k, m):
                out[e + 1 + k] += w.S[i, k, j] * a[e + 1 + j]
                if j > k:
                    out[e + 1 + j] += w.S[i, k, j] * a[e + 1 + k]
        cs, sn = w.cos[i], w.sin[i]
        if c.kind[i] == SLEEVE:
            own = body[6] * u0 + body[7] * u1 + body[8] * u2 + body[9] * a[e] + body[10]
            own += w.flow[i, 0] * f0 + w.flow[i, 1] * f1 + w.flow[i, 2] * f2
            F0 += body[6] * a[e]
            F1 += body[7] * a[e]
            F2 += body[8] * a[e]
            for k in range(m):
                own += w.terms[i, k, 7] * a[e + 1 + k]
                out[e + 1 + k] += w.terms[i, k, 7] * a[e]
                for j in range(m):
                    out[e + 1 + k] += w.K[i, k, j] * y[e + 1 + j]
            f0, f1, f2 = cs * F0 - sn * F1, sn * F0 + cs * F1, F2
            out[e] = own + c.rotor[i] * a[e]
        else:
            f0, f1, f2 = cs * F0 - sn * F1, sn * F0 + cs * F1, F2
            out[e] = w.slide[i, 0] * f0 + w.slide[i, 1] * f1 + w.slide[i, 2] * f2 + c.rotor[i] * a[e]


@compiled
def mass(
    c: Chain, w: Work, y: np.ndarray, v: np.ndarray, a: np.ndarray, gravity: np.ndarray, bias: np.ndarray, M: np.ndarray
) -> None:  # fmt: skip
    """M(y) (n, n), column by column: what accelerations a of 1 add to the forces at rest, `bias` (n,), where v, a and gravity
    are 0 on entry."""
    c, w = pinned(c), pinned(w)
    _prepare(c, w, y, v)
    _inverse(c, w, y, a, gravity, bias)
    for k in range(y.shape[0]):
        a[k] = 1.0
        _inverse(c, w, y, a, gravity, M[k])
        a[k] = 0.0
        for j in range(y.shape[0]):
            M[k, j] -= bias[j]


@compiled
def masses(chains: Chain, w: Work, y: np.ndarray, zero: np.ndarray, M: np.ndarray) -> None:
    """M(y) (B, n, n) of many robots, fields of `chains` with a leading axis, at y (B, n); `zero` (4, n or more) is workspace."""
    n = y.shape[1]
    v, a, gravity, bias = zero[0, :n], zero[1, :n], zero[2, :2], zero[3, :n]
    for k in range(y.shape[0]):
        mass(of_many(chains, k), w, y[k], v, a, gravity, bias, M[k])
