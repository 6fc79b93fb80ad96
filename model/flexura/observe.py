"""What a state looks like from outside: poses, tips and energies, compiled over whole histories."""

from __future__ import annotations

import numpy as np

from .chain import PRISMATIC, REVOLUTE, Chain, Work
from .compiled import compiled
from .outward import outward


@compiled
def _strain(c: Chain, i: int, q: np.ndarray) -> float:
    """1/2 int EI w''^2 tan^2 dx of link i: what its curvature w'' / cos has beyond w''."""
    total = 0.0
    for r in range(2 * c.points[i]):
        s, bend = 0.0, 0.0
        for k in range(q.shape[0]):
            s += c.slope_d1[i, r, k] * q[k]
            bend += c.slope_d2[i, r, k] * q[k]
        total += 0.5 * c.slope_EI[i, r] * bend * bend * s * s / (1.0 - s * s)
    return total


@compiled
def observe(
    c: Chain, w: Work, states: np.ndarray, poses: np.ndarray, tips: np.ndarray, ends: np.ndarray, energies: np.ndarray
) -> None:
    """Fill, for states (T, 2n): poses (T, N, 3); tip deflection, slope (T, N, 2); robot's tip (T, 2); energies (T, 3) [J].

    Energies: kinetic, strain, gravitational (zero where every mass is at the base's height).
    """
    links = c.kind.shape[0]
    n = c.first[links]
    for s in range(states.shape[0]):
        y, v = states[s, :n], states[s, n:]
        outward(c, w, y, v)
        x0, y0, angle = 0.0, 0.0, 0.0  # the attachment's pose in the base frame
        vx, vy, omega = 0.0, 0.0, 0.0  # its velocity, in the predecessor's axes
        kinetic, strain, potential = 0.0, 0.0, 0.0
        for i in range(links):
            e, end = c.first[i], c.first[i + 1]
            q, qd = y[e + 1 : end], v[e + 1 : end]
            if c.kind[i] == REVOLUTE:
                angle += y[e]
            else:
                angle += c.angle[i]
                if i == 0:
                    x0 += y[e]
                    vx += v[e]
            cs, sn = w.cos[i], w.sin[i]
            vx, vy = cs * vx + sn * vy, cs * vy - sn * vx
            omega = w.omega[i]
            body, place = w.body[i], w.place[i]
            S0v, S1v, vv, gv, wL, wLd, slope, spin, hv = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for k in range(end - e - 1):
                S0v += c.S0[i, k] * qd[k]
                S1v += w.mt[i, k] * qd[k]
                vv += qd[k] * qd[k]
                gv += w.g1q[i, k] * qd[k]
                hv += w.hq[i, k] * qd[k]
                wL += c.NL[i, k] * q[k]
                wLd += c.NL[i, k] * qd[k]
                slope += c.SL[i, k] * q[k]
                spin += c.SL[i, k] * qd[k]
                strain += 0.5 * c.lam[i, k] * q[k] * q[k]
            if c.stiffening and end > e + 1:
                strain += _strain(c, i, q)
                for p in range(c.points[i]):
                    rate = 0.0
                    for k in range(end - e - 1):
                        rate += w.h[i, p, k] * qd[k]
                    kinetic += 0.5 * c.point_mass[i, p] * rate * rate
                kinetic += 0.5 * c.tip_inertia[i] * (w.tilt[i] * w.tilt[i] - 1.0) * spin * spin
                slope = np.arcsin(slope)
                spin *= w.tilt[i]
            kinetic += 0.5 * (
                c.mass[i] * (vx * vx + vy * vy) + body[2] * omega * omega + vv + c.rotor[i] * v[e] * v[e]
            ) + vy * omega * body[1] - vx * omega * body[0] - vx * gv + vy * S0v + omega * S1v  # fmt: skip
            ca, sa = np.cos(angle), np.sin(angle)
            potential -= c.gravity[0] * (c.mass[i] * x0 + ca * body[1] - sa * body[0])
            potential -= c.gravity[1] * (c.mass[i] * y0 + sa * body[1] + ca * body[0])
            poses[s, i, 0], poses[s, i, 1], poses[s, i, 2] = x0, y0, angle
            tips[s, i, 0], tips[s, i, 1] = wL, slope
            rx, ry = place[0], place[1]
            x0 += ca * rx - sa * ry
            y0 += sa * rx + ca * ry
            angle += slope
            if i + 1 < links and c.kind[i + 1] == PRISMATIC:
                rate, across = v[end], 0.0
            else:
                rate, across = -hv, wLd
            vx, vy = vx - omega * ry + rate, vy + omega * rx + across
            omega += spin
        ends[s, 0], ends[s, 1] = x0, y0
        energies[s, 0], energies[s, 1], energies[s, 2] = kinetic, strain, potential
