"""A link that slides through a sleeve (joint Pb): its inertia, elasticity and tip at the free length d.

The sleeve is the hub frame, x along its axis, and the link is clamped at its exit. The mesh covers the free length and moves with
it: w(x) = Phi(x / d)^T y. At xi = x / d, with sin = w_xi / d, a point lies at r = (d int_0^xi cos, w), and is the material
point X = L - d + x, which runs through the mesh at xi' = (1 - xi) d' / d. Its velocity in the sleeve's axes is

    V = omega x r + A yd + rho d',    A = dr/dy,    rho = dr/dd + (1 - xi) tau,    tau = (cos, sin)

so that d has a column rho beside the elastic ones. T = 1/2 sum mu |V|^2 over Gauss points of mass mu(d) = rho A(X) d dxi, and
Lagrange's equations of this sum (`model/README.md`, section 4) give for a row with the shape a of the velocity

    sum mu a (dV/dt + omega x V) + d' V (dmu/dd a - mu (1 - xi) a_tau) (+ the row of d: see below) + dU/d(row)

with a_tau the shape of tau. What the straight link would give is taken off each sum and put back as a rigid body, so that
the part inside and behind the sleeve needs no points of its own. dU/dd at fixed y is the configurational force: M0^2 / (2 EI)
pushes a bent link out.
"""

from __future__ import annotations

import numpy as np

from .chain import NODES, Chain, Work
from .compiled import inlined, internal
from .lanes import WIDTH, lanes, load, pack, store

_S = (np.polynomial.legendre.leggauss(NODES)[0] + 1) / 2
# int_0^s_g of the polynomial through values at the Gauss points: rows g, columns the values
_POWERS = np.arange(1, NODES + 1)
_UPTO = (_S[:, None] ** _POWERS / _POWERS) @ np.linalg.inv(np.vander(_S, increasing=True))
C, S, T, G, W, RX, RY, AX, RATE, BEND, UX, WD = range(12)  # columns of Work.sum


@internal
def sleeve(c: Chain, w: Work, i: int, z: np.ndarray, zd: np.ndarray, omega: float) -> float:
    """Link i's terms and its tip as the attachment, for z = (d, y); returns the tip's angle in the sleeve's frame."""
    d, dd = z[0], zd[0]
    om2 = omega * omega
    m = z.shape[0] - 1
    mass = c.mass[i] - c.hub[i]
    behind = d - c.length[i]
    X = c.s1[i] + mass * behind  # int x dm of the straight link
    body = w.body[i]
    body[0], body[1], body[2] = 0.0, X, c.inertia[i] + behind * (2 * c.s1[i] + mass * behind)
    body[3], body[4], body[5] = -om2 * X, 2 * omega * mass * dd, 2 * omega * dd * X
    body[6], body[7], body[8], body[9], body[10] = mass, 0.0, 0.0, mass, -om2 * X
    w.strain[i] = 0.0
    if m == 0:
        w.place[i, 0], w.place[i, 1] = d, 0.0
        w.rate[i, 0], w.rate[i, 1], w.rate[i, 2] = dd, 0.0, 0.0
        w.beta[i, 0], w.beta[i, 1], w.beta[i, 2] = -om2 * d, 2 * omega * dd, 0.0
        w.flow[i, 0], w.flow[i, 1], w.flow[i, 2] = 1.0, 0.0, 0.0
        return 0.0
    _shape(c, w, i, z, zd)
    for k in range(m):
        store(w.terms[i, k], 0, lanes(0.0))
        store(w.terms[i, k], 4, lanes(0.0))
        for b in range(0, m, WIDTH):
            store(w.M[i, k], b, lanes(0.0))
            store(w.K[i, k], b, lanes(0.0))
    points = c.elements[i] * NODES
    for p in range(points + 1):
        _point(c, w, i, p, points, d, dd, omega)
    return _tip(c, w, i, points, d, dd, omega)


