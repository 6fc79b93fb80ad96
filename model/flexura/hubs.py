"""One link condensed to its hub: inertia and bias that the joint feels, with the chain beyond already condensed to A t + b.

Equations (10) to (12) of `model/README.md`; one function for each kind of link, and what the way back out needs of it.
"""

from __future__ import annotations

import numpy as np

from .chain import SLEEVE, Chain, Work
from .compiled import compiled, inlined, internal
from .lanes import WIDTH, lanes, load, load_some, pack, parts, store, total
from .pinned import pinned

_COLUMN = (0, 1, 2, 7)  # of the terms: Mrq for x, y, angle and d
_UNIT = np.eye(2 * WIDTH)[WIDTH - 1]  # 1 in lane k of what is loaded from WIDTH - 1 - k


@inlined
def rigid_hub(c: Chain, w: Work, i: int, A: tuple, b: tuple) -> tuple:
    """Condensed inertia (6) and bias (3) at the hub of a rigid link that carries the wrench A t + b at its attachment."""
    A00, A01, A02, A11, A12, A22 = A
    rx, ry = w.place[i, 0], w.place[i, 1]
    bx, by = w.beta[i, 0], w.beta[i, 1]
    f0 = b[0] + A00 * bx + A01 * by
    f1 = b[1] + A01 * bx + A11 * by
    f2 = b[2] + A02 * bx + A12 * by
    m02, m12 = A02 - ry * A00 + rx * A01, A12 - ry * A01 + rx * A11
    inertia = A22 - ry * (A02 + m02) + rx * (A12 + m12)
    return (
        c.mass[i] + A00, A01, m02 - w.body[i, 0], c.mass[i] + A11, m12 + w.body[i, 1], w.body[i, 2] + inertia,
        w.body[i, 3] + f0, w.body[i, 4] + f1, w.body[i, 5] + f2 - ry * f0 + rx * f1,
    )  # fmt: skip


@internal
def formed_block(c: Chain, w: Work, i: int, gh: float) -> None:
    """Mqq + gh D + gh^2 K of a flexible link into the upper triangle of w.S[i], rows from a multiple of four on: Mqq = 1 + sum mu
    h h^T over its points, and the payload's turning; of a sleeved link what the outward pass has summed."""
    m = c.first[i + 1] - c.first[i] - 1
    if c.kind[i] == SLEEVE:
        inertia, stiffness = 1.0 + gh * c.alpha[i], gh * (c.beta[i] + gh)
        for k in range(m):
            for b in range(k - k % WIDTH, m, WIDTH):
                store(w.S[i, k], b, inertia * load(w.M[i, k], b) + stiffness * load(w.K[i, k], b))
        return
    turning = c.tip_inertia[i] * (w.tilt[i] * w.tilt[i] - 1.0)
    for k in range(m):
        lane = k % WIDTH
        row = (1.0 + gh * (c.damp[i, k] + gh * c.lam[i, k])) * load(_UNIT, WIDTH - 1 - lane)
        for b in range(k - lane, m, WIDTH):
            if c.stiffening:
                row += turning * c.SL[i, k] * load(c.SL[i], b)
                for p in range(c.points[i]):
                    row += c.point_mass[i, p] * w.h[i, p, k] * load(w.h[i, p], b)
            store(w.S[i, k], b, row)
            row = lanes(0.0)


@compiled
def inertia_block(c: Chain, w: Work, i: int) -> None:
    """Mqq of a flexible link, of which w.S[i] is to have the upper triangle."""
    formed_block(pinned(c), pinned(w), i, 0.0)


