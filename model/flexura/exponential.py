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

from typing import Any

import numpy as np

from .acting import Inputs, beyond, drive, found, powers, prescribe
from .basis import Basis, look, moved
from .chain import Chain, Work
from .compiled import compiled, inlined, internal
from .kernel import passes
from .lanes import WIDTH, lanes, load, load_some, store, total
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
    Memory,
    T,
    _copy,
    _grown,
    _weights,
    quintic,
)  # fmt: skip
from .past import COUNT, GAP, HEAD, ORDER, ROWS, SPAN, STEADY, Past, coefficient, order_of, ring, tables
from .pinned import pinned
from .propagator import free, free_waves, moments

EXPONENTIAL = 4  # beside the methods of `loop`
GROWTH = 1.4  # the least that a step may grow by
_SAFE = (0.85 / GROWTH) ** np.arange(1.0, ORDER + 2.0)  # errors above are too large for that
SLOW, WAVE, DAMPED = 0.0, 1.0, 2.0  # modes inside a step: turning by less than 1 rad; by more, underdamped; the others
TIGHT = 20.0  # what the local error is kept below rtol by: few long steps add up what many short ones average out


@internal
def _place(b: Basis, p: Past, eta: np.ndarray, etad: np.ndarray, z: np.ndarray) -> None:
    """y = y0 + sum eta_k phi_k and v = sum eta'_k phi_k, into z, which has room for three numbers more."""
    n = b.seen.shape[0]
    for i in range(0, n, WIDTH):
        y = load(p.origin, i)
        for k in range(n):
            y += eta[k] * load(b.phi[k], i)
        store(z, i, y)
    for i in range(0, n, WIDTH):
        v = lanes(0.0)
        for k in range(n):
            v += etad[k] * load(b.phi[k], i)
        store(z, n + i, v)


@internal
def _force(b: Basis, p: Past, row: int) -> None:
    """N of a row of the rings from its accelerations and state."""
    for i in range(0, b.w2.shape[0], WIDTH):
        sums, eta, etad = lanes(0.0), lanes(0.0), lanes(0.0)
        for k in range(b.seen.shape[0]):
            rows = load(b.rows[k], i)
            sums += p.a[row, k] * rows
            eta += (p.y[row, k] - p.origin[k]) * rows
            etad += p.v[row, k] * rows
        store(p.N[row], i, sums + load(b.w2, i) * eta + load(b.d2, i) * etad)


@internal
def _sizes(b: Basis, scale: np.ndarray, size: np.ndarray) -> None:
    """Error weights of the modes from those of the unknowns."""
    n = b.seen.shape[0]
    for k in range(n):
        y, v = lanes(0.0), lanes(0.0)
        for i in range(0, n, WIDTH):
            phi = load(b.phi[k], i)
            own, rate = phi * load_some(scale, i, n - i), phi * load_some(scale, n + i, n - i)
            y += own * own
            v += rate * rate
        size[0, k], size[1, k] = TIGHT * np.sqrt(total(y)), TIGHT * np.sqrt(total(v))


@internal
def _look(c: Chain, w: Work, d: Inputs, m: Memory, p: Past, t: float, y: np.ndarray, v: np.ndarray, row: int) -> None:
    """Accelerations and powers at (t, y, v) into a row of the rings."""
    prescribe(c, w, d, t, y, v)
    drive(c, d, t, y, v, m.force)
    passes(c, w, y, v, y, v, 0.0, m.force, m.zero, m.zero, p.a[row])
    found(c, w, d, v, m.force)
    powers(c, w, v, m.force, m.K[0])
    n = y.shape[0]
    p.power[row, 0], p.power[row, 1] = m.K[0, 2 * n], m.K[0, 2 * n + 1]
    for k in range(n):
        p.y[row, k], p.v[row, k] = y[k], v[k]
    m.s[EVALS] += 1


