"""Equations of docs/theory/03-equations-of-motion.md, written down with plain NumPy,
against the system and the core."""

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from numpy.polynomial.polynomial import polyfromroots, polyint, polyval

import robots

L, RHO, EI = 0.5, 0.3, 0.8
CARRIAGE = 0.4
RNG = np.random.default_rng(2)


class Element:
    """A uniform link of one element: the places, weights and constants of its three points."""

    def __init__(self, length=L, rho=RHO):
        x, _ = leggauss(3)
        self.x = (1 + x) / 2
        powers = [
            polyint(polyfromroots(np.delete(self.x, j)) / np.prod(self.x[j] - np.delete(self.x, j)))
            for j in range(3)
        ]
        y, dy = leggauss(20)
        w = length * np.column_stack([polyval((1 + y) / 2, p) for p in powers])
        dm = rho * length * dy / 2
        self.m, self.s, self.W = rho * length, dm @ w, w.T @ (dm[:, None] * w)
        self.w_tip = length * np.array([polyval(1.0, p) for p in powers])
        self.B = np.column_stack([self.x, 6 * self.x * (1 - self.x)])


def cart(gravity=(0.0, 0.0), link=None, **keys):
    """A carriage that carries a link of one element: q = [place, angle, rotation, bubble]."""
    first = robots.rigid(0.0, CARRIAGE, 0.0, 0.0, "Pa")
    return robots.system(first, robots.beam(L, RHO, EI, 1, **(link or {})), gravity=gravity, **keys)


def state(n=4, scale=0.7):
    return [scale * RNG.normal(size=n) for _ in range(3)]


def dot(a, b):
    return np.real(np.conj(a) * b)


def test_the_kinetic_energy_of_a_piece():
    """A bent link on a carriage.

    Equations: 20
    """
    system, c, (q, qd, _) = cart(), Element(), state()
    e, spin, v = np.exp(1j * (q[1] + c.B @ q[2:])), qd[1] + c.B @ qd[2:], qd[0] + 0j
    energy = 0.5 * c.m * abs(v) ** 2 + dot(v, c.s @ (1j * e * spin))
    energy += 0.5 * spin @ (c.W * dot(e[:, None], e)) @ spin
    found = system.assembly.energies(q, qd).kinetic - 0.5 * CARRIAGE * qd[0] ** 2
    assert found == pytest.approx(energy, rel=1e-12)
    assert system.observe(q[None], qd[None])[0, -3] == pytest.approx(
        energy + 0.5 * CARRIAGE * qd[0] ** 2, rel=1e-12
    )


def test_the_kinetic_energy_of_a_hub_and_a_rotor():
    """What the keys of a joint add.

    Equations: 21
    """
    (q, qd, _), keys = (
        state(),
        {"hub_mass_kg": 0.2, "hub_inertia_kg_m2": 0.03, "rotor_inertia": 0.01},
    )
    plain, full = (cart(link=link).observe(q[None], qd[None])[0, -3] for link in ({}, keys))
    added = 0.5 * 0.2 * qd[0] ** 2 + 0.5 * 0.03 * qd[1] ** 2 + 0.5 * 0.01 * qd[1] ** 2
    assert full - plain == pytest.approx(added, rel=1e-11)


def test_the_kinetic_energy_of_a_payload_with_rotary_inertia():
    """A payload at the tip of a bent link.

    Equations: 22
    """
    c, (q, qd, _) = Element(), state()
    e, spin = np.exp(1j * (q[1] + c.B @ q[2:])), qd[1] + c.B @ qd[2:]
    tip, turning = qd[0] + c.w_tip @ (1j * e * spin), qd[1] + qd[2]
    added = 0.5 * 0.3 * abs(tip) ** 2 + 0.5 * 0.02 * turning**2
    plain, full = cart(), cart(payload=0.3, payload_inertia=0.02)
    for energy in (
        lambda s: s.observe(q[None], qd[None])[0, -3],
        lambda s: s.assembly.energies(q, qd).kinetic,
    ):
        assert energy(full) - energy(plain) == pytest.approx(added, rel=1e-11)


def test_the_potential_of_gravity():
    """The masses of a bent link, its carriage and its payload.

    Equations: 23
    """
    system, c, (q, qd, _) = cart((1.5, -9.81), payload=0.3), Element(), state()
    e, g = np.exp(1j * (q[1] + c.B @ q[2:])), 1.5 - 9.81j
    moments = CARRIAGE * q[0] + c.m * q[0] + c.s @ e + 0.3 * (q[0] + c.w_tip @ e)
    assert system.observe(q[None], qd[None])[0, -1] == pytest.approx(-dot(g, moments), rel=1e-12)
    assert system.assembly.energies(q, qd).potential == pytest.approx(-dot(g, moments), rel=1e-12)


def arm(**link):
    """A slider, a bent link with two elements, a rigid link."""
    return robots.system(
        robots.rigid(0.1, 0.4, 0.05, 1e-3, "Pa", angle_rad=0.2),
        robots.beam(L, RHO, EI, 2, hub_mass_kg=0.1, **link),
        robots.rigid(0.3, 0.2, 0.1, 2e-3),
        gravity=(0.0, -9.81),
        payload=0.1,
        payload_inertia=1e-3,
    )


