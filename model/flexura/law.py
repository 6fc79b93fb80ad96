"""A sampled controller inside the time loop, compiled: at each tick it measures, computes, and holds its outputs until the next.

The law of one joint, of firmware/README.md, with T the tick, e = r - q, w the tip deflection and s the tip slope w'(L):

    u = kp e + ki sum(e) T + kd (r' - q') + kf w + kg w' + ks s + kt s' + kv r' + kc sign r' + f(t)

r: the reference through a first-order filter; r': its change / T; q': the filtered change of q / T, and of a stepper that counts
its own pulses u of the tick before; w, s: the mean of two ticks, every second tick, through a filter of their own, w' its
change / 2T; joint i takes them in ticks k with k mod 2 = i mod 2 (i from 0). |u| <= limit, and changes by at most slew T a tick.
The sum's part of u stays within the limit, and stands still while limit or slew holds u back and e pushes it further. Filters:
y += a (x - y), a = 1 - exp(-2 pi f T). u becomes a force (times `FORCE`), or a stepper's rate, after a whole number of ticks.

Linear law, in place of it where `F` is not empty (`lqr.py`): z^ = z + L (y - C z), u = -K z^ + Kr r + Kv r' + f(t), limits as
above, and z of the next tick = F z^ + G u with the u that the limits left.

What a tick leaves behind is one segment a joint of the loop's own signals (`signal.evaluate`), which holds until the next tick.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .compiled import compiled, inlined, internal
from .signal import evaluate

NONE, EFFORT, STEPPER = 0, 1, 2  # what a joint's output is: not this controller's, a force or voltage, a rate
(
    KP, KI, KD, KF, KG, KS, KT, KV, KC, LIMIT, SLEW, FORCE, SETPOINT, DERIVATIVE, DEFLECTION, COUNT, DUTY, ENCODER, RIGID, DELAY,
) = range(20)  # fmt: skip  # columns of Law.gains
Q, V, R, SUM, U, PULSES, GIVEN, PLACE, TIP = range(9)  # columns of Law.memory
W1, S1, W, S, WD, SD, TICK = range(7)  # entries of Law.sensor
LOGGED = 6  # reference, output as given, three coefficients of the held segment, the tip deflection as the law takes it


class Law(NamedTuple):
    """A controller of N joints on a robot of n unknowns: constants, gains, and the memory of one run."""

    rate_Hz: float  # 0: there is none
    start: float  # time of tick 0 [s]
    kind: np.ndarray  # (N,) int
    gains: np.ndarray  # (N, 20)
    rows: np.ndarray  # (N, 2) int: rows of the loop's segments that it writes: force, motion; -1: none
    segments: np.ndarray  # (k, 10) of references and feedforwards
    ranges: np.ndarray  # (N, 4) int: reference from, to; feedforward from, to
    first: np.ndarray  # (N,) int: the joints' rows
    look: np.ndarray  # (2, n): tip deflection and slope of the last flexible link
    sleeve: int  # row of the free length by which that slope is divided; -1: none
    quantum: float  # of the measured deflection [m]; 0: exact
    F: np.ndarray  # (p, p) of a linear law; p = 0: PID
    G: np.ndarray  # (p, N)
    L: np.ndarray  # (p, M)
    C: np.ndarray  # (M, p)
    K: np.ndarray  # (N, p)
    Kr: np.ndarray  # (N, N)
    Kv: np.ndarray  # (N, N)
    offset: np.ndarray  # (M,) measurements at the point about which it is linear
    hold: np.ndarray  # (N,) outputs there
    z: np.ndarray  # (2, p) prediction, estimate
    y: np.ndarray  # (M,) measurements
    memory: np.ndarray  # (N, 9)
    sensor: np.ndarray  # (7,)
    ring: np.ndarray  # (N, D) outputs of the last D ticks
    log: np.ndarray  # (ticks, N, 6); 0 ticks: none is kept


def none() -> Law:
    """No controller."""
    z, i = np.zeros, np.int64
    return Law(
        0.0, 0.0, z(0, i), z((0, 20)), z((0, 2), i), z((0, 10)), z((0, 4), i), z(0, i), z((2, 0)), -1, 0.0,
        z((0, 0)), z((0, 0)), z((0, 0)), z((0, 0)), z((0, 0)), z((0, 0)), z((0, 0)), z(0), z(0), z((2, 0)), z(0),
        z((0, 9)), z(7), z((0, 1)), z((0, 0, LOGGED)),
    )  # fmt: skip


@inlined
def due(d: Law) -> float:
    """The time of the next tick [s]."""
    return d.start + d.sensor[TICK] / d.rate_Hz


@inlined
def _rounded(x: float, quantum: float) -> float:
    return x if quantum == 0.0 else quantum * np.floor(x / quantum + 0.5)


@inlined
def _sense(d: Law, y: np.ndarray, k: int) -> None:
    """The strip: readings of two ticks make a value, its filter and its rate."""
    w, slope = 0.0, 0.0
    for j in range(d.look.shape[1]):
        w += d.look[0, j] * y[j]
        slope += d.look[1, j] * y[j]
    if d.sleeve >= 0:
        slope /= y[d.sleeve]
    w, m = _rounded(w, d.quantum), d.sensor
    if d.y.shape[0] > d.kind.shape[0]:
        d.y[d.kind.shape[0]] = w - d.offset[d.kind.shape[0]]
    if k == 0:
        m[W1], m[S1], m[W], m[S] = w, slope, w, slope
    if k % 2 == 0:
        a, per_s = d.gains[0, DEFLECTION], 0.5 * d.rate_Hz
        dw, ds = a * (0.5 * (m[W1] + w) - m[W]), a * (0.5 * (m[S1] + slope) - m[S])
        m[W] += dw
        m[S] += ds
        m[WD], m[SD] = dw * per_s, ds * per_s
    m[W1], m[S1] = w, slope


@inlined
def held(g: np.ndarray, wish: float, last: float, per_tick: float) -> float:
    """A wish within the limit, then within slew T of the output of the tick before."""
    u = min(max(wish, -g[LIMIT]), g[LIMIT])
    change = g[SLEW] * per_tick
    return min(max(u, last - change), last + change)


@inlined
def pid(g: np.ndarray, m: np.ndarray, e: float, rate: float, setpoint_rate: float, extra: float, per_tick: float) -> float:
    """One tick of the law from the error, q', r', and the terms in the strip and of time; keeps the sum and the output in m."""
    total = m[SUM] + g[KI] * e * per_tick
    if not -g[LIMIT] <= total <= g[LIMIT]:
        total = m[SUM]
    sign = 1.0 if setpoint_rate > 0.0 else -1.0 if setpoint_rate < 0.0 else 0.0
    wish = g[KP] * e + total + g[KD] * (setpoint_rate - rate) + g[KV] * setpoint_rate + g[KC] * sign + extra
    u = held(g, wish, m[U], per_tick)
    up = (e < 0.0) == (g[KI] < 0.0)
    if not (wish > u and up) and not (wish < u and not up):
        m[SUM] = total
    m[U] = u
    return u


@internal
def _estimate(d: Law) -> None:
    """z^ = z + L (y - C z)."""
    p = d.F.shape[0]
    for a in range(p):
        d.z[1, a] = d.z[0, a]
    for b in range(d.y.shape[0]):
        new = d.y[b]
        for a in range(p):
            new -= d.C[b, a] * d.z[0, a]
        for a in range(p):
            d.z[1, a] += d.L[a, b] * new


@internal
def _predict(d: Law) -> None:
    """z = F z^ + G u, with the outputs as given."""
    p = d.F.shape[0]
    for a in range(p):
        total = 0.0
        for b in range(p):
            total += d.F[a, b] * d.z[1, b]
        for i in range(d.kind.shape[0]):
            total += d.G[a, i] * (d.memory[i, GIVEN] - d.hold[i])
        d.z[0, a] = total


@internal
def _linear(d: Law, i: int) -> float:
    """-K z^ + Kr r + Kv r' + what holds the robot where it was linearised; R and V of the memory hold r and r'."""
    joints, wish = d.kind.shape[0], d.hold[i]
    for a in range(d.F.shape[0]):
        wish -= d.K[i, a] * d.z[1, a]
    for j in range(joints):
        wish += d.Kr[i, j] * (d.memory[j, R] - d.offset[j]) + d.Kv[i, j] * d.memory[j, V]
    return wish


@compiled
def tick(d: Law, segments: np.ndarray, t: float, z: np.ndarray) -> None:
    """The tick at t: measure the state z, compute, put what is held until the next tick into the loop's `segments`."""
    k, per_tick, rate_Hz, linear = int(d.sensor[TICK]), 1.0 / d.rate_Hz, d.rate_Hz, d.F.shape[0] > 0
    _sense(d, z, k)
    for i in range(d.kind.shape[0]):
        if d.kind[i] == NONE:
            continue
        g, m = d.gains[i], d.memory[i]
        q = _rounded(z[d.first[i]], g[COUNT])
        if k == 0:
            m[Q], m[PULSES], m[PLACE] = q, z[d.first[i]], z[d.first[i]]
            m[R] = evaluate(d.segments[d.ranges[i, 0] : d.ranges[i, 1]], np.nextafter(t, -1e300))[0]
        r = evaluate(d.segments[d.ranges[i, 0] : d.ranges[i, 1]], t)[0]
        step = g[SETPOINT] * (r - m[R])
        m[R] += step
        if linear:
            m[V] = step * rate_Hz
            d.y[i] = q - d.offset[i]
            continue
        speed = (q - m[Q]) * rate_Hz
        m[V] += g[DERIVATIVE] * (speed - m[V])
        m[Q] = q
        rate = m[V]
        if d.kind[i] == STEPPER and g[ENCODER] == 0.0:
            q, rate = m[PULSES], m[U]
        if k % 2 == i % 2:
            m[TIP] = g[KF] * d.sensor[W] + g[KG] * d.sensor[WD] + g[KS] * d.sensor[S] + g[KT] * d.sensor[SD]
        ahead = evaluate(d.segments[d.ranges[i, 2] : d.ranges[i, 3]], t)[0]
        pid(g, m, m[R] - q, rate, step * rate_Hz, m[TIP] + ahead, per_tick)
    if linear:
        _estimate(d)
    for i in range(d.kind.shape[0]):
        if d.kind[i] == NONE:
            continue
        g, m = d.gains[i], d.memory[i]
        if linear:
            ahead = evaluate(d.segments[d.ranges[i, 2] : d.ranges[i, 3]], t)[0]
            m[U] = held(g, _linear(d, i) + ahead, m[U], per_tick)
        _give(d, segments, i, k, t)
    if linear:
        _predict(d)
    d.sensor[TICK] = k + 1


