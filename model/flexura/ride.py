"""A slider (joint Pa) on the link before it: where its hub is, how it moves with the link, and along it.

The hub rides on the elastic line at abscissa eta, at xi = eta / L, or xi = 1 - (L - eta) / d where the link itself slides through
a sleeve with the free length d. w and w_xi at the nodes are those of the Hermite cubics; between them the line is the quintic
through these and the mean curvatures of the elements on both sides, so that the hub's rate of turning, kappa eta', and with it
M(q), does not jump at a node. With l = L or d, sin = w_xi / l, t(xi) = (l int cos, w, asin), the joint's direction is dt/deta
= (cos, sin, kappa), and the convective terms are those of the second derivative of t along the motion (`model/README.md`,
section 4).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .chain import NODES, SLEEVE, Chain, Work
from .compiled import inlined, internal
from .lanes import lanes, load, root, store, total, turned

_S, _W = np.polynomial.legendre.leggauss(NODES)
_S, _W = (_S + 1) / 2, _W / 2


@inlined
def _slopes(s: Any, h: float) -> tuple:
    """The derivatives of the quintic Hermite polynomials on an element of length h at s in [0, 1], a number or four: of value,
    slope and curvature at its start and at its end, where they are the start's, mirrored."""
    t = 1.0 - s
    bump = 30.0 * s * s * t * t
    return (
        bump * (-1.0 / h), 1.0 - s * s * (18.0 - s * (32.0 - 15.0 * s)), s * (1.0 - s * (4.5 - s * (6.0 - 2.5 * s))) * h,
        bump * (1.0 / h), 1.0 - t * t * (18.0 - t * (32.0 - 15.0 * t)), t * (1.0 - t * (4.5 - t * (6.0 - 2.5 * t))) * -h,
    )  # fmt: skip


@internal
def _polynomials(w: Work, s: float, h: float) -> None:
    """These polynomials and their derivatives up to the third into the rows of w.quintic."""
    q = w.quintic
    q[1, 0], q[1, 1], q[1, 2], q[1, 4], q[1, 5], q[1, 6] = _slopes(s, h)
    for end in range(2):
        t, sign = s, 1.0 / h
        if end == 1:
            t, sign = 1.0 - s, -1.0 / h  # of one derivative by x
        k = 4 * end
        q[0, k] = 1.0 - t * t * t * (10.0 - t * (15.0 - 6.0 * t))
        q[2, k] = -60.0 * t * (1.0 - t * (3.0 - 2.0 * t)) * sign * sign
        q[3, k] = -60.0 * (1.0 - t * (6.0 - 6.0 * t)) * sign * sign * sign
        q[0, k + 1] = t * (1.0 - t * t * (6.0 - t * (8.0 - 3.0 * t))) / sign  # h, or -h at the end
        q[2, k + 1] = -t * (36.0 - t * (96.0 - 60.0 * t)) * sign
        q[3, k + 1] = (-36.0 + t * (192.0 - 180.0 * t)) * sign * sign
        q[0, k + 2] = 0.5 * t * t * (1.0 - t * (3.0 - t * (3.0 - t))) * h * h
        q[2, k + 2] = 1.0 - t * (9.0 - t * (18.0 - 10.0 * t))
        q[3, k + 2] = (-9.0 + t * (36.0 - 30.0 * t)) * sign


@inlined
def _along(w: Work, e: int, of: int, derivative: int) -> float:
    """The line's w (of = 0), its rate (1), or a derivative of one by xi, in element e."""
    q = w.quintic[derivative]
    return total(load(w.ride[e, of], 0) * load(q, 0) + load(w.ride[e + 1, of], 0) * load(q, 4))


@inlined
def _four(at: np.ndarray, to: np.ndarray, d0: Any, d1: Any, d2: Any, e0: Any, e1: Any, e2: Any) -> Any:
    """The line's w_xi at four points of an element, from its node values and `_slopes`."""
    return d0 * at[0] + d1 * at[1] + d2 * at[2] + e0 * to[0] + e1 * to[1] + e2 * to[2]


@internal
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
        value, slope = c.ride[i, node, k, 0], c.ride[i, node, k, 1] / c.length[i]
        ry += value * q[k]
        uy += value * qd[k]
        sin += slope * q[k]
        rate += slope * qd[k]
    tilt, angle, turn = 1.0, sin, 0.0
    if c.stiffening:
        tilt = 1.0 / np.sqrt(1.0 - sin * sin)
        angle, turn = np.arcsin(sin), sin * rate * rate * tilt * tilt * tilt
    for k in range(q.shape[0]):
        w.terms[i, k, 4], w.terms[i, k, 5] = 0.0, c.ride[i, node, k, 0]
        w.terms[i, k, 6] = tilt * c.ride[i, node, k, 1] / c.length[i]
    w.slide[i + 1, 0], w.slide[i + 1, 1], w.slide[i + 1, 2] = 1.0, 0.0, 0.0
    return ahead, ry, angle, speed, uy, tilt * rate, 0.0, 0.0, turn


