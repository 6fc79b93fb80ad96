"""The linear part of a robot's equations, solved in closed form over a step: modes, and functions
of their matrix.

In the modes at one configuration, eta'' + C eta' + w^2 eta = N with C = Phi^T D Phi (88). C
is kept whole: damping that couples modes is in the linear part. With y = (eta, eta'), y' = L y +
(0, N), and N = sum_p f_p (t/h)^p, the variation of constants (89) gives

    y(h) = e^(Lh) y(0) + sum_p h p! phi_(p+1)(Lh) (0, f_p),     phi_k(X) = sum_j X^j / (j + k)!

These functions are found from their series at h / 2^s, where Lh is small, and doubled (Higham,
Functions of Matrices, 10.7):

    phi_k(2X) = 2^-k ( e^X phi_k(X) + sum_(j=1..k) phi_j(X) / (k - j)! ),
    e^2X - 1 = 2 (e^X - 1) + (e^X - 1)^2.                                              (99)

The second form keeps the digits of slow modes beside those of fast ones. Accounts stand behind y:
their rates are behind N.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

FREE = 1e-4  # w^2 below this is none [rad^2/s^2]
POOR = 0.05  # the change of M, K and C in the modes that is put up with (94)
MOST = 200  # tables that are kept
AHEAD = 3  # how often longer a step is doubled than the one that is asked for: steps grow
TERMS = 18  # of the series, where no row sum of Lh is above 1


class Table(NamedTuple):
    """A step of length h, with i accounts: y(h) = free y(0) + sum_p forced[p] f_p (89); (2m + i,
    2m + i), (powers, 2m + i, m + i)."""

    free: np.ndarray
    forced: np.ndarray


class Modes:
    """The modes of the free rows at q0 (m,), with M, K, D (m, m) there (87).

    w2 (m,) [rad^2/s^2]; (q, v, accounts) = origin + out y, y = into ((q, v, accounts) - origin),
    and N = rows a + linear y.

    Args:
        M: mass matrix (m, m).
        K: stiffness matrix (m, m).
        D: damping matrix (m, m).
        q0: configuration of the free rows (m,).
        powers: of time in N.
        accounts: how many there are.
    """

    def __init__(
        self,
        M: np.ndarray,
        K: np.ndarray,
        D: np.ndarray,
        q0: np.ndarray,
        powers: int,
        accounts: int,
    ) -> None:
        from scipy.linalg import block_diag, eigh

        squares, self.phi = eigh((K + K.T) / 2, M)
        self.w2 = np.where(squares > max(FREE, 1e-14 * squares[-1]), squares, 0.0)
        self.rows, self.C = self.phi.T @ M, self.phi.T @ D @ self.phi
        self.m, self.powers, self.accounts = len(q0), powers, accounts
        self.origin, one = np.concatenate([q0, np.zeros(self.m + accounts)]), np.eye(accounts)
        self.out, self.into = (
            block_diag(self.phi, self.phi, one),
            block_diag(self.rows, self.rows, one),
        )
        self.linear = np.hstack([np.diag(self.w2), self.C, np.zeros((self.m, accounts))])
        self._tables: dict[float, Table] = {}

    def poor(self, M: np.ndarray, K: np.ndarray, D: np.ndarray, slow: float) -> bool:
        """Whether the robot's matrices have changed too much (94); `slow` [rad/s] is the frequency
        that is as good as zero."""
        w, d = np.maximum(np.sqrt(self.w2), slow), np.sqrt(np.maximum(np.diag(self.C), slow))
        changes = (
            self.phi.T @ M @ self.phi - np.eye(self.m),
            (self.phi.T @ K @ self.phi - np.diag(self.w2)) / np.outer(w, w),
            (self.phi.T @ D @ self.phi - self.C) / np.outer(d, d),
        )
        return max(float(np.linalg.norm(change)) for change in changes) > POOR

    def table(self, h: float) -> Table:
        """The table of a step of length h [s]; those of h / 2, h / 4, ... are found with it."""
        if h not in self._tables:
            if len(self._tables) > MOST:
                self._tables.clear()
            self._double(h * 2.0**AHEAD)
        return self._tables[h]

    def halvings(self, h: float) -> int:
        """How often h is to be halved until no mode turns by more than a radian, or decays by
        much."""
        return max(0, math.ceil(math.log2(float(np.abs(self._matrix(h)[0]).sum(axis=1).max()))))

    def _matrix(self, h: float) -> tuple[np.ndarray, np.ndarray]:
        """L h, with eta in units in which it is balanced, and these units (2m,)."""
        m, size = self.m, np.maximum(np.sqrt(self.w2), 1 / h)
        X = np.zeros((2 * m, 2 * m))
        X[:m, m:], X[m:, :m], X[m:, m:] = (
            np.diag(size * h),
            np.diag(-self.w2 * h / size),
            -self.C * h,
        )
        return X, np.concatenate([size, np.ones(m)])

    def _double(self, h: float) -> None:
        """The tables of h, h / 2, ..., h / 2^levels (99)."""
        levels, count, one = max(self.halvings(h), AHEAD), self.powers, np.eye(2 * self.m)
        X, size = self._matrix(h)
        X = X / 2.0**levels
        term = one / math.factorial(count)
        last = term.copy()
        for j in range(1, TERMS):
            term = term @ X / (count + j)
            last += term
        phis = [last]
        for k in range(count - 1, 0, -1):
            phis.append(X @ phis[-1] + one / math.factorial(k))
        rise, phi, half = (
            X @ phis[-1],
            np.stack(phis[::-1])[:, :, self.m :],
            2.0 ** -np.arange(1, count + 1),
        )
        mix = np.array(
            [
                [half[i] / math.factorial(i - j) if i >= j else 0.0 for j in range(count)]
                for i in range(count)
            ]
        )
        for level in range(levels, -1, -1):
            self._tables[h / 2.0**level] = self._table(one + rise, phi, size, h / 2.0**level)
            if level:
                phi = half[:, None, None] * (phi + rise @ phi) + np.tensordot(mix, phi, 1)
                rise = 2 * rise + rise @ rise

    def _table(self, free: np.ndarray, phi: np.ndarray, size: np.ndarray, h: float) -> Table:
        m, last, p = self.m, range(self.accounts), np.arange(self.powers)
        whole, forced = (
            np.eye(2 * m + len(last)),
            np.zeros((self.powers, 2 * m + len(last), m + len(last))),
        )
        whole[: 2 * m, : 2 * m] = free * size / size[:, None]
        factors = h * np.array([math.factorial(k) for k in p])
        forced[:, : 2 * m, :m] = factors[:, None, None] * phi / size[:, None]
        for i in last:
            forced[:, 2 * m + i, m + i] = h / (p + 1)
        return Table(whole, forced)
