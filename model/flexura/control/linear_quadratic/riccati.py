"""The linear model over a tick, and Riccati's equation of feedback and estimator."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...errors import InputError
from ...io import array


def discretised(A: np.ndarray, B: np.ndarray, T: float) -> tuple[np.ndarray, np.ndarray]:
    """F (n, n) and G (n, m) of a tick of T seconds, over which the inputs are held (74)."""
    from scipy.linalg import expm

    n, m = B.shape
    exponential = expm(np.block([[A, B], [np.zeros((m, n + m))]]) * T)
    return exponential[:n, :n], exponential[:n, n:]


def riccati(F: np.ndarray, G: np.ndarray, Q: np.ndarray, R: np.ndarray, key: str) -> np.ndarray:
    """The stabilising solution of P = Q + F^T P (F - G K) (75). Raises InputError.

    SciPy's balancing sometimes spoils its reordering: then without.
    """
    from scipy.linalg import solve_discrete_are

    for balanced in (True, False):
        try:
            P = solve_discrete_are(F, G, Q, R, balanced=balanced)
        except (np.linalg.LinAlgError, ValueError):
            continue
        if (
            np.abs(np.linalg.eigvals(F - G @ np.linalg.solve(R + G.T @ P @ G, G.T @ P @ F))).max()
            < 1
        ):
            return P
    raise InputError(
        "expected weights and measurements that a stabilising controller exists for", key=key
    )


def deviations(value: Any, count: int, key: str) -> np.ndarray:
    """Numbers above 0, one or `count` of them, (count,). Raises InputError."""
    expected = f"expected a number above 0, or {count} of them"
    found = array(value, key, expected)
    if found.shape not in ((), (count,)) or not np.all(found > 0):
        raise InputError(expected, key=key, value=value)
    return np.broadcast_to(found, (count,))
