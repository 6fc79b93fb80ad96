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

from .chain import COULOMB_SPEED, REVOLUTE, Chain, Work
from .compiled import compiled, inlined
from .outward import outward


@inlined
def _rigid_hub(c: Chain, w: Work, i: int, A: tuple, b: tuple) -> tuple:
    """Condensed inertia (6) and bias (3) at the hub of a rigid link that carries the wrench A t + b at its attachment."""
    A00, A01, A02, A11, A12, A22 = A
    rx, ry = w.place[i, 0], w.place[i, 1]
    bx, by = w.place[i, 2], w.place[i, 3]
    f0 = b[0] + A00 * bx + A01 * by
    f1 = b[1] + A01 * bx + A11 * by
    f2 = b[2] + A02 * bx + A12 * by
    m02, m12 = A02 - ry * A00 + rx * A01, A12 - ry * A01 + rx * A11
    inertia = A22 - ry * (A02 + m02) + rx * (A12 + m12)
    return (
        c.mass[i] + A00, A01, m02 - w.body[i, 0], c.mass[i] + A11, m12 + w.body[i, 1], w.body[i, 2] + inertia,
        w.body[i, 3] + f0, w.body[i, 4] + f1, w.body[i, 5] + f2 - ry * f0 + rx * f1,
    )  # fmt: skip


@inlined
def _elastic(c: Chain, w: Work, i: int, ys: np.ndarray, vs: np.ndarray, gh: float, columns: int) -> None:
    """Factorise S = Mqq + gh D + gh^2 L = l d l^T of a flexible link and form l^-1 (Mqr, cq, Jq^T) in the rows of w.rhs.

    Mqq = 1 + sum mu h h^T over the link's points, and the payload's turning. Columns: Mrq (x, y, angle), cq, Jq (x, y, angle);
    the last three if columns = 7.
    """
    e, end = c.first[i], c.first[i + 1]
    m = end - e - 1
    S, rhs, qs, qds = w.S[i], w.rhs[i], ys[e + 1 : end], vs[e + 1 : end]
    for k in range(m):
        for j in range(k):
            S[k, j] = 0.0
        S[k, k] = 1.0 + gh * c.damp[i, k] + gh * gh * c.lam[i, k]
        rhs[k, 0], rhs[k, 1], rhs[k, 2] = -w.g1q[i, k], c.S0[i, k], w.mt[i, k]
        rhs[k, 3] = c.lam[i, k] * qs[k] + c.damp[i, k] * qds[k] + w.cv[i, k]
        rhs[k, 4], rhs[k, 5], rhs[k, 6] = -w.hq[i, k], c.NL[i, k], w.tilt[i] * c.SL[i, k]
    if c.stiffening:
        turning = c.tip_inertia[i] * (w.tilt[i] * w.tilt[i] - 1.0)
        for k in range(m):
            for j in range(k + 1):
                total = turning * c.SL[i, k] * c.SL[i, j]
                for p in range(c.points[i]):
                    total += c.point_mass[i, p] * w.h[i, p, k] * w.h[i, p, j]
                S[k, j] += total
    for k in range(m):
        for j in range(k):
            entry = S[k, j]
            for s in range(j):
                entry -= S[k, s] * S[j, s]  # S[k, s] still holds l d
            S[k, j] = entry
        d = S[k, k]
        for j in range(k):
            ld = S[k, j]
            lower = ld * w.dinv[i, j]
            d -= ld * lower
            S[k, j] = lower
            for s in range(columns):
                rhs[k, s] -= lower * rhs[j, s]
        w.dinv[i, k] = 1.0 / d


