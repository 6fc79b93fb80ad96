"""Equations of docs/theory/12-springs-and-masses.md, written down with plain NumPy."""

import numpy as np
import pytest

import flexura as fx
from robots import beam, rigid, robot

KS, REST, KG, CG, JR = 7.0, 0.3, 25.0, 0.4, 0.06
LENGTH, RHO, EI, RADIUS = 0.6, 0.3, 2.0, 0.15
MASS, INERTIA, A, B = 0.2, 2e-3, 0.1, -0.07  # of a body, and its centre
AT = 0.45  # where a lump is: at a node of four elements


def arm(**changes):
    """A geared flexible link with all of it."""
    table = beam(LENGTH, RHO, EI, 4, hub_mass_kg=0.5, hub_inertia_kg_m2=0.01)
    table["mass"] = [{"at_m": AT, "mass_kg": MASS, "inertia_kg_m2": INERTIA}]
    table["joint"] |= {
        "hub_radius_m": RADIUS,
        "spring": {"stiffness_N_m_rad": KS, "rest_rad": REST},
        "rotor_inertia_kg_m2": JR,
        "transmission": {"stiffness_N_m_rad": KG, "damping_N_m_s_rad": CG},
    }
    bot = robot(table, payload=MASS, payload_inertia=INERTIA)
    return fx.assemble(bot.replace({"payload.centre_of_mass_m": [A, B]} | changes))


def state(system, seed=1):
    random = np.random.default_rng(seed)
    return 0.3 * random.normal(size=system.n), random.normal(size=system.n)


def moved(system, q, qd, of, h=1e-6):
    """Value and rate of a function of q."""
    return of(q), (of(q + h * qd) - of(q - h * qd)) / (2 * h)


def body_energy(system, q, qd, of):
    """Kinetic energy (111) of a body whose place and angle are a function of q."""
    _, rate = moved(system, q, qd, of)
    return 0.5 * MASS * (rate[0] ** 2 + rate[1] ** 2) + 0.5 * INERTIA * rate[2] ** 2


def kinetic(system, q, qd):
    row = system.equations.observe(q[None], qd[None], 2)[0]
    assert row[-3] == pytest.approx(0.5 * qd @ system.mass(q) @ qd, rel=1e-12)
    return row[-3]


def test_a_spring_beside_a_drive():
    """The energy and the force of the spring, in core and assembly.

    Equations: 108
    """
    with_spring, without = arm(), arm(**{"link.1.joint.spring.stiffness_N_m_rad": 0.0})
    q, qd = state(with_spring)
    push = np.zeros(with_spring.n)
    push[0] = KS * (q[0] - REST)
    assert with_spring.elastic(q) - without.elastic(q) == pytest.approx(push, abs=1e-12)
    V = [s.equations.observe(q[None], qd[None], 2)[0, -2] for s in (with_spring, without)]
    assert V[0] - V[1] == pytest.approx(KS / 2 * (q[0] - REST) ** 2, rel=1e-9)
    zero = np.zeros(with_spring.n)
    a = [s.equations.forces(q, zero, zero, True, True, True) for s in (with_spring, without)]
    assert a[0] - a[1] == pytest.approx(push, abs=1e-12)


def test_a_transmission():
    """Rotor, windup and hub: energies, loss, and the angle of the hub.

    Equations: 109
    """
    system = arm()
    q, qd = state(system)
    stiff = arm(**{"link.1.joint.transmission.stiffness_N_m_rad": 2 * KG})
    V = [s.equations.observe(q[None], qd[None], 2)[0, -2] for s in (stiff, system)]
    assert V[0] - V[1] == pytest.approx(KG / 2 * q[1] ** 2, rel=1e-9)
    heavy = arm(**{"link.1.joint.rotor_inertia_kg_m2": 2 * JR})
    assert kinetic(heavy, q, qd) - kinetic(system, q, qd) == pytest.approx(JR / 2 * qd[0] ** 2)
    assert system.equations.loss(q, qd) == pytest.approx(CG * qd[1] ** 2)
    assert system.line(q, 1, [0.0])[2] == pytest.approx([q[0] + q[1]])
    assert system.labels[:2] == ("joint/1 [rad]", "link/1/windup [rad]")


def test_a_lumped_mass():
    """The kinetic energy of a lump at a node, from the line's place there.

    Equations: 110
    """
    system, q, qd = arm(), *state(arm())
    bare = (
        fx.assemble(system.robot.replace({"link.1.mass.1.mass_kg": 0.0})),
        fx.assemble(
            system.robot.replace({"link.1.mass.1.mass_kg": 0.0, "link.1.mass.1.inertia_kg_m2": 0.0})
        ),
    )
    of = lambda z: np.array([x[0] for x in system.line(z, 1, [AT])])
    own = kinetic(system, q, qd) - kinetic(bare[1], q, qd)
    assert own == pytest.approx(body_energy(system, q, qd, of), rel=1e-6)
    turning = moved(system, q, qd, of)[1][2]
    assert kinetic(bare[0], q, qd) - kinetic(bare[1], q, qd) == pytest.approx(
        INERTIA / 2 * turning**2, rel=1e-6
    )


def test_a_centre_off_the_line():
    """The kinetic energy of a payload off the tip, and of a rigid link off its line.

    Equations: 111
    """
    system, q, qd = arm(), *state(arm())
    bare = arm(**{"payload.mass_kg": 0.0, "payload.inertia_kg_m2": 0.0})

    def centre(z):
        x, y, angle = fx.tip_pose(system, z)
        c, s = np.cos(angle), np.sin(angle)
        return np.array([x + A * c - B * s, y + A * s + B * c, angle])

    own = kinetic(system, q, qd) - kinetic(bare, q, qd)
    assert own == pytest.approx(body_energy(system, q, qd, centre), rel=1e-6)
    body = rigid(0.4, MASS, 0.0, INERTIA) | {"centre_of_mass_m": [A, B]}
    one = fx.assemble(robot(body, gravity=(0.0, -9.81)))
    assert one.mass(np.zeros(1))[0, 0] == pytest.approx(INERTIA + MASS * (A**2 + B**2))
    level, turned = (one.gravity(np.array([x]))[0] for x in (0.0, np.pi / 2))
    assert (level, turned) == pytest.approx((MASS * 9.81 * A, -MASS * 9.81 * B))


def test_a_hub_with_a_radius():
    """Where the line begins, and that the hub's mass stays at the axis.

    Equations: 112
    """
    system, q, qd = arm(), *state(arm())
    phi = q[0] + q[1]
    x, y, _ = system.line(q, 1, [0.0])
    assert (x[0], y[0]) == pytest.approx((RADIUS * np.cos(phi), RADIUS * np.sin(phi)))
    heavy = arm(**{"link.1.joint.hub_mass_kg": 5.0})
    assert kinetic(heavy, q, qd) == pytest.approx(kinetic(system, q, qd), rel=1e-12)
    turning = arm(**{"link.1.joint.hub_inertia_kg_m2": 0.03})
    gain = kinetic(turning, q, qd) - kinetic(system, q, qd)
    assert gain == pytest.approx(0.01 * (qd[0] + qd[1]) ** 2, rel=1e-9)
