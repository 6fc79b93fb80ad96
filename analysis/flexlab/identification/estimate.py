"""Nonlinear least squares with confidence intervals for autocorrelated residuals.

    minimise sum r_t(p)^2,   cov p = H^-1 S H^-1,   H = J^T J,   g_t = J_t r_t,
    S = sum_l w_l sum_t (g_t g_{t-l}^T + transposed),   w_l = 1 - l/(m + 1)

(Newey and West, Econometrica 55 (1987) 703.) Residuals of a mechanical model are not white: what
the model lacks vibrates with the strip. The lag m must therefore span some periods. For white
residuals the result is s^2 (J^T J)^-1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

NORMAL_95 = 1.959964
HALF = 0.5  # of a variance
AT_BOUND = 1e-3  # of the range between the bounds: nearer counts as at the bound


@dataclass(frozen=True)
class Parameter:
    """A number to estimate: start, step of the finite differences, bounds.

    A `factor` is estimated by its logarithm.
    """

    name: str
    start: float
    step: float
    bounds: tuple[float, float]
    factor: bool = True

    def to_scaled(self, value: float) -> float:
        """The value as the solver sees it: the logarithm of a factor."""
        return float(np.log(value)) if self.factor else value

    def to_physical(self, scaled: float) -> float:
        """The value in its unit, from the solver's."""
        return float(np.exp(scaled)) if self.factor else scaled


@dataclass(frozen=True)
class Estimate:
    """Result of a fit with k parameters.

    `values`: by name. `covariance` (k, k): of the scaled values. `residuals` (s, T): by series.
    `derivatives` (k, s, T): of the residuals by the scaled values. `of_inputs` (k, k): the part of
    the covariance that the noise of measured inputs makes.
    """

    parameters: tuple[Parameter, ...]
    values: dict[str, float]
    covariance: np.ndarray
    residuals: np.ndarray
    derivatives: np.ndarray
    evaluations: int
    of_inputs: np.ndarray | None = None

    @property
    def mostly_of_inputs(self) -> np.ndarray:
        """Whether more than half of a value's variance comes from the inputs' noise (k,)."""
        if self.of_inputs is None:
            return np.zeros(len(self.parameters), dtype=bool)
        return np.asarray(np.diag(self.of_inputs) > HALF * np.diag(self.covariance))

    def with_model_uncertainty(self, change: np.ndarray) -> Estimate:
        """Add the covariance due to an uncertainty of the model.

        The change of the residuals by one standard deviation shifts the scaled values by -(J^T
        J)^-1 J^T change. This shift is added as an independent error.

        Args:
            change: change of the residuals (s, T).
        """
        J = self.derivatives.reshape(len(self.parameters), -1)
        scale = np.linalg.norm(J, axis=1)
        scale[scale == 0.0] = 1.0  # what nothing depends on
        shift, *_ = np.linalg.lstsq((J / scale[:, None]).T, -change.ravel(), rcond=None)
        shift /= scale
        return replace(self, covariance=self.covariance + np.outer(shift, shift))

    def deviation(self, name: str) -> float:
        """Standard deviation of the scaled value; of a factor, relative to it."""
        k = [u.name for u in self.parameters].index(name)
        return float(np.sqrt(self.covariance[k, k]))

    def at_bounds(self) -> list[tuple[Parameter, str]]:
        """The parameters whose values are at their "lower" or "upper" bound."""
        out = []
        for parameter in self.parameters:
            low, high = map(parameter.to_scaled, parameter.bounds)
            value = parameter.to_scaled(self.values[parameter.name])
            for word, room in (("lower", value - low), ("upper", high - value)):
                if room <= AT_BOUND * (high - low):
                    out.append((parameter, word))
        return out

    def interval(self, name: str) -> tuple[float, float]:
        """The 95 % interval of a parameter."""
        parameter = next(u for u in self.parameters if u.name == name)
        middle, wide = parameter.to_scaled(self.values[name]), NORMAL_95 * self.deviation(name)
        return parameter.to_physical(middle - wide), parameter.to_physical(middle + wide)


