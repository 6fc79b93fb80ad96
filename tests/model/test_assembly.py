"""Assembly of many robots at once: each gets what it gets alone, to the last bit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given

import flexura as fx
from flexura.assembly import assemble_all, size
from flexura.modes import eigh
from robots import beam, fast, rigid, robot, robots


def equal(a: fx.System, b: fx.System) -> bool:
    fields = [(a.transform, b.transform), (a.to_solver, b.to_solver), (a.spectrum, b.spectrum), *zip(a.chain, b.chain)]
    fields += [pair for one, other in zip(a.links, b.links) for pair in zip(one, other)]
    return a.labels == b.labels and all(np.array_equal(x, y) for x, y in fields)


@fast
@given(robots(coulomb=True, locked=True))
def test_a_robot_among_others_is_the_robot_alone(described):
    """Whatever the others are; its mass matrix is symmetric, its size known before."""
    others = [described.replace({"payload.mass_kg": mass, "link.1.joint.rotor_inertia": mass}) for mass in (0.1, 0.2, 0.3)]
    among = assemble_all([others[0], described, *others[1:]])
    alone = fx.assemble(described)
    assert isinstance(among[1], fx.System) and equal(among[1], alone) and alone.n == size(described)
    for system, each in zip(among, [others[0], described, *others[1:]]):
        assert isinstance(system, fx.System) and equal(system, fx.assemble(each))


def test_kinks_in_other_places_are_no_matter():
    """Tapered links whose kinks lie in different elements, and one whose kink lies on a node."""

    def kinked(at: float) -> fx.Robot:
        taper = [{"at_m": x, "value": v} for x, v in ((0.0, 0.3), (at, 0.2), (0.6, 0.1))]
        return robot(beam(0.6, taper, 0.5, 3, modes=2, hub_inertia_kg_m2=1e-3))

    items = [kinked(at) for at in (0.1, 0.2, 0.25, 0.5)]
    for each, system in zip(items, assemble_all(items)):
        assert isinstance(system, fx.System) and equal(system, fx.assemble(each))
        mass, taper = system.links[0].mass - 0.0, each.links[0].mass_per_length_kg_m
        assert mass == pytest.approx(np.trapezoid([v.value for v in taper], [v.at_m for v in taper]), rel=1e-13)


def test_a_robot_that_accelerates_nothing_does_not_spoil_the_others():
    good, bad = (robot(rigid(0.0, kg, 0.0, kg, "Pa"), rigid(0.1, 0.0, 0.0, inertia)) for kg, inertia in ((1.0, 0.1), (0.0, 0.0)))
    systems = assemble_all([good, bad, good])
    assert list(systems.refused) == [1]
    with pytest.raises(fx.InputError, match=r"link\[1\].joint: nothing to accelerate"):
        systems[1]
    assert all(isinstance(s, fx.System) and equal(s, fx.assemble(good)) for s in (systems[0], systems[2]))
    with pytest.raises(fx.InputError, match="nothing to accelerate"):
        fx.assemble(bad)


def test_the_eigenvalues_are_lapacks():
    from scipy.linalg import eigh as reference

    random = np.random.default_rng(0).normal(size=(2, 5, 12, 12))
    K, M = random @ np.swapaxes(random, 2, 3) + 12 * np.eye(12)
    values, vectors = eigh(K, M)
    for k in range(5):
        assert np.allclose(values[k], reference(K[k], M[k], eigvals_only=True), rtol=1e-12, atol=0)
        assert np.allclose(vectors[k].T @ M[k] @ vectors[k], np.eye(12), atol=1e-12)
        assert np.allclose(K[k] @ vectors[k], M[k] @ vectors[k] * values[k], atol=1e-11 * values[k, -1])
