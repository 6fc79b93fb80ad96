"""Inverse dynamics by Newton-Euler: forces from accelerations, outward and back, without the condensation of `kernel`."""

from __future__ import annotations

import numpy as np

from .chain import REVOLUTE, Chain, Work
from .compiled import compiled
from .outward import outward


@compiled
def inverse(c: Chain, w: Work, y: np.ndarray, v: np.ndarray, a: np.ndarray, gravity: np.ndarray, out: np.ndarray) -> None:
    """Generalised forces out (n,) = M(y) a + bias(y, v) + gravity, without stiffness, damping and friction (Newton-Euler).

    Exact and independent of the condensation in `accelerate`: the check of one against the other is a test.
    """
    outward(c, w, y, v)
    links = c.kind.shape[0]
    t0, t1, t2 = -gravity[0], -gravity[1], 0.0
    for i in range(links):
        e, end = c.first[i], c.first[i + 1]
        if c.kind[i] == REVOLUTE:
            t2 += a[e]
        else:
            t0 += a[e]
        cs, sn = w.cos[i], w.sin[i]
        u0, u1, u2 = cs * t0 + sn * t1, cs * t1 - sn * t0, t2
        w.u[i, 0], w.u[i, 1], w.u[i, 2] = u0, u1, u2
        t0, t1, t2 = u0 - w.place[i, 1] * u2 + w.place[i, 2], u1 + w.place[i, 0] * u2 + w.place[i, 3], u2 + w.place[i, 4]
        for k in range(end - e - 1):
            t0 -= w.hq[i, k] * a[e + 1 + k]
            t1 += c.NL[i, k] * a[e + 1 + k]
            t2 += w.tilt[i] * c.SL[i, k] * a[e + 1 + k]
    f0, f1, f2 = 0.0, 0.0, 0.0
    for i in range(links - 1, -1, -1):
        e, end = c.first[i], c.first[i + 1]
        u0, u1, u2 = w.u[i, 0], w.u[i, 1], w.u[i, 2]
        F0 = c.mass[i] * u0 - w.body[i, 0] * u2 + w.body[i, 3] + f0
        F1 = c.mass[i] * u1 + w.body[i, 1] * u2 + w.body[i, 4] + f1
        F2 = (
            -w.body[i, 0] * u0
            + w.body[i, 1] * u1
            + w.body[i, 2] * u2
            + w.body[i, 5]
            - w.place[i, 1] * f0
            + w.place[i, 0] * f1
            + f2
        )
        for k in range(end - e - 1):
            F0 -= w.g1q[i, k] * a[e + 1 + k]
            F1 += c.S0[i, k] * a[e + 1 + k]
            F2 += w.mt[i, k] * a[e + 1 + k]
            own = a[e + 1 + k] + c.S0[i, k] * u1 + w.mt[i, k] * u2 - w.g1q[i, k] * u0 + w.cv[i, k]
            out[e + 1 + k] = own - w.hq[i, k] * f0 + c.NL[i, k] * f1 + w.tilt[i] * c.SL[i, k] * f2
        if c.stiffening:
            spin = 0.0
            for k in range(end - e - 1):
                spin += c.tip_inertia[i] * (w.tilt[i] * w.tilt[i] - 1.0) * c.SL[i, k] * a[e + 1 + k]
            for k in range(end - e - 1):
                out[e + 1 + k] += spin * c.SL[i, k]
            for p in range(c.points[i]):
                total = 0.0
                for k in range(end - e - 1):
                    total += w.h[i, p, k] * a[e + 1 + k]
                for k in range(end - e - 1):
                    out[e + 1 + k] += c.point_mass[i, p] * total * w.h[i, p, k]
        cs, sn = w.cos[i], w.sin[i]
        f0, f1, f2 = cs * F0 - sn * F1, sn * F0 + cs * F1, F2
        out[e] = (f2 if c.kind[i] == REVOLUTE else f0) + c.rotor[i] * a[e]
