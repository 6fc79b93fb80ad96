"""A slider (joint Pa) on the link before it: where its hub is, how it moves with the link, and along it.

The hub rides on the elastic line at abscissa eta, at xi = eta / L, or xi = 1 - (L - eta) / d where the link itself slides through
a sleeve with the free length d. w and w_xi at the nodes are those of the Hermite cubics; between them the line is the quintic
through these and the mean curvatures of the elements on both sides, so that the hub's rate of turning, kappa eta', and with it
M(q), does not jump at a node. With l = L or d, sin = w_xi / l, t(xi) = (l int cos, w, asin), the joint's direction is dt/deta
= (cos, sin, kappa), and the convective terms are those of the second derivative of t along the motion (`model/README.md`,
section 4).
"""

from __future__ import annotations

import numpy as np

from .chain import NODES, SLEEVE, Chain, Work
from .compiled import compiled, inlined

_S, _W = np.polynomial.legendre.leggauss(NODES)
_S, _W = (_S + 1) / 2, _W / 2


@inlined
def _polynomials(w: Work, s: float, h: float) -> None:
    """Quintic Hermite polynomials on an element of length h at s in [0, 1], and their derivatives up to the third, into the rows
    of w.quintic: value, slope and curvature of the start, then of the end, which are the start's, mirrored."""
    for end in range(2):
        t, sign = s, 1.0 / h
        if end == 1:
            t, sign = 1.0 - s, -1.0 / h  # of one derivative by x
        k = 3 * end
        q = w.quintic
        q[0, k] = 1.0 - t * t * t * (10.0 - t * (15.0 - 6.0 * t))
        q[1, k] = -30.0 * t * t * (1.0 - t * (2.0 - t)) * sign
        q[2, k] = -60.0 * t * (1.0 - t * (3.0 - 2.0 * t)) * sign * sign
        q[3, k] = -60.0 * (1.0 - t * (6.0 - 6.0 * t)) * sign * sign * sign
        slope = 1.0 / sign  # h, or -h at the end
        q[0, k + 1] = t * (1.0 - t * t * (6.0 - t * (8.0 - 3.0 * t))) * slope
        q[1, k + 1] = 1.0 - t * t * (18.0 - t * (32.0 - 15.0 * t))
        q[2, k + 1] = -t * (36.0 - t * (96.0 - 60.0 * t)) * sign
        q[3, k + 1] = (-36.0 + t * (192.0 - 180.0 * t)) * sign * sign
        q[0, k + 2] = 0.5 * t * t * (1.0 - t * (3.0 - t * (3.0 - t))) * h * h
        q[1, k + 2] = t * (1.0 - t * (4.5 - t * (6.0 - 2.5 * t))) * slope
        q[2, k + 2] = 1.0 - t * (9.0 - t * (18.0 - 10.0 * t))
        q[3, k + 2] = (-9.0 + t * (36.0 - 30.0 * t)) * sign


@inlined
def _along(w: Work, e: int, column: int, derivative: int) -> float:
    """The line's w or a derivative of it by xi in element e, from node values that start at `column` of w.ride."""
    total = 0.0
    for k in range(3):
        total += w.ride[e, column + k] * w.quintic[derivative, k]
        total += w.ride[e + 1, column + k] * w.quintic[derivative, 3 + k]
    return total


@compiled
def ride(c: Chain, w: Work, i: int, y: np.ndarray, v: np.ndarray, omega: float) -> float:
    """The attachment of slider i + 1 on link i: r, rate, beta, jac, flow and the direction of the joint; returns its angle."""
    e, end = c.first[i], c.first[i + 1]
    q, qd = y[e + 1 : end], v[e + 1 : end]
    eta, speed = y[end], v[end]
    sleeved = c.kind[i] == SLEEVE
    d, dd, ahead = c.length[i], 0.0, eta  # free length, its rate, the hub's distance from where the link is clamped
    if sleeved:
        d, dd = y[e], v[e]
        ahead = eta - c.length[i] + d
    if q.shape[0] == 0:
        rx, ry, angle = ahead, 0.0, 0.0
        ux, uy, spin = speed + dd, 0.0, 0.0
        ax, ay, turn = 0.0, 0.0, 0.0
        w.slide[i + 1, 0], w.slide[i + 1, 1], w.slide[i + 1, 2] = 1.0, 0.0, 0.0
        w.flow[i, 0], w.flow[i, 1], w.flow[i, 2] = 1.0, 0.0, 0.0
    elif c.node[i + 1] > 0:
        rx, ry, angle, ux, uy, spin, ax, ay, turn = _at_node(c, w, i, c.node[i + 1], q, qd, ahead, speed)
    else:
        rx, ry, angle, ux, uy, spin, ax, ay, turn = _on_curve(c, w, i, q, qd, ahead / d, speed, d, dd)
    w.place[i, 0], w.place[i, 1] = rx, ry
    w.rate[i, 0], w.rate[i, 1], w.rate[i, 2] = ux, uy, spin
    om2 = omega * omega
    w.beta[i, 0], w.beta[i, 1], w.beta[i, 2] = ax - om2 * rx - 2 * omega * uy, ay - om2 * ry + 2 * omega * ux, turn
    return angle