@inlined
def _last_hub(c: Chain, w: Work, i: int, ys: np.ndarray, vs: np.ndarray, gh: float) -> tuple:
    """The same for the last link if it is flexible: nothing is attached to its tip, the payload is in its own terms."""
    _elastic(c, w, i, ys, vs, gh, 4)
    Q00, Q01, Q02, Q11, Q12, Q22, m0, m1, m2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(c.first[i + 1] - c.first[i] - 1):
        r0, r1, r2, cq = w.rhs[i, k, 0], w.rhs[i, k, 1], w.rhs[i, k, 2], w.rhs[i, k, 3]
        d0, d1, d2 = w.dinv[i, k] * r0, w.dinv[i, k] * r1, w.dinv[i, k] * r2
        Q00 += d0 * r0
        Q01 += d0 * r1
        Q02 += d0 * r2
        Q11 += d1 * r1
        Q12 += d1 * r2
        Q22 += d2 * r2
        m0 += d0 * cq
        m1 += d1 * cq
        m2 += d2 * cq
    return (
        c.mass[i] - Q00, -Q01, -w.body[i, 0] - Q02, c.mass[i] - Q11, w.body[i, 1] - Q12, w.body[i, 2] - Q22,
        w.body[i, 3] - m0, w.body[i, 4] - m1, w.body[i, 5] - m2,
    )  # fmt: skip


