"""The time loop, compiled: an explicit and an implicit method with a tolerance, one memory for both, no allocation inside.

Explicit: DOP853 (Dormand and Prince 8(5,3), dense output of order 7; coefficients in `dop853.py`). Implicit: ESDIRK4(3)6L[2]SA of
Kennedy and Carpenter (2003, Appl. Numer. Math. 44), L-stable; each stage is solved by passes of `kernel.accelerate`, which
holds stiffness, damping and gains implicitly, so that a pass costs what an explicit evaluation costs and steps follow the
motion, not the stiffest mode. Under a sampled controller (`law.py`) every tick is an instant to step on, and two pairs without a
stage at the end of the step are cheaper: Ralston 3(2), and 5(4) of Cash and Karp. The local error of joint i is kept below rtol
times the largest |eta_i| so far, that of a link's elastic unknowns below rtol times their largest norm so far, and so for the
velocities; FLOOR replaces these at the start.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .acting import Inputs, beyond, drive, found, powers, prescribe
from .chain import Chain, Work
from .compiled import compiled, inlined, internal
from .kernel import passes
from .lanes import WIDTH, lanes, load, load_some, padded, room, store, store_some, total
from .law import due, tick
from .pinned import pinned
from .tableaus import _A, _AX, _C, _CX, _D, _E3, _E5, _EA, _EC, _EE, _PA, _PC, _PE, GAMMA

EXPLICIT, IMPLICIT, PAIR_3, PAIR_5 = 0, 1, 2, 3
RUNNING, DONE, LIMIT, STUCK = 0, 1, 2, 3
T, H, OUT, BREAK, STEPS, REJECTED, EVALS, ERR, STATUS, FRESH, FAULT, LONGEST = range(12)  # entries of Memory.s
FLOOR = 1e-3  # m, rad (joints); kg^(1/2) m (elastic, mass-normalised); per second for the velocities


class Memory(NamedTuple):
    """All that a run in progress remembers, for n unknowns: state z = (y, v, work, loss) and the stages of one step."""

    s: np.ndarray  # (12,) scalars, see T ... LONGEST
    z: np.ndarray  # (2n + 2,)
    znew: np.ndarray
    K: np.ndarray  # (16, 2n + 2) stage derivatives
    F: np.ndarray  # (7, 2n + 2) dense output
    big: np.ndarray  # (N, 4) largest |eta|, |eta'|, ||q||^2, ||q'||^2 so far
    scale: np.ndarray  # (2n,) error weights
    force: np.ndarray  # (N,)
    ys: np.ndarray  # (n,)
    vs: np.ndarray
    a: np.ndarray
    zero: np.ndarray  # (N,)


def memory(links: int, unknowns: int) -> Memory:
    n, size = unknowns, 2 * unknowns + 2
    wide = padded(size) + WIDTH
    return Memory(**room(
        s=12, z=size, znew=size, K=(16, wide), F=(7, wide), big=(links, 4), scale=2 * n, force=links, ys=n, vs=n, a=n, zero=links,
    ))  # fmt: skip


@inlined
def _copy(source: np.ndarray, target: np.ndarray) -> None:
    for k in range(source.shape[0]):
        target[k] = source[k]


@inlined
def _combine(m: Memory, h: float, weights: np.ndarray, count: int, out: np.ndarray) -> None:
    """out = z + h sum_j weights_j K_j over the first `count` stages."""
    for b in range(0, m.z.shape[0], WIDTH):
        sums = lanes(0.0)
        for j in range(count):
            sums += weights[j] * load(m.K[j], b)
        store(out, b, load(m.z, b) + h * sums)


@inlined
def _error(m: Memory, weights: np.ndarray, count: int) -> float:
    """Sum of the squares of what `weights` make of the first `count` stages, over the error weights."""
    squares = lanes(0.0)
    for b in range(0, m.scale.shape[0], WIDTH):
        sums = lanes(0.0)
        for j in range(count):
            sums += weights[j] * load(m.K[j], b)
        sums *= load_some(m.scale, b, m.scale.shape[0] - b)
        squares += sums * sums
    return total(squares)


@internal
def _slope(c: Chain, w: Work, d: Inputs, m: Memory, t: float, z: np.ndarray, dz: np.ndarray) -> None:
    n = m.a.shape[0]
    y, v = z[:n], z[n : 2 * n]
    prescribe(c, w, d, t, y, v)
    drive(c, d, t, y, v, m.force)
    passes(c, w, y, v, y, v, 0.0, m.force, m.zero, m.zero, dz[n : 2 * n])
    found(c, w, d, v, m.force)
    _copy(v, dz[:n])
    powers(c, w, v, m.force, dz)
    m.s[EVALS] += 1


@inlined
def _grown(c: Chain, m: Memory, z: np.ndarray) -> None:
    """The largest sizes so far, with state z."""
    n = m.a.shape[0]
    for i in range(c.kind.shape[0]):
        e, count, big = c.first[i], c.first[i + 1] - c.first[i] - 1, m.big[i]
        big[0], big[1] = max(big[0], abs(z[e])), max(big[1], abs(z[n + e]))
        q2, v2 = lanes(0.0), lanes(0.0)
        for b in range(0, count, WIDTH):
            q, v = load_some(z, e + 1 + b, count - b), load_some(z, n + e + 1 + b, count - b)
            q2 += q * q
            v2 += v * v
        big[2], big[3] = max(big[2], total(q2)), max(big[3], total(v2))


@internal
def _weights(c: Chain, m: Memory, rtol: float, z: np.ndarray) -> None:
    """Error weights 1/(rtol * size) from the largest sizes so far."""
    _grown(c, m, z)
    n = m.a.shape[0]
    for i in range(c.kind.shape[0]):
        e, end, big = c.first[i], c.first[i + 1], m.big[i]
        m.scale[e], m.scale[n + e] = 1.0 / (rtol * max(big[0], FLOOR)), 1.0 / (rtol * max(big[1], FLOOR))
        place, rate = 1.0 / (rtol * max(np.sqrt(big[2]), FLOOR)), 1.0 / (rtol * max(np.sqrt(big[3]), FLOOR))
        for k in range(e + 1, end):
            m.scale[k], m.scale[n + k] = place, rate


@internal
def _explicit_step(c: Chain, w: Work, d: Inputs, m: Memory, t: float, h: float, last: float) -> float:
    """One DOP853 step from m.z to m.znew; returns the error norm (accept below 1)."""
    K, new = m.K, m.znew
    for s in range(1, 13):
        _combine(m, h, _A[s], s, new)
        _slope(c, w, d, m, min(t + _C[s] * h, last), new, K[s])
    e5, e3 = _error(m, _E5, 13), _error(m, _E3, 13)
    if e5 == 0.0:
        return 0.0
    return abs(h) * e5 / np.sqrt((e5 + 0.01 * e3) * m.scale.shape[0])


@internal
def _pair_step(c: Chain, w: Work, d: Inputs, m: Memory, t: float, h: float, last: float, method: int) -> float:
    """One step of a pair from m.z to m.znew, its first stage included; returns the error norm."""
    K, new, pair = m.K, m.znew, method - PAIR_3
    stages = 3 if method == PAIR_3 else 6
    for s in range(stages):
        _combine(m, h, _PA[pair, s], s, new)
        _slope(c, w, d, m, min(t + _PC[pair, s] * h, last), new, K[s])
    _combine(m, h, _PA[pair, stages], stages, new)
    prescribe(c, w, d, last if t + h > last else t + h, new[: m.a.shape[0]], new[m.a.shape[0] : 2 * m.a.shape[0]])
    return h * np.sqrt(_error(m, _PE[pair], stages) / m.scale.shape[0])


@compiled
def forces(c: Chain, w: Work, d: Inputs, m: Memory, t: np.ndarray, states: np.ndarray, out: np.ndarray) -> None:
    """Drive forces out (T, N) at states (T, 2n); prescribed joints are put on their motion in `states`."""
    c, w, d, m = pinned(c), pinned(w), pinned(d), pinned(m)
    for row in range(t.shape[0]):
        for k in range(states.shape[1]):
            m.znew[k] = states[row, k]
        _slope(c, w, d, m, t[row], m.znew, m.K[1])
        for k in range(states.shape[1]):
            states[row, k] = m.znew[k]
        for i in range(out.shape[1]):
            out[row, i] = m.force[i]


@internal
def _dense(c: Chain, w: Work, d: Inputs, m: Memory, method: int, t: float, h: float, last: float) -> None:
    """What `_interpolate` needs of the step just made beyond its stages."""
    if method == EXPLICIT:
        _explicit_dense(c, w, d, m, t, h, last)
    elif method != IMPLICIT:
        _slope(c, w, d, m, min(t + h, last), m.znew, m.K[5])


@internal
def _explicit_dense(c: Chain, w: Work, d: Inputs, m: Memory, t: float, h: float, last: float) -> None:
    """Coefficients of the order-7 interpolant of the step just made (m.z to m.znew)."""
    K, F, z = m.K, m.F, m.z
    for s in range(3):
        _combine(m, h, _AX[s], 13 + s, F[0])
        _slope(c, w, d, m, min(t + _CX[s] * h, last), F[0], K[13 + s])
    for b in range(0, z.shape[0], WIDTH):
        dz, start, end = load(m.znew, b) - load(z, b), h * load(K[0], b), h * load(K[12], b)
        store(F[0], b, dz)
        store(F[1], b, start - dz)
        store(F[2], b, 2 * dz - (end + start))
        for r in range(4):
            sums = lanes(0.0)
            for j in range(16):
                sums += _D[r, j] * load(K[j], b)
            store(F[3 + r], b, h * sums)


@inlined
def _stage(m: Memory, gh: float) -> None:
    """The state at an implicit stage from its accelerations, into m.znew."""
    n = m.a.shape[0]
    for b in range(0, n, WIDTH):
        store_some(m.znew, b, load(m.ys, b) + gh * gh * load(m.a, b), n - b)
        store_some(m.znew, n + b, load(m.vs, b) + gh * load(m.a, b), n - b)


@internal
def _implicit_step(c: Chain, w: Work, d: Inputs, m: Memory, t: float, h: float, last: float) -> float:
    """One ESDIRK step from m.z to m.znew; returns the error norm, or a large number where a stage does not converge."""
    K, z, new = m.K, m.z, m.znew
    n = m.a.shape[0]
    gh = GAMMA * h
    for k in range(n):
        m.a[k] = K[0, n + k]
    for s in range(1, 6):
        for b in range(0, n, WIDTH):
            ys, vs = load(z, b), load(z, n + b)
            for j in range(s):
                ys += h * _EA[s, j] * load(K[j], b)
                vs += h * _EA[s, j] * load_some(K[j], n + b, n - b)
            store(m.ys, b, ys + gh * vs)
            store(m.vs, b, vs)
        ts = min(t + _EC[s] * h, last)
        drive(c, d, ts, m.ys, m.vs, m.force)
        previous = 1e300
        for iteration in range(10):
            _stage(m, gh)
            _copy(m.a, K[s, :n])
            prescribe(c, w, d, ts, new[:n], new[n : 2 * n])
            passes(c, w, new[:n], new[n : 2 * n], m.ys, m.vs, gh, m.force, d.kp, d.kd, m.a)
            m.s[EVALS] += 1
            change = 0.0
            for k in range(n):
                diff = gh * (m.a[k] - K[s, k])
                change = max(change, abs(diff * m.scale[n + k]), abs(gh * diff * m.scale[k]))
            if change < 0.02:
                break
            if not change < 1e12 or (iteration > 2 and change > 0.9 * previous) or iteration == 9:
                return 1e6
            previous = change
        _stage(m, gh)
        _copy(new[n : 2 * n], K[s, :n])
        _copy(m.a, K[s, n : 2 * n])
        prescribe(c, w, d, ts, new[:n], new[n : 2 * n])
        drive(c, d, ts, new[:n], new[n : 2 * n], m.force)
        found(c, w, d, new[n : 2 * n], m.force)
        powers(c, w, new[n : 2 * n], m.force, K[s])
    for k in range(2 * n, 2 * n + 2):
        sums = 0.0
        for j in range(6):
            sums += _EA[5, j] * K[j, k]
        new[k] = z[k] + h * sums
    return h * np.sqrt(_error(m, _EE, 6) / (2 * n))


@internal
def _interpolate(m: Memory, method: int, h: float, x: float, out: np.ndarray) -> None:
    """The state at t + x h inside the step just made: order 7 (explicit), or quintic Hermite from positions to accelerations
    (all others)."""
    z, new, n, size = m.z, m.znew, m.a.shape[0], m.z.shape[0]
    if method == EXPLICIT:
        for b in range(0, size, WIDTH):
            sums = lanes(0.0)
            for r in range(6, -1, -1):
                sums = (sums + load(m.F[r], b)) * (x if r % 2 == 0 else 1.0 - x)
            store_some(out, b, load(z, b) + sums, size - b)
        return
    for b in range(0, n, WIDTH):
        y0, v0, v1 = load(z, b), h * load(z, n + b), h * load(new, n + b)
        dy, a0, a1 = load(new, b) - y0, h * h * load_some(m.K[0], n + b, n - b), h * h * load_some(m.K[5], n + b, n - b)
        y, v = quintic(x, dy, v0, v1, a0, a1)
        store_some(out, b, y0 + y, n - b)
        store_some(out, n + b, v * (1.0 / h), n - b)
    for k in range(2 * n, size):
        dy, f0, f1 = new[k] - z[k], h * m.K[0, k], h * m.K[5, k]
        out[k] = z[k] + x * (f0 + x * (3 * dy - 2 * f0 - f1 + x * (f0 + f1 - 2 * dy)))


@inlined
def quintic(x: float, dy: Any, v0: Any, v1: Any, a0: Any, a1: Any) -> tuple:
    """What a quintic rises by up to the fraction x, and its slope there, from its whole rise dy and its slopes and curvatures by
    x at both ends."""
    c3 = 10.0 * dy - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1
    c4 = -15.0 * dy + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1
    c5 = 6.0 * dy - 3.0 * v0 - 3.0 * v1 - 0.5 * a0 + 0.5 * a1
    y = x * (v0 + x * (0.5 * a0 + x * (c3 + x * (c4 + x * c5))))
    return y, v0 + x * (a0 + x * (3.0 * c3 + x * (4.0 * c4 + 5.0 * x * c5)))


@inlined
def _shortest(c: Chain, z: np.ndarray) -> float:
    """How much shorter than at the start the longest stable step is: frequencies go with 1/d^2 of a sleeved link."""
    least = 1.0
    for i in range(c.kind.shape[0]):
        if c.reference[i] > 0.0:
            ratio = z[c.first[i]] / c.reference[i]
            least = min(least, ratio * ratio)
    return least


@internal
def _stop_at_limit(
    c: Chain, w: Work, d: Inputs, m: Memory, method: int, t: float, h: float, last: float, past_it: float, joint: int
) -> None:  # fmt: skip
    """Find by bisection where the step just made, from t, leaves a joint's limits: `joint` is beyond them at the fraction
    `past_it` of the step. m.z and s[T] are the last state inside."""
    _dense(c, w, d, m, method, t, h, last)
    low, high, out, n = 0.0, past_it, m.K[15, : m.z.shape[0]], m.a.shape[0]
    m.s[FAULT] = joint
    for _ in range(60):
        middle = 0.5 * (low + high)
        _interpolate(m, method, h, middle, out)
        prescribe(c, w, d, t + middle * h, out[:n], out[n : 2 * n])
        joint = beyond(c, d, out)
        if joint >= 0:
            high, m.s[FAULT] = middle, joint
        else:
            low = middle
    _interpolate(m, method, h, low, out)
    prescribe(c, w, d, t + low * h, out[:n], out[n : 2 * n])
    _copy(out, m.z)
    m.s[STATUS], m.s[T] = LIMIT, t + low * h


@compiled
def advance(
    c: Chain, w: Work, d: Inputs, m: Memory, method: int, rtol: float, t_eval: np.ndarray, out: np.ndarray, max_steps: int
) -> None:
    """Go on with the run held in `m` for at most `max_steps` steps, filling rows of `out` (T, 2n + 2) as their times pass."""
    c, w, d, m = pinned(c), pinned(w), pinned(d), pinned(m)
    s = m.s
    order = (8.0, 4.0, 3.0, 5.0)[method]
    n = m.a.shape[0]
    end = t_eval[-1]
    for _ in range(max_steps):
        t = s[T]
        while int(s[BREAK]) < d.breaks.shape[0] and d.breaks[int(s[BREAK])] <= t:
            s[BREAK] += 1
        if d.law.rate_Hz > 0.0 and due(d.law) <= t:
            tick(d.law, d.segments, t, m.z)
            s[FRESH] = 0.0
        stop = end
        if d.law.rate_Hz > 0.0 and due(d.law) < end:
            stop = due(d.law)
        if int(s[BREAK]) < d.breaks.shape[0] and d.breaks[int(s[BREAK])] < stop:
            stop = d.breaks[int(s[BREAK])]
        last = np.nextafter(stop, -1e300)  # drives are read just before the break at which this step may end
        if s[FRESH] == 0.0:
            if s[STEPS] == 0.0 or method < PAIR_3:
                _weights(c, m, rtol, m.z)
                _slope(c, w, d, m, t, m.z, m.K[0])
            s[FRESH] = 1.0
        h = min(s[H], stop - t, s[LONGEST] * _shortest(c, m.z))
        if stop - t < 1.5 * h and h < stop - t:
            h = 0.5 * (stop - t)
        if method == EXPLICIT:
            ahead = t_eval[int(s[OUT])] - t
            if 0.7 * h < ahead < h:
                h = ahead  # a full step to an output costs less than the three stages of the interpolant
            error = _explicit_step(c, w, d, m, t, h, last)
        elif method == IMPLICIT:
            error = _implicit_step(c, w, d, m, t, h, last)
        else:
            error = _pair_step(c, w, d, m, t, h, last, method)
        if not error < 1.0:
            s[REJECTED] += 1
            if not error < 1e5:
                s[H] = 0.25 * h
            else:
                s[H] = h * max(0.2, 0.9 * error ** (-1.0 / order))
            if s[H] < 1e-14 * max(1.0, abs(t)) or not np.isfinite(s[H]):
                s[STATUS] = STUCK
                return
            continue
        s[STEPS] += 1
        landed = h >= stop - t
        tn = stop if landed else t + h
        if method == EXPLICIT and h == t_eval[int(s[OUT])] - t:
            tn = t_eval[int(s[OUT])]
        prepared = False
        while int(s[OUT]) < t_eval.shape[0] and t_eval[int(s[OUT])] <= tn:
            row = int(s[OUT])
            if t_eval[row] == tn:
                _copy(m.znew, out[row])
            else:
                if not prepared:
                    _dense(c, w, d, m, method, t, h, last)
                    prepared = True
                _interpolate(m, method, h, (t_eval[row] - t) / h, out[row])
                prescribe(c, w, d, t_eval[row], out[row, :n], out[row, n : 2 * n])
            joint = beyond(c, d, out[row])
            if joint >= 0:
                _stop_at_limit(c, w, d, m, method, t, h, last, (t_eval[row] - t) / h, joint)
                return
            s[OUT] += 1
        joint = beyond(c, d, m.znew)
        if joint >= 0:
            _stop_at_limit(c, w, d, m, method, t, h, last, 1.0, joint)
            return
        factor = 5.0 if error == 0.0 else min(5.0, max(0.3, 0.9 * error ** (-0.7 / order) * max(s[ERR], 1e-4) ** (0.3 / order)))
        if h < s[H]:
            s[H] = max(s[H], h * factor)
        else:
            s[H] = h * factor
        s[ERR] = max(error, 1e-4)
        s[T] = tn
        _copy(m.znew, m.z)
        _weights(c, m, rtol, m.z)
        if landed and stop < end:
            s[FRESH] = 0.0  # the drive may jump here
        elif method < PAIR_3:
            _copy(m.K[12 if method == EXPLICIT else 5], m.K[0])
        if tn >= end:
            s[STATUS] = DONE
            return
