"""The compiled core against the extended assembly: one theory, two derivations, (40) to (47)."""

import numpy as np
import pytest

import chains
import flexura as fx
from flexura.robot import Robot

NOTHING = {"gravity": False, "stiffness": False, "damping": False}


def check_residual(robot: Robot, rng: np.random.Generator, slope: float, most: float = 1e-12):
    """The core's accelerations in the assembly's equations, row by row; its forces beside
    theirs."""
    system = fx.assemble(robot)
    assembly, core = system.assembly, system.equations
    q, qd = chains.random_state(assembly, rng, slope)
    M, bias = assembly.mass(q), assembly.bias(q, qd)
    passive = assembly.elastic(q) + assembly.gravity(q), assembly.damping(q) @ qd
    force = np.abs(M) @ np.abs(qd) * rng.normal(size=system.n)
    a = core.accelerations(q, qd, force)
    scale = np.abs(M) @ np.abs(a) + np.abs(bias) + sum(map(np.abs, passive)) + np.abs(force)
    residual = M @ a + bias + sum(passive) - force
    worst = np.abs(residual / np.where(scale > 0, scale, 1.0)).max()
    assert worst < most, (robot.structure, worst)
    forces = core.forces(q, qd, a, True, True, True)
    worst = np.abs((forces - force) / np.where(scale > 0, scale, 1.0)).max()
    assert worst < most, (robot.structure, worst)


@pytest.mark.parametrize("name", chains.SMALL)
def test_small_chains_of_every_kind(name):
    rng = np.random.default_rng(1)
    for slope in (0.01, 1.0, 3.0):
        check_residual(chains.SMALL[name], rng, slope)


@pytest.mark.parametrize("name", chains.SMALL)
def test_each_part_of_the_forces(name):
    system = fx.assemble(chains.SMALL[name])
    assembly, core = system.assembly, system.equations
    q, qd = chains.random_state(assembly, np.random.default_rng(2))
    still = np.zeros(system.n)
    pairs = (
        (core.forces(q, still, qd, *NOTHING.values()), assembly.mass(q) @ qd),
        (core.forces(q, qd, still, *NOTHING.values()), assembly.bias(q, qd)),
        (core.forces(q, still, still, True, False, False), assembly.gravity(q)),
        (core.forces(q, still, still, False, True, False), assembly.elastic(q)),
    )
    for mine, theirs in pairs:
        assert mine == pytest.approx(theirs, abs=1e-12 * np.abs(theirs).max())
    assert core.loss(q, qd) == pytest.approx(assembly.loss(q, qd), rel=1e-12, abs=1e-300)


@pytest.mark.parametrize("seed", range(10))
def test_random_chains(seed):
    rng = np.random.default_rng(100 + seed)
    for _ in range(10):
        check_residual(chains.random_chain(rng, int(rng.integers(1, 5))), rng, 2.0)


@pytest.mark.parametrize("name", ["R, kink", "R, modes, R", "R, Pa on modes", "R, Pb, Pa"])
def test_lines_agree(name):
    system = fx.assemble(chains.SMALL[name])
    q, _ = chains.random_state(system.assembly, np.random.default_rng(3))
    for i, link in enumerate(system.robot.links):
        s = np.linspace(0, link.length_m, 7)
        mine = np.column_stack(system.assembly.line(q, i + 1, s))
        assert system.equations.line(q, i, s) == pytest.approx(mine, abs=1e-12)