@inlined
def _flexible_hub(c: Chain, w: Work, i: int, ys: np.ndarray, vs: np.ndarray, gh: float, A: tuple, b: tuple) -> tuple:
    """The same for a flexible link that carries the wrench f = A t + b at its attachment.

    With Q = Mrq S^-1 Mqr, P = Jq S^-1 Mqr, E = Jq S^-1 Jq^T and B = A (1 + E A)^-1, condensing the elastic rows gives
    t = (1 + E A)^-1 [(X - P) u + t0], t0 = beta - Jq S^-1 cq - E b, and
    F = [Mrr - Q + (X - P)^T B (X - P)] u + hr - Mrq S^-1 cq + (X - P)^T (B t0 + b).
    """
    A00, A01, A02, A11, A12, A22 = A
    b0, b1, b2 = b
    _elastic(c, w, i, ys, vs, gh, 7)
    Q00, Q01, Q02, Q11, Q12, Q22 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    P00, P01, P02, P10, P11, P12, P20, P21, P22 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    E00, E01, E02, E11, E12, E22 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    m0, m1, m2, j0, j1, j2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(c.first[i + 1] - c.first[i] - 1):
        x, s0, s1, cq = w.rhs[i, k, 0], w.rhs[i, k, 1], w.rhs[i, k, 2], w.rhs[i, k, 3]
        jx, jy, jz = w.rhs[i, k, 4], w.rhs[i, k, 5], w.rhs[i, k, 6]
        dx, d0, d1 = w.dinv[i, k] * x, w.dinv[i, k] * s0, w.dinv[i, k] * s1
        ex, ey, ez = w.dinv[i, k] * jx, w.dinv[i, k] * jy, w.dinv[i, k] * jz
        Q00 += dx * x
        Q01 += dx * s0
        Q02 += dx * s1
        Q11 += d0 * s0
        Q12 += d0 * s1
        Q22 += d1 * s1
        m0 += dx * cq
        m1 += d0 * cq
        m2 += d1 * cq
        P00 += jx * dx
        P01 += jx * d0
        P02 += jx * d1
        P10 += jy * dx
        P11 += jy * d0
        P12 += jy * d1
        P20 += jz * dx
        P21 += jz * d0
        P22 += jz * d1
        E00 += ex * jx
        E01 += ex * jy
        E02 += ex * jz
        E11 += ey * jy
        E12 += ey * jz
        E22 += ez * jz
        j0 += ex * cq
        j1 += ey * cq
        j2 += ez * cq
    w00 = 1.0 + E00 * A00 + E01 * A01 + E02 * A02
    w01 = E00 * A01 + E01 * A11 + E02 * A12
    w02 = E00 * A02 + E01 * A12 + E02 * A22
    w10 = E01 * A00 + E11 * A01 + E12 * A02
    w11 = 1.0 + E01 * A01 + E11 * A11 + E12 * A12
    w12 = E01 * A02 + E11 * A12 + E12 * A22
    w20 = E02 * A00 + E12 * A01 + E22 * A02
    w21 = E02 * A01 + E12 * A11 + E22 * A12
    w22 = 1.0 + E02 * A02 + E12 * A12 + E22 * A22
    c00, c01, c02 = w11 * w22 - w12 * w21, w02 * w21 - w01 * w22, w01 * w12 - w02 * w11
    c10, c11, c12 = w12 * w20 - w10 * w22, w00 * w22 - w02 * w20, w02 * w10 - w00 * w12
    c20, c21, c22 = w10 * w21 - w11 * w20, w01 * w20 - w00 * w21, w00 * w11 - w01 * w10
    det = 1.0 / (w00 * c00 + w01 * c10 + w02 * c20)
    c00, c01, c02 = c00 * det, c01 * det, c02 * det
    c10, c11, c12 = c10 * det, c11 * det, c12 * det
    c20, c21, c22 = c20 * det, c21 * det, c22 * det
    x00, x01, x02 = 1.0 - P00, -P01, -w.place[i, 1] - P02
    x10, x11, x12 = -P10, 1.0 - P11, w.place[i, 0] - P12
    x20, x21, x22 = -P20, -P21, 1.0 - P22
    t0 = w.place[i, 2] - j0 - (E00 * b0 + E01 * b1 + E02 * b2)
    t1 = w.place[i, 3] - j1 - (E01 * b0 + E11 * b1 + E12 * b2)
    t2 = w.place[i, 4] - j2 - (E02 * b0 + E12 * b1 + E22 * b2)
    cond = w.cond[i]
    cond[0], cond[1], cond[2], cond[3], cond[4], cond[5] = A00, A01, A02, A11, A12, A22
    cond[6], cond[7], cond[8] = b0, b1, b2
    cond[9], cond[10], cond[11], cond[12], cond[13], cond[14] = c00, c01, c02, c10, c11, c12
    cond[15], cond[16], cond[17] = c20, c21, c22
    cond[18], cond[19], cond[20], cond[21], cond[22], cond[23] = x00, x01, x02, x10, x11, x12
    cond[24], cond[25], cond[26] = x20, x21, x22
    cond[27], cond[28], cond[29] = t0, t1, t2
    cond[30], cond[31], cond[32], cond[33], cond[34], cond[35] = E00, E01, E02, E11, E12, E22
    B00 = A00 * c00 + A01 * c10 + A02 * c20
    B01 = A00 * c01 + A01 * c11 + A02 * c21
    B02 = A00 * c02 + A01 * c12 + A02 * c22
    B11 = A01 * c01 + A11 * c11 + A12 * c21
    B12 = A01 * c02 + A11 * c12 + A12 * c22
    B22 = A02 * c02 + A12 * c12 + A22 * c22
    f0 = B00 * t0 + B01 * t1 + B02 * t2 + b0
    f1 = B01 * t0 + B11 * t1 + B12 * t2 + b1
    f2 = B02 * t0 + B12 * t1 + B22 * t2 + b2
    y00, y01, y02 = B00 * x00 + B01 * x10 + B02 * x20, B00 * x01 + B01 * x11 + B02 * x21, B00 * x02 + B01 * x12 + B02 * x22
    y10, y11, y12 = B01 * x00 + B11 * x10 + B12 * x20, B01 * x01 + B11 * x11 + B12 * x21, B01 * x02 + B11 * x12 + B12 * x22
    y20, y21, y22 = B02 * x00 + B12 * x10 + B22 * x20, B02 * x01 + B12 * x11 + B22 * x21, B02 * x02 + B12 * x12 + B22 * x22
    return (
        c.mass[i] - Q00 + x00 * y00 + x10 * y10 + x20 * y20,
        x00 * y01 + x10 * y11 + x20 * y21 - Q01,
        x00 * y02 + x10 * y12 + x20 * y22 - w.body[i, 0] - Q02,
        c.mass[i] - Q11 + x01 * y01 + x11 * y11 + x21 * y21,
        w.body[i, 1] - Q12 + x01 * y02 + x11 * y12 + x21 * y22,
        w.body[i, 2] - Q22 + x02 * y02 + x12 * y12 + x22 * y22,
        w.body[i, 3] - m0 + x00 * f0 + x10 * f1 + x20 * f2,
        w.body[i, 4] - m1 + x01 * f0 + x11 * f1 + x21 * f2,
        w.body[i, 5] - m2 + x02 * f0 + x12 * f1 + x22 * f2,
    )


