"""Uniform links made from the unit link are the links that quadrature and LAPACK give."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import flexura as fx
from flexura.beam import LinkIntegrals, integrals
from flexura.modes import modal
from flexura.secular import lowest
from flexura.uniform import meshed, reduced
from robots import beam, fast, robot

lengths, laws = st.floats(0.05, 20.0), st.floats(1e-3, 1e3)


def links(elements: int, modes: int | None, sizes: list[tuple[float, float, float]]) -> list:
    kept = {} if modes is None else {"modes": modes}
    return [robot(beam(L, rho, EI, elements, hub_mass_kg=0.2, hub_inertia_kg_m2=0.1, **kept)).links[0] for L, rho, EI in sizes]


def close(a: LinkIntegrals, b: LinkIntegrals, tolerance: float) -> None:
    for name, one, other in zip(LinkIntegrals._fields, a, b):
        one, other = np.asarray(one), np.asarray(other)
        assert one.shape == other.shape, name
        for x, y in zip(one, other):
            assert np.abs(x - y).max(initial=0.0) <= tolerance * np.abs(y).max(initial=0.0), name


@fast
@given(st.integers(1, 9), st.tuples(lengths, laws, laws), st.tuples(lengths, laws, laws), st.floats(0, 10), st.floats(0, 1))
def test_a_uniform_link_is_a_scaled_unit_link(elements, one, other, mass, inertia):
    own, load = links(elements, None, [one, other]), (np.array([mass, 0.0]), np.array([0.0, inertia]))
    close(meshed(own, *load), integrals(own, *load), 1e-12)


@fast
@given(
    st.integers(2, 12), st.integers(1, 3), st.booleans(), st.tuples(lengths, laws, laws),
    st.sampled_from([0.0, 1e-18, 1e-9, 0.01, 1.0, 100.0]), st.sampled_from([0.0, 1e-12, 1e-3, 1.0, 100.0]),
)  # fmt: skip
def test_few_modes_are_the_lowest_of_all(elements, modes, loaded, size, mass, inertia):
    """Whatever the payload, in shares of the link's mass and of mass x length^2, the integrals are those of the dense problem."""
    if modes + 2 * loaded >= 2 * elements:
        return
    own, (L, rho, _) = links(elements, modes, [size, size]), size
    load = [np.array([0.0, 0.0 if loaded else share]) for share in (mass * rho * L, inertia * rho * L**3)]
    found, lam = reduced(own, *load, loaded)
    expected, reference = modal(integrals(own, *load), modes, loaded)
    assert np.allclose(lam, reference, rtol=1e-8, atol=0)
    close(found, expected, 1e-7)
    assert np.allclose(found.M, np.eye(found.M.shape[1]), atol=1e-11) and np.allclose(expected.M, found.M, atol=1e-11)


@fast
@given(st.floats(0, 1e4), st.floats(0, 1e4))
def test_eigenvalues_interlace_and_satisfy_the_full_problem(mass, inertia):
    """K v = x M v of the bare link's modes with the payload's two rows; a payload lowers each, by two places at most."""
    random = np.random.default_rng(0)
    lam, a, b = np.sort(random.uniform(1, 1e6, 12)), random.normal(size=12), 5 * random.normal(size=12)
    values, shapes = np.zeros((1, 5)), np.zeros((1, 12, 5))
    lowest(lam, a, b, np.array([mass]), np.array([inertia]), values, shapes)
    M = np.eye(12) + mass * np.outer(a, a) + inertia * np.outer(b, b)
    assert (values[0] <= lam[:5]).all() and (values[0, 2:] >= lam[:3]).all() and (np.diff(values[0]) > 0).all()
    for x, v in zip(values[0], shapes[0].T):
        left, right = lam * v, x * (M @ v)
        assert np.linalg.norm(left - right) <= 1e-9 * np.linalg.norm(left)
        assert v @ M @ v == pytest.approx(1, abs=1e-9) and a @ v >= 0


@pytest.mark.parametrize("elements", [3, 6, 12, 17])
@pytest.mark.parametrize("length", [0.1, 0.35, 0.7, 0.95])
def test_the_payload_sits_on_the_last_point(elements, length):
    """Lengths of which a twelfth, taken twelve times, is another number: the tip's point must still be the tip's."""
    for stiffness in (1.0, [{"at_m": x, "value": 1.0} for x in (0.0, length)]):
        system = fx.assemble(robot(beam(length, 1.0, stiffness, elements, hub_inertia_kg_m2=1.0), payload=3.0))
        mass = system.links[0].point_mass
        assert system.links[0].point_x[-1] == length and 3.0 < mass[-1] < 3.0 + length
