"""Equations of docs/theory/15-internal-forces.md, written down with sums over many points and
differences in time."""

import numpy as np
import pytest

import flexura as fx
from robots import beam, rigid, robot

ALPHA, BETA, EI, RHO, LENGTH, RADIUS = 2.5, 1e-3, 2.0, 0.3, 0.6, 0.1
MASS, INERTIA, AT, A, B = 0.2, 2e-3, 0.45, 0.05, -0.03  # of a body; of the payload A, B
HUB, HUB_INERTIA, G = 0.5, 0.01, 0.5 - 9.81j


def arm(elements=4, **more):
    """A flexible link with hub, radius, lump and damping, and another one at its tip."""
    damping = {"alpha_1_s": ALPHA, "beta_s": BETA}
    hub = {"hub_mass_kg": HUB, "hub_inertia_kg_m2": HUB_INERTIA, "hub_radius_m": RADIUS}
    one = beam(LENGTH, RHO, EI, elements, damping=damping, **hub, **more)
    one["mass"] = [{"at_m": AT, "mass_kg": MASS, "inertia_kg_m2": INERTIA}]
    two = beam(0.4, RHO, EI, 2, start_rad=0.4)
    bot = robot(one, two, gravity=(G.real, G.imag), payload=MASS, payload_inertia=INERTIA)
    return fx.assemble(bot.replace({"payload.centre_of_mass_m": [A, B]}))


def state(system, seed=1):
    random = np.random.default_rng(seed)
    return [system.start() + 0.03 * random.normal(size=system.n)] + [
        random.normal(size=system.n) for _ in range(2)
    ]


def accelerated(q, qd, qdd, of, h=1e-3):
    """Value and second derivative in time of a function of q, by differences of fourth order."""
    at = [of(q + t * qd + t * t / 2 * qdd) for t in (-2 * h, -h, 0.0, h, 2 * h)]
    return at[2], (16 * (at[1] + at[3]) - at[0] - at[4] - 30 * at[2]) / (12 * h * h)


def points(system, link, low, high, count=80):
    """Abscissas and masses of a link's material by Gauss's rule, on elements of equal length."""
    u, w = np.polynomial.legendre.leggauss(8)
    ends = np.linspace(low, high, count + 1)
    s = (ends[:-1, None] + np.diff(ends)[:, None] * (u + 1) / 2).ravel()
    return s, RHO * (np.diff(ends)[:, None] * w / 2).ravel()


def place(system, link, s):
    """Places (complex) and angles of a link, as a function of q."""

    def of(q):
        x, y, angle = system.line(q, link, s)
        return np.stack([x + 1j * y, angle])

    return of


def beyond(system, q, qd, qdd, low, about):
    """(139), (140) of what lies beyond the abscissa `low` of link 1, about a place."""
    parts = []
    for link, start, end in ((1, low, LENGTH), (2, 0.0, 0.4)):
        s, mass = points(system, link, start, end)
        (r, _), (a, _) = accelerated(q, qd, qdd, place(system, link, s))
        parts.append((mass, r, a, 0.0))
    tip = place(system, 2, [0.4])
    centre = lambda z: tip(z)[0] + (A + 1j * B) * np.exp(1j * tip(z)[1].real)
    bodies = [(lambda z: tip(z)[1], centre)]
    if low <= AT:
        lump = place(system, 1, [AT])
        bodies.append((lambda z: lump(z)[1], lambda z: lump(z)[0]))
    for angle, middle in bodies:
        r, a = accelerated(q, qd, qdd, middle)
        turning = accelerated(q, qd, qdd, angle)[1].real
        parts.append((np.array([MASS]), r, a, INERTIA * turning[0]))
    force = sum(np.sum(mass * (a - G)) for mass, _, a, _ in parts)
    cross = lambda m, r, a: np.sum(((r - about).conj() * m * (a - G)).imag)
    return force, sum(cross(m, r, a) + own for m, r, a, own in parts)


def test_force_and_moment_of_a_joint():
    """Sums over many points, with the hub on the axis, a load at the tip, and the second joint.

    Equations: 139, 140
    """
    system = arm()
    q, qd, qdd = state(system)
    load, moment = 0.3 + 0.7j, 0.11
    found = fx.internal_forces(
        system, q, qd, qdd, tip_force=(load.real, load.imag), tip_moment=moment
    )
    tip = place(system, 2, [0.4])(q)[0][0]
    R, S = beyond(system, q, qd, qdd, 0.0, 0j)
    R, S = R - load - HUB * G, S - (tip.conjugate() * load).imag - moment + HUB_INERTIA * qdd[0]
    own = found.reaction(1)
    assert own.place == 0 and own.force == pytest.approx(R, rel=1e-6)
    assert own.moment == pytest.approx(S, rel=1e-6)
    inner = place(system, 2, [0.0])(q)[0][0]
    assert found.reaction(2).place == pytest.approx(inner)
    only = fx.internal_forces(system, q, qd, qdd).reaction(2)
    assert found.reaction(2).force == pytest.approx(only.force - load)
    lever = ((tip - inner).conjugate() * load).imag
    assert found.reaction(2).moment == pytest.approx(only.moment - lever - moment)


