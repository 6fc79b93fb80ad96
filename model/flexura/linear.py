"""Natural frequencies: about a configuration at rest, or about a steady rotation."""

from __future__ import annotations

from typing import Any

import numpy as np

from .errors import InputError
from .statics import static
from .system import System, jacobian


def frequencies(system: System, q: Any = None, joints: str = "locked", *, qd: Any = None) -> np.ndarray:
    """Natural frequencies [Hz], ascending, of the undamped robot linearised about q (n,).

    By default q is the static equilibrium at the start. `joints`: "locked" (only the elastic unknowns move) or "free" (rigid
    modes come out as 0). `qd` (n,): joint rates of a steady motion about which to linearise, for example a rotation at constant
    speed, joints locked to it: centrifugal stiffening is then in the result, d(forces)/dq and d(forces)/dqd at (q, qd).
    Frequencies of unstable directions come out as 0.
    """
    if joints not in ("locked", "free"):
        raise InputError('expected "locked" or "free"', key="joints", value=joints)
    at = static(system) if q is None else system._check(q)
    rates = np.zeros(system.n) if qd is None else system._check(qd)
    rows = system.elastic_rows if joints == "locked" else system.free_rows
    if len(rows) == 0:
        return np.zeros(0)
    pick = np.ix_(rows, rows)
    zero = np.zeros(system.n)
    # in the solver's coordinates the elastic block of M is well scaled
    T, S = system.transform, system.to_solver

    def forces(y: np.ndarray, v: np.ndarray) -> np.ndarray:
        z = T @ y
        return T.T @ (system._inverse(z, T @ v, zero, system.chain.gravity)) + K0 @ y

    K0 = T.T @ system.stiffness() @ T
    y, v = S @ at, S @ rates
    M = (T.T @ system.mass(at) @ T)[pick]
    K = jacobian(lambda z: forces(z, v), y)[pick]
    if qd is None:
        from scipy.linalg import eigh

        squares = eigh((K + K.T) / 2, M, eigvals_only=True)
        squares[np.abs(squares) < 1e-7 * max(squares[-1], 1.0) * (joints == "free")] = 0.0
        return np.sqrt(np.maximum(squares, 0.0)) / (2 * np.pi)
    G = jacobian(lambda u: forces(y, u), v)[pick]
    n = len(rows)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, G)]])
    values = np.linalg.eigvals(A).imag
    return np.sort(values[values >= 0])[-n:] / (2 * np.pi)