def estimate(
    model: Callable[[dict[str, float]], np.ndarray],
    parameters: Sequence[Parameter],
    correlation_samples: int,
    directions: dict[str, dict[str, float]] | None = None,
    fixed: dict[str, float] | None = None,
    max_steps: int = 12,
) -> Estimate:
    """Fit parameters by nonlinear least squares.

    Ends if a step gains less than 1e-4 of the sum of squares, or after `max_steps` steps.

    Args:
        model: returns residuals (s, T) in units of their noise, for values by name.
        parameters: what is estimated.
        correlation_samples: samples over which the residuals may be correlated.
        directions: for a name, how much other parameters change with it in the finite differences,
            per unit of its scaled value. If two parameters have nearly the same effect, the
            difference between their effects needs a longer step.
        fixed: values by name of what is not estimated, for the model; they are in the result too.
        max_steps: the largest number of steps.
    """
    from scipy.optimize import least_squares

    count = 0

    def physical(scaled: np.ndarray) -> dict[str, float]:
        own = {u.name: u.to_physical(x) for u, x in zip(parameters, scaled, strict=True)}
        return (fixed or {}) | own

    def residuals(scaled: np.ndarray) -> np.ndarray:
        nonlocal count
        count += 1
        return model(physical(scaled))

    names = [u.name for u in parameters]
    step_directions = np.diag([u.step for u in parameters])  # (k, k), a row for each step
    for name, others in (directions or {}).items():
        for other, share in others.items():
            step_directions[names.index(name), names.index(other)] = (
                share * step_directions[names.index(name), names.index(name)]
            )

    at = _remembered(residuals)

    @_remembered
    def jacobian(scaled: np.ndarray) -> np.ndarray:
        base = at(scaled)
        changes = np.array([residuals(scaled + step) - base for step in step_directions])
        return np.linalg.solve(step_directions, changes.reshape(len(step_directions), -1)).reshape(
            changes.shape
        )

    start = np.array([u.to_scaled(u.start) for u in parameters])
    bounds = np.array([[u.to_scaled(edge) for edge in u.bounds] for u in parameters]).T
    scale = np.array([u.step for u in parameters])
    solution = least_squares(
        lambda x: at(x).ravel(),
        start,
        lambda x: jacobian(x).reshape(len(x), -1).T,
        tuple(bounds),
        x_scale=scale,
        ftol=1e-4,
        xtol=1e-7,
        gtol=1e-9,
        max_nfev=max_steps,
    )
    final_residuals = at(solution.x)
    J = jacobian(solution.x)  # (k, s, T)
    return Estimate(
        tuple(parameters),
        physical(solution.x),
        covariance(J, final_residuals, correlation_samples),
        final_residuals,
        J,
        count,
    )


def _remembered(function: Callable[[np.ndarray], np.ndarray]) -> Callable[..., np.ndarray]:
    """The function, which is not computed again where its argument is the last one's."""
    last: list[np.ndarray] = []

    def call(x: np.ndarray) -> np.ndarray:
        if not last or not np.array_equal(last[0], x):
            last[:] = x.copy(), function(x)
        return last[1]

    return call


def covariance(J: np.ndarray, residuals: np.ndarray, correlation_samples: int) -> np.ndarray:
    """Covariance (k, k) of the scaled values.

    NaN for values that nothing depends on; infinite for what cannot be told apart.

    Args:
        J: derivatives (k, s, T).
        residuals: (s, T).
        correlation_samples: the largest lag m.
    """
    there = np.einsum("ist,ist->i", J, J) > 0
    out = np.full((len(J), len(J)), np.nan)
    if there.any():
        try:
            out[np.ix_(there, there)] = _covariance(J[there], residuals, correlation_samples)
        except np.linalg.LinAlgError:
            out[np.ix_(there, there)] = np.inf
    return out


def _covariance(J: np.ndarray, residuals: np.ndarray, correlation_samples: int) -> np.ndarray:
    """The same where each value has an effect."""
    scores = (J * residuals).sum(axis=1)  # (k, T)
    score_covariance = scores @ scores.T
    for lag in range(1, min(correlation_samples, scores.shape[1] - 1) + 1):
        both = scores[:, lag:] @ scores[:, :-lag].T
        score_covariance += (1 - lag / (correlation_samples + 1)) * (both + both.T)
    scale = np.sqrt(np.einsum("ist,ist->i", J, J))
    A = J.reshape(len(J), -1) / scale[:, None]
    inverse_normal = np.linalg.inv(A @ A.T) / np.outer(scale, scale)
    return inverse_normal @ score_covariance @ inverse_normal
