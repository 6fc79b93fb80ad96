"""The whole robot's own modes at one configuration: what exponential steps (`exponential.py`) solve exactly.

With M, K and D the mass, stiffness and damping at that configuration (position gains of the drives in K, friction and rate
gains in D), Phi^T M Phi = 1 and Phi^T K Phi = diag(w2). Of Phi^T D Phi the diagonal d2 is kept. The basis need not be exact and
need not follow the robot: what it leaves out is integrated as a force. It is made again where it has become poor.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .chain import SLEEVE, SLIDER, Chain, Work
from .compiled import compiled, inlined
from .newton_euler import mass

POOR = 0.25  # Frobenius' norm of Phi^T (M - M0) Phi, and of the change of K against w_i w_j, that is put up with
TURN_RAD, TRAVEL = 0.3, 0.02  # a configuration this far from the last looked at is looked at: an angle, a share of a length


class Basis(NamedTuple):
    """n unknowns in the solver's coordinates; joints whose motion is given have a mode of their own, e_k."""

    phi: np.ndarray  # (n, n): y = phi eta
    rows: np.ndarray  # (n, n): eta = rows y, phi^T M
    w2: np.ndarray  # (n,) omega^2
    d2: np.ndarray  # (n,) twice the decay rate
    seen: np.ndarray  # (n,): the configuration looked at last
    M: np.ndarray  # (n, n), and below, workspace
    K: np.ndarray
    D: np.ndarray
    X: np.ndarray
    A: np.ndarray  # M and
    B: np.ndarray  # K in the modes
    unit: np.ndarray  # (n,)
    force: np.ndarray
    still: np.ndarray
    gravity: np.ndarray  # (2,) zero


def basis(n: int) -> Basis:
    z = np.zeros
    return Basis(
        np.eye(n), z((n, n)), z(n), z(n), np.full(n, np.inf), z((n, n)), z((n, n)), z((n, n)), z((n, n)),
        z((n, n)), z((n, n)), z(n), z(n), z(n), z(2),
    )  # fmt: skip


@inlined
def moved(c: Chain, b: Basis, y: np.ndarray) -> bool:
    """Has the robot gone far since the basis was last looked at?"""
    turned = 0.0
    for i in range(c.kind.shape[0]):
        e = c.first[i]
        change = abs(y[e] - b.seen[e])
        if not change < np.inf:
            return True
        if c.kind[i] == SLEEVE and change > TRAVEL * 0.5 * b.seen[e]:
            return True
        if c.kind[i] == SLIDER and i > 0 and change > TRAVEL * c.length[i - 1]:
            return True
        if c.kind[i] != SLEEVE and c.kind[i] != SLIDER:
            turned += change
    return turned > TURN_RAD


@compiled
def look(c: Chain, w: Work, b: Basis, kp: np.ndarray, kd: np.ndarray, y: np.ndarray, rate: float) -> bool:
    """Make the basis if there is none, or if at y it is poor; true if so. `rate` [rad/s]: slower modes are as good as rigid."""
    n = y.shape[0]
    none = not b.seen[0] < np.inf
    for k in range(n):
        b.seen[k] = y[k]
    _matrices(c, w, b, kp, kd, y)
    _congruence(b, b.M, b.A)
    _congruence(b, b.K, b.B)
    inertia, stiffness = 0.0, 0.0
    for i in range(n):
        for j in range(n):
            same = 1.0 if i == j else 0.0
            change = b.B[i, j] - same * b.w2[i]
            inertia += (b.A[i, j] - same) ** 2
            stiffness += change * change / (max(b.w2[i], rate * rate) * max(b.w2[j], rate * rate))
    if not none and max(inertia, stiffness) < POOR * POOR:
        return False
    _again(b)
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(n):
                total += b.phi[k, i] * b.M[k, j]
            b.rows[i, j] = total
    for i in range(n):
        total = 0.0
        for k in range(n):
            for j in range(n):
                total += b.phi[k, i] * b.D[k, j] * b.phi[j, i]
        b.d2[i] = total
    return True


