"""What an exponential run remembers of the forces on its modes, and the weights of a step from them: polynomials through the last
values of N in the variation-of-constants formula of each mode (`propagator.py`)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .basis import Basis
from .compiled import compiled, inlined
from .propagator import free, moments

ORDER = 5
STIFF_ORDER = 2  # of modes that turn by more than STIFF rad a step: extrapolation would blow up what the basis leaves of them
STIFF = 3.0
ROWS = ORDER + 1  # of the rings: the new value has a row of its own until the step is accepted
COUNT, SPAN, STEADY, HEAD = range(4)  # entries of Past.s: values held, step of the tables, steps since it changed, newest row


class Past(NamedTuple):
    """What a multistep run remembers for n unknowns, and the tables of the present step. Row HEAD of the rings is the newest."""

    s: np.ndarray  # (4,)
    origin: np.ndarray  # (n,) y0, the state where the basis was taken up: small numbers keep their digits
    eta: np.ndarray  # (n,)
    etad: np.ndarray
    t: np.ndarray  # (ROWS,) a ring, and so below: times
    a: np.ndarray  # (ROWS, n) accelerations where the equations were looked at,
    y: np.ndarray  # and there the state
    v: np.ndarray
    N: np.ndarray
    power: np.ndarray  # (ROWS, 2) power of the drives, and lost
    step: np.ndarray  # (4, n) free motion
    A: np.ndarray  # (ORDER + 1, n) moments
    B: np.ndarray
    ahead: np.ndarray  # (2, ORDER, n) weights of the old values in eta, eta' predicted; rows by age
    late: np.ndarray  # (4, n) weights of new less extrapolated N: correction of eta, eta'; error of both
    poly: np.ndarray  # (2, ORDER + 2, ORDER + 1) by age, coefficients of Lagrange's polynomials; of the new one; of the error's
    end: np.ndarray  # (2, ORDER + 1) the values of the old ones at the end of the step
    low: np.ndarray  # (n,) int: 1 for modes of low order
    area: np.ndarray  # (ORDER + 1,) integrals of the polynomials over the step
    node: np.ndarray  # (ORDER,) the values' times by age, in steps from the newest
    gap: np.ndarray  # (n,) new less extrapolated N
    new: np.ndarray  # (4, n) eta, eta' predicted; eta, eta' corrected
    size: np.ndarray  # (2, n) error weights of eta, eta'
    f: np.ndarray  # (ORDER + 1, n) N as a polynomial inside the step
    column: np.ndarray  # (2, ORDER + 1)
    work: np.ndarray  # (2, n)
    tables: np.ndarray  # (2, 40)


def past(n: int) -> Past:
    z, k, r = np.zeros, ORDER, ROWS
    return Past(
        z(4), z(n), z(n), z(n), z(r), z((r, n)), z((r, n)), z((r, n)), z((r, n)), z((r, 2)), z((4, n)), z((k + 1, n)),
        z((k + 1, n)),
        z((2, k, n)), z((4, n)), z((2, k + 2, k + 1)), z((2, k + 1)), np.zeros(n, np.int64), z(k + 1), z(k), z(n), z((4, n)),
        z((2, n)), z((k + 1, n)), z((2, k + 1)), z((2, n)), z((2, 40)),
    )  # fmt: skip


@compiled
def tables(b: Basis, p: Past, h: float, k: int) -> None:
    """Weights of a step of h from the last k values of N."""
    n = b.w2.shape[0]
    head = int(p.s[HEAD])
    if h != p.s[SPAN]:
        A, B = p.column[0], p.column[1]
        for i in range(n):
            g, dg = free(b.w2[i], b.d2[i], h)
            p.step[0, i], p.step[1, i], p.step[2, i], p.step[3, i] = dg + b.d2[i] * g, g, -b.w2[i] * g, dg
            moments(b.w2[i], b.d2[i], h, g, dg, A, B, p.tables)
            for m in range(ORDER + 1):
                p.A[m, i], p.B[m, i] = A[m], B[m]
            p.low[i] = 1 if b.w2[i] * h * h > STIFF * STIFF else 0
        p.s[SPAN], p.s[STEADY] = h, 0.0
    for j in range(k):
        p.node[j] = (p.t[(head + j) % ROWS] - p.t[head]) / h
    short = min(k, STIFF_ORDER)
    _polynomials(p, 0, k)
    _polynomials(p, 1, short)
    for j in range(k + 2):
        for i in range(n):
            low, y, v = p.low[i], 0.0, 0.0
            for m in range(k + 1):
                y += p.poly[low, j, m] * p.A[m, i]
                v += p.poly[low, j, m] * p.B[m, i]
            if j < k:
                p.ahead[0, j, i], p.ahead[1, j, i] = y, v
            else:
                p.late[2 * (j - k), i], p.late[2 * (j - k) + 1, i] = y, v
    for j in range(k + 1):
        p.area[j] = 0.0
        for m in range(k + 1):
            p.area[j] += p.poly[0, j, m] / (m + 1)


@inlined
def _polynomials(p: Past, low: int, used: int) -> None:
    """Polynomials through the last `used` values: Lagrange's, the one for the gap and the one for the error."""
    k = int(p.s[COUNT])
    for j in range(k + 2):
        c = p.poly[low, j]
        for m in range(ORDER + 1):
            c[m] = 0.0
        if used <= j < k:
            continue
        c[0] = 1.0
        degree = 0
        for i in range(used if j != k + 1 else used - 1):
            if i != j:
                degree = _times(c, degree, p.node[i])
        if j == k + 1:
            degree = _times(c, degree, 1.0)
        below = 1.0
        for i in range(used):
            if i != j:
                below *= (p.node[j] if j < used else 1.0) - p.node[i]
        for m in range(degree + 1):
            c[m] /= below
    for j in range(k):
        p.end[low, j] = 0.0
        for m in range(k):
            p.end[low, j] += p.poly[low, j, m]


@inlined
def _times(c: np.ndarray, degree: int, root: float) -> int:
    """c(s) <- (s - root) c(s)."""
    for m in range(degree + 1, 0, -1):
        c[m] = c[m - 1] - root * c[m]
    c[0] *= -root
    return degree + 1