@inlined
def _give(d: Law, segments: np.ndarray, i: int, k: int, t: float) -> None:
    """Joint i's output, after its delay, as the segment that holds from t on."""
    g, m, per_tick = d.gains[i], d.memory[i], 1.0 / d.rate_Hz
    size, late = d.ring.shape[1], int(g[DELAY])
    d.ring[i, k % size] = m[U]
    before = m[GIVEN]
    given = d.ring[i, (k - late) % size] if k >= late else 0.0
    m[PULSES] += m[U] * per_tick
    if d.kind[i] == EFFORT:
        given = _rounded(given, g[DUTY])
        row = segments[d.rows[i, 0]]
        row[1] = g[FORCE] * given
    else:
        row = segments[d.rows[i, 1]]
        row[1], row[2], row[3] = m[PLACE], given, 0.0
        if g[RIGID] != 0.0:  # no spring between pulses and joint: the rate changes evenly over the tick
            row[2], row[3] = before, 0.5 * (given - before) * d.rate_Hz
        m[PLACE] += per_tick * (row[2] + row[3] * per_tick)
    row[0] = t
    m[GIVEN] = given
    if k < d.log.shape[0]:
        d.log[k, i, 0], d.log[k, i, 1], d.log[k, i, 5] = m[R], given, d.sensor[W]
        d.log[k, i, 2], d.log[k, i, 3], d.log[k, i, 4] = row[1], row[2], row[3]