@compiled
def _matrices(c: Chain, w: Work, b: Basis, kp: np.ndarray, kd: np.ndarray, y: np.ndarray) -> None:
    """M, K and D at y: M by one inverse dynamics for each unknown."""
    n = y.shape[0]
    for k in range(n):
        b.unit[k], b.still[k] = 0.0, 0.0
    mass(c, w, y, b.still, b.unit, b.gravity, b.force, b.X)
    for k in range(n):
        for j in range(n):
            b.K[k, j], b.D[k, j] = 0.0, 0.0
    for i in range(c.kind.shape[0]):
        e, end = c.first[i], c.first[i + 1]
        b.K[e, e], b.D[e, e] = kp[i], kd[i] + c.viscous[i]
        for k in range(end - e - 1):
            row = e + 1 + k
            if c.kind[i] == SLEEVE:
                for j in range(k + 1):
                    damping = c.alpha[i] * w.M[i, k, j] + c.beta[i] * w.K[i, k, j]
                    b.K[row, e + 1 + j] = b.K[e + 1 + j, row] = w.K[i, k, j]
                    b.D[row, e + 1 + j] = b.D[e + 1 + j, row] = damping
            else:
                b.K[row, row], b.D[row, row] = c.lam[i, k], c.damp[i, k]
    for k in range(n):
        for j in range(n):
            b.M[k, j] = 0.5 * (b.X[k, j] + b.X[j, k])
    for i in range(c.kind.shape[0]):
        if w.held[i]:
            e = c.first[i]
            for j in range(n):
                b.M[e, j] = b.M[j, e] = b.K[e, j] = b.K[j, e] = b.D[e, j] = b.D[j, e] = 0.0
            b.M[e, e] = 1.0


@compiled
def _congruence(b: Basis, A: np.ndarray, out: np.ndarray) -> None:
    """phi^T A phi."""
    n = A.shape[0]
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(n):
                total += A[i, k] * b.phi[k, j]
            b.X[i, j] = total
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(n):
                total += b.phi[k, i] * b.X[k, j]
            out[i, j] = total


@compiled
def _again(b: Basis) -> None:
    """A new basis from the old one, in which M and K (A, B) are already nearly diagonal: Cholesky's M = l l^T, then Jacobi's
    rotations of l^-1 K l^-T."""
    n, M, K, phi = b.w2.shape[0], b.A, b.B, b.phi
    for i in range(n):
        for j in range(i + 1):
            total = M[i, j]
            for k in range(j):
                total -= M[i, k] * M[j, k]
            M[i, j] = np.sqrt(total) if i == j else total / M[j, j]
    for i in range(n):  # rows of l^-1 K, then columns; phi l^-T
        for j in range(n):
            for k in range(i):
                K[i, j] -= M[i, k] * K[k, j]
            K[i, j] /= M[i, i]
    for j in range(n):
        for i in range(n):
            for k in range(j):
                K[i, j] -= M[j, k] * K[i, k]
                phi[i, j] -= M[j, k] * phi[i, k]
            K[i, j] /= M[j, j]
            phi[i, j] /= M[j, j]
    for _ in range(30):
        off, size = 0.0, 0.0
        for i in range(n):
            size += K[i, i] * K[i, i]
            for j in range(i):
                off += K[i, j] * K[i, j]
        if off <= 1e-30 * size:
            break
        for p in range(n):
            for q in range(p + 1, n):
                _rotate(K, phi, p, q)
    for i in range(n):
        b.w2[i] = max(K[i, i], 0.0)


@compiled
def _rotate(K: np.ndarray, phi: np.ndarray, p: int, q: int) -> None:
    """Jacobi's rotation that makes K[p, q] zero."""
    if K[p, q] == 0.0:
        return
    theta = (K[q, q] - K[p, p]) / (2.0 * K[p, q])
    tan = 1.0 / (abs(theta) + np.sqrt(theta * theta + 1.0))
    if theta < 0.0:
        tan = -tan
    cos = 1.0 / np.sqrt(tan * tan + 1.0)
    sin = tan * cos
    for k in range(K.shape[0]):
        K[k, p], K[k, q] = cos * K[k, p] - sin * K[k, q], sin * K[k, p] + cos * K[k, q]
        phi[k, p], phi[k, q] = cos * phi[k, p] - sin * phi[k, q], sin * phi[k, p] + cos * phi[k, q]
    for k in range(K.shape[0]):
        K[p, k], K[q, k] = cos * K[p, k] - sin * K[q, k], sin * K[p, k] + cos * K[q, k]