@inlined
def _shape(c: Chain, w: Work, i: int, z: np.ndarray, zd: np.ndarray) -> None:
    """Slopes at the points and what accumulates along the line, into w.sum and w.sum_h."""
    m, h = z.shape[0] - 1, 1.0 / c.elements[i]
    s0, s1, s2, s3 = 0.0, 0.0, 0.0, 0.0  # int cos - 1, sec - 1, tan s', sec^3 s'^2 up to this element
    for k in range(m):
        w.sum_h[0, k] = 0.0
    for n in range(c.elements[i]):
        for g in range(NODES):
            _slope(c, w, i, n * NODES + g, z, zd)
        for g in range(NODES + 1):  # the last one: at the element's end, with the Gauss weights
            p = n * NODES + g
            a0, a1, a2, a3 = s0, s1, s2, s3
            for r in range(NODES):
                f = w.sum[n * NODES + r]
                upto = h * _UPTO[g, r] if g < NODES else c.sleeve_w[i, n * NODES + r]
                sec = 1.0 / f[C]
                a0 += upto * (f[C] - 1.0)
                a1 += upto * (sec - 1.0)
                a2 += upto * f[T] * f[RATE]
                a3 += upto * f[G] * f[RATE] * f[RATE]
            if g < NODES:
                f = w.sum[p]
                f[RX], f[RY], f[AX], f[UX] = a0, a1, a3, a2  # in units of xi; _point makes positions of them
            else:
                s0, s1, s2, s3 = a0, a1, a2, a3
        base = n * NODES
        for k in range(m):
            start = w.sum_h[base, k]
            t0, t1, t2, t3 = (
                w.sum[base, T] * c.sleeve_d1[i, base, k], w.sum[base + 1, T] * c.sleeve_d1[i, base + 1, k],
                w.sum[base + 2, T] * c.sleeve_d1[i, base + 2, k], w.sum[base + 3, T] * c.sleeve_d1[i, base + 3, k],
            )  # fmt: skip
            for g in range(NODES):
                w.sum_h[base + g, k] = start + h * (_UPTO[g, 0] * t0 + _UPTO[g, 1] * t1 + _UPTO[g, 2] * t2 + _UPTO[g, 3] * t3)
            whole = c.sleeve_w[i, base] * t0 + c.sleeve_w[i, base + 1] * t1 + c.sleeve_w[i, base + 2] * t2
            w.sum_h[base + NODES, k] = start + whole + c.sleeve_w[i, base + 3] * t3
    tip = c.elements[i] * NODES
    _slope(c, w, i, tip, z, zd)
    f = w.sum[tip]
    f[RX], f[RY], f[AX], f[UX] = s0, s1, s3, s2


@inlined
def _slope(c: Chain, w: Work, i: int, p: int, z: np.ndarray, zd: np.ndarray) -> None:
    """sin, cos and their kin, the rate of sin at fixed xi, and w'' and w at point p."""
    d, dd = z[0], zd[0]
    value, first, second, rate, wd = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(z.shape[0] - 1):
        value += c.sleeve_phi[i, p, k] * z[1 + k]
        wd += c.sleeve_phi[i, p, k] * zd[1 + k]
        first += c.sleeve_d1[i, p, k] * z[1 + k]
        rate += c.sleeve_d1[i, p, k] * zd[1 + k]
        second += c.sleeve_d2[i, p, k] * z[1 + k]
    f = w.sum[p]
    sin = first / d
    f[S], f[W], f[WD], f[BEND], f[RATE] = sin, value, wd, second / (d * d), (rate - sin * dd) / d
    if c.stiffening:
        cos = np.sqrt(1.0 - sin * sin)
        sec = 1.0 / cos
        f[C], f[T], f[G] = cos, sin * sec, sec * sec * sec
    else:
        f[C], f[T], f[G] = 1.0, 0.0, 0.0


@inlined
def _law(c: Chain, i: int, X: float) -> tuple:
    """rho A, its derivative, E I, its derivative at the material abscissa X."""
    piece = 0
    while piece + 1 < c.law_x.shape[1] and X >= c.law_x[i, piece + 1]:
        piece += 1
    s = X - c.law_x[i, piece]
    a, b = c.law_mass[i, piece], c.law_EI[i, piece]
    return (
        a[0] + s * (a[1] + s * a[2]), a[1] + 2 * s * a[2],
        b[0] + s * (b[1] + s * (b[2] + s * (b[3] + s * b[4]))), b[1] + s * (2 * b[2] + s * (3 * b[3] + s * 4 * b[4])),
    )  # fmt: skip


