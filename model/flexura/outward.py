"""The outward pass: positions and velocities from the base to the tip, and every link's inertia terms and velocity-dependent
forces."""

from __future__ import annotations

import numpy as np

from .chain import REVOLUTE, SLEEVE, SLIDER, Chain, Work
from .compiled import inlined
from .ride import ride
from .sleeve import sleeve


@inlined
def outward(c: Chain, w: Work, y: np.ndarray, v: np.ndarray) -> None:
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


@inlined
def _link(c: Chain, w: Work, i: int, q: np.ndarray, qd: np.ndarray, omega: float) -> float:
    """A link clamped to its hub (R, Pa): its terms, and its tip as the attachment; returns the tip's angle in its frame."""
    m = q.shape[0]
    om2 = omega * omega
    slope, spin, wL, wLd, S0q, S0v, qq, qv = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(m):
        slope += c.SL[i, k] * q[k]
        spin += c.SL[i, k] * qd[k]
        wL += c.NL[i, k] * q[k]
        wLd += c.NL[i, k] * qd[k]
        S0q += c.S0[i, k] * q[k]
        S0v += c.S0[i, k] * qd[k]
        qq += q[k] * q[k]
        qv += q[k] * qd[k]
        w.col[i, k, 0], w.col[i, k, 1], w.col[i, k, 2] = 0.0, c.S0[i, k], c.S1[i, k]
        w.jac[i, k, 0], w.jac[i, k, 1], w.jac[i, k, 2] = 0.0, c.NL[i, k], c.SL[i, k]
        w.cv[i, k] = -om2 * q[k]
    w.body[i, 0], w.body[i, 1], w.body[i, 2] = S0q, c.s1[i], c.inertia[i] + qq
    w.body[i, 3], w.body[i, 4], w.body[i, 5] = -2 * omega * S0v - om2 * c.s1[i], -om2 * S0q, 2 * omega * qv
    Jp = c.tip_inertia[i]
    if Jp > 0.0:  # q^T M q has the payload's turning in it, which does not act at a distance
        w.body[i, 2] -= Jp * slope * slope
        w.body[i, 5] -= 2 * omega * Jp * slope * spin
        for k in range(m):
            w.cv[i, k] += om2 * Jp * slope * c.SL[i, k]
    u, k_, z, turn = 0.0, 0.0, 0.0, 0.0
    w.tilt[i] = 1.0
    if c.stiffening and m > 0:
        if c.points[i] == 4:  # the usual number as a constant: the compiler unrolls the loops over points
            u, k_, z = _bend(c, w, i, q, qd, omega, 4)
        else:
            u, k_, z = _bend(c, w, i, q, qd, omega, c.points[i])
        # the tip's tangent turns by asin(w'), faster than w' by 1/cos
        tilt = 1.0 / np.sqrt(1.0 - slope * slope)
        w.tilt[i] = tilt
        turn = slope * spin * spin * tilt * tilt * tilt
        if Jp > 0.0:
            w.body[i, 5] += Jp * turn
            for k in range(m):
                w.col[i, k, 2] += Jp * (tilt - 1.0) * c.SL[i, k]
                w.cv[i, k] += Jp * tilt * turn * c.SL[i, k]
        for k in range(m):
            w.jac[i, k, 2] = tilt * c.SL[i, k]
        slope = np.arcsin(slope)
        spin *= tilt
    rx = c.length[i] + u
    w.place[i, 0], w.place[i, 1] = rx, wL
    w.rate[i, 0], w.rate[i, 1], w.rate[i, 2] = -k_, wLd, spin
    w.beta[i, 0], w.beta[i, 1], w.beta[i, 2] = -om2 * rx - 2 * omega * wLd - z, -om2 * wL - 2 * omega * k_, turn
    return slope


