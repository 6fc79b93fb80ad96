"""The lowest modes of a uniform link with a payload, from all modes of the link without: they differ by two rows.

In the modes of the bare link, K = diag(lambda) and M = 1 + U U^T, U = (sqrt(mass) a, sqrt(inertia) b), with a, b the deflections
and slopes of the modes' tips. With D = diag(lambda) - x, (K - x M) v = 0 is

    S c = 0,   S(x) = 1 - x U^T D^-1 U  (2, 2),   v = D^-1 U c                                                              (1)

and by Sylvester's law K - x M has as many negative eigenvalues as D and S together: so many modes lie below x (Golub, SIAM Review
15 (1973), 318). That bisects each eigenvalue down to two neighbouring numbers, at 2n divisions a trial in place of (2n)^3.
"""

from __future__ import annotations

import numpy as np

from .compiled import compiled, inlined, internal

_NEAR = 1e-16  # less than the distance between two numbers, in shares of them


@inlined
def _apart(value: float, x: float) -> float:
    """value - x, but never 0."""
    gap = value - x
    return gap if abs(gap) >= _NEAR * value else _NEAR * value


@internal
def _sides(lam: np.ndarray, a: np.ndarray, b: np.ndarray, mass: float, inertia: float, x: float) -> tuple:
    """S(x) as s11, s12, s22, and how many modes lie below x."""
    aa, ab, bb, below = 0.0, 0.0, 0.0, 0
    for k in range(lam.shape[0]):
        inverse = 1.0 / _apart(lam[k], x)
        aa += a[k] * a[k] * inverse
        ab += a[k] * b[k] * inverse
        bb += b[k] * b[k] * inverse
        below += lam[k] < x
    s11, s12, s22 = 1.0 - x * mass * aa, -x * np.sqrt(mass * inertia) * ab, 1.0 - x * inertia * bb
    if s11 * s22 < s12 * s12:
        below += 1
    elif s11 + s22 < 0.0:
        below += 2
    return s11, s12, s22, below


@compiled
def lowest(
    lam: np.ndarray, a: np.ndarray, b: np.ndarray, mass: np.ndarray, inertia: np.ndarray, values: np.ndarray, shapes: np.ndarray
) -> None:
    """Eigenvalues `values` (B, m), ascending, and `shapes` (B, n, m) in the bare link's modes, M-normalised, tips towards +w, of
    B links with payloads of `mass` and `inertia` (B,); lam, a, b (n,) of the bare link, m <= n."""
    n = lam.shape[0]
    for link in range(mass.shape[0]):
        heavy, turning = np.sqrt(mass[link]), np.sqrt(inertia[link])
        for mode in range(values.shape[1]):
            v = shapes[link, :, mode]
            low, high = 0.0, lam[mode]  # a payload only lowers it
            while mass[link] > 0.0 or inertia[link] > 0.0:
                x = 0.5 * (low + high)
                if not low < x < high:
                    break
                if _sides(lam, a, b, mass[link], inertia[link], x)[3] > mode:
                    high = x
                else:
                    low = x
            values[link, mode] = high
            if high == lam[mode]:  # no payload, or one that is lost in the digits
                for k in range(n):
                    v[k] = 0.0
                v[mode] = 1.0
            else:
                s11, s12, s22, _ = _sides(lam, a, b, mass[link], inertia[link], high)
                c1, c2 = (-s12, s11) if abs(s11) > abs(s22) else (s22, -s12)
                for k in range(n):
                    v[k] = (heavy * a[k] * c1 + turning * b[k] * c2) / _apart(lam[k], high)
            square, tip, slope = 0.0, 0.0, 0.0
            for k in range(n):
                square += v[k] * v[k]
                tip += a[k] * v[k]
                slope += b[k] * v[k]
            scale = 1.0 / np.sqrt(square + mass[link] * tip * tip + inertia[link] * slope * slope)
            if tip < 0.0:
                scale = -scale
            for k in range(n):
                v[k] *= scale
