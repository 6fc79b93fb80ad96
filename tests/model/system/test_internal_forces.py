"""Joint reactions and forces along links: textbooks' beams, sums of momentum, the rows of
Lagrange's equations, and bending by curvature."""

import math

import numpy as np
import pytest

import flexura as fx
from flexura.system import Balance
from flexura.system.masses import Masses
from robots import beam, rigid, robot

L, EI, RHO, G = 0.4, 2.0, 0.3, 9.81
S = np.array([0.0, 0.07, 0.1, 0.25, L])


def test_a_cantilever_with_a_tip_force_and_its_own_weight():
    """M = P (L - s) - q (L - s)^2 / 2, V = P - q (L - s) for small bending; the clamp takes all
    of the weight, its own too."""
    q, P = RHO * 1e-4 * G, 1e-5
    arm = robot(beam(L, RHO, EI, 8, locked=True, hub_mass_kg=1.0), gravity=(0.0, -1e-4 * G))
    found = fx.internal_forces(arm, tip_force=(0.0, P))
    left = L - S
    own = found.link(1, S)
    assert own.bending_moment == pytest.approx(P * left - q * left**2 / 2, rel=1e-6, abs=1e-14)
    assert own.shear_force == pytest.approx(P - q * left, rel=1e-6, abs=1e-14)
    assert np.abs(own.axial_force).max() < 1e-4 * np.abs(own.shear_force).max()
    clamp = found.reaction(1)
    assert clamp.force == pytest.approx(1j * (q * L + 1e-4 * G - P), abs=1e-16)
    assert clamp.moment == pytest.approx(q * L**2 / 2 - P * L, rel=1e-6)


def test_the_stress_of_sections():
    """sigma = -M y / I at half the height; at a distance where one is given."""
    P, b, h = 1e-3, 0.02, 0.002
    strip = {"length_m": L, "elements": 4, "young_modulus_Pa": 2e11, "density_kg_m3": 7850.0}
    joint = {"joint": {"type": "R", "locked": True}}
    flat = robot(strip | joint | {"section": {"width_m": b, "height_m": h}})
    stress = fx.internal_forces(flat, tip_force=(0.0, P)).link(1, [0.1]).stress
    assert stress == pytest.approx([-6 * P * (L - 0.1) / (b * h**2)], rel=1e-4)
    ends = [{"at_m": 0.0, "shape": "round", "diameter_m": 0.01}]
    ends += [{"at_m": L, "shape": "round", "diameter_m": 0.006}]
    cone = robot(strip | joint | {"section": ends})
    stress = fx.internal_forces(cone, tip_force=(0.0, P)).link(1, [0.2]).stress
    assert stress == pytest.approx([-32 * P * 0.2 / (math.pi * 0.008**3)], rel=1e-4)
    general = robot(strip | joint | {"section": {"area_m2": b * h, "second_moment_m4": 1e-12}})
    assert fx.internal_forces(general).link(1).stress is None
    assert general.links[0].bending_stress(2.0, 0.1, 0.003) == pytest.approx(-2.0 * 0.003 / 1e-12)
    assert fx.internal_forces(robot(beam(L, RHO, EI) | joint)).link(1).stress is None


def test_a_turning_link_pulls():
    """N = mu omega^2 (L^2 - s^2) / 2 + m omega^2 L of a link that turns evenly, straight."""
    omega, m, radius = 7.0, 0.05, 0.03
    arm = robot(beam(L, RHO, EI, 4, hub_radius_m=radius, hub_mass_kg=1.0), payload=m)
    s = fx.assemble(arm)
    qd = np.zeros(s.n)
    qd[0] = omega
    found = fx.internal_forces(s, s.start(), qd)
    r, end = radius + S, radius + L
    pull = omega**2 * (RHO * (end**2 - r**2) / 2 + m * end)
    own = found.link(1, S)
    assert own.axial_force == pytest.approx(pull, rel=1e-12)
    assert np.abs(own.bending_moment).max() < 1e-12 > np.abs(own.shear_force).max()
    assert found.reaction(1).force == pytest.approx(-pull[0], rel=1e-12)


