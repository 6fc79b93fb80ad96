"""The line of a bent link, from the deflections that a Run holds at its stations.

The line is inextensible: x(s) = int cos(theta) ds, y(s) = int sin(theta) ds, with the tangent's
angle theta(s) a cubic spline through the middles of the eight intervals and the tip. Its values
there are found from the deflections y(s_k) and the tip's slope, by Newton's method: right at any
bending. The dissertation's linear model has x = s instead.
"""

from __future__ import annotations

from functools import cache
from itertools import product

import numpy as np

from ..quantities import STATIONS

PER_STATION = 3  # curve points in each interval between stations
POINTS = (STATIONS - 1) * PER_STATION + 1
STEPS = 30  # of Newton's method
CLOSE = 1e-12  # of the length: deflections that are met
DAMPING = 1e-9  # where the line is at right angles to x, its deflection hardly says its angle

STEEP = 1.1  # rad: a line that is nowhere steeper goes forward everywhere
_CHOICES = np.array(list(product((False, True), repeat=STATIONS - 1)))


@cache
def _rule(tip_slope: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For the length 1: angles at the knots -> angles at all Gauss points (P, G, K); the weights
    (G,) of one interval between curve points, and the knots' places (K,) without the hub."""
    from scipy.interpolate import CubicSpline

    cells = STATIONS - 1
    knots = np.concatenate([(np.arange(cells) + 0.5) / cells, [1.0] if tip_slope else []])
    nodes, weights = np.polynomial.legendre.leggauss(4)
    ends = np.linspace(0.0, 1.0, POINTS)
    half = 0.5 / (POINTS - 1)
    places = 0.5 * (ends[1:] + ends[:-1])[:, None] + half * nodes
    unit = np.vstack([np.zeros(len(knots)), np.eye(len(knots))])  # the hub's angle is 0
    spline = CubicSpline(np.concatenate([[0.0], knots]), unit)
    return spline(places), half * weights, knots


def inextensible(deflection: np.ndarray, slope: np.ndarray | None, length: float) -> np.ndarray:
    """The line of a link in its hub frame.

    Args:
        deflection: (F, STATIONS) [m], at equal arc lengths from the hub to the tip.
        slope: (F,) [rad], the tangent's angle at the tip; None: not known.
        length: of the link [m].

    Returns:
        (F, POINTS, 2) [m]; NaN where a deflection is.
    """
    to_angles, weights, knots = _rule(slope is not None)
    y = deflection / length
    rise = np.diff(y, axis=1) * (STATIONS - 1)  # the mean of sin(theta) in each interval
    there = np.asarray(np.isfinite(y).all(axis=1))
    if slope is not None:
        there &= np.isfinite(slope)
    rise = np.where(there[:, None], rise, 0.0)
    end = np.zeros(len(y)) if slope is None else np.where(there, slope, 0.0)
    theta = _first_guess(rise, end, knots)
    count = STATIONS - 1
    for _ in range(STEPS):
        angle = np.einsum("pgk,fk->fpg", to_angles, theta)
        left = _cells(np.sin(angle) @ weights) * count - rise  # (F, count)
        slopes = np.einsum("fpg,g,pgk->fpk", np.cos(angle), weights, to_angles)
        slopes = slopes.reshape(len(y), count, PER_STATION, -1).sum(axis=2) * count
        if slope is not None:
            left = np.concatenate([left, theta[:, -1:] - end[:, None]], axis=1)
            last = np.broadcast_to(np.eye(len(knots))[-1], (len(y), 1, len(knots)))
            slopes = np.concatenate([slopes, last], axis=1)
        if not len(y) or np.abs(left).max() < CLOSE:
            break
        back = slopes.transpose(0, 2, 1)
        step = np.linalg.solve(
            back @ slopes + DAMPING * np.eye(len(knots)), (back @ left[:, :, None])
        )
        theta = theta - np.clip(step[:, :, 0], -0.5, 0.5)
    angle = np.einsum("pgk,fk->fpg", to_angles, theta)
    steps = np.stack([np.cos(angle) @ weights, np.sin(angle) @ weights], axis=2)
    line = np.concatenate([np.zeros((len(y), 1, 2)), np.cumsum(steps, axis=1)], axis=1) * length
    line[~there] = np.nan
    return line


def _cells(steps: np.ndarray) -> np.ndarray:
    """Sums (F, STATIONS - 1) over the curve's steps (F, POINTS - 1) between stations."""
    return steps.reshape(len(steps), STATIONS - 1, PER_STATION).sum(axis=2)


def _first_guess(rise: np.ndarray, end: np.ndarray, knots: np.ndarray) -> np.ndarray:
    """Angles at the knots (F, K) with these sines (F, STATIONS - 1). A sine has two angles: of all
    ways to choose them, the one that bends most evenly from the hub to the tip's slope."""
    sloped = len(knots) > rise.shape[1]
    small = np.arcsin(np.clip(rise, -1.0, 1.0))
    guess = small.copy()
    for k in np.flatnonzero((np.abs(end) > STEEP) | (np.abs(small).max(axis=1) > STEEP)):
        beyond = np.where(_CHOICES, np.pi - small[k], small[k])  # (ways, STATIONS - 1)
        ways = np.unwrap(np.column_stack([np.zeros(len(beyond)), beyond]), axis=1)
        ways = np.column_stack([ways, np.full(len(ways), end[k])]) if sloped else ways
        bends = np.diff(ways, axis=1) / np.diff(np.concatenate([[0.0], knots]))
        guess[k] = ways[(np.diff(bends, axis=1) ** 2).sum(axis=1).argmin(), 1:STATIONS]
    return np.column_stack([guess, end]) if sloped else guess
