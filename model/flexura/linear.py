"""Natural frequencies: about a configuration at rest, or about a steady rotation."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import nodal
from .errors import InputError
from .statics import static
from .system import System


def frequencies(system: System, q: Any = None, joints: str = "locked", *, qd: Any = None) -> np.ndarray:
    """Natural frequencies [Hz], ascending, of the undamped robot linearised about q (n,).

    By default q is the static equilibrium at the start. `joints`: "locked" (only the elastic unknowns move) or "free" (rigid
    modes come out as 0). `qd` (n,): joint rates of a steady motion about which to linearise, for example a rotation at constant
    speed, joints locked to it: centrifugal stiffening is then in the result, d(forces)/dq and d(forces)/dqd at (q, qd).
    Frequencies of unstable directions come out as 0.
    """
    if joints not in ("locked", "free"):
        raise InputError('expected "locked" or "free"', key="joints", value=joints)
    if system.robot.nodal:
        whole = static(system) if q is None else np.asarray(q, dtype=float)
        piece = nodal.at(system, whole)
        spin = None if qd is None else piece.rates(np.asarray(qd, dtype=float))
        return frequencies(piece.system, piece.part(whole), joints, qd=spin)
    at = static(system) if q is None else system._check(q)
    rates = np.zeros(system.n) if qd is None else system._check(qd)
    rows = system.elastic_rows if joints == "locked" else system.free_rows
    if len(rows) == 0:
        return np.zeros(0)
    pick = np.ix_(rows, rows)
    T, S = system.transform, system.to_solver  # in the solver's coordinates the elastic block of M is well scaled
    y, v = S @ at, S @ rates
    M = (T.T @ system.mass(at) @ T)[pick]
    K = (system.modal_stiffness + system.differences(lambda z: system.residual(z, v), y))[pick]
    if qd is None:
        from scipy.linalg import eigh

        squares = eigh((K + K.T) / 2, M, eigvals_only=True)
        rigid = len(system.free_rows) - len(system.elastic_rows) if joints == "free" and not system.chain.gravity.any() else 0
        squares[:rigid] = 0.0  # without gravity nothing holds a free joint
        return np.sqrt(np.maximum(squares, 0.0)) / (2 * np.pi)
    G = system.differences(lambda u: system.residual(y, u), v, 1e3)[pick]
    n = len(rows)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, G)]])
    values = np.linalg.eigvals(A).imag
    return np.sort(values[values >= 0])[-n:] / (2 * np.pi)
