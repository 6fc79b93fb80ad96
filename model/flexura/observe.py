"""What a state looks like from outside: poses, tips and energies, compiled over whole histories."""

from __future__ import annotations

import numpy as np

from .chain import REVOLUTE, SLEEVE, Chain, Work
from .compiled import compiled, inlined, internal
from .hubs import formed_block
from .outward import passed_outward
from .pinned import pinned


@internal
def _strain(c: Chain, i: int, q: np.ndarray) -> float:
    """1/2 int EI w''^2 tan^2 dx of link i: what its curvature w'' / cos has beyond w''."""
    total = 0.0
    for half in range(2):
        for p in range(c.points[i]):
            s, bend = 0.0, 0.0
            for k in range(q.shape[0]):
                s += c.slope_d1[i, half, p, k] * q[k]
                bend += c.slope_d2[i, half, p, k] * q[k]
            total += 0.5 * c.slope_EI[i, half, p] * bend * bend * s * s / (1.0 - s * s)
    return total


@inlined
def tip(c: Chain, i: int, q: np.ndarray) -> tuple[float, float]:
    """The deflection of link i's tip [m] and sin of its slope (behind a sleeve: times the free length)."""
    deflection, sin = 0.0, 0.0
    for k in range(q.shape[0]):
        deflection += c.NL[i, k] * q[k]
        sin += c.SL[i, k] * q[k]
    return deflection, sin


@compiled
def observe(
    c: Chain, w: Work, states: np.ndarray, poses: np.ndarray, tips: np.ndarray, ends: np.ndarray, energies: np.ndarray
) -> None:
    """Fill, for states (T, 2n): poses (T, N, 3); tip deflection, slope (T, N, 2); robot's tip (T, 2); energies (T, 3) [J].

    The pose of a link behind a sleeve is that of its proximal end. Energies: kinetic, strain, gravitational (zero where every
    mass is at the base's height).
    """
    c, w = pinned(c), pinned(w)
    links = c.kind.shape[0]
    n = c.first[links]
    for s in range(states.shape[0]):
        y, v = states[s, :n], states[s, n:]
        passed_outward(c, w, y, v)
        x0, y0, angle = 0.0, 0.0, 0.0  # the attachment's pose in the base frame
        vx, vy = 0.0, 0.0  # its velocity, in the predecessor's axes
        kinetic, strain, potential = 0.0, 0.0, 0.0
        for i in range(links):
            e, end = c.first[i], c.first[i + 1]
            m = end - e - 1
            q, qd = y[e + 1 : end], v[e + 1 : end]
            body, flow = w.body[i], 0.0
            if c.kind[i] == SLEEVE:
                flow = v[e]
            elif i == 0:
                vx, vy = w.slide[0, 0] * v[e], 0.0
                x0 = w.slide[0, 0] * y[e]
            angle += y[e] if c.kind[i] == REVOLUTE else c.angle[i]
            cs, sn, omega = w.cos[i], w.sin[i], w.omega[i]
            vx, vy = cs * vx + sn * vy, cs * vy - sn * vx
            # T = 1/2 U^T [[Mrr, Mrq], [Mqr, Mqq]] U, U = (vx, vy, omega, d', qd)
            formed_block(c, w, i, 0.0)
            for k in range(m):
                shared = w.terms[i, k, 0] * vx + w.terms[i, k, 1] * vy + w.terms[i, k, 2] * omega
                if c.kind[i] == SLEEVE:
                    shared += w.terms[i, k, 7] * flow
                for j in range(k + 1, m):
                    shared += w.S[i, k, j] * qd[j]
                kinetic += qd[k] * (shared + 0.5 * w.S[i, k, k] * qd[k])
            kinetic += 0.5 * (c.mass[i] * (vx * vx + vy * vy) + body[2] * omega * omega + c.rotor[i] * v[e] * v[e])
            kinetic += omega * (vy * body[1] - vx * body[0])
            if c.kind[i] == SLEEVE:
                kinetic += flow * (body[6] * vx + body[7] * vy + body[8] * omega + 0.5 * body[9] * flow)
                strain += w.strain[i]
            else:
                for k in range(m):
                    strain += 0.5 * c.lam[i, k] * q[k] * q[k]
                if c.stiffening and m > 0:
                    strain += _strain(c, i, q)
            ca, sa = np.cos(angle), np.sin(angle)
            potential -= c.gravity[0] * (c.mass[i] * x0 + ca * body[1] - sa * body[0])
            potential -= c.gravity[1] * (c.mass[i] * y0 + sa * body[1] + ca * body[0])
            behind = y[e] - c.length[i] if c.kind[i] == SLEEVE else 0.0
            poses[s, i, 0], poses[s, i, 1], poses[s, i, 2] = x0 + ca * behind, y0 + sa * behind, angle
            deflection, sin = tip(c, i, q)
            if c.kind[i] == SLEEVE and m > 0:
                sin /= y[e]
            tips[s, i, 0], tips[s, i, 1] = deflection, np.arcsin(sin) if c.stiffening else sin
            rx, ry = w.place[i, 0], w.place[i, 1]
            x0 += ca * rx - sa * ry
            y0 += sa * rx + ca * ry
            angle += w.angle[i]
            vx, vy = vx - omega * ry + w.rate[i, 0], vy + omega * rx + w.rate[i, 1]
        ends[s, 0], ends[s, 1] = x0, y0
        energies[s, 0], energies[s, 1], energies[s, 2] = kinetic, strain, potential