def test_a_swinging_rod_and_a_box_that_falls():
    """The pivot of a uniform rod at phi: m g (1 + 3 sin^2) / 4 and so on; none in free fall."""
    phi, rate, m = 0.6, 1.3, RHO * L
    rod = {"length_m": L, "mass_per_length_kg_m": RHO, "joint": {"type": "R"}}
    bar = fx.assemble(robot(rod, gravity=(0.0, -G)))
    more = -1.5 * G * math.cos(phi) / L
    found = fx.internal_forces(bar, [phi], [rate], [more])
    t = np.exp(1j * phi)
    centre = L / 2 * t * (1j * more - rate**2)
    assert found.reaction(1).force == pytest.approx(m * (centre + 1j * G), rel=1e-12)
    assert abs(found.reaction(1).moment) < 1e-14
    x = S / L  # a falling rod bends as m g cos(phi) x (1 - x)^2 L / 4
    moment = m * G * math.cos(phi) * L / 4 * x * (1 - x) ** 2
    assert found.link(1, S).bending_moment == pytest.approx(moment, abs=1e-14)
    rail = robot(
        beam(L, RHO, EI, 4, type="Pa", angle_rad=1.0, hub_mass_kg=0.3),
        beam(L, RHO, EI, 4, start_rad=0.5),
        gravity=(G, 0.0),
        payload=0.1,
    )
    run = fx.simulate(rail, [0.0, 0.1, 0.2], start="straight", internal_forces=True)
    assert run["joint/1/position"][-1] == pytest.approx(G * 0.2**2 / 2)
    within = [run[n] for n in run if "reaction" in n or "_force" in n or "moment" in n]
    assert len(within) == 8 + 2 * 27 and np.abs(within).max() < 1e-9


KINDS = ("R", "Pa", "Pa on a rigid link", "Pb", "rigid Pb")


def arm(kind, modes=None, **changes):
    """Three links with springs, gear, hub radius, lumps, taper and a payload off the tip."""
    more = {"modes": modes} if modes else {}
    one = beam(0.6, 0.3, 2.0, 4, hub_mass_kg=0.5, hub_inertia_kg_m2=0.01, **more)
    if kind == "Pa on a rigid link":
        one = rigid(0.6, 0.3, 0.2, 0.01, hub_mass_kg=0.5, hub_inertia_kg_m2=0.01)
    if kind != "Pa":
        lump = {"at_m": 0.45, "mass_kg": 0.2, "inertia_kg_m2": 0.0 if modes else 2e-3}
        one["mass"] = [lump]
    one["joint"] |= {
        "hub_radius_m": 0.1,
        "spring": {"stiffness_N_m_rad": 7.0, "rest_rad": 0.3},
        "rotor_inertia_kg_m2": 0.06,
        "viscous_friction_N_m_s_rad": 0.3,
        "transmission": {"stiffness_N_m_rad": 25.0, "damping_N_m_s_rad": 0.4},
    }
    own = {"start_m": 0.3, "angle_rad": 0.4, "hub_mass_kg": 0.3, "rotor_mass_kg": 0.2}
    taper = [{"at_m": 0.0, "value": 0.3}, {"at_m": 0.5, "value": 0.1}]
    two = {
        "R": lambda: beam(0.5, taper, 1.0, 4, start_rad=0.3, hub_mass_kg=0.3),
        "Pb": lambda: beam(0.5, taper, 1.0, 4, type="Pb", hub_inertia_kg_m2=0.01, **own),
        "rigid Pb": lambda: rigid(
            0.5, 0.4, 0.2, 0.01, type="Pb", viscous_friction_N_s_m=0.7, **own
        ),
    }.get(kind, lambda: beam(0.5, taper, 1.0, 4, type="Pa", hub_inertia_kg_m2=0.01, **own))()
    last = rigid(0.2, 0.1, 0.1, 0.001)
    made = robot(one, two, last, gravity=(0.5, -G), payload=0.1, payload_inertia=1e-3)
    return fx.assemble(made.replace({"payload.centre_of_mass_m": [0.05, -0.03]} | changes))


def state(system, seed=0, bent=0.02):
    """Some q, qd, qdd (n,), with small bending."""
    random = np.random.default_rng(seed)
    out = [bent * random.normal(size=system.n), *random.normal(size=(2, system.n))]
    for i, link in enumerate(system.robot.links):
        if link.modes:
            for each in out:
                each[system.link_rows(i)] *= 0.01
    out[0] += system.start()
    return out


def momentum(system, q, qd):
    """Momentum x, y and moment of momentum about the origin, from the columns of all masses."""
    line, turn = 0j, 0.0
    for link in system.assembly.structure.states(q, qd):
        for part in system.assembly.structure.masses(link):
            speed = part.columns @ qd
            if isinstance(part, Masses):
                line += part.mass @ speed
                turn += float(part.mass @ (part.place.conj() * speed).imag)
            else:
                turn += part.inertia * speed
    return np.array([line.real, line.imag, turn])


