"""A link's own modes: the coordinates in which its mass matrix is the identity and its stiffness is diagonal."""

from __future__ import annotations

import numpy as np

from .beam import LinkIntegrals


def modal(links: LinkIntegrals, modes: int | None, loaded: bool) -> tuple[LinkIntegrals, np.ndarray]:
    """B links in mass-normalised modal coordinates, and the eigenvalues omega^2 (B, m) [rad^2/s^2], ascending.

    With `modes` None all of the mesh's modes are kept: an exact change of coordinates. Otherwise the lowest `modes`
    clamped modes, and, where another link is attached to the tip (`loaded`), the two static shapes K^-1 phi(L) and
    K^-1 phi'(L): a joint's force and moment bend the tip in a way to which a series of clamped modes converges slowly
    (the second joint of an RR arm is 10 to 30 times more accurate with them).
    """
    size = links.S0.shape[1]
    if size == 0:
        return links, np.zeros((len(links.S0), 0))
    values, vectors = eigh(links.K, links.M)
    if modes is not None and modes + 2 * loaded < size:
        basis, values = vectors[:, :, :modes], values[:, :modes]
        if loaded:
            static = np.linalg.solve(links.K, np.stack([links.NL, links.SL], axis=2))
            for _ in range(2):  # what the modes have of them left out, so that M stays 1 to round-off
                static = static - basis @ (np.swapaxes(basis, 1, 2) @ (links.M @ static))
            weight = (static * (links.M @ static)).sum(axis=1)
            basis = np.concatenate([basis, static / np.sqrt(weight)[:, None, :]], axis=2)
            reduced = links.changed(basis)
            values, mixed = eigh(reduced.K, reduced.M)
            basis = basis @ mixed
        vectors = basis
    sign = np.where((links.NL[:, None, :] @ vectors) < 0, -1.0, 1.0)  # the tip moves to +w
    return links.changed(vectors * sign), values


def eigh(K: np.ndarray, M: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """lambda (B, m), ascending, and V (B, m, m) of K V = M V diag(lambda), V^T M V = 1, of B symmetric pairs, M positive.

    By M = R R^T and the symmetric problem of R^-1 K R^-T.
    """
    R = np.linalg.inv(np.linalg.cholesky(M))
    values, vectors = np.linalg.eigh(R @ K @ np.swapaxes(R, -1, -2))
    return values, np.swapaxes(R, -1, -2) @ vectors