@inlined
def passes(
    c: Chain, w: Work, y: np.ndarray, v: np.ndarray, ys: np.ndarray, vs: np.ndarray, gh: float,
    force: np.ndarray, kp: np.ndarray, kd: np.ndarray, a: np.ndarray,
) -> None:  # fmt: skip
    """Accelerations a (n,) at (y, v) under joint forces, with the linear terms at ys + gh^2 a, vs + gh a.

    `force` (N,) is what acts in the joints apart from friction, at (ys, vs); kp, kd (N,) are its gains. A joint that is held
    (`w.held`) has the acceleration `w.given`, and its force is found (`w.reaction`).
    """
    outward(c, w, y, v)
    links = c.kind.shape[0]
    A, b = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)  # the wrench A t + b at the attachment of link i
    for i in range(links - 1, -1, -1):
        e = c.first[i]
        if c.first[i + 1] - e == 1:
            I00, I01, I02, I11, I12, I22, p0, p1, p2 = _rigid_hub(c, w, i, A, b)
        elif i + 1 == links:
            I00, I01, I02, I11, I12, I22, p0, p1, p2 = _last_hub(c, w, i, ys, vs, gh)
        else:
            I00, I01, I02, I11, I12, I22, p0, p1, p2 = _flexible_hub(c, w, i, ys, vs, gh, A, b)
        # into the axes of the predecessor
        cs, sn = w.cos[i], w.sin[i]
        q0, q1 = cs * I00 - sn * I01, cs * I01 - sn * I11
        r0, r1 = sn * I00 + cs * I01, sn * I01 + cs * I11
        A00, A01, A11 = q0 * cs - q1 * sn, q0 * sn + q1 * cs, r0 * sn + r1 * cs
        A02, A12, A22 = cs * I02 - sn * I12, sn * I02 + cs * I12, I22
        b0, b1, b2 = cs * p0 - sn * p1, sn * p0 + cs * p1, p2
        # condense the joint
        if c.kind[i] == REVOLUTE:
            a0, a1, a2, diagonal, bias = A02, A12, A22, A22, b2
        else:
            a0, a1, a2, diagonal, bias = A00, A01, A02, A00, b0
        diagonal += c.rotor[i]
        if w.held[i]:
            dinv, rest, gain = 0.0, -bias, w.given[i]
        else:
            tau, hold = force[i] - c.viscous[i] * vs[e], 0.0
            if c.coulomb[i] > 0.0:
                grip = np.tanh(v[e] / COULOMB_SPEED)
                hold = c.coulomb[i] * (1.0 - grip * grip) / COULOMB_SPEED
                tau -= c.coulomb[i] * grip + hold * (vs[e] - v[e])
            dinv = 1.0 / (diagonal + gh * (c.viscous[i] + hold + kd[i]) + gh * gh * kp[i])
            rest = tau - bias
            gain = rest * dinv
        w.joint[i, 0], w.joint[i, 1], w.joint[i, 2], w.joint[i, 3], w.joint[i, 4] = a0, a1, a2, dinv, rest
        w.joint[i, 5] = diagonal
        A = (
            A00 - a0 * a0 * dinv, A01 - a0 * a1 * dinv, A02 - a0 * a2 * dinv,
            A11 - a1 * a1 * dinv, A12 - a1 * a2 * dinv, A22 - a2 * a2 * dinv,
        )  # fmt: skip
        b = (b0 + a0 * gain, b1 + a1 * gain, b2 + a2 * gain)
    t0, t1, t2 = -c.gravity[0], -c.gravity[1], 0.0
    for i in range(links):
        e, end = c.first[i], c.first[i + 1]
        rest = w.joint[i, 4] - w.joint[i, 0] * t0 - w.joint[i, 1] * t1 - w.joint[i, 2] * t2
        if w.held[i]:
            a[e] = w.given[i]
            w.reaction[i] = w.joint[i, 5] * a[e] - rest
        else:
            a[e] = w.joint[i, 3] * rest
        if c.kind[i] == REVOLUTE:
            t2 += a[e]
        else:
            t0 += a[e]
        cs, sn = w.cos[i], w.sin[i]
        u0, u1, u2 = cs * t0 + sn * t1, cs * t1 - sn * t0, t2
        cond = w.cond[i]
        if end - e == 1:
            t0 = u0 - w.place[i, 1] * u2 + w.place[i, 2]
            t1 = u1 + w.place[i, 0] * u2 + w.place[i, 3]
        else:
            f0, f1, f2 = 0.0, 0.0, 0.0
            if i + 1 < links:
                r0 = cond[18] * u0 + cond[19] * u1 + cond[20] * u2 + cond[27]
                r1 = cond[21] * u0 + cond[22] * u1 + cond[23] * u2 + cond[28]
                r2 = cond[24] * u0 + cond[25] * u1 + cond[26] * u2 + cond[29]
                t0 = cond[9] * r0 + cond[10] * r1 + cond[11] * r2
                t1 = cond[12] * r0 + cond[13] * r1 + cond[14] * r2
                t2 = cond[15] * r0 + cond[16] * r1 + cond[17] * r2
                # once refined: the inverse has the square of the condition of 1 + E A in its error, which heavy bodies make large
                f0 = cond[0] * t0 + cond[1] * t1 + cond[2] * t2
                f1 = cond[1] * t0 + cond[3] * t1 + cond[4] * t2
                f2 = cond[2] * t0 + cond[4] * t1 + cond[5] * t2
                r0 -= t0 + cond[30] * f0 + cond[31] * f1 + cond[32] * f2
                r1 -= t1 + cond[31] * f0 + cond[33] * f1 + cond[34] * f2
                r2 -= t2 + cond[32] * f0 + cond[34] * f1 + cond[35] * f2
                t0 += cond[9] * r0 + cond[10] * r1 + cond[11] * r2
                t1 += cond[12] * r0 + cond[13] * r1 + cond[14] * r2
                t2 += cond[15] * r0 + cond[16] * r1 + cond[17] * r2
                f0 = cond[0] * t0 + cond[1] * t1 + cond[2] * t2 + cond[6]
                f1 = cond[1] * t0 + cond[3] * t1 + cond[4] * t2 + cond[7]
                f2 = cond[2] * t0 + cond[4] * t1 + cond[5] * t2 + cond[8]
            m = end - e - 1
            qdd = a[e + 1 : end]
            for k in range(m):  # l^T qdd = -dinv l^-1 (Mqr u + cq + Jq^T f)
                total = w.rhs[i, k, 0] * u0 + w.rhs[i, k, 1] * u1 + w.rhs[i, k, 2] * u2 + w.rhs[i, k, 3]
                qdd[k] = -w.dinv[i, k] * (total + w.rhs[i, k, 4] * f0 + w.rhs[i, k, 5] * f1 + w.rhs[i, k, 6] * f2)
            for k in range(m - 1, 0, -1):
                for j in range(k):
                    qdd[j] -= w.S[i, k, j] * qdd[k]


@compiled
def accelerate(
    c: Chain, w: Work, y: np.ndarray, v: np.ndarray, ys: np.ndarray, vs: np.ndarray, gh: float,
    force: np.ndarray, kp: np.ndarray, kd: np.ndarray, a: np.ndarray,
) -> None:  # fmt: skip
    """`passes` as a function to call."""
    passes(c, w, y, v, ys, vs, gh, force, kp, kd, a)
