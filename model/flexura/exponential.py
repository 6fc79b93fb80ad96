"""Exponential steps: the linear part of a robot's motion solved exactly, what is left of it summed up as in Adams' method.

In the modes of `basis.Basis`, y = y0 + phi eta, the equations of motion are eta'' + d2 eta' + w2 eta = N, where N = rows a +
w2 eta + d2 eta' takes the accelerations a from a pass of `kernel.passes`: exact, whatever the basis. N varies with the motion
and not with the vibration. A polynomial through its last values (at most ORDER of them) is put into the variation-of-constants
formula (`propagator.py`), the equations are looked at once where that leads, and the polynomial through the new value too makes
the step: a variable-step Adams method (predict, evaluate, correct) for an oscillating system, of order ORDER + 1, at one
evaluation a step. Steps need not resolve any frequency of the robot. Hochbruck and Ostermann, Acta Numerica 19 (2010), 2.5
(exponential multistep methods); the error is estimated as Shampine and Gordon do, by leaving out the oldest value.
"""

from __future__ import annotations

import numpy as np

from .basis import Basis, look, moved
from .chain import Chain, Work
from .compiled import compiled, inlined
from .kernel import passes
from .loop import (
    BREAK,
    DONE,
    EVALS,
    FAULT,
    FRESH,
    LIMIT,
    OUT,
    REJECTED,
    STATUS,
    STEPS,
    STUCK,
    H,
    Inputs,
    Memory,
    T,
    _copy,
    _find,
    _outside,
    _powers,
    _prescribe,
    _weights,
    drive,
)  # fmt: skip
from .past import COUNT, HEAD, ORDER, ROWS, SPAN, STEADY, Past, tables
from .propagator import free, moments

EXPONENTIAL = 4  # beside the methods of `loop`
TIGHT = 20.0  # what the local error is kept below rtol by: few long steps add up what many short ones average out


@inlined
def _multiply(A: np.ndarray, x: np.ndarray, out: np.ndarray) -> None:
    for i in range(out.shape[0]):
        total = 0.0
        for k in range(x.shape[0]):
            total += A[i, k] * x[k]
        out[i] = total


@inlined
def _place(b: Basis, p: Past, eta: np.ndarray, y: np.ndarray) -> None:
    """y = y0 + phi eta."""
    _multiply(b.phi, eta, y)
    for k in range(y.shape[0]):
        y[k] += p.origin[k]


@inlined
def _force(b: Basis, p: Past, row: int) -> None:
    """N of a row of the rings from its accelerations and state."""
    n = b.w2.shape[0]
    for i in range(n):
        total, eta, etad = 0.0, 0.0, 0.0
        for k in range(n):
            total += b.rows[i, k] * p.a[row, k]
            eta += b.rows[i, k] * (p.y[row, k] - p.origin[k])
            etad += b.rows[i, k] * p.v[row, k]
        p.N[row, i] = total + b.w2[i] * eta + b.d2[i] * etad


@compiled
def _sizes(phi: np.ndarray, scale: np.ndarray, size: np.ndarray) -> None:
    """Error weights of the modes from those of the unknowns."""
    n = phi.shape[0]
    for i in range(n):
        y, v = 0.0, 0.0
        for k in range(n):
            own = phi[k, i] * scale[k]
            rate = phi[k, i] * scale[n + k]
            y += own * own
            v += rate * rate
        size[0, i], size[1, i] = TIGHT * np.sqrt(y), TIGHT * np.sqrt(v)


@inlined
def _look(c: Chain, w: Work, d: Inputs, m: Memory, p: Past, t: float, y: np.ndarray, v: np.ndarray, row: int) -> None:
    """Accelerations and powers at (t, y, v) into a row of the rings."""
    _prescribe(c, w, d, t, y, v)
    drive(c, d, t, y, v, m.force)
    passes(c, w, y, v, y, v, 0.0, m.force, m.zero, m.zero, p.a[row])
    _find(c, w, d, v, m.force)
    _powers(c, w, v, m.force, m.K[0])
    n = y.shape[0]
    p.power[row, 0], p.power[row, 1] = m.K[0, 2 * n], m.K[0, 2 * n + 1]
    for k in range(n):
        p.y[row, k], p.v[row, k] = y[k], v[k]
    m.s[EVALS] += 1


