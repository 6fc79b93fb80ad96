"""The internal dynamics of a robot whose tip is held: transmission zeros, and what is bounded."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

ON_AXIS = 1e-6  # of |s|: a zero whose real part is smaller does not decay in either direction


@dataclass(frozen=True)
class ZeroDynamics:
    """Small motions z = e - e0 of the elastic unknowns about an equilibrium while the outputs stay
    where they are (114).

    A z'' + B z' + C z = 0, of the rows that no drive pushes, in the motions that move no output.
    Its eigenvalues are the transmission zeros. `zeros` (2k,) [1/s] by magnitude; `decaying` and
    `growing`: rows (., 2k) that, times (z, z'), give what must be 0 at the start and at the end of
    a bounded motion.
    """

    zeros: np.ndarray
    decaying: np.ndarray
    growing: np.ndarray

    @property
    def on_axis(self) -> np.ndarray:
        """Zeros on the imaginary axis [1/s]: no bounded motion of the joints goes with them."""
        return self.zeros[np.abs(self.zeros.real) <= ON_AXIS * np.abs(self.zeros)]

    def rate(self, sign: int) -> float:
        """The slowest rate [1/s] at which what is before (sign 1) or after (-1) the path fades."""
        real = sign * self.zeros.real
        fades = real > ON_AXIS * np.abs(self.zeros)
        return float(real[fades].min(initial=np.inf))


def zero_dynamics(
    M: np.ndarray,
    G: np.ndarray,
    K: np.ndarray,
    output: np.ndarray,
    elastic: np.ndarray,
    joints: np.ndarray,
) -> ZeroDynamics:
    """The zero dynamics of M q'' + G q' + K q = drives with outputs `output` (m, n) q.

    Args: M, G, K (n, n); output (m, n); elastic (k,) and joints (m,): the rows of q.

    Raises: numpy.linalg.LinAlgError: the joints do not move the outputs in all directions.
    """
    from scipy.linalg import schur

    k = len(elastic)
    if k == 0:
        none = np.zeros((0, 0))
        return ZeroDynamics(np.zeros(0, dtype=complex), none, none)
    size = 1 / np.sqrt(np.abs(np.diag(K)[elastic]) + 1e-300)
    N = np.zeros((len(M), k))
    N[elastic] = np.diag(size)
    N[joints] = -np.linalg.solve(output[:, joints], output[:, elastic] * size)
    A, B, C = (size[:, None] * (X[elastic] @ N) for X in (M, G, K))
    X = np.block([[np.zeros((k, k)), np.eye(k)], [-np.linalg.solve(A, np.hstack([C, B]))]])
    zeros = np.linalg.eigvals(X)
    scale = np.append(1 / size, 1 / size)
    sides = []
    for side in ("lhp", "rhp"):
        _, vectors, count = schur(X.T, output="real", sort=side)
        sides.append(vectors[:, :count].T * scale)
    order = np.argsort(np.abs(zeros), kind="stable")
    return ZeroDynamics(zeros[order], *sides)
