"""Equilibria: the elastica under a dead tip load, roll-up, and the geometric stiffness (51)."""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

import chains
from flexura.system.assembly import Assembly
from robots import beam, rigid, robot

# all 20 polynomials of a link: a slider without mass stands on its tip
WHOLE = robot(beam(1.0, 1.0, 1.0, 10), rigid(0.0, 0.0, 0.0, 0.0, "Pa", start=1.0))


def geometric(assembly, q, force):
    """The geometric stiffness (n, n) of joints R under a dead tip force (complex), by (51)."""
    S, g = np.zeros((assembly.n, assembly.n)), complex(*assembly.robot.gravity_m_s2)
    states = assembly.structure.states(q, 0 * q)
    load = assembly.robot.payload.mass_kg * g + force
    for state in reversed(states):
        for line in reversed(state.lines):
            gamma = np.real(
                np.conj(line.piece.weights * line.free * load + line.piece.s * g) * line.e
            )
            turning = np.real(-1j * line.E / line.e[:, None])
            S += turning.T @ (gamma[:, None] * turning)
            load += line.piece.mass.sum() * g
        load += assembly.robot.links[state.number].joint.hub_mass_kg * g
    return S


def equilibrium(assembly, force, moment=0.0, steps=1):
    """q with joints held at their start under a dead tip force and moment (50)."""
    q, free = np.zeros(assembly.n), np.setdiff1d(np.arange(assembly.n), assembly.rows)
    q[assembly.rows] = assembly.robot.start
    for share in np.arange(1, steps + 1) / steps:
        for _ in range(60):
            tip = assembly.tip(q)
            load = np.real(tip.velocity.conj() * force * share) + tip.turning * moment * share
            R = (assembly.elastic(q) + assembly.gravity(q) - load)[free]
            S = (assembly.stiffness(q) + geometric(assembly, q, force * share))[np.ix_(free, free)]
            step = np.linalg.solve(S, -R)
            q[free] += step / max(1.0, np.abs(step).max())
            if np.abs(step).max() < 1e-13:
                break
        else:
            raise AssertionError("Newton's method does not converge")
    return q


def elastica(load):
    """x, y, slope of a cantilever's tip (L = EI = 1) under a dead transverse force."""
    first = lambda k: np.arcsin(1 / (k * np.sqrt(2)))
    reach = lambda k: ellipk(k**2) - ellipkinc(first(k), k**2)
    k = brentq(lambda k: reach(k) - np.sqrt(load), np.sqrt(0.5) + 1e-12, 1 - 1e-12, xtol=1e-15)
    sine, a = 2 * k**2 - 1, np.sqrt(load)
    return (
        np.sqrt(2 * sine) / a,
        1 - 2 * (ellipe(k**2) - ellipeinc(first(k), k**2)) / a,
        np.arcsin(sine),
    )


def test_the_elliptic_integrals_give_the_published_elastica():
    x, y, slope = elastica(2.0)
    assert (1 - x, y, slope) == pytest.approx((0.160642, 0.493457, 0.781750), abs=1e-6)


@pytest.mark.parametrize(
    "load, error", [(1.0, 1e-5), (2.0, 1e-5), (5.0, 1e-5), (10.0, 1e-5), (25.0, 3e-5)]
)
def test_the_elastica(load, error):
    assembly = Assembly(robot(beam(1.0, 1.0, 1.0, 8)))
    tip = assembly.tip(equilibrium(assembly, 1j * load, steps=1 if load < 5 else 4))
    x, y, slope = elastica(load)
    assert (tip.place.real, tip.place.imag, tip.angle) == pytest.approx((x, y, slope), abs=error)


def test_the_elastica_of_a_link_in_one_piece():
    """With 20 polynomials the tip is right to the interpolation's 1e-8."""
    assembly = Assembly(WHOLE)
    tip = assembly.tip(equilibrium(assembly, 10j, steps=4))
    assert (tip.place.real, tip.place.imag, tip.angle) == pytest.approx(elastica(10.0), abs=1e-8)


def test_a_moment_rolls_the_link_up():
    """A tip moment 2 pi EI / L bends a link into a circle: the tip is at the root."""
    assembly = Assembly(robot(beam(1.0, 1.0, 1.0, 8)))
    tip = assembly.tip(equilibrium(assembly, 0j, 2 * np.pi))
    assert tip.angle == pytest.approx(2 * np.pi, abs=1e-12) and abs(tip.place) < 1e-10


def test_euler_s_load_makes_the_tangent_singular():
    """P = pi^2 EI / (4 L^2) along a clamped link: the least eigenvalue of the tangent is zero."""
    for chain, error in ((robot(beam(1.0, 1.0, 1.0, 16)), 1e-6), (WHOLE, 1e-9)):
        assembly = Assembly(chain)
        q = np.append(np.zeros(assembly.n - 1), chain.start[-1])
        own = slice(1, assembly.rows[1] if len(assembly.rows) > 1 else None)
        tangent = lambda P, a=assembly, q=q, own=own: (a.stiffness(q) + geometric(a, q, -P + 0j))[
            own, own
        ]
        assert brentq(lambda P, t=tangent: np.linalg.eigvalsh(t(P))[0], 2.0, 3.0) == pytest.approx(
            np.pi**2 / 4, rel=error
        )


@pytest.mark.parametrize("name", ["R", "R, kink", "R, modes, R"])
def test_the_geometric_stiffness_is_the_slope_of_the_loads(name):
    assembly = Assembly(chains.SMALL[name])
    q, _ = chains.random_state(assembly, np.random.default_rng(3))
    load = lambda x: assembly.gravity(x) - np.real(assembly.tip(x).velocity.conj() * (2 - 3j))
    want = chains.slopes(load, q, 1e-4)
    assert geometric(assembly, q, 2 - 3j) == pytest.approx(want, abs=1e-8 * np.abs(want).max())
