"""Nonlinear least squares with confidence intervals that hold where residuals hang together.

    minimise sum r_t(p)^2,   cov p = H^-1 S H^-1,   H = J^T J,   S = sum_l w_l sum_t (g_t g_{t-l}^T
    + transposed),  g_t = J_t r_t

with w_l = 1 - l/(m + 1): Newey & West, Econometrica 55 (1987) 703. Residuals of a mechanical model
are no white noise: what the model lacks rings as the strip does, so that m must span some periods.
White residuals give back s^2 (J^T J)^-1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

NORMAL_95 = 1.959964


@dataclass(frozen=True)
class Unknown:
    """One number to be found: where to begin, the step of its differences, its bounds. A `factor`
    is found by its logarithm."""

    name: str
    start: float
    step: float
    bounds: tuple[float, float]
    factor: bool = True

    def inner(self, value: float) -> float:
        return float(np.log(value)) if self.factor else value

    def outer(self, inner: float) -> float:
        return float(np.exp(inner)) if self.factor else inner


@dataclass(frozen=True)
class Found:
    """The values (k,) by name, the covariance (k, k) of the inner ones (logarithms of factors),
    residuals by series (s, T) and their derivatives (k, s, T)."""

    unknowns: tuple[Unknown, ...]
    values: dict[str, float]
    covariance: np.ndarray
    residuals: np.ndarray
    derivatives: np.ndarray
    evaluations: int

    def doubted(self, change: np.ndarray) -> Found:
        """With the covariance that is due to a doubt about the model: `change` (s, T) of its
        residuals is one standard deviation.

        The shift of the inner values that such a change would cause, -(J^T J)^-1 J^T change, is
        added as an error of its own.
        """
        J = self.derivatives.reshape(len(self.unknowns), -1)
        scale = np.linalg.norm(J, axis=1)
        shift, *_ = np.linalg.lstsq((J / scale[:, None]).T, -change.ravel(), rcond=None)
        shift /= scale
        return replace(self, covariance=self.covariance + np.outer(shift, shift))

    def deviation(self, name: str) -> float:
        """Standard deviation of the inner value: of a factor relative to it."""
        k = [u.name for u in self.unknowns].index(name)
        return float(np.sqrt(self.covariance[k, k]))

    def interval(self, name: str) -> tuple[float, float]:
        """The 95 % interval."""
        unknown = next(u for u in self.unknowns if u.name == name)
        middle, wide = unknown.inner(self.values[name]), NORMAL_95 * self.deviation(name)
        return unknown.outer(middle - wide), unknown.outer(middle + wide)


def estimate(
    model: Callable[[dict[str, float]], np.ndarray],
    unknowns: Sequence[Unknown],
    memory: int,
    together: dict[str, dict[str, float]] | None = None,
    most: int = 12,
) -> Found:
    """Fit `model(values) -> residuals (s, T)` in units of their noise. `memory`: samples over which
    they may hang together.

    `together`: for a name, by how much others are moved with it when the derivatives are taken, per
    unit of its inner value: where two unknowns do nearly the same, the difference between them
    needs a step of its own, far longer than either alone may be. Ends where a step gains less than
    1e-4 of the sum of squares, or after `most` steps.
    """
    from scipy.optimize import least_squares

    count = 0

    def outer(inner: np.ndarray) -> dict[str, float]:
        return {u.name: u.outer(x) for u, x in zip(unknowns, inner, strict=True)}

    def residuals(inner: np.ndarray) -> np.ndarray:
        nonlocal count
        count += 1
        return model(outer(inner))

    names = [u.name for u in unknowns]
    along = np.diag([u.step for u in unknowns])  # (k, k), a row for each step
    for name, others in (together or {}).items():
        for other, share in others.items():
            along[names.index(name), names.index(other)] = (
                share * along[names.index(name), names.index(name)]
            )

    def differences(inner: np.ndarray) -> np.ndarray:
        base = residuals(inner)
        changes = np.array([residuals(inner + step) - base for step in along])
        return np.linalg.solve(along, changes.reshape(len(along), -1)).reshape(changes.shape)

    start = np.array([u.inner(u.start) for u in unknowns])
    bounds = np.array([[u.inner(edge) for edge in u.bounds] for u in unknowns]).T
    scale = np.array([u.step for u in unknowns])
    found = least_squares(
        lambda x: residuals(x).ravel(),
        start,
        lambda x: differences(x).reshape(len(x), -1).T,
        tuple(bounds),
        x_scale=scale,
        ftol=1e-4,
        xtol=1e-7,
        gtol=1e-9,
        max_nfev=most,
    )
    last = residuals(found.x)
    J = differences(found.x)  # (k, s, T)
    return Found(tuple(unknowns), outer(found.x), covariance(J, last, memory), last, J, count)


def covariance(J: np.ndarray, residuals: np.ndarray, memory: int) -> np.ndarray:
    """The covariance (k, k) of the values, J (k, s, T), residuals (s, T)."""
    scores = (J * residuals).sum(axis=1)  # (k, T)
    inside = scores @ scores.T
    for lag in range(1, min(memory, scores.shape[1] - 1) + 1):
        both = scores[:, lag:] @ scores[:, :-lag].T
        inside += (1 - lag / (memory + 1)) * (both + both.T)
    scale = np.sqrt(np.einsum("ist,ist->i", J, J))
    A = J.reshape(len(J), -1) / scale[:, None]
    bread = np.linalg.inv(A @ A.T) / np.outer(scale, scale)
    return bread @ inside @ bread