@inlined
def _predict(b: Basis, m: Memory, p: Past, h: float) -> None:
    """The state a step of h leads to without a look at the equations there: p.new[:2], and y, v, work and loss in m.znew; minus
    the extrapolated N in p.gap, and minus the powers in m.K[1]."""
    n, k, head = b.w2.shape[0], int(p.s[COUNT]), int(p.s[HEAD])
    if h != p.s[SPAN] or p.s[STEADY] <= ORDER:
        tables(b, p, h, k)
    eta, etad, gap = p.new[0], p.new[1], p.gap
    for i in range(n):
        eta[i] = p.step[0, i] * p.eta[i] + p.step[1, i] * p.etad[i]
        etad[i] = p.step[2, i] * p.eta[i] + p.step[3, i] * p.etad[i]
        gap[i] = 0.0
    work, loss, work_gap, loss_gap = 0.0, 0.0, 0.0, 0.0
    for j in range(k):
        row, end = (head + j) % ROWS, p.end[0, j]
        for i in range(n):
            eta[i] += p.ahead[0, j, i] * p.N[row, i]
            etad[i] += p.ahead[1, j, i] * p.N[row, i]
            gap[i] -= p.end[p.low[i], j] * p.N[row, i]
        work += p.area[j] * p.power[row, 0]
        loss += p.area[j] * p.power[row, 1]
        work_gap -= end * p.power[row, 0]
        loss_gap -= end * p.power[row, 1]
    _place(b, p, eta, m.znew[:n])
    _multiply(b.phi, etad, m.znew[n : 2 * n])
    m.znew[2 * n], m.znew[2 * n + 1] = m.z[2 * n] + h * work, m.z[2 * n + 1] + h * loss
    m.K[1, 0], m.K[1, 1] = work_gap, loss_gap


@inlined
def _correct(b: Basis, m: Memory, p: Past, h: float, new: int) -> float:
    """The step with what was found where `_predict` led, in a row of the rings: to p.new[2:] and m.znew. Returns the error norm
    (accept below 1)."""
    n, k = b.w2.shape[0], int(p.s[COUNT])
    gap = p.gap
    _multiply(b.rows, p.a[new], p.N[new])
    error = 0.0
    for i in range(n):
        eta, etad = p.new[0, i], p.new[1, i]
        p.N[new, i] += b.w2[i] * eta + b.d2[i] * etad
        gap[i] += p.N[new, i]
        p.new[2, i] = eta + p.late[0, i] * gap[i]
        p.new[3, i] = etad + p.late[1, i] * gap[i]
        e0, e1 = p.late[2, i] * gap[i] * p.size[0, i], p.late[3, i] * gap[i] * p.size[1, i]
        error += e0 * e0 + e1 * e1
    _place(b, p, p.new[2], m.znew[:n])
    _multiply(b.phi, p.new[3], m.znew[n : 2 * n])
    m.znew[2 * n] += h * p.area[k] * (p.power[new, 0] + m.K[1, 0])
    m.znew[2 * n + 1] += h * p.area[k] * (p.power[new, 1] + m.K[1, 1])
    return np.sqrt(error / (2 * n))


@inlined
def _force_inside(p: Past) -> None:
    """N over the step just made as a polynomial, f."""
    k, head = int(p.s[COUNT]), int(p.s[HEAD])
    for q in range(k + 1):
        for i in range(p.gap.shape[0]):
            p.f[q, i] = p.gap[i] * p.poly[p.low[i], k, q]
    for j in range(k):
        row = (head + j) % ROWS
        for q in range(k):
            for i in range(p.gap.shape[0]):
                p.f[q, i] += p.poly[p.low[i], j, q] * p.N[row, i]