@internal
def _predict(b: Basis, m: Memory, p: Past, h: float) -> None:
    """The state a step of h leads to without a look at the equations there: p.new[:2], and y, v, work and loss in m.znew; minus
    the extrapolated N in p.gap, and minus the powers in m.K[1]."""
    n, k, head = b.seen.shape[0], int(p.s[COUNT]), int(p.s[HEAD])
    if h != p.s[SPAN] or p.s[STEADY] <= ORDER:
        tables(b, p, h, k)
    for i in range(0, n, WIDTH):
        y, v, gap = load(p.eta, i), load(p.etad, i), lanes(0.0)
        eta, etad = load(p.step[0], i) * y + load(p.step[1], i) * v, load(p.step[2], i) * y + load(p.step[3], i) * v
        for j in range(order_of(p, k, i)):
            force = load(p.N[ring(head, j)], i)
            eta += load(p.ahead[0, j], i) * force
            etad += load(p.ahead[1, j], i) * force
            gap -= load(p.ahead[2, j], i) * force
        store(p.new[0], i, eta)
        store(p.new[1], i, etad)
        store(p.gap, i, gap)
    _place(b, p, p.new[0], p.new[1], m.znew)
    work, loss, work_gap, loss_gap = 0.0, 0.0, 0.0, 0.0
    for j in range(k):
        row, end = ring(head, j), p.end[j]
        work += p.area[j] * p.power[row, 0]
        loss += p.area[j] * p.power[row, 1]
        work_gap -= end * p.power[row, 0]
        loss_gap -= end * p.power[row, 1]
    m.znew[2 * n], m.znew[2 * n + 1] = m.z[2 * n] + h * work, m.z[2 * n + 1] + h * loss
    m.K[1, 0], m.K[1, 1] = work_gap, loss_gap


@internal
def _correct(b: Basis, m: Memory, p: Past, h: float, new: int) -> float:
    """The step with what was found where `_predict` led, in a row of the rings: to p.new[2:] and m.znew. Returns the error norm
    (accept below 1)."""
    n = b.seen.shape[0]
    work, loss = m.znew[2 * n], m.znew[2 * n + 1]
    squares = lanes(0.0)
    for i in range(0, n, WIDTH):
        eta, etad = load(p.new[0], i), load(p.new[1], i)
        force = load(b.w2, i) * eta + load(b.d2, i) * etad
        for j in range(n):
            force += p.a[new, j] * load(b.rows[j], i)
        gap = load(p.gap, i) + force
        store(p.N[new], i, force)
        store(p.gap, i, gap)
        store(p.new[2], i, eta + load(p.late[0], i) * gap)
        store(p.new[3], i, etad + load(p.late[1], i) * gap)
        e0, e1 = load(p.late[2], i) * gap * load(p.size[0], i), load(p.late[3], i) * gap * load(p.size[1], i)
        squares += e0 * e0 + e1 * e1
    _place(b, p, p.new[2], p.new[3], m.znew)
    m.znew[2 * n] = work + h * p.area[GAP] * (p.power[new, 0] + m.K[1, 0])
    m.znew[2 * n + 1] = loss + h * p.area[GAP] * (p.power[new, 1] + m.K[1, 1])
    return np.sqrt(total(squares) / (2 * n))


@internal
def _force_inside(b: Basis, p: Past, h: float) -> None:
    """What `_inside` needs of the step just made: eta'' at its ends, which modes turn how fast, and where some turn by 1 rad or
    more, N as a polynomial, f, and the motion that N alone makes, slow."""
    n, k, head = b.seen.shape[0], int(p.s[COUNT]), int(p.s[HEAD])
    first, last = p.N[head], p.N[ring(head, ROWS - 1)]
    for i in range(0, n, WIDTH):
        gap, order, w2, d2 = load(p.gap, i), order_of(p, k, i), load(b.w2, i), load(b.d2, i)
        store(p.bent[0], i, h * h * (load(first, i) - w2 * load(p.eta, i) - d2 * load(p.etad, i)))
        store(p.bent[1], i, h * h * (load(last, i) - w2 * load(p.new[2], i) - d2 * load(p.new[3], i)))
        fast = 0.0
        for j in range(i, i + WIDTH):
            turn, drag = b.w2[j] * h * h, b.d2[j] * h
            p.kind[j] = SLOW
            if turn >= 1.0 and drag < 0.6 * turn and drag * drag < 3.9 * turn:
                p.kind[j] = WAVE
            elif turn >= 1.0 or drag >= 1.0:
                p.kind[j] = DAMPED
            fast += p.kind[j]
        if fast == 0.0:
            continue
        for q in range(k + 1):
            f = lanes(0.0)
            if q <= order:
                f = gap * coefficient(p, GAP, q, i)
                for j in range(order):
                    f += coefficient(p, j, q, i) * load(p.N[ring(head, j)], i)
            store(p.f[q], i, f)
        w2, _ = _waving(b, p, i)
        above, here, inverse, drag = lanes(0.0), lanes(0.0), 1.0 / w2, d2 * (1.0 / h)
        bend = inverse * (1.0 / (h * h))
        for q in range(order, -1, -1):
            below = inverse * (load(p.f[q], i) - (q + 1.0) * drag * here) - (q + 1.0) * (q + 2.0) * bend * above
            above, here = here, below
            store(p.slow[q], i, below)


