"""The outward pass: positions and velocities from the base to the tip, and every link's inertia terms and velocity-dependent
forces."""

from __future__ import annotations

import numpy as np

from .chain import REVOLUTE, SLEEVE, SLIDER, Chain, Work
from .compiled import compiled, inlined, internal
from .lanes import WIDTH, lanes, load, load_some, parts, root, running, store, total, turned
from .pinned import pinned
from .ride import ride
from .sleeve import sleeve


@internal
def passed_outward(c: Chain, w: Work, y: np.ndarray, v: np.ndarray) -> None:
    """Positions and velocities along the chain, and each link's inertia terms and velocity-dependent forces."""
    links = c.kind.shape[0]
    omega, slope = 0.0, 0.0  # of the place where the next joint is attached; its slope relative to its link
    if c.kind[0] == SLIDER:
        w.slide[0, 0], w.slide[0, 2] = 1.0, 0.0
    else:
        w.slide[0, 0], w.slide[0, 2] = 0.0, 1.0
    for i in range(links):
        e, end = c.first[i], c.first[i + 1]
        if c.kind[i] == REVOLUTE:
            psi = slope + y[e]
            omega += v[e]
        else:
            psi = slope + c.angle[i]
        w.cos[i], w.sin[i], w.omega[i] = np.cos(psi), np.sin(psi), omega
        if c.kind[i] == SLEEVE:
            slope = sleeve(c, w, i, y[e:end], v[e:end], omega)
        else:
            slope = _link(c, w, i, y[e + 1 : end], v[e + 1 : end], omega)
        if i + 1 < links:
            if c.kind[i + 1] == SLIDER:
                slope = ride(c, w, i, y, v, omega)
            else:
                w.slide[i + 1, 0], w.slide[i + 1, 1], w.slide[i + 1, 2] = 0.0, 0.0, 1.0
        w.angle[i] = slope
        omega += w.rate[i, 2]


@compiled
def outward(c: Chain, w: Work, y: np.ndarray, v: np.ndarray) -> None:
    """`passed_outward` for Python."""
    passed_outward(pinned(c), pinned(w), y, v)


@internal
def _link(c: Chain, w: Work, i: int, q: np.ndarray, qd: np.ndarray, omega: float) -> float:
    """A link clamped to its hub (R, Pa): its terms, and its tip as the attachment; returns the tip's angle in its frame."""
    om2, body, L = omega * omega, w.body[i], c.length[i]
    w.tilt[i] = 1.0
    if q.shape[0] == 0:
        body[0], body[1], body[2], body[3], body[4], body[5] = 0.0, c.s1[i], c.inertia[i], -om2 * c.s1[i], 0.0, 0.0
        w.place[i, 0], w.place[i, 1] = L, 0.0
        w.rate[i, 0], w.rate[i, 1], w.rate[i, 2] = 0.0, 0.0, 0.0
        w.beta[i, 0], w.beta[i, 1], w.beta[i, 2] = -om2 * L, 0.0, 0.0
        return 0.0
    slope, spin, wL, wLd, S0q, S0v, qq, qv = _sums(c, i, q, qd)
    Jp = c.tip_inertia[i]  # q^T M q has the payload's turning in it, which does not act at a distance
    body[0], body[1], body[2] = S0q, c.s1[i], c.inertia[i] + qq - Jp * slope * slope
    body[3], body[4], body[5] = -2 * omega * S0v - om2 * c.s1[i], -om2 * S0q, 2 * omega * (qv - Jp * slope * spin)
    if not c.stiffening:
        _terms(c, w, i, q, qd, omega, 1.0, om2 * Jp * slope)
        w.place[i, 0], w.place[i, 1] = L, wL
        w.rate[i, 0], w.rate[i, 1], w.rate[i, 2] = 0.0, wLd, spin
        w.beta[i, 0], w.beta[i, 1], w.beta[i, 2] = -om2 * L - 2 * omega * wLd, -om2 * wL, 0.0
        return slope
    # the tip's tangent turns by asin(w'), faster than w' by 1/cos
    tilt = 1.0 / np.sqrt(1.0 - slope * slope)
    w.tilt[i] = tilt
    turn = slope * spin * spin * tilt * tilt * tilt
    dU, dK, dZ = _points(c, w, i, q, qd, omega)
    qHq, qHv, vHv = _terms(c, w, i, q, qd, omega, tilt, Jp * (om2 * slope + tilt * turn))
    body[5] += Jp * turn
    rx, K = L + dU - 0.5 * qHq, dK + qHv
    w.place[i, 0], w.place[i, 1] = rx, wL
    w.rate[i, 0], w.rate[i, 1], w.rate[i, 2] = -K, wLd, tilt * spin
    w.beta[i, 0], w.beta[i, 1] = -om2 * rx - 2 * omega * wLd - dZ - vHv, -om2 * wL - 2 * omega * K
    w.beta[i, 2] = turn
    return np.arcsin(slope)