@inlined
def _inside(m: Memory, b: Basis, p: Past, h: float, x: float, out: np.ndarray) -> None:
    """The state at the fraction x of the step just made, after `_force_inside`: modes that turn by less than 1 rad a step by
    Hermite's quintic, the others exactly."""
    n, k = b.w2.shape[0], int(p.s[COUNT])
    eta, etad = p.work[0], p.work[1]
    for i in range(n):
        y0, v0, w2, d2 = p.eta[i], p.etad[i], b.w2[i], b.d2[i]
        if w2 * h * h < 1.0 and d2 * h < 1.0:
            end = 0.0
            for q in range(k + 1):
                end += p.f[q, i]
            y1, v1 = p.new[2, i], p.new[3, i]
            a0, a1 = h * h * (p.f[0, i] - w2 * y0 - d2 * v0), h * h * (end - w2 * y1 - d2 * v1)
            dy, v0, v1 = y1 - y0, h * v0, h * v1
            c3 = 10 * dy - 6 * v0 - 4 * v1 - 1.5 * a0 + 0.5 * a1
            c4 = -15 * dy + 8 * v0 + 7 * v1 + 1.5 * a0 - a1
            c5 = 6 * dy - 3 * v0 - 3 * v1 - 0.5 * a0 + 0.5 * a1
            eta[i] = y0 + x * (v0 + x * (0.5 * a0 + x * (c3 + x * (c4 + x * c5))))
            etad[i] = (v0 + x * (a0 + x * (3 * c3 + x * (4 * c4 + x * 5 * c5)))) / h
        else:
            g, dg = free(w2, d2, x * h)
            moments(w2, d2, x * h, g, dg, p.column[0], p.column[1], p.tables)
            y, v, power = (dg + d2 * g) * y0 + g * v0, dg * v0 - w2 * g * y0, 1.0
            for q in range(k + 1):
                y += p.column[0, q] * power * p.f[q, i]
                v += p.column[1, q] * power * p.f[q, i]
                power *= x
            eta[i], etad[i] = y, v
    _place(b, p, eta[:n], out[:n])
    _multiply(b.phi, etad[:n], out[n : 2 * n])
    head, new = int(p.s[HEAD]), (int(p.s[HEAD]) + ROWS - 1) % ROWS
    for r in range(2):
        dz, f0, f1 = m.znew[2 * n + r] - m.z[2 * n + r], h * p.power[head, r], h * p.power[new, r]
        out[2 * n + r] = m.z[2 * n + r] + x * (f0 + x * (3 * dz - 2 * f0 - f1 + x * (f0 + f1 - 2 * dz)))


@compiled
def _stop_at_limit(
    c: Chain, w: Work, d: Inputs, m: Memory, b: Basis, p: Past, t: float, h: float, beyond: float, joint: int
) -> None:
    """As `loop._stop_at_limit`."""
    low, high, out, n = 0.0, beyond, m.K[15], m.a.shape[0]
    m.s[FAULT] = joint
    for turn in range(61):
        middle = 0.5 * (low + high) if turn < 60 else low
        _inside(m, b, p, h, middle, out)
        _prescribe(c, w, d, t + middle * h, out[:n], out[n : 2 * n])
        joint = _outside(c, d, out)
        if joint >= 0:
            high, m.s[FAULT] = middle, joint
        else:
            low = middle
    _copy(out, m.z)
    m.s[STATUS], m.s[T] = LIMIT, t + low * h


@compiled
def _settle(b: Basis, m: Memory, p: Past) -> None:
    """Put the state and the past into the basis as it is now."""
    n = m.a.shape[0]
    for k in range(n):
        p.origin[k], p.eta[k] = m.z[k], 0.0
    for j in range(int(p.s[COUNT])):
        _force(b, p, (int(p.s[HEAD]) + j) % ROWS)
    _multiply(b.rows, m.z[n : 2 * n], p.etad)
    p.s[SPAN] = 0.0
    _sizes(b.phi, m.scale, p.size)


