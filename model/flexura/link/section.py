"""A link's mass per length and bending stiffness as polynomials between breaks."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.polynomial.polynomial import polyder
from numpy.typing import ArrayLike

from ..robot import Link
from .quadrature import cells

MASS_DEGREE, STIFFNESS_DEGREE = 2, 4  # of rho A and EI, if a section's dimensions are linear


@dataclass(frozen=True)
class Material:
    """rho A(s) [kg/m] and EI(s) [N m^2] as polynomials between breaks.

    `breaks` (I + 1,) [m], from 0 to the link's length. `mass` (I, 3), `stiffness` (I, 5): row k has
    the powers of s - breaks[k], lowest first.
    """

    breaks: np.ndarray
    mass: np.ndarray
    stiffness: np.ndarray

    @cached_property
    def length(self) -> float:
        """Length of the link [m]."""
        return float(self.breaks[-1])

    @cached_property
    def uniform(self) -> bool:
        """Whether mass per length and stiffness are constant along the link."""
        return (
            len(self.mass) == 1 and not self.mass[0, 1:].any() and not self.stiffness[0, 1:].any()
        )

    def mass_per_length(self, s: ArrayLike, derivative: int = 0) -> np.ndarray:
        """rho A at s (S,) [kg/m], or its derivative by s.

        Args:
            s: places (S,) [m].
            derivative: its order, 0 to 2.
        """
        return self._values(self._slopes[0][derivative], s)

    def bending_stiffness(self, s: ArrayLike, derivative: int = 0) -> np.ndarray:
        """EI at s (S,) [N m^2], or its derivative by s.

        Args:
            s: places (S,) [m].
            derivative: its order, 0 to 2.
        """
        return self._values(self._slopes[1][derivative], s)

    def quadrature(self, start: float, end: float, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Gauss points and weights [m] on each smooth part of start <= s <= end.

        Args:
            start: lower end [m].
            end: upper end [m].
            count: points of each part.
        """
        inner = self.breaks[1:-1]
        inner = inner[(inner > start) & (inner < end)]
        return cells(np.concatenate([[start], inner, [end]]), count)

    @cached_property
    def _slopes(self) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Powers of mass and stiffness and of their first two derivatives, lowest first.

        (powers, I) each.
        """
        return tuple([polyder(rows.T, k) for k in range(3)] for rows in (self.mass, self.stiffness))  # type: ignore[return-value]

    def _values(self, powers: np.ndarray, s: ArrayLike) -> np.ndarray:
        s = np.atleast_1d(np.asarray(s)) * 1.0
        if self.uniform:
            return np.full(s.shape, powers[0, 0], s.dtype)
        k = np.clip(np.searchsorted(self.breaks, s, side="right") - 1, 0, powers.shape[1] - 1)
        x, value = s - self.breaks[k], powers[-1, k]
        for row in powers[-2::-1]:
            value = value * x + row[k]
        return value


def material(link: Link) -> Material:
    """Mass and stiffness of a link of the robot file.

    Tapers are linear in the section's dimensions.
    """
    breaks = np.array(link.breaks())
    parts = list(pairwise(breaks))
    mass = [_powers(link.mass_per_length, a, b, MASS_DEGREE) for a, b in parts]
    if not link.flexible:
        return Material(breaks, np.array(mass), np.zeros((len(parts), STIFFNESS_DEGREE + 1)))
    return Material(
        breaks,
        np.array(mass),
        np.array([_powers(link.bending_stiffness, a, b, STIFFNESS_DEGREE) for a, b in parts]),
    )


def _powers(function, a: float, b: float, degree: int) -> np.ndarray:  # type: ignore[no-untyped-def]
    """Powers of s - a (degree + 1,) of a polynomial, from its values between a and b."""
    t = np.linspace(0, 1, degree + 1)
    values = function(a + (b - a) * t)
    if np.ptp(values) == 0:
        return np.append(values[0], np.zeros(degree))
    return np.linalg.solve(np.vander(t, increasing=True), values) / (b - a) ** np.arange(degree + 1)