@inlined
def _sums(c: Chain, i: int, q: np.ndarray, qd: np.ndarray) -> tuple:
    """Slope and deflection of the tip with their rates, S0 q, S0 v, q^2, q v."""
    zero = lanes(0.0)
    slope, spin, wL, wLd, S0q, S0v, qq, qv = zero, zero, zero, zero, zero, zero, zero, zero
    for b in range(0, q.shape[0], WIDTH):
        own, rate = load_some(q, b, q.shape[0] - b), load_some(qd, b, q.shape[0] - b)
        SL, NL, S0 = load(c.SL[i], b), load(c.NL[i], b), load(c.S0[i], b)
        slope += SL * own
        spin += SL * rate
        wL += NL * own
        wLd += NL * rate
        S0q += S0 * own
        S0v += S0 * rate
        qq += own * own
        qv += own * rate
    a, b_, c_, d = turned(slope, spin, wL, wLd)
    e, f, g, h = turned(S0q, S0v, qq, qv)
    return parts((a + b_) + (c_ + d)) + parts((e + f) + (g + h))


@internal
def _points(c: Chain, w: Work, i: int, q: np.ndarray, qd: np.ndarray, omega: float) -> tuple[float, float, float]:
    """The geometry of an inextensible line at link i's points, four at a time, into w.slope and w.point, and what it adds to the
    inertia terms; returns u, h.v, z of its tip, what they have beyond second order.

    The point at arc length x lies at (x + u, w) in the hub's frame, with u = int_0^x (cos - 1), sin = w', so that
    du/dt = -h.v, h = int_0^x tan phi', and d2u/dt2 = -h.qdd - z, z = int_0^x (dw'/dt)^2 / cos^3. The curvature is w'' / cos,
    which adds 1/2 int EI w''^2 tan^2 to the strain energy. What is of second order in (q, v) comes from the exact integrals G1,
    G2, H (`_terms`); the rest (tan - sin and the like, and products of u) is summed over the link's points.
    """
    zero, om2 = lanes(0.0), omega * omega
    U, K, Z, dU, dK, dZ = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0  # u, h.v, z so far, and their parts of higher order
    b, J, hx, hy, hw = zero, zero, zero, zero, zero
    for p in range(0, c.points[i], WIDTH):
        u, k, z, du, dk, dz = _bent(c, w, i, q, qd, 0, p)
        u1, k1, z1, du1, dk1, dz1 = _bent(c, w, i, q, qd, 1, p)
        u, k, z = running(u + u1) + U, running(k + k1) + K, running(z + z1) + Z
        du, dk, dz = running(du + du1) + dU, running(dk + dk1) + dK, running(dz + dz1) + dZ
        wp, wd = zero, zero
        for j in range(q.shape[0]):
            phi = load(c.point_phi_T[i, j], p)
            wp += phi * q[j]
            wd += phi * qd[j]
        mu, x = load(c.point_mass[i], p), load(c.point_x[i], p)
        store(w.point[0], p, mu * (om2 * u + 2 * omega * wd + z))
        store(w.point[1], p, -2 * omega * mu * k)
        store(w.point[2], p, mu * u)
        store(w.point[3], p, mu * wp)
        store(w.point[4], p, om2 * mu * x)
        b += mu * du
        J += mu * (2 * x * du + u * u)
        hx += mu * dz
        hy += mu * dk
        hw += mu * (wp * z - 2 * omega * (k * u + dk * x))
        U, K, Z = parts(u)[3], parts(k)[3], parts(z)[3]
        dU, dK, dZ = parts(du)[3], parts(dk)[3], parts(dz)[3]
    body, more = w.body[i], total(b)
    body[1] += more
    body[2] += total(J)
    body[3] -= om2 * more + total(hx)
    body[4] -= 2 * omega * total(hy)
    body[5] += total(hw)
    return dU, dK, dZ