@inlined
def _bend(c: Chain, w: Work, i: int, q: np.ndarray, qd: np.ndarray, omega: float, points: int) -> tuple[float, float, float]:
    """Add the geometry of an inextensible line to link i's inertia terms and forces; returns u, h.v, z of its tip.

    The point at arc length x lies at (x + u, w) in the hub's frame, with u = int_0^x (cos - 1), sin = w', so that
    du/dt = -h.v, h = int_0^x tan phi', and d2u/dt2 = -h.qdd - z, z = int_0^x (dw'/dt)^2 / cos^3. The curvature is w'' / cos,
    which adds 1/2 int EI w''^2 tan^2 to the strain energy. What is of second order in (q, v) comes from the exact integrals G1,
    G2, H; the rest (tan - sin and the like, and products of u) is summed over the link's points.
    """
    m = q.shape[0]
    om2 = omega * omega
    qGq, qGv, vGv, qG2q, qG2v, qHq, qHv, vHv = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(m):
        g, gv, g2, h, hv = 0.0, 0.0, 0.0, 0.0, 0.0
        for j in range(m):
            g += c.G1[i, k, j] * q[j]
            gv += c.G1[i, k, j] * qd[j]
            g2 += c.G2[i, k, j] * q[j]
            h += c.H[i, k, j] * q[j]
            hv += c.H[i, k, j] * qd[j]
        w.col[i, k, 0], w.jac[i, k, 0] = -g, -h
        w.cv[i, k] += om2 * g2
        qGq += g * q[k]
        qGv += g * qd[k]
        vGv += gv * qd[k]
        qG2q += g2 * q[k]
        qG2v += g2 * qd[k]
        qHq += h * q[k]
        qHv += h * qd[k]
        vHv += hv * qd[k]
    U, K, Z, dU, dK, dZ = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0  # u, h.v, z so far, and their parts of higher order
    b, J, hx, hy, hw = -0.5 * qGq, -qG2q, vGv, qGv, -2 * omega * qG2v
    for p in range(points):
        for half in range(2):
            r = 2 * p + half
            s, sd, bend = 0.0, 0.0, 0.0
            for k in range(m):
                s += c.slope_d1[i, r, k] * q[k]
                sd += c.slope_d1[i, r, k] * qd[k]
                bend += c.slope_d2[i, r, k] * q[k]
            cos = np.sqrt(1.0 - s * s)
            sec = 1.0 / cos
            sec2 = sec * sec
            dx, moment = c.slope_dx[i, r], c.slope_EI[i, r] * bend * s * sec2
            sin, vv = dx * s, dx * sd * sd
            rest = sin * (sec - 1.0)
            u, z = dx * (cos - 1.0), vv * sec2 * sec
            U += u
            K += (sin + rest) * sd
            Z += z
            dU += u + 0.5 * sin * s
            dK += rest * sd
            dZ += z - vv
            w.slope[r, 0], w.slope[r, 1], w.slope[r, 2], w.slope[r, 3] = sin + rest, rest, moment * bend * sec2, moment * s
        wp, wd = 0.0, 0.0
        for k in range(m):
            wp += c.point_phi[i, p, k] * q[k]
            wd += c.point_phi[i, p, k] * qd[k]
        mu, x = c.point_mass[i, p], c.point_x[i, p]
        w.point[p, 0], w.point[p, 1] = mu * (om2 * U + 2 * omega * wd + Z), -2 * omega * mu * K
        w.point[p, 2], w.point[p, 3], w.point[p, 4] = mu * U, mu * wp, mu * om2 * x
        b += mu * dU
        J += mu * (2 * x * dU + U * U)
        hx += mu * dZ
        hy += mu * dK
        hw += mu * (wp * Z - 2 * omega * (K * U + dK * x))
    w.body[i, 1] += b
    w.body[i, 2] += J
    w.body[i, 3] -= om2 * b + hx
    w.body[i, 4] -= 2 * omega * hy
    w.body[i, 5] += hw
    for k in range(m):
        h, dh, g, mt, cv = 0.0, 0.0, 0.0, 0.0, 0.0
        for p in range(points):
            for half in range(2):
                r = 2 * p + half
                d1 = c.slope_d1[i, r, k]
                h += w.slope[r, 0] * d1
                dh += w.slope[r, 1] * d1
                cv += w.slope[r, 2] * d1 + w.slope[r, 3] * c.slope_d2[i, r, k]
            phi = c.point_phi[i, p, k]
            w.h[i, p, k] = h
            g += c.point_mass[i, p] * dh
            mt += w.point[p, 2] * phi + w.point[p, 3] * h
            cv += w.point[p, 0] * h + w.point[p, 1] * phi + w.point[p, 4] * dh
        w.col[i, k, 0] -= g
        w.jac[i, k, 0] -= dh
        w.col[i, k, 2] += mt
        w.cv[i, k] += cv
    return dU - 0.5 * qHq, dK + qHv, dZ + vHv