def test_lagranges_equations():
    """The forces are the derivatives of the energies, by differences of a run's own channels.

    Equations: 24
    """
    system = arm()
    q, qd, qdd = state(system.n, 0.5)

    def energies(q, qd):
        return system.observe(q[None], qd[None])[0, -3:]

    one, h = np.eye(system.n), 1e-4

    def momenta(q, qd):  # of a quadratic form, so that differences are exact
        return np.array([(energies(q, qd + e)[0] - energies(q, qd - e)[0]) / 2 for e in one])

    def slope(f, h):  # of fourth order
        return (8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h)

    inertia = slope(lambda t: momenta(q + t * qd + 0.5 * t * t * qdd, qd + t * qdd), h)
    forces = [slope(lambda t, e=e: energies(q + t * e, qd) @ [-1, 1, 1], h) for e in one]
    assert system.forces(q, qd, qdd) == pytest.approx(inertia + forces, rel=1e-6, abs=1e-7)


def test_the_equations_of_motion_of_a_two_link_arm():
    """The textbook's equations of a rigid arm with friction, and their solution in the core.

    Equations: 25
    """
    (l1, c1, m1, J1), (c2, m2, J2), g = (0.4, 0.15, 1.2, 0.02), (0.2, 0.7, 0.01), 9.81
    first = robots.rigid(
        l1, m1, c1, J1, viscous_friction=0.3, coulomb_friction=0.05, rotor_inertia=0.02
    )
    system = robots.system(first, robots.rigid(0.5, m2, c2, J2), gravity=(0.0, -g))
    q, qd, qdd = state(2)
    a, b = m2 * l1 * c2 * np.cos(q[1]), m2 * l1 * c2 * np.sin(q[1])
    M22 = J2 + m2 * c2**2
    M11 = J1 + m1 * c1**2 + m2 * l1**2 + M22 + 2 * a
    M = np.array([[M11 + 0.02, M22 + a], [M22 + a, M22]])
    h = np.array([-b * (2 * qd[0] * qd[1] + qd[1] ** 2), b * qd[0] ** 2])
    reach2 = m2 * c2 * np.cos(q[0] + q[1])
    G = g * np.array([(m1 * c1 + m2 * l1) * np.cos(q[0]) + reach2, reach2])
    forces = M @ qdd + h + np.array([0.3, 0.0]) * qd + G
    assert system.forces(q, qd, qdd) == pytest.approx(forces, rel=1e-12)
    assert system.accelerations(q, qd, forces) == pytest.approx(qdd, rel=1e-11)
    friction = np.array([0.05 * np.tanh(qd[0] / 1e-3), 0.0])
    assert system.assembly.coulomb(qd) == pytest.approx(friction, rel=1e-13)


def test_rayleigh_damping():
    """A clamped link with a payload, and a joint with viscous friction.

    Equations: 26
    """
    alpha, beta, c = 0.4, 2e-3, Element()
    link = {"damping": {"alpha_1_s": alpha, "beta_s": beta}, "viscous_friction": 0.7}
    D = cart(link=link, payload=0.3, payload_inertia=0.02).damping
    tip = c.B.T @ c.w_tip
    M = c.B.T @ c.W @ c.B + 0.3 * np.outer(tip, tip)
    M[0, 0] += 0.02  # the shapes at the tip are (1, 0)
    expected = np.zeros((4, 4))
    expected[1, 1] = 0.7
    expected[2:, 2:] = alpha * M + beta * EI / L * np.diag([1, 12])
    assert D == pytest.approx(expected, rel=1e-11, abs=1e-15)


def test_the_balance_of_energy_and_the_loss():
    """Along the motion that follows, energies rise by the work less the loss.

    Equations: 27, 28
    """
    system = arm(
        damping={"alpha_1_s": 0.1, "beta_s": 1e-3}, viscous_friction=0.2, coulomb_friction=0.3
    )
    q, qd, _ = state(system.n, 0.4)
    drives = np.array([3.0, -1.0, 0.5])
    force = np.zeros(system.n)
    force[system.joint_rows] = drives
    friction = np.zeros(system.n)
    friction[system.joint_rows] = np.array([0.0, 0.3, 0.0]) * np.tanh(qd[system.joint_rows] / 1e-3)
    a = system.accelerations(q, qd, force - friction)

    def total(t):
        return system.observe((q + t * qd + 0.5 * t * t * a)[None], (qd + t * a)[None])[
            0, -3:
        ].sum()

    h = 1e-5
    rise = (8 * (total(h) - total(-h)) - (total(2 * h) - total(-2 * h))) / (12 * h)
    P = qd @ system.damping @ qd + friction @ qd
    assert system.equations.loss(q, qd) == pytest.approx(P, rel=1e-11)
    assert P > 0
    assert rise == pytest.approx(drives @ qd[system.joint_rows] - P, rel=1e-6, abs=1e-6)