@internal
def _elastic(c: Chain, w: Work, i: int, ys: np.ndarray, vs: np.ndarray, gh: float) -> None:
    """Factorise S = Mqq + gh D + gh^2 K = l d l^T of a flexible link, and form l^-1 of its terms at the ends of its rows."""
    e, end = c.first[i], c.first[i + 1]
    m = end - e - 1
    S, L, dinv, M = w.S[i], w.L[i], w.dinv[i], w.dinv.shape[1]
    qs, qds, alpha, beta = ys[e + 1 : end], vs[e + 1 : end], c.alpha[i], c.beta[i]
    formed_block(c, w, i, gh)
    for k in range(m):
        row, terms = S[k], w.terms[i, k]
        if c.kind[i] == SLEEVE:
            sums = lanes(0.0)
            for b in range(0, m, WIDTH):
                q, qd = load_some(qs, b, m - b), load_some(qds, b, m - b)
                inertia, stiffness = load(w.M[i, k], b), load(w.K[i, k], b)
                sums += stiffness * q + (alpha * inertia + beta * stiffness) * qd
            linear = total(sums)
        else:
            linear = c.lam[i, k] * qs[k] + c.damp[i, k] * qds[k]
        store(row, M, load(terms, 0) + pack(0.0, 0.0, 0.0, linear))
        store(row, M + 4, load(terms, 4))
    for j in range(0, m, 2):  # two pivots at a time: what is beyond is read and written half as often
        first = S[j]
        dinv[j] = 1.0 / first[j]
        if j + 1 == m:
            break
        second, lower = S[j + 1], first[j + 1] * dinv[j]
        L[j + 1, j] = lower
        for b in range(j + 1 - (j + 1) % WIDTH, M + 8, WIDTH):
            store(second, b, load(second, b) - lower * load(first, b))
        dinv[j + 1] = 1.0 / second[j + 1]
        for k in range(j + 2, m):
            row, lower, lower_2 = S[k], first[k] * dinv[j], second[k] * dinv[j + 1]
            L[k, j], L[k, j + 1] = lower, lower_2
            for b in range(k - k % WIDTH, M + 8, WIDTH):
                store(row, b, load(row, b) - lower * load(first, b) - lower_2 * load(second, b))


@inlined
def last_hub(c: Chain, w: Work, i: int, ys: np.ndarray, vs: np.ndarray, gh: float) -> tuple:
    """The same for the last link if it is flexible: nothing is attached to its tip, the payload is in its own terms."""
    _elastic(c, w, i, ys, vs, gh)
    x, y, angle = lanes(0.0), lanes(0.0), lanes(0.0)
    for k in range(c.first[i + 1] - c.first[i] - 1):
        r = w.S[i, k, w.dinv.shape[1] :]
        own = load(r, 0)
        x += w.dinv[i, k] * r[0] * own
        y += w.dinv[i, k] * r[1] * own
        angle += w.dinv[i, k] * r[2] * own
    Q00, Q01, Q02, m0 = parts(x)
    _, Q11, Q12, m1 = parts(y)
    _, _, Q22, m2 = parts(angle)
    return (
        c.mass[i] - Q00, -Q01, -w.body[i, 0] - Q02, c.mass[i] - Q11, w.body[i, 1] - Q12, w.body[i, 2] - Q22,
        w.body[i, 3] - m0, w.body[i, 4] - m1, w.body[i, 5] - m2,
    )  # fmt: skip


@inlined
def _attached(w: Work, i: int, A: tuple, b: tuple, t: tuple, E: tuple) -> tuple:
    """B = A (1 + E A)^-1 (6, upper triangle by rows) and B t0 + b (3), with t0 = t - E b for t = beta - Jq S^-1 cq: what the
    chain beyond link i's attachment is to its hub. Keeps what `released` needs."""
    A00, A01, A02, A11, A12, A22 = A
    E00, E01, E02, E11, E12, E22 = E
    b0, b1, b2 = b
    t0 = t[0] - (E00 * b0 + E01 * b1 + E02 * b2)
    t1 = t[1] - (E01 * b0 + E11 * b1 + E12 * b2)
    t2 = t[2] - (E02 * b0 + E12 * b1 + E22 * b2)
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
    c00, c01, c02, c10, c11, c12 = c00 * det, c01 * det, c02 * det, c10 * det, c11 * det, c12 * det
    c20, c21, c22 = c20 * det, c21 * det, c22 * det
    cond = w.cond[i]
    cond[0], cond[1], cond[2], cond[3], cond[4], cond[5] = A
    cond[6], cond[7], cond[8] = b
    cond[9], cond[10], cond[11], cond[12], cond[13], cond[14] = c00, c01, c02, c10, c11, c12
    cond[15], cond[16], cond[17] = c20, c21, c22
    cond[27], cond[28], cond[29] = t0, t1, t2
    cond[30], cond[31], cond[32], cond[33], cond[34], cond[35] = E
    B00 = A00 * c00 + A01 * c10 + A02 * c20
    B01 = A00 * c01 + A01 * c11 + A02 * c21
    B02 = A00 * c02 + A01 * c12 + A02 * c22
    B11 = A01 * c01 + A11 * c11 + A12 * c21
    B12 = A01 * c02 + A11 * c12 + A12 * c22
    B22 = A02 * c02 + A12 * c12 + A22 * c22
    f0 = B00 * t0 + B01 * t1 + B02 * t2 + b0
    f1 = B01 * t0 + B11 * t1 + B12 * t2 + b1
    f2 = B02 * t0 + B12 * t1 + B22 * t2 + b2
    return B00, B01, B02, B11, B12, B22, f0, f1, f2