@internal
def _point(c: Chain, w: Work, i: int, p: int, points: int, d: float, dd: float, omega: float) -> None:
    """Add point p: a piece of the link at a Gauss point, or the payload at the tip (p = points)."""
    f, phi, d1, h = w.sum[p], c.sleeve_phi[i, p], c.sleeve_d1[i, p], w.sum_h[p]
    m = c.first[i + 1] - c.first[i] - 1
    xi, weight = c.sleeve_xi[i, p], c.sleeve_w[i, p]
    left, om2 = 1.0 - xi, omega * omega
    cos, sin, tan, bend = f[C], f[S], f[T], f[BEND]
    rho_A, slope_A, EI, slope_EI = _law(c, i, c.length[i] - d * left)
    if p < points:
        mu, dmu = weight * d * rho_A, weight * (rho_A - d * left * slope_A)
    else:
        mu, dmu = c.payload[i], 0.0
    rx, ry = d * (xi + f[RX]), f[W]
    px, py = xi + f[RY] + left * cos, left * sin  # rho
    gx, gy = dd * (xi + f[RX]) - d * f[UX], f[WD]  # the rate of r at this xi
    Vx, Vy = gx - omega * ry + left * cos * dd, gy + omega * rx + left * sin * dd
    Bx = -omega * gy - d * f[AX] - left * tan * f[RATE] * dd - omega * Vy
    By = omega * gx + left * f[RATE] * dd + omega * Vx
    x = d * xi  # the straight link's place; its V = (dd, omega x), B = (-om2 x, omega dd (1 + xi))
    body, flux = w.body[i], mu * left * dd
    body[0] += mu * ry
    body[1] += mu * (rx - x)
    body[2] += mu * (rx * rx + ry * ry - x * x)
    body[3] += mu * (Bx + om2 * x) + dmu * dd * (Vx - dd)
    body[4] += mu * (By - omega * dd * (1.0 + xi)) + dmu * dd * (Vy - omega * x)
    turn = mu * (rx * By - ry * Bx) - flux * (cos * Vy - sin * Vx) + dmu * dd * (rx * Vy - ry * Vx)
    body[5] += turn - mu * x * omega * dd * (1.0 + xi) + flux * omega * x - dmu * dd * omega * x * x
    body[6] += mu * (px - 1.0)
    body[7] += mu * py
    body[8] += mu * (rx * py - ry * px)
    body[9] += mu * (px * px + py * py - 1.0)
    along = f[RATE] + sin * dd / d  # the rate of sin by yd alone
    bent = mu * (px * Bx + py * By) + dmu * (dd * (px * Vx + py * Vy) - 0.5 * (Vx * Vx + Vy * Vy))
    bent += mu * left * (Vx * (-tan * along - omega * sin) + Vy * (along + omega * cos))
    straight = -mu * om2 * x + dmu * 0.5 * (dd * dd - om2 * x * x) + mu * left * om2 * x
    body[10] += bent - straight
    # strain energy: K holds what is linear in y, cv the rest; dU/dd is whole in the row of d
    sec2 = 1.0 + tan * tan
    moment = weight * d * EI * bend
    force1, force2 = moment * bend * sin * sec2 * sec2 / d, moment * tan * tan / (d * d)
    if not c.stiffening:
        force1 = 0.0
    w.strain[i] += 0.5 * moment * bend * sec2
    body[10] -= 0.5 * moment * bend * sec2 * (3.0 + 2.0 * tan * tan) / d + 0.5 * weight * d * left * slope_EI * bend * bend * sec2
    stiff = weight * EI / (d * d * d)
    ax, ay = mu * Bx + dmu * dd * Vx, mu * By + dmu * dd * Vy
    tx, ty = flux * tan * Vx / d, -flux * Vy / d
    for k in range(m):
        hk, fk, bent_k, terms = h[k], phi[k], c.sleeve_d2[i, p, k], w.terms[i, k]
        force = ay * fk - ax * hk + (tx + ty + force1) * d1[k] + force2 * bent_k
        column = pack(-mu * hk, mu * fk, mu * (rx * fk + ry * hk), force)
        store(terms, 0, load(terms, 0) + column)
        terms[7] += mu * (py * fk - px * hk)
        mh, mf, sk = mu * hk, mu * fk, stiff * bent_k
        for b in range(0, m, WIDTH):
            store(w.M[i, k], b, load(w.M[i, k], b) + mh * load(h, b) + mf * load(phi, b))
            store(w.K[i, k], b, load(w.K[i, k], b) + sk * load(c.sleeve_d2[i, p], b))


@inlined
def _tip(c: Chain, w: Work, i: int, tip: int, d: float, dd: float, omega: float) -> float:
    """The tip as the attachment of the next joint, and the payload's turning there; returns the tip's angle."""
    f = w.sum[tip]
    sin, sec, om2 = f[S], 1.0 / f[C], omega * omega
    lean = -sin * sec / d  # d angle / dd
    spin = f[RATE] * sec
    turn = -2 * dd / d * f[RATE] * sec + sin * f[RATE] * f[RATE] * f[G]
    rx, ry = d * (1.0 + f[RX]), f[W]
    ux, uy = dd * (1.0 + f[RX]) - d * f[UX], f[WD]
    w.place[i, 0], w.place[i, 1] = rx, ry
    w.rate[i, 0], w.rate[i, 1], w.rate[i, 2] = ux, uy, spin
    w.beta[i, 0], w.beta[i, 1], w.beta[i, 2] = -om2 * rx - 2 * omega * uy - d * f[AX], -om2 * ry + 2 * omega * ux, turn
    w.flow[i, 0], w.flow[i, 1], w.flow[i, 2] = 1.0 + f[RY], 0.0, lean
    Jp, m = c.tip_inertia[i], c.first[i + 1] - c.first[i] - 1
    for k in range(m):
        w.terms[i, k, 4], w.terms[i, k, 5], w.terms[i, k, 6] = -w.sum_h[tip, k], c.NL[i, k], sec * c.SL[i, k] / d
    if Jp > 0.0:
        body = w.body[i]
        body[5] += Jp * turn
        body[8] += Jp * lean
        body[9] += Jp * lean * lean
        body[10] += Jp * lean * turn
        for k in range(m):
            jk = Jp * w.terms[i, k, 6]
            w.terms[i, k, 2] += jk
            w.terms[i, k, 7] += jk * lean
            w.terms[i, k, 3] += jk * turn
            for j in range(m):
                w.M[i, k, j] += jk * w.terms[i, j, 6]
    return np.arcsin(sin) if c.stiffening else sin