@internal
def _on_curve(
    c: Chain, w: Work, i: int, q: np.ndarray, qd: np.ndarray, xi: float, speed: float, d: float, dd: float
) -> tuple:  # fmt: skip
    """The hub at xi of the elastic line, whose length is d and grows at dd."""
    m, elements = q.shape[0], c.elements[i]
    h = 1.0 / elements
    last = min(max(int(xi * elements), 0), elements - 1)
    for n in range(last + 2):
        own, rate = lanes(0.0), lanes(0.0)
        for k in range(m):
            node = load(c.ride[i, n, k], 0)
            own += node * q[k]
            rate += node * qd[k]
        store(w.ride[n, 0], 0, own)
        store(w.ride[n, 1], 0, rate)
        store(w.ride[n, 2], 0, lanes(0.0))
    # integrals up to xi: of cos - 1, sec - 1, tan s', sec^3 s'^2, and the weights of grad int tan w_xi
    shrink, grow, T1, T2 = lanes(0.0), lanes(0.0), lanes(0.0), lanes(0.0)
    if c.stiffening:
        for n in range(last + 1):
            part = 1.0 if n < last else xi * elements - last
            weight = load(_W, 0) * (part * h)
            d0, d1, d2, e0, e1, e2 = _slopes(load(_S, 0) * part, h)
            sin = _four(w.ride[n, 0], w.ride[n + 1, 0], d0, d1, d2, e0, e1, e2) / d
            rate = _four(w.ride[n, 1], w.ride[n + 1, 1], d0, d1, d2, e0, e1, e2) / d - sin * (dd / d)
            cos = root(1.0 - sin * sin)
            sec = 1.0 / cos
            tan = weight * sin * sec
            shrink += weight * (cos - 1.0)
            grow += weight * (sec - 1.0)
            T1 += tan * rate
            T2 += weight * sec * sec * sec * rate * rate
            a0, a1, a2, a3 = turned(tan * d0, tan * d1, tan * d2, lanes(0.0))
            store(w.ride[n, 2], 0, load(w.ride[n, 2], 0) + ((a0 + a1) + (a2 + a3)))
            a0, a1, a2, a3 = turned(tan * e0, tan * e1, tan * e2, lanes(0.0))
            store(w.ride[n + 1, 2], 0, (a0 + a1) + (a2 + a3))
    shrunk, grown, T1s, T2s = total(shrink), total(grow), total(T1), total(T2)
    return _hub(c, w, i, xi, speed, d, dd, m, last, shrunk, grown, T1s, T2s)


@inlined
def _hub(
    c: Chain, w: Work, i: int, xi: float, speed: float, d: float, dd: float, m: int, last: int,
    shrink: float, grow: float, T1: float, T2: float,
) -> tuple:  # fmt: skip
    """The hub where it is, from the curve up to there."""
    elements = c.elements[i]
    _polynomials(w, xi * elements - last, 1.0 / elements)
    value, N1, N2, N3 = _along(w, last, 0, 0), _along(w, last, 0, 1), _along(w, last, 0, 2), _along(w, last, 0, 3)
    vd, V1, V2 = _along(w, last, 1, 0), _along(w, last, 1, 1), _along(w, last, 1, 2)
    sin = N1 / d
    cos, sec, tan, sec3 = 1.0, 1.0, 0.0, 0.0
    angle = sin
    if c.stiffening:
        cos = np.sqrt(1.0 - sin * sin)
        sec = 1.0 / cos
        tan, sec3 = sin * sec, sec * sec * sec
        angle = np.arcsin(sin)
    for k in range(m):
        jx = lanes(0.0)
        for n in range(last + 2):
            jx += load(w.ride[n, 2], 0) * load(c.ride[i, n, k], 0)
        near, far = load(c.ride[i, last, k], 0), load(c.ride[i, last + 1, k], 0)
        jy = near * load(w.quintic[0], 0) + far * load(w.quintic[0], 4)
        jt = near * load(w.quintic[1], 0) + far * load(w.quintic[1], 4)
        w.terms[i, k, 4], w.terms[i, k, 5], w.terms[i, k, 6] = -total(jx), total(jy), sec / d * total(jt)
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