@inlined
def flexible_hub(c: Chain, w: Work, i: int, ys: np.ndarray, vs: np.ndarray, gh: float, A: tuple, b: tuple) -> tuple:
    """The same for a flexible link that carries the wrench f = A t + b at its attachment.

    With Q = Mrq S^-1 Mqr, P = Jq S^-1 Mqr, E = Jq S^-1 Jq^T and B = A (1 + E A)^-1, condensing the elastic rows gives
    t = (1 + E A)^-1 [(X - P) u + t0], t0 = beta - Jq S^-1 cq - E b, and
    F = [Mrr - Q + (X - P)^T B (X - P)] u + hr - Mrq S^-1 cq + (X - P)^T (B t0 + b).
    """
    _elastic(c, w, i, ys, vs, gh)
    zero = lanes(0.0)
    qx, qy, qt, px, py, pt, ex, ey, et = zero, zero, zero, zero, zero, zero, zero, zero, zero
    for k in range(c.first[i + 1] - c.first[i] - 1):
        r, inverse = w.S[i, k, w.dinv.shape[1] :], w.dinv[i, k]
        own, tip = load(r, 0), load(r, 4)
        qx += inverse * r[0] * own
        qy += inverse * r[1] * own
        qt += inverse * r[2] * own
        px += inverse * r[4] * own
        py += inverse * r[5] * own
        pt += inverse * r[6] * own
        ex += inverse * r[4] * tip
        ey += inverse * r[5] * tip
        et += inverse * r[6] * tip
    Q00, Q01, Q02, m0 = parts(qx)
    _, Q11, Q12, m1 = parts(qy)
    _, _, Q22, m2 = parts(qt)
    P00, P01, P02, j0 = parts(px)
    P10, P11, P12, j1 = parts(py)
    P20, P21, P22, j2 = parts(pt)
    E00, E01, E02, _ = parts(ex)
    _, E11, E12, _ = parts(ey)
    _, _, E22, _ = parts(et)
    x00, x01, x02 = 1.0 - P00, -P01, -w.place[i, 1] - P02
    x10, x11, x12 = -P10, 1.0 - P11, w.place[i, 0] - P12
    x20, x21, x22 = -P20, -P21, 1.0 - P22
    cond = w.cond[i]
    cond[18], cond[19], cond[20], cond[21], cond[22], cond[23] = x00, x01, x02, x10, x11, x12
    cond[24], cond[25], cond[26] = x20, x21, x22
    t = (w.beta[i, 0] - j0, w.beta[i, 1] - j1, w.beta[i, 2] - j2)
    B00, B01, B02, B11, B12, B22, f0, f1, f2 = _attached(w, i, A, b, t, (E00, E01, E02, E11, E12, E22))
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


