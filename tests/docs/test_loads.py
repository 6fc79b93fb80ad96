"""Equations of docs/theory/14-loads.md, written down with plain NumPy."""

import numpy as np
import pytest

import flexura as fx
from flexura.signals import Loads
from flexura.system import acting_loads, impact, load_forces
from robots import beam, rigid, robot

GRAVITY = (0.4, -2.0)
CHAINS = {
    "RR": (beam(0.5, 0.2, 1.0, 3), beam(0.4, 0.2, 1.0, 2, modes=2)),
    "R hub R": (beam(0.5, 0.2, 1.0, 2, hub_radius_m=0.1), rigid(0.4, 0.2, 0.2, 1e-3)),
    "R Pa": (beam(0.6, 0.2, 1.0, 3), beam(0.3, 0.2, 1.0, 2, type="Pa", start=0.25, angle_rad=0.4)),
    "R Pb": (rigid(0.4, 0.3, 0.2, 1e-3), beam(0.6, 0.2, 1.0, 3, type="Pb", start=0.35)),
    "R Pb rigid": (rigid(0.4, 0.3, 0.2, 1e-3), rigid(0.5, 0.3, 0.2, 1e-3, type="Pb", start=0.3)),
}


def loaded(name, stiffening=True):
    """A robot, a state of it, and loads on both links: forces in both frames, and a moment."""
    system = fx.assemble(robot(*CHAINS[name], gravity=GRAVITY, stiffening=stiffening))
    random = np.random.default_rng(3)
    q = system.start() + 0.2 * random.normal(size=system.n) * (system.start() == 0)
    lengths = [link.length_m for link in system.robot.links]
    each = [
        fx.Load(1, 0.4 * lengths[0], [1.0, -0.3], moment_N_m=0.2),
        fx.Load(2, 0.8 * lengths[1], [0.5, 0.7], frame="link"),
        fx.Load(2, 0.1 * lengths[1], [0.2, -0.1], moment_N_m=-0.3),  # of a Pb: in the sleeve
        fx.Load(2, lengths[1], [-0.4, 0.6], moment_N_m=0.1, frame="link"),
    ]
    return system, q, Loads(tuple(each))


def place(system, q, load):
    """x, y, angle at a load."""
    return np.array([part[0] for part in system.line(q, load.link, [load.at_m])])


def force_of(system, q, load):
    """(134): the force's components in the base's axes, and the moment."""
    f1, f2, m = load.at(0.0)
    turn = np.exp(1j * place(system, q, load)[2]) if load.frame == "link" else 1.0
    f = (f1 + 1j * f2) * turn
    return np.array([f.real, f.imag, m])


@pytest.mark.parametrize("stiffening", [True, False])
@pytest.mark.parametrize("name", CHAINS)
def test_virtual_work_of_loads(name, stiffening):
    """Core and assembly against differences of places and angles.

    Equations: 133, 134
    """
    system, q, loads = loaded(name, stiffening)
    expected, h = np.zeros(system.n), 1e-6
    for load in loads.each:
        acts = force_of(system, q, load)
        for k in range(system.n):
            step = h * np.eye(system.n)[k]
            moved = place(system, q + step, load) - place(system, q - step, load)
            expected[k] += acts @ moved / (2 * h)
    found = load_forces(system, q[None], loads, np.zeros(1))[0]
    assert found == pytest.approx(expected, abs=2e-8)
    dense = system.assembly.loads(q, loads.rows, loads.values(0.0))
    assert found == pytest.approx(dense, abs=1e-12)
    in_base = [force_of(system, q, load) for load in loads.each]
    assert acting_loads(system, q, loads, 0.0) == pytest.approx(np.array(in_base), abs=1e-12)


@pytest.mark.parametrize("name", CHAINS)
def test_power_of_the_loads(name):
    """The rate of kinetic energy of a robot at rest under loads alone, and the power of (135).

    Equations: 135
    """
    system, q, loads = loaded(name)
    qd = np.random.default_rng(4).normal(size=system.n)
    h, power = 1e-6, 0.0
    for load in loads.each:
        rate = (place(system, q + h * qd, load) - place(system, q - h * qd, load)) / (2 * h)
        power += force_of(system, q, load) @ rate
    Q = load_forces(system, q[None], loads, np.zeros(1))[0]
    assert Q @ qd == pytest.approx(power, abs=1e-7)
    a = system.accelerations(q, qd, Q) - system.accelerations(q, qd, np.zeros(system.n))
    assert qd @ system.mass(q) @ a == pytest.approx(power, rel=1e-7)


@pytest.mark.parametrize("stiffening", [True, False])
def test_a_static_equilibrium_under_loads(stiffening):
    """Elastic forces, gravity and loads are in balance in the elastic rows.

    Equations: 136
    """
    system, _, loads = loaded("RR", stiffening)
    q = fx.static(system, loads=loads)
    Q = load_forces(system, q[None], loads, np.zeros(1))[0]
    left = system.elastic(q) + system.gravity(q) - Q
    assert np.abs(left[system.elastic_rows]).max() < 1e-9
    assert np.abs(Q[system.elastic_rows]).max() > 0.1


def carrying(mass, inertia=0.0):
    """A two-link arm with a payload of this mass."""
    return fx.assemble(
        robot(*CHAINS["RR"][:1], rigid(0.3, 0.2, 0.1, 1e-3), payload=mass, payload_inertia=inertia)
    )


def test_momentum_where_a_payload_is_taken_up():
    """Rates from the core's mass matrices with and without it, and the energy in both forms.

    Equations: 137, 138
    """
    before, after = carrying(0.1, 1e-3), carrying(0.25, 3e-3)
    random = np.random.default_rng(5)
    q, v = 0.3 * random.normal(size=before.n), random.normal(size=before.n)
    M0, M = before.equations.mass(q), after.equations.mass(q)
    expected = np.linalg.solve(M, M0 @ v)
    found = impact(before, after, q, v, np.zeros(0, dtype=int))
    assert found.qd == pytest.approx(expected, rel=1e-9)
    fall = 0.5 * v @ M0 @ v - 0.5 * expected @ M @ expected
    assert found.lost == pytest.approx(fall, rel=1e-9)
    change = v - expected
    carnot = 0.5 * change @ M0 @ change + 0.5 * expected @ (M - M0) @ expected
    assert fall == pytest.approx(carnot, rel=1e-9)
    back = impact(after, before, q, v, np.zeros(0, dtype=int))
    assert back.qd == pytest.approx(v) and back.lost == 0.0
    assert back.gone == pytest.approx(0.5 * v @ (M - M0) @ v, rel=1e-9)