@inlined
def _bent(c: Chain, w: Work, i: int, q: np.ndarray, qd: np.ndarray, half: int, p: int) -> tuple:
    """u, h.v, z between points p to p + 3 and the ones before them, from one slope point in each gap, and their parts of higher
    order."""
    s, sd, bend = lanes(0.0), lanes(0.0), lanes(0.0)
    for k in range(q.shape[0]):
        d1 = load(c.slope_d1_T[i, k, half], p)
        s += d1 * q[k]
        sd += d1 * qd[k]
        bend += load(c.slope_d2_T[i, k, half], p) * q[k]
    cos = root(1.0 - s * s)
    sec = 1.0 / cos
    sec2 = sec * sec
    dx, moment = load(c.slope_dx[i, half], p), load(c.slope_EI[i, half], p) * bend * s * sec2
    sin, vv = dx * s, dx * sd * sd
    rest = sin * (sec - 1.0)
    tan, u, z = sin + rest, dx * (cos - 1.0), vv * sec2 * sec
    store(w.slope[0, half], p, tan)
    store(w.slope[1, half], p, rest)
    store(w.slope[2, half], p, moment * bend * sec2)
    store(w.slope[3, half], p, moment * s)
    return u, tan * sd, z, u + 0.5 * sin * s, rest * sd, z - vv


@internal
def _terms(
    c: Chain, w: Work, i: int, q: np.ndarray, qd: np.ndarray, omega: float, tilt: float, turning: float
) -> tuple[float, float, float]:  # fmt: skip
    """The elastic rows' terms and h, four modes at a time, from what `_points` left; returns q H q, q H v, v H v.

    `turning`: the force on w'(L).
    """
    zero, om2, m, Jp = lanes(0.0), omega * omega, q.shape[0], c.tip_inertia[i]
    qGq, qGv, vGv, qG2q, qG2v, qHq, qHv, vHv = zero, zero, zero, zero, zero, zero, zero, zero
    for b in range(0, m, WIDTH):
        own, rate, SL = load_some(q, b, m - b), load_some(qd, b, m - b), load(c.SL[i], b)
        x, angle, force = zero, load(c.S1[i], b) + Jp * (tilt - 1.0) * SL, turning * SL - om2 * own
        jx = zero
        if c.stiffening:
            g, gv, g2, h, hv = zero, zero, zero, zero, zero
            for j in range(m):
                G1, G2, H = load(c.G1[i, j], b), load(c.G2[i, j], b), load(c.H[i, j], b)
                g += G1 * q[j]
                gv += G1 * qd[j]
                g2 += G2 * q[j]
                h += H * q[j]
                hv += H * qd[j]
            x, jx = -g, -h
            force += om2 * g2
            qGq += g * own
            qGv += g * rate
            vGv += gv * rate
            qG2q += g2 * own
            qG2v += g2 * rate
            qHq += h * own
            qHv += h * rate
            vHv += hv * rate
            h, rest = zero, zero
            for p in range(c.points[i]):
                near, far = load(c.slope_d1[i, 0, p], b), load(c.slope_d1[i, 1, p], b)
                h += w.slope[0, 0, p] * near + w.slope[0, 1, p] * far
                rest += w.slope[1, 0, p] * near + w.slope[1, 1, p] * far
                force += w.slope[2, 0, p] * near + w.slope[2, 1, p] * far
                force += w.slope[3, 0, p] * load(c.slope_d2[i, 0, p], b) + w.slope[3, 1, p] * load(c.slope_d2[i, 1, p], b)
                phi = load(c.point_phi[i, p], b)
                store(w.h[i, p], b, h)
                x -= c.point_mass[i, p] * rest
                angle += w.point[2, p] * phi + w.point[3, p] * h
                force += w.point[0, p] * h + w.point[1, p] * phi + w.point[4, p] * rest
            jx -= rest
        one, two, three, four = turned(x, load(c.S0[i], b), angle, force)
        five, six, seven, eight = turned(jx, load(c.NL[i], b), tilt * SL, zero)
        store(w.terms[i, b], 0, one)
        store(w.terms[i, b + 1], 0, two)
        store(w.terms[i, b + 2], 0, three)
        store(w.terms[i, b + 3], 0, four)
        store(w.terms[i, b], 4, five)
        store(w.terms[i, b + 1], 4, six)
        store(w.terms[i, b + 2], 4, seven)
        store(w.terms[i, b + 3], 4, eight)
    if c.stiffening:
        body, more = w.body[i], -0.5 * total(qGq)
        body[1] += more
        body[2] -= total(qG2q)
        body[3] -= om2 * more + total(vGv)
        body[4] -= 2 * omega * total(qGv)
        body[5] -= 2 * omega * total(qG2v)
    return total(qHq), total(qHv), total(vHv)
