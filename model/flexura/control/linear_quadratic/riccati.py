"""The linear model over a tick, and Riccati's equation of feedback and estimator."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...errors import InputError
from ...io import array


def discretised(A: np.ndarray, B: np.ndarray, T: float) -> tuple[np.ndarray, np.ndarray]:
    """F (n, n) and G (n, m) of a tick of T seconds, over which the inputs are held (74).

    Raises:
        InputError: they are no finite numbers, as of a motion that grows without bound in a tick.
    """
    from scipy.linalg import expm

    n, m = B.shape
    with np.errstate(over="ignore", invalid="ignore"):
        exponential = expm(np.block([[A, B], [np.zeros((m, n + m))]]) * T)
    if not np.isfinite(exponential).all():
        expected = "expected shorter ticks: the linear model has no finite numbers over one"
        raise InputError(expected, key="rate_Hz", value=1 / T)
    return exponential[:n, :n], exponential[:n, n:]


# the largest and the smallest deviation whose square is a number with room for products
LEAST, MOST = 1e-100, 1e100
SOUGHT = {  # by the first of the arguments that Riccati's equation comes from
    "effort": "effort, position, deflection and damping that a stable regulator exists for, at "
    "this rate_Hz",
    "noise": "measurements, noise and disturbance that a stable estimator exists for, at this "
    "rate_Hz",
}


def riccati(F: np.ndarray, G: np.ndarray, Q: np.ndarray, R: np.ndarray, key: str) -> np.ndarray:
    """The stabilising solution of P = Q + F^T P (F - G K) (75), of the regulator (`key`: "effort")
    or the estimator ("noise"). Raises InputError.

    SciPy's balancing sometimes makes its reordering fail. The equation is then solved without it.
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
    raise InputError(f"expected {SOUGHT[key]}", key=key)


def deviations(value: Any, count: int, key: str) -> np.ndarray:
    """Standard deviations as an array (count,), each above 0; one number stands for all. Raises
    InputError, with `key`."""
    expected = f"expected a number above 0, or {count} of them"
    found = array(value, key, expected)
    if found.shape not in ((), (count,)) or not np.all((found > LEAST) & (found < MOST)):
        raise InputError(expected, key=key, value=value)
    return np.broadcast_to(found, (count,))
