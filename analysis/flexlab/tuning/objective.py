"""What a controller is judged by: one number from the figures of a run, or two for a Pareto front.

    J = sum_i ( itae_i / 1 s^2 + overshoot_weight max(0, overshoot_i - overshoot_free) +
    effort_weight effort_i )
        + vibration_weight vibration / (L 1 s^2)

Figures as in `response.py`; L the length of the last flexible link. A run that doesn't come to its
end (a joint limit, a bent link, chatter) counts FAILED (2 - the fraction of the time it reached),
far above any run that does. Of several robots the worst counts. A run that was abandoned as worse
than what a search can use counts what J had come to by then. Pareto: settling time of the slowest
joint [s] against rms of the tip deflection [mm]; a joint that doesn't settle counts twice the
duration and its error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexura.control import EFFORT, ERROR, ITAE, JOINT, OVERSHOOT, RMS, SETTLING, STRIP, VIBRATION
from flexura.errors import InputError
from flexura.signals import finite

FAILED = 1e3
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
            if not (finite(value) and value >= 0):
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


def split(figures: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Figures (..., 6 N + 4) as those of the joints (..., N, 6) and of the strip (..., 4)."""
    shape = figures.shape[:-1]
    return figures[..., : -len(STRIP)].reshape(*shape, -1, len(JOINT)), figures[..., -len(STRIP) :]


def prices(weights: Weights, joints: int, length_m: float) -> np.ndarray:
    """J as sum_k price_k max(0, figure_k - free_k): the prices and what is free, (2, 6 N + 4)."""
    out = np.zeros((2, len(JOINT) * joints + len(STRIP)))
    each, strip = split(out)
    each[0, :, ITAE], each[0, :, OVERSHOOT], each[0, :, EFFORT] = (
        1.0,
        weights.overshoot,
        weights.effort,
    )
    each[1, :, OVERSHOOT] = weights.overshoot_free
    strip[0, VIBRATION] = weights.vibration / length_m
    return out


def single(figures: np.ndarray, reached: np.ndarray, prices: np.ndarray) -> np.ndarray:
    """J (B, 1) of figures (B, R, 6 N + 4) of R robots, the worst of them, and the fractions reached
    (B, R)."""
    paid = prices[0] > 0
    price, free = prices[:, paid]
    total = (price * np.maximum(0.0, figures[..., paid] - free)).sum(axis=-1)
    return _worst(total[..., None], reached)


def double(figures: np.ndarray, reached: np.ndarray, duration_s: float) -> np.ndarray:
    """Settling time [s] and rms of the deflection [mm], (B, 2), the worst of R robots of each."""
    joints, strip = split(figures)
    late = duration_s * (2 + joints[..., ERROR])
    settling = np.where(np.isfinite(joints[..., SETTLING]), joints[..., SETTLING], late).max(
        axis=-1
    )
    return _worst(np.stack([settling, 1e3 * strip[..., RMS]], axis=-1), reached)


def _worst(values: np.ndarray, reached: np.ndarray) -> np.ndarray:
    whole = np.where(
        np.isfinite(values), values, FAILED * (2.0 - reached)[..., None]
    )  # figures that failed are NaN
    return whole.max(axis=1)
