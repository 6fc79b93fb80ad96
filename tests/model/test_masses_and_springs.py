"""Masses on links, centres off the line, hub radii and springs beside drives, against textbook
answers to 1e-5, and their energies."""

import numpy as np
import pytest
from scipy.special import ellipk

import beams
import flexura as fx
from beams import Beam, Body
from flexura import signals
from robots import beam, rigid, robot

L, RHO, EI = 0.8, 0.5, 2.0
LINE = Beam(L, RHO, EI)
NEAR = 1e-5
CLAMPED = float("inf")


def near(found, exact):
    assert len(found) >= len(exact) > 0
    assert np.asarray(found)[: len(exact)] == pytest.approx(exact, rel=NEAR)


def link(elements=32, masses=(), **joint):
    table = beam(L, RHO, EI, elements, **joint)
    keys = ("at_m", "mass_kg", "inertia_kg_m2")
    return table | {"mass": [dict(zip(keys, m, strict=True)) for m in masses]} if masses else table


def loaded(bot, mass, inertia, centre):
    return bot.replace(
        {
            "payload.mass_kg": mass,
            "payload.inertia_kg_m2": inertia,
            "payload.centre_of_mass_m": centre,
        }
    )


@pytest.mark.parametrize("mass", [0.3, 0.0])
@pytest.mark.parametrize("at", [0.3 * L, 0.5 * L, 0.99 * L, L])
def test_a_mass_on_a_cantilever(at, mass):
    """Two beams that meet in a body (Laura, Maurizi and Pombo, J. Sound Vib. 41, 1975); an inertia
    without mass is the limit of a wide and light one."""
    exact = beams.frequencies(LINE, lambda w: CLAMPED, [(at, Body(mass, 2e-3))], 60.0)
    near(fx.frequencies(robot(link(masses=[(at, mass, 2e-3)])), count=3), exact)
    if at == L:
        near(fx.frequencies(loaded(robot(link()), mass, 2e-3, (0.0, 0.0)), count=3), exact)


def test_a_mass_on_a_link_in_modes():
    """Polynomials bend less sharply at a mass than a mesh with a node there."""
    table = link(8, [(0.3 * L, 0.3, 0.0)]) | {"modes": 4}
    exact = beams.frequencies(LINE, lambda w: CLAMPED, [(0.3 * L, Body(0.3))], 60.0)
    assert fx.frequencies(robot(table), count=3) == pytest.approx(exact, rel=3e-4)


@pytest.mark.parametrize("slider", [False, True])
def test_an_inertia_between_the_ends_needs_a_mesh(slider):
    table = link(8, [(0.3 * L, 0.3, 1e-3)]) | ({} if slider else {"modes": 4})
    chain = [table, rigid(0.1, 1.0, 0.05, 0.0, "Pa", start_m=0.4)] if slider else [table]
    with pytest.raises(fx.InputError, match=r"link\[1\].mass\[1\].inertia_kg_m2"):
        robot(*chain)
    chain[0]["mass"][0]["at_m"] = L
    assert len(fx.frequencies(robot(*chain))) > 3


@pytest.mark.parametrize("form", [{"elements": 32}, {"elements": 8, "modes": 6}])
@pytest.mark.parametrize("centre", [(0.15, 0.0), (0.0, 0.1), (-0.1, 0.08)])
def test_a_payload_with_its_centre_off_the_tip(form, centre):
    """Bhat and Wagner, J. Sound Vib. 45 (1976): a cantilever with a tip mass whose centre is not at
    the tip."""
    bot = loaded(robot(link() | form), 0.4, 3e-3, centre)
    exact = beams.frequencies(LINE, lambda w: CLAMPED, [(L, Body(0.4, 3e-3, *centre))], 60.0)
    near(fx.frequencies(bot, count=3), exact)


def test_a_spring_hinged_beam():
    """Spring-hinged and free (Blevins, Formulas for Natural Frequency, table 8-1)."""
    spring = {"stiffness_N_m_rad": 5.0, "rest_rad": 0.3}
    bot = robot(link(spring=spring, start=0.3))
    near(
        fx.frequencies(bot, joints="free", count=3),
        beams.frequencies(LINE, lambda w: 5.0, [], 60.0),
    )
    stiff = bot.replace({"link.1.joint.spring.stiffness_N_m_rad": 1e9})
    clamped = np.array([1.875104069, 4.694091133]) ** 2 * np.sqrt(EI / RHO) / L**2 / (2 * np.pi)
    near(fx.frequencies(stiff, joints="free", count=2), clamped)


