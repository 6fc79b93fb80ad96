"""Exudyn's steps: their length, and which of them to record for the output times."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from .build import TwinModel

MAX_STEPS = 5_000_000  # refused beyond
DEFAULT_STEPS = 500_000  # a default step is never so short that it needs more
MAX_STEP_S = 5e-4  # s
STEPS_PER_FIRST_PERIOD = 240  # of the lowest frequency
STEPS_PER_HIGHEST_PERIOD = 60  # of the highest frequency that takes part
RIGID_HZ = 0.02  # frequencies below are rigid motions
ROUND_OFF = 3e-8  # frequencies below this part of the highest are round-off
# s, the run for which these hold; phase errors grow with time, so that h goes with 1/sqrt(time)
REFERENCE_DURATION_S = 2.0
ON_STEP_TOLERANCE = (
    1e-9  # how far a time may lie from a step, relative to the step, to count as on it
)


@dataclass(frozen=True)
class Steps:
    """`count` steps of `length` [s].

    `keep` (count + 1,) marks those to record. `exact`: every output time is one of them.
    """

    length: float
    count: int
    keep: np.ndarray
    exact: bool

    def at_times(
        self, t: np.ndarray, at: np.ndarray, q: np.ndarray, v: np.ndarray, a: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Coordinates at the output times that the record reached.

        Args:
            t: output times (T,) [s].
            at: recorded times (K,) [s], from 0 on.
            q: coordinates (K, n).
            v: velocities (K, n).
            a: accelerations (K, n).

        Returns:
            Times (k,), coordinates, velocities and accelerations (k, n); the last are linear
                between steps.
        """
        t = t[t <= at[-1] + 1e-3 * self.length]  # round-off of many steps
        if self.exact:
            own = np.searchsorted(at, t - self.length / 2)
            return t, q[own], v[own], a[own]
        more = [np.interp(t, at, column) for column in a.T]
        return t, *_interpolate(t, at, q, v, a), np.array(more).reshape(a.shape[1], -1).T


def plan_steps(t: np.ndarray, longest: float, forced: bool) -> Steps:
    """Steps up to t[-1]; they divide the output step if t is uniform and begins on it.

    Args:
        t: output times (T,) [s].
        longest: the longest step [s].
        forced: the user gave the length, so that too many steps are an error, not a reason for
            longer ones.

    Raises:
        InputError: there would be too many steps.
    """
    end = float(t[-1])
    if end == 0:
        return Steps(longest, 0, np.ones(1, dtype=bool), True)
    if not forced:
        longest = max(longest, end / DEFAULT_STEPS)
    if end / longest > MAX_STEPS:
        expected = f"expected at most {MAX_STEPS} steps, that is at least {end / MAX_STEPS:.3g} s"
        raise InputError(expected, key="step_s", value=longest)
    spacing = float(t[1] - t[0]) if len(t) > 1 else end
    if spacing > 0 and np.all(np.abs(t / spacing - np.round(t / spacing)) < 1e-6):
        length = spacing / math.ceil(spacing / longest - 1e-9)
    else:
        length = end / math.ceil(end / longest - 1e-9)
    count = round(end / length)
    places = t / length
    exact = bool(np.all(np.abs(places - np.round(places)) < max(ON_STEP_TOLERANCE, 1e-12 * count)))
    keep = np.zeros(count + 1, dtype=bool)
    keep[0] = True
    wanted = [np.round(places)] if exact else [np.floor(places), np.ceil(places)]
    for places_k in wanted:
        keep[np.clip(places_k.astype(int), 0, count)] = True
    return Steps(length, count, keep, exact)


def suggest_step(model: TwinModel, settings: Any, end: float) -> float:
    """A step for a time error below about 1e-3 of the tip deflection [s].

    240 steps in a period of the lowest frequency, and 60 in one of the highest that takes part, at
    the robot's start. The latter is taken as the lowest and one more a flexible link (measured on a
    carriage with a flexible arm, bang-bang driven, over 2 s: 3e-4 to 8e-4).

    Args:
        model: the assembled robot.
        settings: Exudyn's settings.
        end: duration [s].
    """
    try:
        hertz = np.sort(
            model.mbs.ComputeODE2Eigenvalues(simulationSettings=settings, convert2Frequencies=True)[
                0
            ]
        )
    except Exception:  # of a linear solver about a singular matrix: the step is a proposal only
        return MAX_STEP_S
    hertz = hertz[np.isfinite(hertz)]
    hertz = hertz[hertz > max(RIGID_HZ, ROUND_OFF * hertz.max(initial=0.0))]
    if len(hertz) == 0:
        return MAX_STEP_S
    highest = hertz[min(sum(count > 0 for count in model.mesh.elements), len(hertz) - 1)]
    return min(
        MAX_STEP_S,
        min(1 / (STEPS_PER_FIRST_PERIOD * hertz[0]), 1 / (STEPS_PER_HIGHEST_PERIOD * highest))
        * math.sqrt(REFERENCE_DURATION_S / max(end, REFERENCE_DURATION_S)),
    )


def _interpolate(
    t: np.ndarray, at: np.ndarray, q: np.ndarray, v: np.ndarray, a: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates and velocities at t (T,) by cubics.

    Args:
        t: output times (T,) [s].
        at: recorded times (K,) [s].
        q: coordinates (K, n).
        v: velocities (K, n).
        a: accelerations (K, n).
    """
    if len(at) == 1:
        return q[: len(t)], v[: len(t)]
    k = np.clip(np.searchsorted(at, t, side="right") - 1, 0, len(at) - 2)
    h = (at[k + 1] - at[k])[:, None]
    s = (t - at[k])[:, None] / h
    one, two, three, four = (
        1 - 3 * s**2 + 2 * s**3,
        h * (s - 2 * s**2 + s**3),
        3 * s**2 - 2 * s**3,
        h * (s**3 - s**2),
    )

    def cubic(y: np.ndarray, rate: np.ndarray) -> np.ndarray:
        return one * y[k] + two * rate[k] + three * y[k + 1] + four * rate[k + 1]

    return cubic(q, v), cubic(v, a)