@pytest.mark.parametrize("s", [0.0, 0.2, 0.5])
def test_forces_in_a_section(s):
    """The cut's force along and across the tangent, with the damping in proportion to the mass.

    Equations: 141, 143
    """
    system = arm()
    q, qd, qdd = state(system)
    (p,), (angle,) = place(system, 1, [s])(q)
    t, hub = np.exp(1j * angle.real), np.exp(1j * q[0])
    R, S = beyond(system, q, qd, qdd, s, p)
    x, mass = points(system, 1, s, LENGTH)
    own = system.link_rows(0)
    turn = lambda at: system.angles(1, np.atleast_1d(at))[:, own] @ qd[own]

    def rise(at):
        u, w = np.polynomial.legendre.leggauss(8)
        ends = np.linspace(0.0, at, 13)  # kinks at the elements' ends are among these for AT
        u = (ends[:-1, None] + np.diff(ends)[:, None] * (u + 1) / 2).ravel()
        return (np.diff(ends)[:, None] * w / 2).ravel() @ turn(u)

    rates = np.array([rise(at) for at in x])
    f, m = -ALPHA * 1j * hub * mass @ rates, -ALPHA * (mass * rates) @ (x - s)
    if s <= AT:
        f -= ALPHA * MASS * 1j * hub * rise(AT)
        m -= ALPHA * (MASS * rise(AT) * (AT - s) + INERTIA * turn(AT)[0])
    R, S = R - f, S - m
    found = fx.internal_forces(system, q, qd, qdd).link(1, [s])
    near = {"rel": 2e-4, "abs": 2e-4}
    assert found.axial_force == pytest.approx([-(t.conjugate() * R).real], **near)
    assert found.shear_force == pytest.approx([-((1j * t).conjugate() * R).real], **near)
    assert found.bending_moment == pytest.approx([-S], **near)


def test_the_slope_of_the_bending_moment():
    """dM/ds = -Q in a link without damping in proportion to its mass, by differences; the place of
    a coarse mesh turns with its angle to the error of (4) only.

    Equations: 142
    """
    system = fx.assemble(arm(16).robot.replace({"link.1.damping": {"beta_s": BETA}}))
    q, qd, qdd = state(system)
    found = fx.internal_forces(system, q, qd, qdd).link(1, [0.2, 0.2 - 1e-4, 0.2 + 1e-4])
    M = found.bending_moment
    assert (M[2] - M[1]) / 2e-4 == pytest.approx(-found.shear_force[0], rel=1e-4)


def test_what_a_joint_transmits_of_its_drive():
    """The joint's row of Lagrange's equations, for R and for a Pa on a bent link.

    Equations: 144
    """
    one = beam(0.6, RHO, EI, 4)
    two = rigid(0.3, 0.2, 0.1, 0.01, type="Pa", start_m=0.35, angle_rad=0.4)
    two["joint"] |= {"rotor_mass_kg": 0.3, "viscous_friction_N_s_m": 0.7}
    two["joint"]["spring"] = {"stiffness_N_m": 5.0, "rest_m": 0.1}
    system = fx.assemble(robot(one, two, gravity=(0.0, -9.81)))
    q, qd, qdd = state(system)
    F, row = system.forces(q, qd, qdd), system.joint_rows[1]
    found = fx.internal_forces(system, q, qd, qdd)
    assert found.reaction(1).moment == pytest.approx(F[0], rel=1e-11)
    line = place(system, 1, np.array([q[row] - 1e-5, q[row] + 1e-5]))(q)
    tau = (line[0][1] - line[0][0]) / 2e-5
    kappa = (line[1][1] - line[1][0]).real / 2e-5
    own = found.reaction(2)
    F0 = F[row] - 0.3 * qdd[row] - 0.7 * qd[row] - 5.0 * (q[row] - 0.1)
    assert (tau.conjugate() * own.force).real + kappa * own.moment == pytest.approx(F0, rel=1e-7)


def test_the_bending_moment_by_curvature():
    """EI times the curvature and beta times its rate, in a robot that moves by (25).

    Equations: 145
    """
    system = fx.assemble(arm(16).robot.replace({"link.1.damping": {"beta_s": BETA}}))
    system = fx.assemble(system.robot.replace({"link.1.mass": []}))
    q = fx.static(system)
    qd = -20.0 * q
    qdd = system.accelerations(q, qd, np.zeros(system.n))
    s, h = 0.3 + LENGTH / 32, 1e-5
    slope = (system.angles(1, [s + h]) - system.angles(1, [s - h]))[0] / (2 * h)
    M = EI * slope @ (q + BETA * qd)
    assert abs(EI * BETA * slope @ qd) > 0.01 * abs(M)
    found = fx.internal_forces(system, q, qd, qdd).link(1, [s]).bending_moment[0]
    assert found == pytest.approx(M, rel=3e-3)


def test_the_stress_of_a_fibre():
    """Of a box: half the height over the second moment of area.

    Equations: 146
    """
    b, h, wall, P = 0.02, 0.03, 0.002, 5.0
    box = {"shape": "box", "width_m": b, "height_m": h, "wall_m": wall}
    link = {"length_m": 0.5, "elements": 4, "section": box, "joint": {"type": "R", "locked": True}}
    made = robot(link | {"young_modulus_Pa": 7e10, "density_kg_m3": 2700.0})
    second = (b * h**3 - (b - 2 * wall) * (h - 2 * wall) ** 3) / 12
    found = fx.internal_forces(made, tip_force=(0.0, P)).link(1, [0.1])
    assert found.stress == pytest.approx(-found.bending_moment * (h / 2) / second, rel=1e-12)
    assert found.stress == pytest.approx([-P * 0.4 * (h / 2) / second], rel=1e-4)