def test_a_beam_on_a_hub_with_a_radius():
    """A free hub of inertia J whose radius sets the beam off the axis: J phi'' = M - r Q at its
    root (Meirovitch, Principles and Techniques of Vibrations, 1997, on hub-beam systems)."""
    J, radius = 0.05, 0.25
    bot = robot(link(hub_inertia_kg_m2=J, hub_radius_m=radius))
    exact = beams.frequencies(LINE, lambda w: -J * w**2, [], 60.0, radius=radius)
    near(fx.frequencies(bot, joints="free", count=4)[1:], exact)
    clamped = fx.frequencies(robot(link()), count=3)
    assert fx.frequencies(bot, count=3) == pytest.approx(clamped, rel=1e-9)


@pytest.mark.parametrize("radius", [0.0, 0.4])
def test_rotation_stiffens_a_beam_by_its_hub_radius(radius):
    """Wright et al. 1982: a rotating beam clamped to a hub, in the plane of rotation."""
    bot = robot(link(hub_radius_m=radius, hub_inertia_kg_m2=1.0))
    system, rate = fx.assemble(bot), 12.0
    qd = np.zeros(system.n)
    qd[0] = rate
    q = fx.static(bot)
    near(fx.frequencies(bot, q=q, qd=qd)[:2], beams.rotating(LINE, radius, rate, 25.0))


def test_a_rotating_beam_of_the_literature():
    """Wright et al. 1982, hub radius as long as the beam, Omega = 10 in units of sqrt(EI/(m L^4)):
    16.606 out of the plane, so sqrt(16.606^2 - 10^2) in it."""
    unit = np.sqrt(EI / RHO) / L**2
    found = beams.rotating(LINE, L, 10 * unit, 25.0, 1)[0] * 2 * np.pi / unit
    assert np.hypot(found, 10.0) == pytest.approx(16.606, abs=1e-3)


def test_a_mass_on_a_spring():
    """x'' = -k/m (x - rest), to the last period: a Pa on the base."""
    spring = {"stiffness_N_m": 50.0, "rest_m": 0.1}
    bot = robot(rigid(0.0, 2.0, 0.0, 0.0, "Pa", spring=spring, start_m=0.3))
    t = np.linspace(0, 2, 41)
    run = fx.simulate(bot, t, rtol=1e-10)
    assert run["joint/1/position"] == pytest.approx(0.1 + 0.2 * np.cos(5.0 * t), abs=1e-7)
    assert run["energy/strain"] == pytest.approx(25.0 * 0.04 * np.cos(5.0 * t) ** 2, abs=1e-6)
    assert run.meta["energy_error"] < 1e-8
    assert fx.frequencies(bot, joints="free") == pytest.approx([5.0 / (2 * np.pi)])


def test_a_pendulum_whose_centre_is_off_its_line():
    """A compound pendulum swings about where its centre hangs below the axis, with the period of
    large angles 4 K(sin^2(a/2)) sqrt(J/(m g rho)) (Goldstein, Classical Mechanics)."""
    m, along, across, I, g = 0.7, 0.3, 0.2, 0.01, 9.81
    rho, lies = np.hypot(along, across), np.arctan2(across, along)
    body = rigid(0.5, m, 0.0, I) | {"centre_of_mass_m": [along, across]}
    amplitude = 1.2
    bot = robot(body, gravity=(0.0, -g)).replace(
        {"link.1.joint.start_rad": amplitude - np.pi / 2 - lies}
    )
    J = I + m * rho**2
    period = 4 * ellipk(np.sin(amplitude / 2) ** 2) * np.sqrt(J / (m * g * rho))
    run = fx.simulate(bot, [0.0, period / 2, period], rtol=1e-11)
    hanging = -np.pi / 2 - lies
    assert run["joint/1/position"] - hanging == pytest.approx(
        [amplitude, -amplitude, amplitude], abs=1e-6
    )
    level = bot.replace({"link.1.joint.start_rad": 0.0})
    assert fx.inverse(level, [0.0, 1.0], [0.0])["joint/1/drive"] == pytest.approx(m * g * along)


