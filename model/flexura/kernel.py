"""The equations of motion, compiled: kinematics along the chain, forward and inverse dynamics, energies.

Notation of `model/README.md`. All vectors are in the axes of the link's hub frame; u = (ax, ay, alpha) is the
acceleration of the hub frame relative to free fall (gravity enters as an acceleration of the base), t that of the place where
the next joint is attached. A link's equations are

    F   = Mrr u + Mrq qdd + hr + X^T f             wrench that the joint exerts on the hub
    0   = Mqr u + Mqq qdd + hq + L q + D qd + Jq^T f   elastic rows; L = diag(omega^2), D diagonal
    t   = X u + Jq qdd + beta                      acceleration of the attachment, which carries the wrench f = A t + b

Condensing the outboard chain from the tip to the base gives A and b of every attachment (an articulated-body recursion with
elastic coordinates), and so, in `passes`, the accelerations, in time proportional to the number of links. No matrix larger than
a link's own elastic block is ever factorised.

`gh` makes the same pass an implicit stage: with y = y* + gh^2 a and v = v* + gh a the linear terms (stiffness,
damping, gains) are taken at y, v and the others at the current iterate. gh = 0 is plain forward dynamics.
"""

from __future__ import annotations

import numpy as np

from .chain import COULOMB_SPEED, REVOLUTE, SLEEVE, Chain, Work
from .compiled import compiled, inlined, internal
from .hubs import flexible_hub, last_hub, released, rigid_hub, sleeve_hub
from .lanes import WIDTH, load, pack, store, total
from .outward import passed_outward
from .pinned import pinned


@inlined
def _grip(
    c: Chain, w: Work, i: int, v: np.ndarray, vs: np.ndarray, gh: float, force: np.ndarray, kp: np.ndarray, kd: np.ndarray,
    diagonal: float, bias: float,
) -> tuple:  # fmt: skip
    """1 / (diagonal + ...), the force left for acceleration, and the acceleration where the joint's own row says so."""
    diagonal += c.rotor[i]
    w.joint[i, 5] = diagonal
    if w.held[i]:
        return 0.0, -bias, w.given[i]
    e = c.first[i]
    tau, hold = force[i] - c.viscous[i] * vs[e], 0.0
    if c.coulomb[i] > 0.0:
        grip = np.tanh(v[e] / COULOMB_SPEED)
        hold = c.coulomb[i] * (1.0 - grip * grip) / COULOMB_SPEED
        tau -= c.coulomb[i] * grip + hold * (vs[e] - v[e])
    dinv = 1.0 / (diagonal + gh * (c.viscous[i] + hold + kd[i]) + gh * gh * kp[i])
    rest = tau - bias
    return dinv, rest, rest * dinv