@inlined
def _at_node(c: Chain, w: Work, i: int, node: int, q: np.ndarray, qd: np.ndarray, ahead: float, speed: float) -> tuple:
    """The dissertation's reading (table 2.1): the hub at (d, w_k) with the slope of node k, and no convective terms."""
    ry, uy, sin, rate = 0.0, 0.0, 0.0, 0.0
    for k in range(q.shape[0]):
        value, slope = c.ride[i, node, 0, k], c.ride[i, node, 1, k] / c.length[i]
        ry += value * q[k]
        uy += value * qd[k]
        sin += slope * q[k]
        rate += slope * qd[k]
    tilt, angle, turn = 1.0, sin, 0.0
    if c.stiffening:
        tilt = 1.0 / np.sqrt(1.0 - sin * sin)
        angle, turn = np.arcsin(sin), sin * rate * rate * tilt * tilt * tilt
    for k in range(q.shape[0]):
        w.jac[i, k, 0], w.jac[i, k, 1] = 0.0, c.ride[i, node, 0, k]
        w.jac[i, k, 2] = tilt * c.ride[i, node, 1, k] / c.length[i]
    w.slide[i + 1, 0], w.slide[i + 1, 1], w.slide[i + 1, 2] = 1.0, 0.0, 0.0
    return ahead, ry, angle, speed, uy, tilt * rate, 0.0, 0.0, turn


@inlined
def _on_curve(
    c: Chain, w: Work, i: int, q: np.ndarray, qd: np.ndarray, xi: float, speed: float, d: float, dd: float
) -> tuple:  # fmt: skip
    """The hub at xi of the elastic line, whose length is d and grows at dd."""
    m, elements = q.shape[0], c.elements[i]
    h = 1.0 / elements
    last = min(max(int(xi * elements), 0), elements - 1)
    for n in range(last + 2):
        for k in range(9):
            w.ride[n, k] = 0.0
        for j in range(3):
            for k in range(m):
                w.ride[n, j] += c.ride[i, n, j, k] * q[k]
                w.ride[n, 3 + j] += c.ride[i, n, j, k] * qd[k]
    # integrals up to xi: of cos - 1, sec - 1, tan s', sec^3 s'^2, and the weights of grad int tan w_xi
    shrink, grow, T1, T2 = 0.0, 0.0, 0.0, 0.0
    if c.stiffening:
        for n in range(last + 1):
            part = 1.0 if n < last else xi * elements - last
            for g in range(NODES):
                weight = _W[g] * part * h
                _polynomials(w, _S[g] * part, h)
                sin = _along(w, n, 0, 1) / d
                rate = _along(w, n, 3, 1) / d - sin * dd / d
                cos = np.sqrt(1.0 - sin * sin)
                sec = 1.0 / cos
                shrink += weight * (cos - 1.0)
                grow += weight * (sec - 1.0)
                T1 += weight * sin * sec * rate
                T2 += weight * sec * sec * sec * rate * rate
                for k in range(3):
                    w.ride[n, 6 + k] += weight * sin * sec * w.quintic[1, k]
                    w.ride[n + 1, 6 + k] += weight * sin * sec * w.quintic[1, 3 + k]
    _polynomials(w, xi * elements - last, h)
    value, N1, N2, N3 = _along(w, last, 0, 0), _along(w, last, 0, 1), _along(w, last, 0, 2), _along(w, last, 0, 3)
    vd, V1, V2 = _along(w, last, 3, 0), _along(w, last, 3, 1), _along(w, last, 3, 2)
    sin = N1 / d
    cos, sec, tan, sec3 = 1.0, 1.0, 0.0, 0.0
    angle = sin
    if c.stiffening:
        cos = np.sqrt(1.0 - sin * sin)
        sec = 1.0 / cos
        tan, sec3 = sin * sec, sec * sec * sec
        angle = np.arcsin(sin)
    for k in range(m):
        jx, jy, jt = 0.0, 0.0, 0.0
        for n in range(last + 2):
            for j in range(3):
                jx += w.ride[n, 6 + j] * c.ride[i, n, j, k]
        for j in range(3):
            a, b = c.ride[i, last, j, k], c.ride[i, last + 1, j, k]
            jy += a * w.quintic[0, j] + b * w.quintic[0, 3 + j]
            jt += a * w.quintic[1, j] + b * w.quintic[1, 3 + j]
        w.jac[i, k, 0], w.jac[i, k, 1], w.jac[i, k, 2] = -jx, jy, sec * jt / d
    behind = 1.0 - xi if c.kind[i] == SLEEVE else 0.0  # dxi/dd = (1 - xi) / d
    rate = dd / d
    fixed = V1 / d - sin * rate  # d sin / dt at this xi
    move = (behind * dd + speed) / d  # dxi/dt
    pull = -2.0 * move * rate  # d2xi/dt2 without d'' and eta''
    turning = (V1 + N2 * move) / d - sin * rate
    ux = d * (cos * move - T1) + dd * (xi + shrink)
    uy = vd + N1 * move
    spin = sec * turning
    ax = d * (cos * pull - 2 * tan * fixed * move - tan * N2 / d * move * move + 2 * rate * T1 - T2) + 2 * dd * (cos * move - T1)
    ay = 2 * V1 * move + N2 * move * move + N1 * pull
    second = (2 * V2 * move + N3 * move * move + N2 * pull) / d - 2 * rate * turning
    turn = sec * second + sin * sec3 * turning * turning
    w.slide[i + 1, 0], w.slide[i + 1, 1], w.slide[i + 1, 2] = cos, sin, sec * N2 / (d * d)
    w.flow[i, 0], w.flow[i, 1] = xi + grow + behind * cos, behind * sin
    w.flow[i, 2] = sec * (behind * N2 / d - sin) / d
    return d * (xi + shrink), value, angle, ux, uy, spin, ax, ay, turn
