"""Uniform links, from the one whose length, mass and bending stiffness are 1.

With xi = x / L and T = diag(1, L, 1, L, ...), phi(x) = T phi_1(xi): every integral of the unit link takes T for each phi in it,
and the dimensions of the rest. Where only some modes are kept, q = T^-1 Z p / sqrt(rho A L) with Z the modes of the unit link
with its payload, so that T drops out and the whole mesh is not needed: a population of such links costs a tenth of what
quadrature and the eigenvalues of each would.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from .beam import LinkIntegrals, bare_integrals, flexible, lengths, numbers, with_ends
from .modes import eigh, modal
from .robot import Joint, Link
from .secular import lowest


@cache
def _unit(elements: int, modes: int | None) -> LinkIntegrals:
    """The integrals of a link of 1 m, 1 kg/m and 1 N m^2, with a leading axis (1,)."""
    numbers_ = {"length_m": 1.0, "mass_per_length_kg_m": 1.0, "bending_stiffness_N_m2": 1.0}
    return flexible([Link(**numbers_, elements=elements, modes=modes, joint=Joint(type="R"))])


def meshed(links: Sequence[Link], tip_mass: np.ndarray, tip_inertia: np.ndarray) -> LinkIntegrals:
    """`beam.integrals` of uniform flexible links (R, Pa)."""
    one, n = _unit(links[0].elements, links[0].modes), links[0].elements
    L, rho, EI = lengths(links), numbers(links, "mass_per_length"), numbers(links, "bending_stiffness")
    of = lambda values: values[:, None]
    T = np.tile([1.0, 0.0], n) + of(L) * np.tile([0.0, 1.0], n)
    rows = T[:, None, :]
    both = T[:, :, None] * rows
    matrix = lambda a, factor: a * (factor[:, None, None] * both)
    bare = bare_integrals(
        links, S0=of(rho * L) * T * one.S0, S1=of(rho * L**2) * T * one.S1, M=matrix(one.M, rho * L), K=matrix(one.K, EI / L**3),
        G1=matrix(one.G1, rho), G2=matrix(one.G2, rho * L), H=matrix(one.H, 1 / L), NL=T * one.NL, SL=T * one.SL / of(L),
        basis=np.tile(np.eye(2 * n), (len(links), 1, 1)), ride=one.ride * T[:, None, None, :], point_phi=one.point_phi * rows,
        slope_d1=one.slope_d1 * (rows / L[:, None, None]), slope_d2=one.slope_d2 * (rows / L[:, None, None] ** 2),
        **_along(one, L, rho, EI),
    )  # fmt: skip
    return with_ends(bare, links, tip_mass, tip_inertia)


def reduced(
    links: Sequence[Link], tip_mass: np.ndarray, tip_inertia: np.ndarray, loaded: bool
) -> tuple[LinkIntegrals, np.ndarray]:
    """`beam.integrals` and `modes.modal` of uniform flexible links (R, Pa) with `modes`; `loaded` links have no payload."""
    one, n, modes = _unit(links[0].elements, links[0].modes), links[0].elements, links[0].modes
    assert modes is not None
    L, rho, EI = lengths(links), numbers(links, "mass_per_length"), numbers(links, "bending_stiffness")
    if loaded:
        Z, values = _loaded_modes(n, modes)
    else:
        (bare, V), values, shapes = _all_modes(n, modes), np.zeros((len(L), modes)), np.zeros((len(L), 2 * n, modes))
        lowest(bare, one.NL[0] @ V, one.SL[0] @ V, tip_mass / (rho * L), tip_inertia / (rho * L**3), values, shapes)
        Z = V @ shapes
    scaled = lambda factor: Z * factor[:, None, None]
    norm = 1 / np.sqrt(rho * L)
    own = lambda a, factor: (a[..., None, :] @ scaled(factor))[..., 0, :]
    around = lambda a, factor: _symmetric(np.swapaxes(Z, 1, 2) @ (a @ scaled(factor)))
    T = np.tile([1.0, 0.0], n) + L[:, None] * np.tile([0.0, 1.0], n)
    found = bare_integrals(
        links, S0=own(one.S0, rho * L * norm), S1=own(one.S1, rho * L**2 * norm), G1=around(one.G1, 1 / L),
        G2=around(one.G2, np.ones_like(L)), H=around(one.H, 1 / (rho * L**2)), M=around(one.M, np.ones_like(L)),
        K=around(one.K, EI / (rho * L**4)), NL=own(one.NL, norm), SL=own(one.SL, norm / L), basis=scaled(norm) / T[:, :, None],
        ride=one.ride @ scaled(norm)[:, None], point_phi=one.point_phi @ scaled(norm), slope_d1=one.slope_d1 @ scaled(norm / L),
        slope_d2=one.slope_d2 @ scaled(norm / L**2), **_along(one, L, rho, EI),
    )  # fmt: skip
    return with_ends(found, links, tip_mass, tip_inertia), values * (EI / (rho * L**4))[:, None]


@cache
def _all_modes(elements: int, modes: int) -> tuple[np.ndarray, np.ndarray]:
    """The unit link's eigenvalues (2n,), and its modes (2n, 2n)."""
    one = _unit(elements, modes)
    values, V = eigh(one.K, one.M)
    return values[0], V[0]


@cache
def _loaded_modes(elements: int, modes: int) -> tuple[np.ndarray, np.ndarray]:
    """Shapes (1, 2n, modes + 2) and eigenvalues (1, modes + 2) of the unit link with another one at its tip."""
    kept, values = modal(_unit(elements, modes), modes, loaded=True)
    return kept.basis, values


def _along(one: LinkIntegrals, L: np.ndarray, rho: np.ndarray, EI: np.ndarray) -> dict[str, np.ndarray]:
    """What does not depend on the coordinates."""
    of = lambda values: values[:, None]
    return {
        "mass": rho * L * one.mass, "s1": rho * L**2 * one.s1, "inertia": rho * L**3 * one.inertia,
        "point_x": of(L) * one.point_x, "point_mass": of(rho * L) * one.point_mass,
        "slope_dx": of(L) * one.slope_dx, "slope_EI": of(EI * L) * one.slope_EI,
    }  # fmt: skip


def _symmetric(a: np.ndarray) -> np.ndarray:
    return (a + np.swapaxes(a, 1, 2)) / 2