def test_a_heavy_tool_off_the_tip_bends_a_cantilever():
    """Statics: the tool's weight at the tip and its moment (Gere, Mechanics of Materials)."""
    m, along, g = 1e-4, 0.2, 9.81
    bot = loaded(robot(link(8, locked=True) | {"mass_per_length_kg_m": 1e-9}), m, 0.0, (along, 0.0))
    bot = bot.replace({"gravity_m_s2": [0.0, -g]})
    tip = fx.simulate(bot, [0.0, 1e-4])["link/1/tip_deflection"][0]
    assert tip == pytest.approx(-m * g * (L**3 / 3 + along * L**2 / 2) / EI, rel=NEAR)


def furnished():
    """An arm with all of it: springs, a radius, masses, a tool and a bracket off their lines."""
    bracket = rigid(0.2, 0.3, 0.0, 1e-3, hub_inertia_kg_m2=1e-3, hub_radius_m=0.05)
    bracket |= {"centre_of_mass_m": [0.1, 0.04], "mass": [{"at_m": 0.15, "mass_kg": 0.1}]}
    bracket["joint"]["spring"] = {"stiffness_N_m_rad": 3.0, "rest_rad": 0.2}
    arm = link(4, [(0.37, 0.1, 1e-4)], start=0.4, hub_radius_m=0.03, hub_mass_kg=0.2)
    bot = robot(bracket, arm, gravity=(0.0, -9.81), payload=0.15, payload_inertia=1e-4)
    return bot.replace({"payload.centre_of_mass_m": [0.05, -0.03]})


@pytest.mark.parametrize("method", ["explicit", "implicit", "exponential"])
def test_energy_is_kept(method):
    run = fx.simulate(furnished(), np.linspace(0, 0.5, 26), rtol=1e-7, method=method)
    assert run.complete and run.meta["energy_error"] < 1e-5
    assert np.ptp(run["energy/strain"]) > 0.01


def test_inverse_dynamics_come_back():
    bot, t = furnished(), np.linspace(0, 0.6, 61)
    motion = [signals.cycloid(0.5, 0.6), signals.cycloid(-0.2, 0.6, 0.4)]
    asked = fx.inverse(bot, t, motion, rtol=1e-8)
    drives = [asked[f"joint/{i}/drive"] for i in (1, 2)]
    done = fx.simulate(bot, t, drives, rtol=1e-8)
    for i, signal in enumerate(motion, 1):
        want = [signal(x)[0] for x in t]
        assert np.abs(done[f"joint/{i}/position"] - want).max() < 2e-4


def test_the_dissertations_line_takes_them_too():
    """Small motions of the linear model are those of the exact line."""
    exact = furnished().replace({"gravity_m_s2": [0.0, 0.0], "link.1.joint.spring.rest_rad": 0.0})
    exact = exact.replace({"link.2.mass.1.at_m": L / 2})  # at a node: it has equal elements
    linear = exact.replace({"stiffening": False})
    for joints in ("locked", "free"):
        a, b = (fx.frequencies(bot, joints=joints, count=4) for bot in (exact, linear))
        assert a == pytest.approx(b, rel=1e-6, abs=1e-9)
    run = fx.simulate(linear, [0.0, 0.1, 0.2], [0.1, 0.02], rtol=1e-7)
    assert run.meta["energy_error"] < 1e-5


def test_a_population_is_its_robots():
    bot = furnished()
    keys = {"payload.mass_kg": [0.1, 0.2], "link.2.joint.hub_radius_m": [0.0, 0.05]}
    varied = {"link.1.joint.spring.stiffness_N_m_rad": [1.0, 4.0]} | keys
    t = np.linspace(0, 0.2, 5)
    names = ["tip/x", "joint/2/position"]
    made = fx.simulate(fx.Batch.vary(bot, varied), t, channels=names)
    for k in range(2):
        run = fx.simulate(bot.replace({key: values[k] for key, values in varied.items()}), t)
        for name in names:
            assert made[name][k] == pytest.approx(run[name], abs=1e-5)