@inlined
def _waving(b: Basis, p: Past, i: int) -> tuple[Any, Any]:
    """w2 and d2 of the modes i to i + 3 that are waves, 1 and 0 of the others."""
    kind = load(p.kind, i)
    wave = kind * (2.0 - kind)
    return wave * load(b.w2, i) + (1.0 - wave), wave * load(b.d2, i)


@inlined
def _exactly(b: Basis, p: Past, i: int, h: float, x: float, k: int) -> tuple[float, float]:
    """eta, eta' of mode i at the fraction x of the step, by its moments."""
    w2, d2, y0, v0 = b.w2[i], b.d2[i], p.eta[i], p.etad[i]
    g, dg = free(w2, d2, x * h)
    moments(w2, d2, x * h, g, dg, p.column[0], p.column[1], p.tables)
    y, v, power = (dg + d2 * g) * y0 + g * v0, dg * v0 - w2 * g * y0, 1.0
    for q in range(k + 1):
        y += p.column[0, q] * power * p.f[q, i]
        v += p.column[1, q] * power * p.f[q, i]
        power *= x
    return y, v


@internal
def _inside(m: Memory, b: Basis, p: Past, h: float, x: float, out: np.ndarray) -> None:
    """The state at the fraction x of the step just made, after `_force_inside`: modes that turn by less than 1 rad a step by
    Hermite's quintic, the others exactly, stiff ones as free motion about the one that N alone makes of them."""
    n, k = b.seen.shape[0], int(p.s[COUNT])
    eta, etad, place = p.work[0], p.work[1], m.K[14]
    for i in range(0, n, WIDTH):
        y0, y1, kind = load(p.eta, i), load(p.new[2], i), load(p.kind, i)
        if total((kind - WAVE) * (kind - WAVE)) > 0.0:
            y, v = quintic(x, y1 - y0, h * load(p.etad, i), h * load(p.new[3], i), load(p.bent[0], i), load(p.bent[1], i))
            store(eta, i, y0 + y)
            store(etad, i, v * (1.0 / h))
        if total(kind) > 0.0:
            (w2, d2), y, v = _waving(b, p, i), lanes(0.0), lanes(0.0)
            for q in range(order_of(p, k, i), -1, -1):
                v = v * x + y
                y = y * x + load(p.slow[q], i)
            g, dg = free_waves(w2, d2, x * h)
            y0, v0 = y0 - load(p.slow[0], i), load(p.etad, i) - load(p.slow[1], i) * (1.0 / h)
            wave = kind * (2.0 - kind)
            store(eta, i, wave * (y + (dg + d2 * g) * y0 + g * v0) + (1.0 - wave) * load(eta, i))
            store(etad, i, wave * (v * (1.0 / h) + dg * v0 - w2 * g * y0) + (1.0 - wave) * load(etad, i))
            for j in range(i, min(i + WIDTH, n)):
                if p.kind[j] == DAMPED:
                    eta[j], etad[j] = _exactly(b, p, j, h, x, k)
    _place(b, p, eta, etad, place)
    for j in range(2 * n):
        out[j] = place[j]
    head = int(p.s[HEAD])
    new = ring(head, ROWS - 1)
    for r in range(2):
        dz, f0, f1 = m.znew[2 * n + r] - m.z[2 * n + r], h * p.power[head, r], h * p.power[new, r]
        out[2 * n + r] = m.z[2 * n + r] + x * (f0 + x * (3 * dz - 2 * f0 - f1 + x * (f0 + f1 - 2 * dz)))


