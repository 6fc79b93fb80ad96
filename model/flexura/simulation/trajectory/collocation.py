"""A whole motion as the unknown: piecewise polynomials in time, and the equations of motion at the
points of Gauss.

On each interval of a mesh the unknowns q(t) (n,) are polynomials of degree k + 1 that join with
their first derivatives. The equations hold at the interval's k points of Gauss (113):

    q(t) = sum_b c_b B_b(t),    r(q, q', q'', t) = 0 at t_ij = t_i + h_i (1 + g_j) / 2.

The error at the mesh falls as h^(2k) for smooth motions (de Boor and Swartz 1973). The matrix of
Newton's method is a band as wide as one interval, so its cost is linear in the duration.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...signals import COLUMNS, Signal

POINTS = 4  # of Gauss in each interval


@dataclass(frozen=True)
class Mesh:
    """Ascending times `nodes` (N + 1,) [s] between which motions are polynomials (113)."""

    nodes: np.ndarray

    @cached_property
    def t(self) -> np.ndarray:
        """The points of Gauss (N POINTS,) [s]."""
        gauss = np.polynomial.legendre.leggauss(POINTS)[0]
        steps = np.diff(self.nodes)
        return (self.nodes[:-1, None] + steps[:, None] * (1 + gauss) / 2).ravel()

    @cached_property
    def weights(self) -> np.ndarray:
        """Of the points in integrals over time (N POINTS,) [s]."""
        weights = np.polynomial.legendre.leggauss(POINTS)[1]
        return (np.diff(self.nodes)[:, None] / 2 * weights).ravel()

    @property
    def count(self) -> int:
        """How many functions B_b there are."""
        return POINTS * (len(self.nodes) - 1) + 2

    @cached_property
    def values(self) -> np.ndarray:
        """B, B' and B'' at the points of Gauss (3, N POINTS, POINTS + 2): those functions that are
        not 0 there, of which the first is that of `first`."""
        return self._local(self.t, np.repeat(np.arange(len(self.nodes) - 1), POINTS))

    @cached_property
    def first(self) -> np.ndarray:
        """The number of the first function that is not 0 at each point (N POINTS,)."""
        return np.repeat(POINTS * np.arange(len(self.nodes) - 1), POINTS)

    @cached_property
    def ends(self) -> np.ndarray:
        """B, B' and B'' at the first and the last node (3, 2, POINTS + 2), as in `values`."""
        last = len(self.nodes) - 2
        return self._local(self.nodes[[0, -1]], np.array([0, last]))

    def at(self, t: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
        """q, q', q'' (3, T, n) at times t (T,) within the mesh, of coefficients (count, n)."""
        interval = np.clip(np.searchsorted(self.nodes, t, side="right") - 1, 0, len(self.nodes) - 2)
        own = coefficients[POINTS * interval[:, None] + np.arange(POINTS + 2)]
        return np.einsum("dtb,tbn->dtn", self._local(t, interval), own)

    def here(self, coefficients: np.ndarray) -> np.ndarray:
        """q, q', q'' (3, N POINTS, n) at the points of Gauss, of coefficients (count, n)."""
        own = coefficients[self.first[:, None] + np.arange(POINTS + 2)]
        return np.einsum("dtb,tbn->dtn", self.values, own)

    def signal(self, coefficients: np.ndarray) -> Signal:
        """The motion of coefficients (count,) as a Signal; the last segment is at rest."""
        u = np.linspace(0, 1, POINTS + 2)
        to_powers = np.linalg.inv(np.vander(u, increasing=True))
        steps = np.diff(self.nodes)
        count = len(steps)
        interval = np.repeat(np.arange(count), POINTS + 2)
        local = self._local((self.nodes[:-1, None] + steps[:, None] * u).ravel(), interval)[0]
        own = coefficients[POINTS * interval[:, None] + np.arange(POINTS + 2)]
        values = np.einsum("tb,tb->t", local, own).reshape(count, -1)
        rows = np.zeros((count + 1, COLUMNS))
        rows[:, 0] = self.nodes
        rows[:-1, 1 : POINTS + 3] = values @ to_powers.T / steps[:, None] ** np.arange(POINTS + 2)
        rows[-1, 1] = values[-1, -1]
        return Signal(rows, {"kind": "motion"})

    def through(self, values: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Coefficients (count, n) with given values (N POINTS, n) at the points of Gauss and `ends`
        (2, n) at both ends."""
        one = np.ones((len(self.t), 1, 1))
        matrix = self.band([one * 1.0, one * 0.0, one * 0.0], self.ends[0, :1], self.ends[0, 1:])
        return matrix.solve(np.vstack([ends[:1], values, ends[1:]]))

    def band(self, parts: list[np.ndarray], start: np.ndarray, end: np.ndarray) -> Band:
        """The matrix of linear equations for the coefficients.

        Args:
            parts: what multiplies q, q' and q'' at each point of Gauss, three arrays (T, n, n).
            start: equations of the first interval's coefficients (rows, (POINTS + 2) n).
            end: equations of the last interval's coefficients.
        """
        T, n, _ = parts[0].shape
        blocks = sum(
            part[:, :, None, :] * values[:, None, :, None]
            for part, values in zip(parts, self.values, strict=True)
        )
        wide = (POINTS + 2) * n
        rows = np.vstack([start, np.asarray(blocks).reshape(T * n, wide), end])
        first = np.concatenate(
            [
                np.zeros(len(start), dtype=int),
                np.repeat(self.first * n, n),
                np.full(len(end), (self.count - POINTS - 2) * n),
            ]
        )
        return Band(rows, first)

    def _local(self, t: np.ndarray, interval: np.ndarray) -> np.ndarray:
        """B, B' and B'' (3, T, POINTS + 2) at times t (T,) of the intervals with these numbers."""
        step = np.diff(self.nodes)
        h = step[interval]
        # C1 at the nodes: B-splines with knots of multiplicity POINTS, whose first and last
        # pieces depend on the steps of the neighbours
        before = step[np.maximum(interval - 1, 0)] * (interval > 0)
        after = step[np.minimum(interval + 1, len(step) - 1)] * (interval < len(step) - 1)
        return _pieces((t - self.nodes[interval]) / h, h, before, after)


def _pieces(u: np.ndarray, h: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """B, B', B'' (3, T, k + 2) at shares u (T,) of intervals of lengths h (T,) whose neighbours are
    `before` and `after` long (0: none).

    In Bernstein's polynomials of degree k + 1 the joints ask for one thing at each node: the
    coefficient there is the mean of the two beside it, weighted by the other interval's length.
    """
    p = POINTS + 1
    bernstein = np.zeros((3, len(u), p + 1))
    bernstein[0] = _bernstein(u, p)
    low = np.pad(_bernstein(u, p - 1), ((0, 0), (1, 1)))
    bernstein[1] = p * (low[:, :-1] - low[:, 1:]) / h[:, None]
    low = np.pad(_bernstein(u, p - 2), ((0, 0), (2, 2)))
    bernstein[2] = p * (p - 1) * (low[:, :-2] - 2 * low[:, 1:-1] + low[:, 2:]) / h[:, None] ** 2
    # free coefficients: k inner ones of each interval, and the outer ones of the first and last.
    # Function 0 is the last inner one of the interval before (or the first end), function k + 1
    # the first inner one of the interval after (or the last end).
    out = bernstein.copy()
    left, right = h / (before + h), h / (h + after)
    out[:, :, 0] = bernstein[:, :, 0] * np.where(before > 0, left, 1.0)
    out[:, :, 1] += bernstein[:, :, 0] * np.where(before > 0, 1 - left, 0.0)
    out[:, :, p] = bernstein[:, :, p] * np.where(after > 0, right, 1.0)
    out[:, :, p - 1] += bernstein[:, :, p] * np.where(after > 0, 1 - right, 0.0)
    return out


def _bernstein(u: np.ndarray, p: int) -> np.ndarray:
    """Bernstein's polynomials of degree p at u (T,), (T, p + 1)."""
    power = np.arange(p + 1)
    choose = np.array([math.comb(p, i) for i in power], dtype=float)
    return np.asarray(choose * u[:, None] ** power * (1 - u[:, None]) ** (p - power))


@dataclass(frozen=True)
class Band:
    """A square matrix of rows (R, wide) whose first entries stand in the columns `first` (R,)."""

    rows: np.ndarray
    first: np.ndarray

    def times(self, x: np.ndarray) -> np.ndarray:
        """Its product with x (R,) or (R, m)."""
        wide = self.rows.shape[1]
        return np.einsum("rw,rw...->r...", self.rows, x[self.first[:, None] + np.arange(wide)])

    def solve(self, right: np.ndarray) -> np.ndarray:
        """x with matrix x = right, (R,) or (R, m); rows are scaled to their largest entry.

        Raises: numpy.linalg.LinAlgError: the matrix is singular, or has an entry that is no number.
        """
        return self.factorised()(right)

    def factorised(self) -> Callable[[np.ndarray], np.ndarray]:
        """The function that solves for right sides; errors as in `solve`."""
        from scipy.sparse import csr_matrix
        from scipy.sparse.linalg import splu

        R, wide = self.rows.shape
        size = np.abs(self.rows).max(axis=1)
        if not np.all(np.isfinite(size) & (size > 0)):
            raise np.linalg.LinAlgError("a row is 0, or has an entry that is no number")
        column = self.first[:, None] + np.arange(wide)
        entries = ((self.rows / size[:, None]).ravel(), column.ravel(), np.arange(R + 1) * wide)
        matrix = csr_matrix(entries, shape=(R, R))
        matrix.eliminate_zeros()
        try:
            factors = splu(matrix.tocsc(), permc_spec="NATURAL")
        except RuntimeError as error:
            raise np.linalg.LinAlgError(str(error)) from None
        return lambda right: np.asarray(
            factors.solve(right / (size if right.ndim == 1 else size[:, None]))
        )