@internal
def passes(
    c: Chain, w: Work, y: np.ndarray, v: np.ndarray, ys: np.ndarray, vs: np.ndarray, gh: float,
    force: np.ndarray, kp: np.ndarray, kd: np.ndarray, a: np.ndarray,
) -> None:  # fmt: skip
    """Accelerations a (n,) at (y, v) under joint forces, with the linear terms at ys + gh^2 a, vs + gh a.

    `force` (N,) is what acts in the joints apart from friction, at (ys, vs); kp, kd (N,) are its gains. A joint that is held
    (`w.held`) has the acceleration `w.given`, and its force is found (`w.reaction`).
    """
    passed_outward(c, w, y, v)
    links = c.kind.shape[0]
    A, b = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)  # the wrench A t + b at the attachment of link i
    for i in range(links - 1, -1, -1):
        e = c.first[i]
        if c.kind[i] == SLEEVE:  # its joint's row stands beside the hub's rows: condense it there
            sleeve_hub(c, w, i, ys, vs, gh, A, b)
            I, p = w.inertia, w.bias
            a0, a1, a2 = I[0, 3], I[1, 3], I[2, 3]
            dinv, rest, gain = _grip(c, w, i, v, vs, gh, force, kp, kd, I[3, 3], p[3])
            w.joint[i, 0], w.joint[i, 1], w.joint[i, 2], w.joint[i, 3], w.joint[i, 4] = a0, a1, a2, dinv, rest
            I00, I01, I02 = I[0, 0] - a0 * a0 * dinv, I[0, 1] - a0 * a1 * dinv, I[0, 2] - a0 * a2 * dinv
            I11, I12, I22 = I[1, 1] - a1 * a1 * dinv, I[1, 2] - a1 * a2 * dinv, I[2, 2] - a2 * a2 * dinv
            p0, p1, p2 = p[0] + a0 * gain, p[1] + a1 * gain, p[2] + a2 * gain
        elif c.first[i + 1] - e == 1:
            I00, I01, I02, I11, I12, I22, p0, p1, p2 = rigid_hub(c, w, i, A, b)
        elif i + 1 == links:
            I00, I01, I02, I11, I12, I22, p0, p1, p2 = last_hub(c, w, i, ys, vs, gh)
        else:
            I00, I01, I02, I11, I12, I22, p0, p1, p2 = flexible_hub(c, w, i, ys, vs, gh, A, b)
        # into the axes of the predecessor
        cs, sn = w.cos[i], w.sin[i]
        q0, q1 = cs * I00 - sn * I01, cs * I01 - sn * I11
        r0, r1 = sn * I00 + cs * I01, sn * I01 + cs * I11
        A00, A01, A11 = q0 * cs - q1 * sn, q0 * sn + q1 * cs, r0 * sn + r1 * cs
        A02, A12, A22 = cs * I02 - sn * I12, sn * I02 + cs * I12, I22
        b0, b1, b2 = cs * p0 - sn * p1, sn * p0 + cs * p1, p2
        if c.kind[i] == SLEEVE:
            A, b = (A00, A01, A02, A11, A12, A22), (b0, b1, b2)
            continue
        # condense the joint
        if c.kind[i] == REVOLUTE:
            a0, a1, a2, diagonal, bias = A02, A12, A22, A22, b2
        else:
            s0, s1, s2 = w.slide[i, 0], w.slide[i, 1], w.slide[i, 2]
            a0, a1, a2 = A00 * s0 + A01 * s1 + A02 * s2, A01 * s0 + A11 * s1 + A12 * s2, A02 * s0 + A12 * s1 + A22 * s2
            diagonal, bias = s0 * a0 + s1 * a1 + s2 * a2, s0 * b0 + s1 * b1 + s2 * b2
        dinv, rest, gain = _grip(c, w, i, v, vs, gh, force, kp, kd, diagonal, bias)
        w.joint[i, 0], w.joint[i, 1], w.joint[i, 2], w.joint[i, 3], w.joint[i, 4] = a0, a1, a2, dinv, rest
        A = (
            A00 - a0 * a0 * dinv, A01 - a0 * a1 * dinv, A02 - a0 * a2 * dinv,
            A11 - a1 * a1 * dinv, A12 - a1 * a2 * dinv, A22 - a2 * a2 * dinv,
        )  # fmt: skip
        b = (b0 + a0 * gain, b1 + a1 * gain, b2 + a2 * gain)
    t0, t1, t2 = -c.gravity[0], -c.gravity[1], 0.0
    for i in range(links):
        e, end = c.first[i], c.first[i + 1]
        cs, sn = w.cos[i], w.sin[i]
        if c.kind[i] == SLEEVE:
            u0, u1, u2 = cs * t0 + sn * t1, cs * t1 - sn * t0, t2
            a[e] = _own(w, i, u0, u1, u2)
        else:
            a[e] = _own(w, i, t0, t1, t2)
            t0 += w.slide[i, 0] * a[e]
            t1 += w.slide[i, 1] * a[e]
            t2 += w.slide[i, 2] * a[e]
            u0, u1, u2 = cs * t0 + sn * t1, cs * t1 - sn * t0, t2
        cond = w.cond[i]
        f0, f1, f2 = 0.0, 0.0, 0.0
        if i + 1 == links:
            pass
        elif c.kind[i] == SLEEVE:
            X = w.X[i]
            r0 = X[0, 0] * u0 + X[0, 1] * u1 + X[0, 2] * u2 + X[0, 3] * a[e] + cond[27]
            r1 = X[1, 0] * u0 + X[1, 1] * u1 + X[1, 2] * u2 + X[1, 3] * a[e] + cond[28]
            r2 = X[2, 0] * u0 + X[2, 1] * u1 + X[2, 2] * u2 + X[2, 3] * a[e] + cond[29]
            t0, t1, t2, f0, f1, f2 = released(w, i, r0, r1, r2)
        elif end - e == 1:
            t0 = u0 - w.place[i, 1] * u2 + w.beta[i, 0]
            t1 = u1 + w.place[i, 0] * u2 + w.beta[i, 1]
            t2 = u2
        else:
            r0 = cond[18] * u0 + cond[19] * u1 + cond[20] * u2 + cond[27]
            r1 = cond[21] * u0 + cond[22] * u1 + cond[23] * u2 + cond[28]
            r2 = cond[24] * u0 + cond[25] * u1 + cond[26] * u2 + cond[29]
            t0, t1, t2, f0, f1, f2 = released(w, i, r0, r1, r2)
        m, qdd = end - e - 1, w.qdd
        hub, tip = pack(u0, u1, u2, 1.0), pack(f0, f1, f2, a[e] if c.kind[i] == SLEEVE else 0.0)
        for k in range(m):  # l^T qdd = -dinv l^-1 (Mqr u + cq + Jq^T f)
            r = w.S[i, k, w.dinv.shape[1] :]
            qdd[k] = -w.dinv[i, k] * total(load(r, 0) * hub + load(r, 4) * tip)
        for k in range(m - 1, 0, -1):
            for j in range(0, k, WIDTH):
                store(qdd, j, load(qdd, j) - qdd[k] * load(w.L[i, k], j))
        for k in range(m):
            a[e + 1 + k] = qdd[k]


@inlined
def _own(w: Work, i: int, t0: float, t1: float, t2: float) -> float:
    """The joint's acceleration from what it stands on, or, where it is held to one, the force that this takes."""
    rest = w.joint[i, 4] - w.joint[i, 0] * t0 - w.joint[i, 1] * t1 - w.joint[i, 2] * t2
    if w.held[i]:
        w.reaction[i] = w.joint[i, 5] * w.given[i] - rest
        return w.given[i]
    return w.joint[i, 3] * rest


@compiled
def accelerate(
    c: Chain, w: Work, y: np.ndarray, v: np.ndarray, ys: np.ndarray, vs: np.ndarray, gh: float,
    force: np.ndarray, kp: np.ndarray, kd: np.ndarray, a: np.ndarray,
) -> None:  # fmt: skip
    """`passes` for Python."""
    passes(pinned(c), pinned(w), y, v, ys, vs, gh, force, kp, kd, a)
