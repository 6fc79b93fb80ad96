"""The objective of a search: one number from the metrics of a run, or two for a Pareto front.

    J = sum_i ( itae_i / 1 s^2 + overshoot_weight max(0, overshoot_i - overshoot_free)
                + effort_weight effort_i )
        + vibration_weight vibration / (L 1 s^2)

Metrics are those of `flexura.control`; L is the length of the last flexible link. A run that does
not reach its end (a joint limit, a bent link, chatter) costs FAILURE_COST (2 - the fraction of the
time it reached), far above any run that does. Of several robots the worst counts. A run that was
stopped because a search cannot use it counts its J until then. Pareto: settling time of the slowest
joint [s] against rms of the tip deflection [mm]; a joint that does not settle counts twice the
duration and its error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexura.control import EFFORT, ERROR, ITAE, JOINT, OVERSHOOT, RMS, SETTLING, STRIP, VIBRATION
from flexura.errors import InputError
from flexura.signals import is_finite

FAILURE_COST = 1e3
HELP = """J = sum over joints of [ int t |r - q| dt / |step| + OVERSHOOT max(0, overshoot - 5 %)
+ EFFORT int (u / limit)^2 dt / T ] + VIBRATION int t |w - w(end)| dt / L
times in s, w the tip deflection, L the link's length; capitals are the weights"""


@dataclass(frozen=True)
class Weights:
    """The weights of J's terms, all numbers of 0 or more."""

    vibration: float = 100.0
    effort: float = 0.01
    overshoot: float = 1.0
    overshoot_free: float = 0.05

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (is_finite(value) and value >= 0):
                raise InputError(
                    "expected a finite number of 0 or more",
                    key=f"--{name.replace('_', '-')}",
                    value=value,
                )

    def text(self) -> str:
        """J with its numbers, for results."""
        terms = ["itae_i / s^2"]
        terms += (
            [f"{self.overshoot:g} max(0, overshoot_i - {self.overshoot_free:g})"]
            if self.overshoot
            else []
        )
        terms += [f"{self.effort:g} effort_i"] if self.effort else []
        strip = f" + {self.vibration:g} vibration / (L s^2)" if self.vibration else ""
        return f"J = sum_i [ {' + '.join(terms)} ]{strip}"


def split_metrics(metrics: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Split metrics (..., 6 N + 4) into those of N joints (..., N, 6) and of the strip (..., 4)."""
    shape = metrics.shape[:-1]
    return metrics[..., : -len(STRIP)].reshape(*shape, -1, len(JOINT)), metrics[..., -len(STRIP) :]


def cost_weights(weights: Weights, joints: int, length_m: float) -> np.ndarray:
    """Weights of J = sum_k weight_k max(0, metric_k - free_k).

    Args:
        weights: of J's terms.
        joints: their number N.
        length_m: L [m].

    Returns:
        Weights and what is free, (2, 6 N + 4).
    """
    out = np.zeros((2, len(JOINT) * joints + len(STRIP)))
    each, strip = split_metrics(out)
    each[0, :, ITAE], each[0, :, OVERSHOOT], each[0, :, EFFORT] = (
        1.0,
        weights.overshoot,
        weights.effort,
    )
    each[1, :, OVERSHOOT] = weights.overshoot_free
    strip[0, VIBRATION] = weights.vibration / length_m
    return out


def scalar_cost(metrics: np.ndarray, reached: np.ndarray, cost_weights: np.ndarray) -> np.ndarray:
    """J of the worst of R robots.

    Args:
        metrics: (B, R, 6 N + 4).
        reached: fractions of the time reached (B, R).
        cost_weights: as the function of this name returns them.

    Returns:
        (B, 1).
    """
    paid = cost_weights[0] > 0
    weight, free = cost_weights[:, paid]
    total = (weight * np.maximum(0.0, metrics[..., paid] - free)).sum(axis=-1)
    return _worst(total[..., None], reached)


def two_objectives(metrics: np.ndarray, reached: np.ndarray, duration_s: float) -> np.ndarray:
    """Settling time [s] and rms of the deflection [mm] of the worst of R robots.

    Args:
        metrics: (B, R, 6 N + 4).
        reached: fractions of the time reached (B, R).
        duration_s: of the manoeuvre [s].

    Returns:
        (B, 2).
    """
    joints, strip = split_metrics(metrics)
    late = duration_s * (2 + joints[..., ERROR])
    settling = np.where(np.isfinite(joints[..., SETTLING]), joints[..., SETTLING], late).max(
        axis=-1
    )
    return _worst(np.stack([settling, 1e3 * strip[..., RMS]], axis=-1), reached)


def _worst(values: np.ndarray, reached: np.ndarray) -> np.ndarray:
    # metrics of failed runs are NaN
    whole = np.where(np.isfinite(values), values, FAILURE_COST * (2.0 - reached)[..., None])
    return whole.max(axis=1)