@pytest.mark.parametrize("modes", [None, 3])
@pytest.mark.parametrize("kind", KINDS)
def test_the_base_takes_the_change_of_momentum(kind, modes):
    """Force and moment of joint 1 = d(momentum)/dt less gravity, to 1e-9, by differences of sixth
    order."""
    system = arm(kind, modes if kind != "Pa on a rigid link" else None)
    q, qd, qdd = state(system)
    found = fx.internal_forces(system, q, qd, qdd).reaction(1)
    at = lambda t: momentum(system, q + t * qd + t**2 / 2 * qdd, qd + t * qdd)
    h = 1e-3
    change = sum(w * (at(k * h) - at(-k * h)) for k, w in ((1, 45), (2, -9), (3, 1))) / (60 * h)
    parts = [
        part
        for link in system.assembly.structure.states(q, qd)
        for part in system.assembly.structure.masses(link)
        if isinstance(part, Masses)
    ]
    g = complex(*system.robot.gravity_m_s2)
    weight = sum(part.mass.sum() for part in parts) * g
    turned = sum(float(part.mass @ (part.place.conj() * g).imag) for part in parts)
    needed = change - np.array([weight.real, weight.imag, turned])
    got = np.array([found.force.real, found.force.imag, found.moment])
    assert got == pytest.approx(needed, rel=1e-9, abs=1e-9 * np.abs(needed).max())


@pytest.mark.parametrize("modes", [None, 3])
@pytest.mark.parametrize("kind", KINDS)
def test_a_joint_hands_on_what_drive_spring_friction_and_rotor_leave(kind, modes):
    """The row of each joint in Lagrange's equations (144): the moment of R, the force along a
    slider's or a rigid sleeve's line, on a bent link with its moment."""
    system = arm(kind, modes if kind != "Pa on a rigid link" else None)
    q, qd, qdd = state(system)
    found = fx.internal_forces(system, q, qd, qdd)
    forces = system.forces(q, qd, qdd)
    for i, link in enumerate(system.robot.links):
        row, own, joint = system.joint_rows[i], found.reaction(i + 1), link.joint
        left = forces[row] - joint.rotor_inertia * qdd[row] - joint.viscous_friction * qd[row]
        left -= joint.spring_stiffness * (q[row] - joint.spring_rest)
        along = (own.force * np.exp(-1j * own.axis)).real
        if joint.type == "R":
            assert own.moment == pytest.approx(left, rel=1e-11)
        elif kind in ("rigid Pb", "Pa on a rigid link"):
            assert along == pytest.approx(left, rel=1e-11)
        elif kind == "Pa":
            hub = system.assembly.structure.states(q, qd)[i].hub
            sliding = (hub.velocity[row].conj() * own.force).real + hub.turning[row] * own.moment
            assert sliding == pytest.approx(left, rel=1e-11)


def test_the_force_that_pushes_a_bent_link_out_of_its_sleeve():
    """At rest: force along the sleeve = drive + M0^2 / (2 EI) (36), (144)."""
    strip = robot(beam(0.5, 0.2, 1.0, 8, type="Pb", start_m=0.3))
    P = (0.1, 0.4)
    system = fx.assemble(strip)
    q = fx.static(system, tip_force=P)
    found = fx.internal_forces(system, q, tip_force=P)
    exit_moment = found.link(1, [0.2]).bending_moment[0]
    tip = system.assembly.tip(q)
    drive = fx.holding(system, q)[0] - (tip.velocity[0].conj() * complex(*P)).real
    reaction = found.reaction(1)
    assert reaction.force == pytest.approx(-complex(*P), abs=1e-12)
    assert reaction.force.real == pytest.approx(drive + exit_moment**2 / 2, rel=1e-6)
    assert abs(reaction.force.real - drive) > 1e-3
    assert -reaction.moment == pytest.approx(exit_moment, rel=1e-9)
    assert np.isnan(found.link(1, [0.1]).bending_moment).all()


