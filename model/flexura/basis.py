"""The whole robot's own modes at one configuration: what exponential steps (`exponential.py`) solve exactly.

With M, K and D the mass, stiffness and damping at that configuration (position gains of the drives in K, friction and rate
gains in D), and a mode a row of Phi, Phi M Phi^T = 1 and Phi K Phi^T = diag(w2). Of Phi D Phi^T the diagonal d2 is kept. The
basis need not be exact and need not follow the robot: what it leaves out is integrated as a force. It is made again where it has
become poor.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .chain import SLEEVE, SLIDER, Chain, Work
from .compiled import compiled, inlined, internal
from .lanes import WIDTH, lanes, load, padded, room, store, total
from .newton_euler import mass
from .pinned import pinned

POOR = 0.25  # Frobenius' norm of Phi (M - M0) Phi^T, and of the change of K against w_i w_j, that is put up with
TURN_RAD, TRAVEL = 0.3, 0.02  # a configuration this far from the last looked at is looked at: an angle, a share of a length


class Basis(NamedTuple):
    """n unknowns in the solver's coordinates; joints whose motion is given have a mode of their own, e_k. Rows of matrices and
    the vectors below are made N long, a multiple of four, by zeros: modes that stay at rest."""

    phi: np.ndarray  # (n, N) the modes, one a row, slow ones first: y = sum_k eta_k phi_k
    rows: np.ndarray  # (n, N): eta = sum_i y_i rows_i, M phi^T
    w2: np.ndarray  # (N,) omega^2
    d2: np.ndarray  # (N,) twice the decay rate
    seen: np.ndarray  # (n,): the configuration looked at last
    M: np.ndarray  # (n, N), and below, workspace
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
    N = padded(n)
    b = Basis(**room(
        phi=(n, N), rows=(n, N), w2=N, d2=N, seen=n, M=(n, N), K=(n, N), D=(n, N), X=(n, N), A=(n, N), B=(n, N), unit=n, force=n,
        still=n, gravity=2,
    ))  # fmt: skip
    b.phi[:], b.seen[:] = np.eye(n, N), np.inf
    return b


@internal
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
    c, w, b, n = pinned(c), pinned(w), pinned(b), y.shape[0]
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
    for k in range(n):
        decay = lanes(0.0)
        for block in range(0, n, WIDTH):
            row, across = lanes(0.0), lanes(0.0)
            for i in range(n):
                row += b.phi[k, i] * load(b.M[i], block)
                across += b.phi[k, i] * load(b.D[i], block)
            store(b.X[k], block, row)
            decay += across * load(b.phi[k], block)
        b.d2[k] = total(decay)
    for k in range(n):
        for i in range(n):
            b.rows[i, k] = b.X[k, i]
    return True


@internal
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
                for j in range(end - e - 1):
                    b.K[row, e + 1 + j] = w.K[i, k, j]
                    b.D[row, e + 1 + j] = c.alpha[i] * w.M[i, k, j] + c.beta[i] * w.K[i, k, j]
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


@internal
def _congruence(b: Basis, A: np.ndarray, out: np.ndarray) -> None:
    """phi A phi^T of a symmetric A."""
    n = A.shape[0]
    for k in range(n):
        for block in range(0, n, WIDTH):
            row = lanes(0.0)
            for i in range(n):
                row += b.phi[k, i] * load(A[i], block)
            store(b.X[k], block, row)
    for k in range(n):
        for j in range(k + 1):
            both = lanes(0.0)
            for block in range(0, n, WIDTH):
                both += load(b.X[k], block) * load(b.phi[j], block)
            out[k, j] = out[j, k] = total(both)


@internal
def _again(b: Basis) -> None:
    """A new basis from the old one, in which M and K (A, B) are already nearly diagonal: Cholesky's M = l l^T, then Jacobi's
    rotations of l^-1 K l^-T."""
    n, M, K, phi = b.seen.shape[0], b.A, b.B, b.phi
    for i in range(n):
        for j in range(i + 1):
            rest = M[i, j]
            for k in range(j):
                rest -= M[i, k] * M[j, k]
            M[i, j] = np.sqrt(rest) if i == j else rest / M[j, j]
    for i in range(n):  # rows of l^-1 K and of l^-1 phi, then columns
        for k in range(i):
            _less(K, i, k, M[i, k], n)
            _less(phi, i, k, M[i, k], n)
        for block in range(0, n, WIDTH):
            store(K[i], block, load(K[i], block) / M[i, i])
            store(phi[i], block, load(phi[i], block) / M[i, i])
    for j in range(n):
        for i in range(n):
            for k in range(j):
                K[i, j] -= M[j, k] * K[i, k]
            K[i, j] /= M[j, j]
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
    for i in range(n):  # slow modes first
        b.w2[i] = max(K[i, i], 0.0)
        for k in range(i, 0, -1):
            if b.w2[k] >= b.w2[k - 1]:
                break
            b.w2[k], b.w2[k - 1] = b.w2[k - 1], b.w2[k]
            _turn(phi, k - 1, k, 0.0, 1.0)


@inlined
def _less(A: np.ndarray, i: int, k: int, factor: float, n: int) -> None:
    """Row i of A less a multiple of row k."""
    for block in range(0, n, WIDTH):
        store(A[i], block, load(A[i], block) - factor * load(A[k], block))


@inlined
def _turn(A: np.ndarray, p: int, q: int, cos: float, sin: float) -> None:
    """Rows p and q of A, turned against each other."""
    for block in range(0, A.shape[1], WIDTH):
        a, b = load(A[p], block), load(A[q], block)
        store(A[p], block, cos * a - sin * b)
        store(A[q], block, sin * a + cos * b)


@internal
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
    _turn(K, p, q, cos, sin)
    _turn(phi, p, q, cos, sin)