@internal
def sleeve_hub(c: Chain, w: Work, i: int, ys: np.ndarray, vs: np.ndarray, gh: float, A: tuple, b: tuple) -> None:
    """Condensed inertia (4 x 4) and bias (4) of a link at its sleeve, in x, y, angle and d, into w.inertia and w.bias: the
    equations of `flexible_hub` with a fourth column, rho, in Mrr, Mrq and X."""
    I, p, X, body = w.inertia, w.bias, w.X[i], w.body[i]
    m = c.first[i + 1] - c.first[i] - 1
    mass = c.mass[i]
    I[0, 0], I[0, 1], I[0, 2], I[0, 3], I[1, 1], I[1, 2] = mass, 0.0, -body[0], body[6], mass, body[1]
    I[1, 3], I[2, 2], I[2, 3], I[3, 3] = body[7], body[2], body[8], body[9]
    p[0], p[1], p[2], p[3] = body[3], body[4], body[5], body[10]
    X[0, 0], X[0, 1], X[0, 2], X[0, 3] = 1.0, 0.0, -w.place[i, 1], w.flow[i, 0]
    X[1, 0], X[1, 1], X[1, 2], X[1, 3] = 0.0, 1.0, w.place[i, 0], w.flow[i, 1]
    X[2, 0], X[2, 1], X[2, 2], X[2, 3] = 0.0, 0.0, 1.0, w.flow[i, 2]
    E00, E01, E02, E11, E12, E22 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    t0, t1, t2 = w.beta[i, 0], w.beta[i, 1], w.beta[i, 2]
    if m > 0:
        _elastic(c, w, i, ys, vs, gh)
        for row in range(4):
            near, far = lanes(0.0), lanes(0.0)
            for k in range(m):
                r = w.S[i, k, w.dinv.shape[1] :]
                own = w.dinv[i, k] * r[_COLUMN[row]]
                near += own * load(r, 0)
                far += own * load(r, 4)
            q0, q1, q2, force = parts(near)
            x0, x1, x2, q3 = parts(far)
            I[row, 0] -= q0
            I[row, 1] -= q1
            I[row, 2] -= q2
            I[row, 3] -= q3
            p[row] -= force
            X[0, row] -= x0
            X[1, row] -= x1
            X[2, row] -= x2
        ex, ey, et, tx, ty, tt = lanes(0.0), lanes(0.0), lanes(0.0), lanes(0.0), lanes(0.0), lanes(0.0)
        for k in range(m):
            r, inverse = w.S[i, k, w.dinv.shape[1] :], w.dinv[i, k]
            own, tip = load(r, 0), load(r, 4)
            ex += inverse * r[4] * tip
            ey += inverse * r[5] * tip
            et += inverse * r[6] * tip
            tx += inverse * r[4] * own
            ty += inverse * r[5] * own
            tt += inverse * r[6] * own
        E00, E01, E02, _ = parts(ex)
        _, E11, E12, _ = parts(ey)
        _, _, E22, _ = parts(et)
        t0 -= parts(tx)[3]
        t1 -= parts(ty)[3]
        t2 -= parts(tt)[3]
    if i + 1 == c.kind.shape[0]:
        return
    B00, B01, B02, B11, B12, B22, f0, f1, f2 = _attached(w, i, A, b, (t0, t1, t2), (E00, E01, E02, E11, E12, E22))
    for row in range(4):
        x0, x1, x2 = X[0, row], X[1, row], X[2, row]
        y0, y1, y2 = B00 * x0 + B01 * x1 + B02 * x2, B01 * x0 + B11 * x1 + B12 * x2, B02 * x0 + B12 * x1 + B22 * x2
        for col in range(row, 4):
            I[row, col] += y0 * X[0, col] + y1 * X[1, col] + y2 * X[2, col]
        p[row] += x0 * f0 + x1 * f1 + x2 * f2


@inlined
def released(w: Work, i: int, r0: float, r1: float, r2: float) -> tuple:
    """t = (1 + E A)^-1 r, refined once, and the wrench f = A t + b: the inverse has the square of the condition of 1 + E A in its
    error, which heavy bodies make large."""
    cond = w.cond[i]
    t0 = cond[9] * r0 + cond[10] * r1 + cond[11] * r2
    t1 = cond[12] * r0 + cond[13] * r1 + cond[14] * r2
    t2 = cond[15] * r0 + cond[16] * r1 + cond[17] * r2
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
    return t0, t1, t2, f0, f1, f2
