"""The extended assembly: identities that hold for every chain."""

import numpy as np
import pytest

import chains
from flexura.system.assembly import Assembly

ALL = [(name, linear) for name in chains.SMALL for linear in (False, True)]


def assembly_and_state(name, linear=False, seed=1):
    assembly = Assembly(chains.SMALL[name], linear)
    return assembly, *chains.random_state(assembly, np.random.default_rng(seed))


@pytest.mark.parametrize("name, linear", ALL)
def test_the_mass_matrix_is_symmetric_and_positive_definite(name, linear):
    assembly, q, _ = assembly_and_state(name, linear)
    M = assembly.mass(q)
    unit = M / np.sqrt(np.outer(np.diag(M), np.diag(M)))
    assert unit == pytest.approx(unit.T, abs=1e-15)
    assert np.linalg.eigvalsh(unit)[0] > 1e-12


@pytest.mark.parametrize("name, linear", ALL)
def test_the_bias_is_that_of_lagranges_equations(name, linear):
    """d/dt dT/dqd - dT/dq by differences; in a sleeve this tests the cancellations of (37)."""
    assembly, q, qd = assembly_and_state(name, linear)
    want = chains.lagrange(assembly, q, qd)
    assert assembly.bias(q, qd) == pytest.approx(want, abs=1e-8 * np.abs(want).max())


@pytest.mark.parametrize("name, linear", ALL)
def test_elastic_forces_and_gravity_are_the_slopes_of_their_energies(name, linear):
    assembly, q, qd = assembly_and_state(name, linear)
    for force, energy in ((assembly.elastic(q), "strain"), (assembly.gravity(q), "potential")):
        want = chains.slopes(
            lambda x, part=energy: np.array(getattr(assembly.energies(x, qd), part)), q, 1e-4
        )
        assert force == pytest.approx(want, abs=1e-7 * max(np.abs(want).max(), 1e-6))


@pytest.mark.parametrize("name", chains.SMALL)
def test_the_stiffness_is_the_slope_of_the_elastic_forces(name):
    assembly, q, _ = assembly_and_state(name)
    want = chains.slopes(assembly.elastic, q, 1e-4)
    assert assembly.stiffness(q) == pytest.approx(want, abs=1e-9 * max(np.abs(want).max(), 1e-6))


@pytest.mark.parametrize("seed", range(12))
def test_power_on_random_chains(seed):
    """d/dt (T + U + V) = qd . forces - loss along any motion."""
    rng = np.random.default_rng(seed)
    assembly = Assembly(chains.random_chain(rng))
    q, qd = chains.random_state(assembly, rng, 2.0)
    qdd, h = 0.1 * qd, 1e-4
    energy = lambda t: sum(assembly.energies(q + t * qd + t**2 / 2 * qdd, qd + t * qdd))
    power = (8 * (energy(h) - energy(-h)) - energy(2 * h) + energy(-2 * h)) / (12 * h)
    parts = np.abs(qd) @ np.abs(assembly.mass(q)) @ np.abs(qdd) + sum(
        np.abs(qd) @ np.abs(x)
        for x in (assembly.bias(q, qd), assembly.elastic(q), assembly.gravity(q))
    )
    assert qd @ assembly.forces(q, qd, qdd) - assembly.loss(q, qd) == pytest.approx(
        power, abs=1e-7 * parts
    )


@pytest.mark.parametrize("seed", range(12, 40))
def test_random_chains_have_positive_definite_mass_matrices(seed):
    rng = np.random.default_rng(seed)
    assembly = Assembly(chains.random_chain(rng))
    q, _ = chains.random_state(assembly, rng, 2.0)
    M = assembly.mass(q)
    scale = np.sqrt(np.diag(M))
    np.linalg.cholesky(M / np.outer(scale, scale) + 1e-13 * np.eye(assembly.n))


def test_labels_name_the_unknowns():
    labels = Assembly(chains.SMALL["R, modes, R"]).labels
    assert labels == (
        "joint/1",
        "link/1/mode/1",
        "link/1/mode/2",
        "link/1/mode/3",
        "link/1/mode/4",
        "joint/2",
        "link/2/element/1/rotation",
        "link/2/element/1/bubble",
    )
    assert Assembly(chains.SMALL["Pb"]).labels[:2] == ("joint/1", "link/1/shape/1")


def test_the_tips_columns_are_its_slopes():
    for name in chains.SMALL:
        assembly, q, qd = assembly_and_state(name)
        tip = assembly.tip(q, qd)
        want = chains.slopes(
            lambda x, a=assembly: np.array([a.tip(x).place, a.tip(x).angle]), q, 1e-4
        )
        near = 1e-7 * np.abs(want).max()
        assert tip.velocity == pytest.approx(want[0], abs=near) and tip.turning == pytest.approx(
            want[1].real, abs=near
        )
        along = lambda t, a=assembly, q=q, qd=qd: a.tip(q + t * qd).velocity @ qd
        assert tip.rest == pytest.approx((along(1e-5) - along(-1e-5)) / 2e-5, rel=1e-6, abs=1e-6)


def test_a_line_goes_from_its_hub_to_its_tip_at_unit_speed():
    assembly, q, _ = assembly_and_state("R, kink")
    x, y, theta = assembly.line(q, 1, np.linspace(0, 1, 401))
    assert (x[0], y[0], theta[0]) == pytest.approx((0, 0, q[0]))
    tip = assembly.tip(q)
    assert x[-1] + 1j * y[-1] == pytest.approx(tip.place) and theta[-1] == pytest.approx(tip.angle)
    steps, middle = np.diff(x + 1j * y) * 400, (theta[1:] + theta[:-1]) / 2
    assert steps == pytest.approx(
        np.exp(1j * middle), abs=1e-2
    )  # what three points an element leave


def test_damping_takes_power_by_modes():
    """D = alpha M + beta K in a link's own modes: 2 zeta omega = alpha + beta omega^2."""
    assembly = Assembly(
        chains.robot(chains.beam(1.0, 2.0, 3.0, 4, modes=3, **chains.DAMPED), payload=0.4)
    )
    D, (piece,) = assembly.damping(np.zeros(4)), assembly.structure.links[0]
    assert D[1:, 1:] == pytest.approx(np.diag(0.3 + 0.01 * piece.K), rel=1e-9, abs=1e-9)
    mesh = Assembly(chains.robot(chains.beam(1.0, 2.0, 3.0, 4, **chains.DAMPED), payload=0.4))
    M, K = mesh.mass(np.zeros(9))[1:, 1:], mesh.stiffness(np.zeros(9))[1:, 1:]
    assert mesh.damping(np.zeros(9))[1:, 1:] == pytest.approx(
        0.3 * M + 0.01 * K, rel=1e-12, abs=1e-15
    )


def test_coulomb_friction_opposes_the_joint():
    assembly = Assembly(chains.robot(chains.rigid(1.0, 1.0, 0.5, 0.1, coulomb_friction=0.3)))
    assert (
        assembly.coulomb(np.array([1.0])) == pytest.approx([0.3])
        and assembly.coulomb(np.zeros(1)) == 0
    )
    assert assembly.loss(np.zeros(1), np.array([-2.0])) == pytest.approx(0.6)
