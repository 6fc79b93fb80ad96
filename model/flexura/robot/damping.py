"""The damping of a link: Rayleigh's two factors, given, or found from damping ratios of the link's
own clamped modes."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import Field, model_validator

from ..errors import WrongValue
from .table import BOUNDS, Table, quantity

if TYPE_CHECKING:
    from .link import Link
    from .payload import Payload

LEAST_ELEMENTS = 24  # of the mesh that gives a link's clamped frequencies
_X, _W = np.polynomial.legendre.leggauss(5)
Ratio = Annotated[float, Field(gt=0, le=BOUNDS["ratio"].high)]


class Damping(Table):
    """Rayleigh damping of the elastic unknowns, D = alpha M + beta K (26).

    Instead of the factors: `ratio` of the first clamped mode of the link, or `ratios` of the first
    two.
    """

    alpha_1_s: float = quantity("alpha_1_s", "the mass-proportional factor in 1/s", 0.0)
    beta_s: float = quantity("beta_s", "the stiffness-proportional factor in seconds", 0.0)
    ratio: float | None = quantity(
        "ratio", "the damping ratio of the link's first clamped mode, by beta_s", None
    )
    ratios: tuple[Ratio, Ratio] | None = Field(
        None,
        strict=False,
        description="the damping ratios of the link's first two clamped modes, two numbers above 0 "
        f"and at most {BOUNDS['ratio'].high:g}",
    )

    @model_validator(mode="after")
    def _one_way(self) -> Damping:
        factors = any((self.alpha_1_s, self.beta_s))
        for key in ("ratio", "ratios"):
            value = getattr(self, key)
            if value is not None and (factors or (key == "ratios" and self.ratio is not None)):
                shown = list(value) if isinstance(value, tuple) else value
                raise WrongValue(key, shown, "one of alpha_1_s and beta_s, ratio, or ratios")
        return self

    @property
    def by_ratio(self) -> bool:
        """Whether damping ratios are given."""
        return self.ratio is not None or self.ratios is not None


def rayleigh(link: Link, payload: Payload | None) -> tuple[float, float]:
    """The factors of a link's damping D = alpha M + beta K (26).

    A ratio of one mode gives beta = 2 zeta / omega. Two give both factors, by
    2 zeta_k omega_k = alpha + beta omega_k^2.

    Args:
        link: the link.
        payload: what it carries; None: the link is not the last one.

    Returns:
        alpha [1/s] and beta [s].

    Raises:
        WrongValue: ratios that Rayleigh's factors, 0 or more, do not give.
    """
    given = link.damping
    if not given.by_ratio:
        return given.alpha_1_s, given.beta_s
    omega = clamped_frequencies(link, payload)
    if given.ratio is not None:
        return 0.0, 2 * given.ratio / float(omega[0])
    assert given.ratios is not None
    (z1, z2), (w1, w2) = given.ratios, omega[:2].tolist()
    low, high = z1 * w1 / w2, z1 * w2 / w1
    if not (low <= z2 <= high and np.isfinite(w2)):
        expected = (
            f"a second ratio from {low:.3g} to {high:.3g} beside {z1:g}: the modes have "
            f"{w1 / (2 * np.pi):.4g} and {w2 / (2 * np.pi):.4g} Hz, and alpha and beta are 0 or "
            f"more"
        )
        raise WrongValue("damping.ratios", [z1, z2], expected)
    spread = w2**2 - w1**2
    alpha, beta = 2 * w1 * w2 * (z1 * w2 - z2 * w1) / spread, 2 * (z2 * w2 - z1 * w1) / spread
    return max(alpha, 0.0), max(beta, 0.0)


def clamped_frequencies(link: Link, payload: Payload | None) -> np.ndarray:
    """The natural frequencies of a straight link that is clamped at its hub (Pb: at the sleeve's
    exit at the start), by Hermite's cubic elements.

    Args:
        link: the link.
        payload: what it carries; None: nothing.

    Returns:
        Frequencies, ascending [rad/s]; infinite where nothing moves.
    """
    from scipy.linalg import eigh

    start = link.length_m - link.joint.start if link.joint.type == "Pb" else 0.0
    kinks = [x for x in [*link.breaks(), *(each.at_m for each in link.mass)] if x > start]
    places = sorted({start, *kinks})
    spans, ends = np.diff(places), [start]
    longest = (link.length_m - start) / LEAST_ELEMENTS
    for a, span in zip(places, spans, strict=False):
        pieces = int(np.ceil(span / longest - 1e-9))
        ends += [a + span * k / pieces for k in range(1, pieces + 1)]
    M, K = np.zeros((2, 2 * len(ends), 2 * len(ends)))
    u = (_X + 1) / 2
    for k, (a, b) in enumerate(pairwise(ends)):
        h, own = b - a, slice(2 * k, 2 * k + 4)
        w = h / 2 * _W
        N = np.stack(
            [
                1 - 3 * u**2 + 2 * u**3,
                h * (u - 2 * u**2 + u**3),
                3 * u**2 - 2 * u**3,
                h * (u**3 - u**2),
            ]
        )
        curvature = np.stack([12 * u - 6, h * (6 * u - 4), 6 - 12 * u, h * (6 * u - 2)]) / h**2
        M[own, own] += (N * (w * link.mass_per_length(a + h * u))) @ N.T
        K[own, own] += (curvature * (w * link.bending_stiffness(a + h * u))) @ curvature.T
    for each in link.mass:
        if each.at_m > start:
            node = 2 * int(np.argmin(np.abs(np.array(ends) - each.at_m)))
            M[node, node] += each.mass_kg
            M[node + 1, node + 1] += each.inertia_kg_m2
    if payload is not None:
        along, across = payload.centre_of_mass_m
        lever = np.array([1.0, along])
        M[-2:, -2:] += payload.mass_kg * np.outer(lever, lever)
        M[-1, -1] += payload.inertia_kg_m2 + payload.mass_kg * across**2
    mu = eigh(M[2:, 2:], K[2:, 2:], eigvals_only=True)[::-1]
    return np.asarray(np.where(mu > 1e-12 * mu[0], 1 / np.sqrt(np.maximum(mu, 1e-300)), np.inf))
