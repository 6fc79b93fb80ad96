"""What an exponential run remembers of the forces on its modes, and the weights of a step from them: polynomials through the last
values of N in the variation-of-constants formula of each mode (`propagator.py`)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .basis import Basis
from .compiled import inlined, internal
from .lanes import WIDTH, lanes, load, padded, room, store
from .propagator import free, moments

ORDER = 5
STIFF_ORDER = 2  # of modes that turn by more than STIFF rad a step: extrapolation would blow up what the basis leaves of them
STIFF = 3.0
_OVER = 1.0 / np.arange(1, ORDER + 2)
ROWS = ORDER + 1  # of the rings: the new value has a row of its own until the step is accepted
# entries of Past.s: values held, step of the tables, steps since it changed, newest row, and the first of the stiff modes
COUNT, SPAN, STEADY, HEAD, STIFFER = range(5)


class Past(NamedTuple):
    """What a multistep run remembers for n unknowns and as many modes, and the tables of the present step: rows N long, a
    multiple of four, zeros after their own values. Row HEAD of the rings is the newest."""

    s: np.ndarray  # (5,)
    origin: np.ndarray  # (N,) y0, the state where the basis was taken up: small numbers keep their digits
    eta: np.ndarray  # (N,)
    etad: np.ndarray
    t: np.ndarray  # (ROWS,) a ring, and so below: times
    a: np.ndarray  # (ROWS, N) accelerations where the equations were looked at,
    y: np.ndarray  # and there the state
    v: np.ndarray
    N: np.ndarray
    power: np.ndarray  # (ROWS, 2) power of the drives, and lost
    step: np.ndarray  # (4, N) free motion
    A: np.ndarray  # (ORDER + 1, N) moments
    B: np.ndarray
    ahead: np.ndarray  # (3, ORDER, N) weights of the old values by age in eta, eta' predicted, and in N extrapolated
    late: np.ndarray  # (4, N) weights of new less extrapolated N: correction of eta, eta'; error of both
    poly: np.ndarray  # (2, ORDER + 2, ORDER + 1) by age, coefficients of Lagrange's polynomials; of the new one; of the error's
    low: np.ndarray  # (N,) 1 for modes of low order, the last ones
    end: np.ndarray  # (ORDER + 1,) the polynomials at the end of the step
    area: np.ndarray  # (ORDER + 1,) their integrals over it
    node: np.ndarray  # (ORDER,) the values' times by age, in steps from the newest
    gap: np.ndarray  # (N,) new less extrapolated N
    new: np.ndarray  # (4, N) eta, eta' predicted; eta, eta' corrected
    size: np.ndarray  # (2, N) error weights of eta, eta'
    f: np.ndarray  # (ORDER + 1, N) N as a polynomial inside the step
    bent: np.ndarray  # (2, N) h^2 eta'' at both ends of the step
    slow: np.ndarray  # (ORDER + 1, N) the motion that N alone makes of stiff modes, as a polynomial
    work: np.ndarray  # (2, N)
    column: np.ndarray  # (2, ORDER + 1)
    tables: np.ndarray  # (2, 40)


def past(n: int) -> Past:
    k, r, N = ORDER, ROWS, padded(n)
    return Past(**room(
        s=5, origin=N, eta=N, etad=N, t=r, a=(r, N), y=(r, N), v=(r, N), N=(r, N), power=(r, 2), step=(4, N), A=(k + 1, N),
        B=(k + 1, N), ahead=(3, k, N), late=(4, N), poly=(2, k + 2, k + 1), low=N, end=k + 1, area=k + 1, node=k, gap=N,
        new=(4, N), size=(2, N), f=(k + 1, N), bent=(2, N), slow=(k + 1, N), work=(2, N), column=(2, k + 1), tables=(2, 40),
    ))  # fmt: skip


@inlined
def ring(head: int, age: int) -> int:
    """The row of a value, so many steps old."""
    return head + age if head + age < ROWS else head + age - ROWS


@internal
def tables(b: Basis, p: Past, h: float, k: int) -> None:
    """Weights of a step of h from the last k values of N."""
    n = b.w2.shape[0]
    head = int(p.s[HEAD])
    if h != p.s[SPAN]:
        A, B, stiffer = p.column[0], p.column[1], 0
        for i in range(b.seen.shape[0]):
            g, dg = free(b.w2[i], b.d2[i], h)
            p.step[0, i], p.step[1, i], p.step[2, i], p.step[3, i] = dg + b.d2[i] * g, g, -b.w2[i] * g, dg
            moments(b.w2[i], b.d2[i], h, g, dg, A, B, p.tables)
            for m in range(ORDER + 1):
                p.A[m, i], p.B[m, i] = A[m], B[m]
            if b.w2[i] * h * h <= STIFF * STIFF:
                stiffer = i + 1
        for i in range(n):
            p.low[i] = 0.0 if i < stiffer else 1.0
        p.s[SPAN], p.s[STEADY], p.s[STIFFER] = h, 0.0, stiffer
    for j in range(k):
        p.node[j] = (p.t[ring(head, j)] - p.t[head]) / h
    _polynomials(p, 0, k, k)
    if p.s[STIFFER] < b.seen.shape[0]:
        _polynomials(p, 1, min(k, STIFF_ORDER), k)
    for i in range(0, n, WIDTH):
        order = order_of(p, k, i)
        for j in range(k + 2):
            y, v, end = lanes(0.0), lanes(0.0), lanes(0.0)
            for m in range(order + 1 if j < order or j >= k else 0):
                value = coefficient(p, j, m, i)
                y += value * load(p.A[m], i)
                v += value * load(p.B[m], i)
                end += value
            if j < k:
                store(p.ahead[0, j], i, y)
                store(p.ahead[1, j], i, v)
                store(p.ahead[2, j], i, end)
            else:
                store(p.late[2 * (j - k)], i, y)
                store(p.late[2 * (j - k) + 1], i, v)
    for j in range(k + 1):
        p.end[j], p.area[j] = 0.0, 0.0
        for m in range(k + 1):
            p.end[j] += p.poly[0, j, m]
            p.area[j] += p.poly[0, j, m] * _OVER[m]


@inlined
def order_of(p: Past, k: int, i: int) -> int:
    """The highest order of the modes i to i + 3."""
    return k if i < p.s[STIFFER] else min(k, STIFF_ORDER)


@inlined
def coefficient(p: Past, j: int, m: int, i: int) -> Any:
    """Coefficient m of the polynomial of value j, for the modes i to i + 3."""
    if i + WIDTH <= p.s[STIFFER]:
        return lanes(p.poly[0, j, m])
    low = load(p.low, i)
    return (1.0 - low) * p.poly[0, j, m] + low * p.poly[1, j, m]


@inlined
def _polynomials(p: Past, low: int, used: int, k: int) -> None:
    """Polynomials through the last `used` of k values: Lagrange's, the one for the gap and the one for the error. Multiplied up
    from their roots: dividing the product of all would lose four digits where nodes lie far apart."""
    for j in range(k + 2):
        row = p.poly[low, j]
        for m in range(ORDER + 1):
            row[m] = 0.0
        if used <= j < k:
            continue
        if j > k and used == 1:  # the error's: the end in place of the oldest
            row[0], row[1] = -1.0, 1.0
            continue
        at = p.node[j] if j < used else 1.0  # where it is to be 1
        degree, below = (0, 1.0) if j == 0 else (1, at)  # the newest node is at 0
        row[degree] = 1.0
        for i in range(1, used):
            if i != j:
                below *= at - p.node[i]
                root = p.node[i] if j <= k or i < used - 1 else 1.0
                degree += 1
                for m in range(degree, 0, -1):
                    row[m] = row[m - 1] - root * row[m]
                row[0] *= -root
        inverse = 1.0 / below
        for m in range(degree + 1):
            row[m] *= inverse
