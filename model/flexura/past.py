"""What an exponential run remembers of the forces on its modes, and the weights of a step from them: polynomials through the last
values of N in the variation-of-constants formula of each mode (`propagator.py`)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .basis import Basis
from .compiled import inlined, internal
from .lanes import WIDTH, lanes, load, pack, padded, room, store
from .propagator import free, moments

ORDER = 5
STIFF_ORDER = 2  # of modes that turn by more than STIFF rad a step: extrapolation would blow up what the basis leaves of them
STIFF = 3.0
_OVER = 1.0 / np.arange(1, ORDER + 2)
_UNIT = np.eye(2 * WIDTH)[WIDTH - 1]  # 1 in lane k of what is loaded from WIDTH - 1 - k
GAP, ERROR = ORDER, ORDER + 1  # the polynomials of the new less the extrapolated value, and of the error of a step
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
    poly: np.ndarray  # (2, ORDER + 1, 8) coefficients of Lagrange's polynomials, a column each, by age; of GAP's; of ERROR's
    low: np.ndarray  # (N,) 1 for modes of low order, the last ones
    end: np.ndarray  # (8,) the polynomials at the end of the step
    area: np.ndarray  # (8,) their integrals over it
    node: np.ndarray  # (8,) the values' times by age, in steps from the newest
    gap: np.ndarray  # (N,) new less extrapolated N
    new: np.ndarray  # (4, N) eta, eta' predicted; eta, eta' corrected
    size: np.ndarray  # (2, N) error weights of eta, eta'
    f: np.ndarray  # (ORDER + 1, N) N as a polynomial inside the step
    bent: np.ndarray  # (2, N) h^2 eta'' at both ends of the step
    slow: np.ndarray  # (ORDER + 1, N) the motion that N alone makes of stiff modes, as a polynomial
    kind: np.ndarray  # (N,) how each mode moves inside the step
    work: np.ndarray  # (2, N)
    column: np.ndarray  # (2, ORDER + 1)
    tables: np.ndarray  # (2, 40)


def past(n: int) -> Past:
    k, r, N = ORDER, ROWS, padded(n)
    return Past(**room(
        s=5, origin=N, eta=N, etad=N, t=r, a=(r, N), y=(r, N), v=(r, N), N=(r, N), power=(r, 2), step=(4, N), A=(k + 1, N),
        B=(k + 1, N), ahead=(3, k, N), late=(4, N), poly=(2, k + 1, 8), low=N, end=8, area=8, node=8, gap=N,
        new=(4, N), size=(2, N), f=(k + 1, N), bent=(2, N), slow=(k + 1, N), kind=N, work=(2, N), column=(2, k + 1),
        tables=(2, 40),
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
        if stiffer == b.seen.shape[0]:
            stiffer = n
        for i in range(n):
            p.low[i] = 0.0 if i < stiffer else 1.0
        p.s[SPAN], p.s[STEADY], p.s[STIFFER] = h, 0.0, stiffer
    for j in range(k):
        p.node[j] = (p.t[ring(head, j)] - p.t[head]) / h
    _polynomials(p, 0, k)
    if p.s[STIFFER] < b.seen.shape[0]:
        _polynomials(p, 1, min(k, STIFF_ORDER))
    for j in range(0, 8, WIDTH):
        end, area = lanes(0.0), lanes(0.0)
        for m in range(ORDER + 1):
            row = load(p.poly[0, m], j)
            end += row
            area += _OVER[m] * row
        store(p.end, j, end)
        store(p.area, j, area)
    for i in range(0, n, WIDTH):
        order = order_of(p, k, i)
        if order == ORDER:  # as a constant, for which the compiler unrolls the loops
            _weigh(p, k, ORDER, i)
        else:
            _weigh(p, k, order, i)


@inlined
def _weigh(p: Past, k: int, order: int, i: int) -> None:
    """The weights of k values for the modes i to i + 3, from the last `order` ones."""
    for j in range(order):
        y, v, end = lanes(0.0), lanes(0.0), lanes(0.0)
        for m in range(order):
            value = coefficient(p, j, m, i)
            y += value * load(p.A[m], i)
            v += value * load(p.B[m], i)
            end += value
        store(p.ahead[0, j], i, y)
        store(p.ahead[1, j], i, v)
        store(p.ahead[2, j], i, end)
    for j in range(order, k):
        for row in range(3):
            store(p.ahead[row, j], i, lanes(0.0))
    for r in range(2):
        y, v = lanes(0.0), lanes(0.0)
        for m in range(order + 1):
            value = coefficient(p, GAP + r, m, i)
            y += value * load(p.A[m], i)
            v += value * load(p.B[m], i)
        store(p.late[2 * r], i, y)
        store(p.late[2 * r + 1], i, v)


@inlined
def order_of(p: Past, k: int, i: int) -> int:
    """The highest order of the modes i to i + 3."""
    return k if i < p.s[STIFFER] else min(k, STIFF_ORDER)


@inlined
def coefficient(p: Past, j: int, m: int, i: int) -> Any:
    """Coefficient m of the polynomial of value j, for the modes i to i + 3."""
    if i + WIDTH <= p.s[STIFFER]:
        return lanes(p.poly[0, m, j])
    low = load(p.low, i)
    return (1.0 - low) * p.poly[0, m, j] + low * p.poly[1, m, j]


@inlined
def _polynomials(p: Past, low: int, used: int) -> None:
    """Polynomials through the last `used` values: Lagrange's, GAP's and ERROR's, eight side by side, each multiplied up from its
    roots. (Dividing the product of all would lose four digits where nodes lie far apart.)"""
    C, skipped = p.poly[low], load(_UNIT, 0)
    for m in range(ORDER + 1):
        store(C[m], 0, lanes(1.0 if m == 0 else 0.0))
        store(C[m], WIDTH, lanes(1.0 if m == 0 else 0.0))
    at, at_end = load(p.node, 0), pack(p.node[WIDTH], 1.0, 1.0, 0.0)  # where each is to be 1
    below, below_end = lanes(1.0), lanes(1.0)
    for i in range(used):
        node = p.node[i]
        own = load(_UNIT, WIDTH - 1 - i) if i < WIDTH else lanes(0.0)  # Lagrange's i-th has no root at its own node
        own_end = skipped + load(_UNIT, WIDTH - 1) if i == WIDTH else skipped
        other, other_end = 1.0 - own, 1.0 - own_end
        below *= own + other * (at - node)
        below_end *= own_end + other_end * (at_end - node)
        root = node * other - own
        # the error's: the end in place of the oldest
        root_end = pack(node, node, node if i < used - 1 else 1.0, 0.0) * other_end - own_end
        for m in range(i + 1, 0, -1):
            store(C[m], 0, other * load(C[m - 1], 0) - root * load(C[m], 0))
            store(C[m], WIDTH, other_end * load(C[m - 1], WIDTH) - root_end * load(C[m], WIDTH))
        store(C[0], 0, -root * load(C[0], 0))
        store(C[0], WIDTH, -root_end * load(C[0], WIDTH))
    none, none_end = lanes(0.0), skipped  # no value of that age
    for j in range(used, WIDTH):
        none += load(_UNIT, WIDTH - 1 - j)
    if used <= WIDTH:
        none_end += load(_UNIT, WIDTH - 1)
    some, some_end = 1.0 - none, 1.0 - none_end
    scale, scale_end = some / (some * below + none), some_end / (some_end * below_end + none_end)
    for m in range(used + 1):
        store(C[m], 0, scale * load(C[m], 0))
        store(C[m], WIDTH, scale_end * load(C[m], WIDTH))
