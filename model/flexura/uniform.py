"""Uniform links, from the one whose length, mass and bending stiffness are 1.

With xi = x / L and T = diag(1, L, 1, L, ...), phi(x) = T phi_1(xi): every integral of the unit link takes T for each phi in it,
and the dimensions of the rest. Where only some modes are kept, q = T^-1 Z p / sqrt(rho A L) with Z the modes of the unit link
with its payload: the same with the unit link in the coordinates of Z, and 1 / sqrt(rho A L) in place of T. A population of such
links costs a tenth of what quadrature and the eigenvalues of each would.
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
    ones = {"length_m": 1.0, "mass_per_length_kg_m": 1.0, "bending_stiffness_N_m2": 1.0}
    return flexible([Link(**ones, elements=elements, modes=modes, joint=Joint(type="R"))])


def meshed(links: Sequence[Link], tip_mass: np.ndarray, tip_inertia: np.ndarray) -> LinkIntegrals:
    """`beam.integrals` of uniform flexible links (R, Pa)."""
    bare = _scaled(links, _unit(links[0].elements, links[0].modes), _nodal(links))
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
    norm = np.repeat(1 / np.sqrt(rho * L)[:, None], Z.shape[2], axis=1)
    found = with_ends(_scaled(links, one.changed(Z), norm), links, tip_mass, tip_inertia)
    return found, values * (EI / (rho * L**4))[:, None]


def _nodal(links: Sequence[Link]) -> np.ndarray:
    """T of the nodal unknowns, its diagonal (B, 2n)."""
    n = links[0].elements
    return np.asarray(np.tile([1.0, 0.0], n) + lengths(links)[:, None] * np.tile([0.0, 1.0], n))


def _scaled(links: Sequence[Link], one: LinkIntegrals, T: np.ndarray) -> LinkIntegrals:
    """Links without hubs and payloads, from the unit link in some coordinates z = T p, T (B, m) a diagonal."""
    L, rho, EI = lengths(links), numbers(links, "mass_per_length"), numbers(links, "bending_stiffness")
    of = lambda values: values[:, None]
    rows = T[:, None, :]
    both = T[:, :, None] * rows
    matrix = lambda a, factor: a * (factor[:, None, None] * both)
    return bare_integrals(
        links, mass=rho * L * one.mass, s1=rho * L**2 * one.s1, inertia=rho * L**3 * one.inertia, S0=of(rho * L) * T * one.S0,
        S1=of(rho * L**2) * T * one.S1, M=matrix(one.M, rho * L), K=matrix(one.K, EI / L**3), G1=matrix(one.G1, rho),
        G2=matrix(one.G2, rho * L), H=matrix(one.H, 1 / L), NL=T * one.NL, SL=T * one.SL / of(L),
        basis=one.basis * rows / _nodal(links)[:, :, None], ride=one.ride * T[:, None, None, :], point_x=of(L) * one.point_x,
        point_mass=of(rho * L) * one.point_mass, point_phi=one.point_phi * rows, slope_dx=of(L) * one.slope_dx,
        slope_EI=of(EI * L) * one.slope_EI, slope_d1=one.slope_d1 * (rows / L[:, None, None]),
        slope_d2=one.slope_d2 * (rows / L[:, None, None] ** 2),
    )  # fmt: skip


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
