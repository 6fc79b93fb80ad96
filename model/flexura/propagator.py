"""One damped oscillator x'' + d2 x' + w2 x = f, solved exactly over a step: the free motion and the response to powers of time.

With g the response to an impulse (g'' + d2 g' + w2 g = 0, g(0) = 0, g'(0) = 1) a step of h does

    x(h)  = (g' + d2 g) x(0) + g x'(0) + sum_m A_m f_m        A_m = int_0^h g(h - t) (t/h)^m dt
    x'(h) = -w2 g x(0)      + g' x'(0) + sum_m B_m f_m        B_m = int_0^h g'(h - t) (t/h)^m dt

for f = sum_m f_m (t/h)^m. By parts, B_m = m A_(m-1) / h (m > 0), B_0 = g, and

    w2 h^2 a_m + d2 h m a_(m-1) + m (m - 1) a_(m-2) = 1,        a_m = A_m / h^2, m > 1,

a recurrence that is run upwards where w2 h^2 is large, downwards where everything is small, and where damping is strong solved as
the boundary value problem that it is (Olver; without pivoting, which an overdamped mode does not need).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .compiled import compiled, inlined
from .lanes import lanes, nearest, pack, parts, root

_PI = (3.141592651605606, 1.9841871583270443e-09, 1.034036596358821e-18)  # 30 bits, 30 bits, the rest
_TAYLOR = np.array([(-1.0) ** (m // 2) / math.factorial(m) for m in range(23)])
_FROM, _NEAR = 40, 20  # where the downward recurrence begins: what is left of its guess is below round-off
_BELOW = np.array([0.0, 0.0, *(1.0 / (m * (m - 1)) for m in range(2, _FROM + 1))])
_DRAG = np.array([0.0, 0.0, *(1.0 / (m - 1) for m in range(2, _FROM + 1))])


@compiled
def free(w2: float, d2: float, h: float) -> tuple[float, float]:
    """g(h), g'(h)."""
    decay = 0.5 * d2
    square = w2 - decay * decay
    if abs(square) * h * h < 1e-4:
        z = square * h * h
        e = np.exp(-decay * h)
        g = e * h * (1.0 - z / 6.0 * (1.0 - z / 20.0 * (1.0 - z / 42.0)))
        return g, e * (1.0 - z / 2.0 * (1.0 - z / 12.0 * (1.0 - z / 30.0))) - decay * g
    if square > 0.0:
        omega = np.sqrt(square)
        e = np.exp(-decay * h)
        g = e * np.sin(omega * h) / omega
        return g, e * np.cos(omega * h) - decay * g
    kappa = np.sqrt(-square)
    slow, fast = w2 / (decay + kappa), decay + kappa  # decay rates
    e, f = np.exp(-slow * h), np.exp(-fast * h)
    g = (e - f) / (2.0 * kappa)
    return g, (fast * f - slow * e) / (2.0 * kappa)


@inlined
def free_waves(w2: Any, d2: Any, h: float) -> tuple[Any, Any]:
    """g(h), g'(h) of four oscillators that are all underdamped."""
    decay = 0.5 * d2
    omega = root(w2 - decay * decay)
    sine, cosine = waves(omega * h)
    a, b, c, d = parts(decay)
    if max(a, b, c, d) > 0.0:
        e = pack(np.exp(-a * h), np.exp(-b * h), np.exp(-c * h), np.exp(-d * h))
        sine, cosine = e * sine, e * cosine
    g = sine / omega
    return g, cosine - decay * g


@inlined
def waves(x: Any) -> tuple[Any, Any]:
    """sin x and cos x of four numbers below 1e5, to 2e-16 and what x itself is rounded by: a multiple of pi taken off in three
    parts, then Taylor's series, of which 21 powers are enough up to pi / 2."""
    k = nearest(x * (1.0 / np.pi))
    r = ((x - k * _PI[0]) - k * _PI[1]) - k * _PI[2]
    half = 0.5 * k
    odd = half - nearest(half)
    sign, z = 1.0 - 8.0 * odd * odd, r * r
    sine, cosine = lanes(_TAYLOR[21]), lanes(_TAYLOR[22])
    for m in range(19, 0, -2):
        sine = sine * z + _TAYLOR[m]
        cosine = cosine * z + _TAYLOR[m + 1]
    return sign * sine * r, sign * (cosine * z + 1.0)


@compiled
def moments(w2: float, d2: float, h: float, g: float, dg: float, A: np.ndarray, B: np.ndarray, work: np.ndarray) -> None:
    """A_m and B_m for m < len(A), 2 < len(A) < 12; `work` (2, 40)."""
    count = A.shape[0]
    x2, dd = w2 * h * h, d2 * h
    a = work[0]
    if x2 >= 9.0 and dd < 0.6 * x2:
        inverse = 1.0 / x2
        a[0] = (1.0 - dg - d2 * g) * inverse
        a[1] = (1.0 - g / h - dd * a[0]) * inverse
        for m in range(2, count):
            a[m] = (1.0 - dd * m * a[m - 1] - m * (m - 1) * a[m - 2]) * inverse
    elif dd < 3.0 or dd * dd < 4.2 * x2:
        begin = _NEAR if x2 < 1.0 and dd < 0.1 else _FROM
        above, here = 1.0 / (begin * begin), 1.0 / ((begin - 1) * (begin - 1))
        for m in range(begin, 1, -1):
            below = (1.0 - x2 * above) * _BELOW[m] - dd * _DRAG[m] * here
            above, here = here, below
            if m - 2 < count:
                a[m - 2] = below
    else:  # b_m = B_m / h: x2 b_(m+1) / (m + 1) + dd b_m + m b_(m-1) = 1, from b_0 = g / h to nearly 1 / (dd + m)
        size = 36
        low = work[1]
        b = a
        b[0], low[0] = g / h, 0.0  # row by row: b_m = b[m] - low[m] b_(m+1)
        for m in range(1, size):
            pivot = dd - m * low[m - 1]
            low[m] = x2 / ((m + 1) * pivot)
            b[m] = (1.0 - m * b[m - 1]) / pivot
        following = 1.0 / (dd + size + x2 / (size + 1))
        for m in range(size - 1, -1, -1):
            following = b[m] - low[m] * following
            b[m] = following
        for m in range(count):
            a[m] = b[m + 1] / (m + 1)
    for m in range(count):
        A[m] = a[m] * h * h
        B[m] = g if m == 0 else m * a[m - 1] * h