@pytest.mark.parametrize("modes", [None, 3])
@pytest.mark.parametrize("kind", KINDS)
def test_bending_moments_do_the_work_of_elastic_forces(kind, modes):
    """The integral of M db_k/ds is the elastic force of each unknown, with its damping beta (145),
    in any motion, with damping in proportion to the mass beyond the cut (143)."""
    on_rigid = kind == "Pa on a rigid link"
    damping = {"link.2.damping": {"alpha_1_s": 2.0, "beta_s": 1e-3}} if kind != "rigid Pb" else {}
    damping |= {} if on_rigid else {"link.1.damping": {"alpha_1_s": 3.0, "beta_s": 2e-3}}
    system = arm(kind, None if on_rigid else modes, **damping)
    drive = [fx.signals.harmonic(1.0, 1.5), fx.signals.harmonic(0.5, 2.0), 0.0]
    run = fx.simulate(system, [0.0, 0.15], drive, rtol=1e-6)
    q, qd = run.states[-1, : system.n], run.states[-1, system.n :]
    force = np.zeros(system.n)
    force[system.joint_rows] = [run[f"joint/{i}/drive"][-1] for i in (1, 2, 3)]
    qdd = system.accelerations(q, qd, force)
    found, structure = fx.internal_forces(system, q, qd, qdd), system.assembly.structure
    K, near = system.assembly.stiffness_blocks(q), 5e-4 if modes else 2e-5
    u, w = np.polynomial.legendre.leggauss(10)
    for i, link in enumerate(system.robot.links):
        free = q[system.joint_rows[i]] if link.joint.type == "Pb" else link.length_m
        start, kinks = link.length_m - free, [each.at_m for each in link.mass]
        if i == 0 and kind.startswith("Pa"):
            kinks.append(q[system.joint_rows[1]])
        for piece, own in zip(structure.links[i], structure.own[i]):
            d = free if link.joint.type == "Pb" else piece.length
            inner = [x for x in (*kinks, *link.breaks()) if start < x < start + d]
            ends = np.array([start, *sorted(inner), start + d])
            X = (ends[:-1, None] + np.diff(ends)[:, None] * (u + 1) / 2).ravel()
            dX = (np.diff(ends)[:, None] * w / 2).ravel()
            moment = found.link(i + 1, X).bending_moment
            work = (dX * moment / d) @ piece.shapes((X - start) / d, 1)
            elastic = K[own, own] @ (q[own] + system.robot.rayleigh(i)[1] * qd[own])
            size = np.abs(dX * moment / d) @ np.abs(piece.shapes((X - start) / d, 1))
            assert np.abs(work - elastic).max() < near * size.max(), (i, own)
            start += d


def test_modes_and_the_linear_line_agree_with_the_mesh():
    """Links in their own modes, and the dissertation's line at small bending."""
    found = []
    for change in ({}, {"link.1.modes": 6}, {"stiffening": False}):
        made = robot(beam(L, RHO, 200.0, 8), gravity=(0.0, -G), payload=0.05).replace(change)
        system = fx.assemble(made)
        q = fx.static(system)
        turning = np.eye(system.n)[0]
        own = fx.internal_forces(system, q, 2.0 * turning, 3.0 * turning)
        found.append([*own.link(1, S).bending_moment, own.reaction(1).force.imag])
    assert found[1] == pytest.approx(found[0], rel=2e-3, abs=1e-3)
    assert found[2] == pytest.approx(found[0], rel=1e-3, abs=1e-3)


def test_a_row_is_one_state_and_forces_follow_their_slopes():
    """Many times at once give what each gives alone; dM/ds = -V (142)."""
    system = arm("Pb")
    states = [np.array([state(system, seed, 0.001)[k] for seed in range(3)]) for k in range(3)]
    many = Balance(system.assembly.structure, *states)
    for k in range(3):
        one = fx.internal_forces(system, *(x[k] for x in states))
        for i in range(3):
            for a, b in zip(many.reaction(i), one.reaction(i + 1)):
                assert a[k] == pytest.approx(b, rel=1e-13)
        here = one.link(1, [0.2, 0.2 - 1e-4, 0.2 + 1e-4])
        moment = here.bending_moment
        slope = (moment[2] - moment[1]) / 2e-4
        assert slope == pytest.approx(-here.shear_force[0], rel=1e-4)


def test_wrong_arguments_are_refused():
    made = robot(rigid(0.3, 0.2, 0.1, 0.001), gravity=(0.0, -G))
    found = fx.internal_forces(made)
    for call, key in (
        (lambda: found.reaction(2), "joint"),
        (lambda: found.link(0), "link"),
        (lambda: found.link(1, [0.4]), "s"),
        (lambda: found.link(1, [0.1]), "s"),
        (lambda: fx.internal_forces(made, [0.0, 1.0]), "q"),
        (lambda: fx.internal_forces(made, tip_force=1.0), "tip_force"),
    ):
        with pytest.raises(fx.InputError) as refused:
            call()
        assert refused.value.key == key
    ends = found.link(1, [0.0, 0.3]).bending_moment
    assert ends == pytest.approx([-0.2 * G * 0.1, 0.0])
    nodal = robot(beam(0.5, 0.2, 1.0, type="Pb", start_m=0.3)).replace({"sliding": "nodal"})
    for call in (
        lambda: fx.internal_forces(nodal),
        lambda: fx.simulate(nodal, [0.0, 0.1], internal_forces=True),
    ):
        with pytest.raises(fx.InputError, match="continuous"):
            call()