@compiled
def advance(
    c: Chain, w: Work, d: Inputs, m: Memory, b: Basis, p: Past, rtol: float, t_eval: np.ndarray, out: np.ndarray, max_steps: int
) -> None:  # fmt: skip
    """As `loop.advance`: at most `max_steps` steps of the run held in `m` and `p`, filling rows of `out` (T, 2n + 2)."""
    s, n, end = m.s, m.a.shape[0], t_eval[-1]
    for _ in range(max_steps):
        t = s[T]
        while int(s[BREAK]) < d.breaks.shape[0] and d.breaks[int(s[BREAK])] <= t:
            s[BREAK] += 1
        stop = end
        if int(s[BREAK]) < d.breaks.shape[0] and d.breaks[int(s[BREAK])] < end:
            stop = d.breaks[int(s[BREAK])]
        fresh = s[FRESH] == 0.0  # begin anew: the drives may jump here
        left, h, tn = 1.0, 0.0, t
        if fresh:
            _weights(c, m, rtol, m.z)
            p.s[HEAD], p.s[COUNT] = 0.0, 1.0
            _copy(m.z, m.znew)
        else:
            if moved(c, b, m.z) and look(c, w, b, d.kp, d.kd, m.z[:n], 1.0 / s[H]):
                _settle(b, m, p)
            left = np.ceil((stop - t) / s[H] - 1e-6)
            h = s[H] if left > 5.0 else (stop - t) / left
            if abs(h - p.s[SPAN]) < 1e-9 * h:
                h = p.s[SPAN]
            tn = stop if left == 1.0 else t + h
            _predict(b, m, p, h)
        new = 0 if fresh else (int(p.s[HEAD]) + ROWS - 1) % ROWS
        y, v = m.znew[:n], m.znew[n : 2 * n]
        _look(c, w, d, m, p, t if fresh else min(tn, np.nextafter(stop, -1e300)), y, v, new)
        p.t[new] = tn
        if fresh:
            if moved(c, b, m.z):
                look(c, w, b, d.kp, d.kd, m.z[:n], 1.0 / s[H])
            _settle(b, m, p)
            s[FRESH] = 1.0
            continue
        error = _correct(b, m, p, h, new)
        _prescribe(c, w, d, tn, y, v)
        k = p.s[COUNT]
        factor = 2.0 if error == 0.0 else 0.85 * error ** (-1.0 / (k + 1.0))
        if not error < 1.0:
            s[REJECTED] += 1
            s[H] = h * max(0.25, factor) if error < 1e300 else 0.1 * h
            if s[H] < 1e-14 * max(1.0, abs(t)) or not np.isfinite(s[H]):
                s[STATUS] = STUCK
                return
            continue
        s[STEPS] += 1
        prepared = False
        while int(s[OUT]) < t_eval.shape[0] and t_eval[int(s[OUT])] <= tn:
            row = int(s[OUT])
            if t_eval[row] == tn:
                _copy(m.znew, out[row])
            else:
                if not prepared:
                    _force_inside(p)
                    prepared = True
                _inside(m, b, p, h, (t_eval[row] - t) / h, out[row])
                _prescribe(c, w, d, t_eval[row], out[row, :n], out[row, n : 2 * n])
            joint = _outside(c, d, out[row])
            if joint >= 0:
                _stop_at_limit(c, w, d, m, b, p, t, h, (t_eval[row] - t) / h, joint)
                return
            s[OUT] += 1
        joint = _outside(c, d, m.znew)
        if joint >= 0:
            _force_inside(p)
            _stop_at_limit(c, w, d, m, b, p, t, h, 1.0, joint)
            return
        s[T] = tn
        _copy(m.znew, m.z)
        _copy(p.new[2], p.eta)
        _copy(p.new[3], p.etad)
        p.s[HEAD] = (int(p.s[HEAD]) + ROWS - 1) % ROWS
        p.s[COUNT] = min(k + 1.0, 1.0 * ORDER)
        p.s[STEADY] += 1.0
        if factor * h > 1.4 * s[H] and (k < ORDER or p.s[STEADY] > 2.0):
            s[H] = min(factor * h, 2.0 * s[H])
        _weights(c, m, rtol, m.z)
        if tn >= end:
            s[STATUS] = DONE
            return
        if left == 1.0:
            s[FRESH], s[H] = 0.0, max(0.1 * s[H], 1e-3 * h)
        elif int(s[STEPS]) % 8 == 0 or k < ORDER:
            _sizes(b.phi, m.scale, p.size)