@internal
def _stop_at_limit(
    c: Chain, w: Work, d: Inputs, m: Memory, b: Basis, p: Past, t: float, h: float, past_it: float, joint: int
) -> None:
    """As `loop._stop_at_limit`."""
    low, high, out, n = 0.0, past_it, m.K[15, : m.z.shape[0]], m.a.shape[0]
    m.s[FAULT] = joint
    for turn in range(61):
        middle = 0.5 * (low + high) if turn < 60 else low
        _inside(m, b, p, h, middle, out)
        prescribe(c, w, d, t + middle * h, out[:n], out[n : 2 * n])
        joint = beyond(c, d, out)
        if joint >= 0:
            high, m.s[FAULT] = middle, joint
        else:
            low = middle
    _copy(out, m.z)
    m.s[STATUS], m.s[T] = LIMIT, t + low * h


@internal
def _settle(b: Basis, m: Memory, p: Past) -> None:
    """Put the state and the past into the basis as it is now."""
    n = m.a.shape[0]
    for k in range(n):
        p.origin[k], p.eta[k] = m.z[k], 0.0
    for j in range(int(p.s[COUNT])):
        _force(b, p, ring(int(p.s[HEAD]), j))
    for i in range(0, n, WIDTH):
        etad = lanes(0.0)
        for k in range(n):
            etad += m.z[n + k] * load(b.rows[k], i)
        store(p.etad, i, etad)
    p.s[SPAN] = 0.0
    _sizes(b, m.scale, p.size)


@compiled
def advance(
    c: Chain, w: Work, d: Inputs, m: Memory, b: Basis, p: Past, rtol: float, t_eval: np.ndarray, out: np.ndarray, max_steps: int
) -> None:  # fmt: skip
    """As `loop.advance`: at most `max_steps` steps of the run held in `m` and `p`, filling rows of `out` (T, 2n + 2)."""
    c, w, d, m, b, p = pinned(c), pinned(w), pinned(d), pinned(m), pinned(b), pinned(p)
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
        new = 0 if fresh else ring(int(p.s[HEAD]), ROWS - 1)
        y, v = m.znew[:n], m.znew[n : 2 * n]
        at = np.nextafter(stop, -1e300) if left == 1.0 and not fresh else tn  # drives are read just before a break
        _look(c, w, d, m, p, at, y, v, new)
        p.t[new] = tn
        if fresh:
            if moved(c, b, m.z):
                look(c, w, b, d.kp, d.kd, m.z[:n], 1.0 / s[H])
            _settle(b, m, p)
            s[FRESH] = 1.0
            continue
        error = _correct(b, m, p, h, new)
        prescribe(c, w, d, tn, y, v)
        k = p.s[COUNT]
        factor = 1.0  # not enough to change the step
        if not _SAFE[int(k)] <= error < 1.0:
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
                    _force_inside(b, p, h)
                    prepared = True
                _inside(m, b, p, h, (t_eval[row] - t) / h, out[row])
                prescribe(c, w, d, t_eval[row], out[row, :n], out[row, n : 2 * n])
            joint = beyond(c, d, out[row])
            if joint >= 0:
                _stop_at_limit(c, w, d, m, b, p, t, h, (t_eval[row] - t) / h, joint)
                return
            s[OUT] += 1
        joint = beyond(c, d, m.znew)
        if joint >= 0:
            _force_inside(b, p, h)
            _stop_at_limit(c, w, d, m, b, p, t, h, 1.0, joint)
            return
        s[T] = tn
        _copy(m.znew, m.z)
        for i in range(0, n, WIDTH):
            store(p.eta, i, load(p.new[2], i))
            store(p.etad, i, load(p.new[3], i))
        p.s[HEAD] = ring(int(p.s[HEAD]), ROWS - 1)
        p.s[COUNT] = min(k + 1.0, 1.0 * ORDER)
        p.s[STEADY] += 1.0
        if factor * h > GROWTH * s[H] and (k < ORDER or p.s[STEADY] > 2.0):
            s[H] = min(factor * h, 2.0 * s[H])
        if tn >= end:
            s[STATUS] = DONE
            return
        if left == 1.0:
            _grown(c, m, m.z)
            s[FRESH], s[H] = 0.0, max(0.1 * s[H], 1e-3 * h)
        elif int(s[STEPS]) % 8 == 0 or k < ORDER:
            _weights(c, m, rtol, m.z)
            _sizes(b, m.scale, p.size)
        else:
            _grown(c, m, m.z)
