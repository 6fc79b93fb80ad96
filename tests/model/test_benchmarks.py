"""Benchmarks B1 to B6 with analytic or published answers, and textbook answers for what acts in the
joints.

Frequencies of beams are given as bL, w = (bL)^2 sqrt(EI/rhoA)/L^2; links have L = EI = rhoA = 1
unless a benchmark has its own. The relative error of the frequency of cubic Hermite elements of
length h is (bh)^4/1440, less where other masses move along.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ellipk

import flexura as fx
from flexura import signals
from robots import beam, bench_arm, by_hub, rigid, system

CLAMPED = np.array([1.875104069, 4.694091133, 7.854757438, 10.99554073, 14.13716839])


def angular(sys: fx.System, joints: str = "locked", **keys) -> np.ndarray:
    return 2 * np.pi * fx.frequencies(sys, joints=joints, **keys)


def unit_link(elements: int, payload: float = 0.0, **keys) -> fx.System:
    return system(beam(1.0, 1.0, 1.0, elements, **keys), payload=payload)


# B1: natural frequencies


@pytest.mark.parametrize(
    ("elements", "printed"),
    [
        (1, [4.8e-3, 0.58]),
        (2, [4.8e-4, 8.5e-3, 0.22]),
        (4, [3.3e-5, 1.2e-3, 7.7e-3]),
        (8, [2.1e-6, 8.0e-5, 6.1e-4]),
    ],
)
def test_clamped_frequencies_have_the_error_of_cubic_elements(elements, printed):
    """B1, table "Elements needed"."""
    exact = CLAMPED[: len(printed)] ** 2
    error = angular(unit_link(elements))[: len(printed)] / exact - 1
    assert error == pytest.approx(printed, rel=0.1)


@pytest.mark.parametrize(
    ("elements", "largest"), [(1, 34.8), (2, 218), (3, 528), (4, 953), (6, 2155), (8, 3832)]
)
def test_the_largest_frequency_of_a_mesh_is_the_one_that_limits_explicit_steps(elements, largest):
    """B1, table "Step-size limits", to the digits printed there."""
    assert angular(unit_link(elements))[-1] == pytest.approx(
        largest, abs=0.06 if largest < 100 else 0.6
    )


@pytest.mark.parametrize(
    ("exact", "payload", "hub", "joints"),
    [
        (CLAMPED, 0.0, 0.0, "locked"),
        ([3.926602312, 7.068582746, 10.21017612, 13.35176878], 0.0, 0.0, "free"),
        ([1.419964430, 4.111133386, 7.190335242], 0.5, 0.0, "locked"),
        ([1.247917410, 4.031139437, 7.134132241], 1.0, 0.0, "locked"),
        ([2.010003322, 4.703794262, 7.856823551], 0.0, 1.0, "free"),
    ],
    ids=["clamped", "pinned", "tip mass 0.5", "tip mass 1", "hub inertia 1"],
)
@pytest.mark.parametrize("elements", [8, 16])
def test_frequencies_are_exact_up_to_the_error_of_the_elements(
    elements, exact, payload, hub, joints
):
    """B1: 0 <= error <= (bh)^4/1440; a free joint adds the rigid mode at 0."""
    found = angular(unit_link(elements, payload, hub_inertia_kg_m2=hub), joints)
    if joints == "free":
        assert found[0] == 0.0
        found = found[1:]
    error = found[: len(exact)] / np.square(exact) - 1
    bound = (np.array(exact) / elements) ** 4 / 1440
    assert np.all(error > -1e-9) and np.all(error < 1.02 * bound + 1e-9)
    if (
        payload == 0 and hub == 0
    ):  # where only the beam moves the bound is the error, to the next power of bh
        assert error == pytest.approx(bound, rel=0.02 + 0.08 * (np.max(exact) / elements) ** 2)


@pytest.mark.parametrize(("mode", "meshes"), [(1, [2, 4, 8, 16]), (2, [4, 8, 16])])
def test_frequencies_converge_with_order_four(mode, meshes):
    """B1, B12; mode 2 from four elements on, since with two bh = 2.3 is not small."""
    errors = [angular(unit_link(n))[mode - 1] / CLAMPED[mode - 1] ** 2 - 1 for n in meshes]
    order = -np.polyfit(np.log(meshes), np.log(errors), 1)[0]
    assert 3.8 < order < 4.2


# B2: the published two-link arm


@pytest.mark.parametrize(
    ("payload", "inertia", "published", "exact"),
    [
        (
            1.2,
            0.1 + 0.1 * 0.5**2 / 3 + 5e-4 + 0.1 * 0.5**2,
            [0.48, 1.80],
            [0.479693, 1.796589, 32.0972],
        ),
        (0.1, 5e-4, [2.18, 15.91], [2.178334, 15.914513, 40.1008]),
    ],
    ids=["link 1", "link 2"],
)
def test_clamped_links_of_the_published_arm_have_its_frequencies(
    payload, inertia, published, exact
):
    """B2 (De Luca and Siciliano 1991): published digits, and the exact values up to the elements'
    error.

    Link 1 carries the straight second link as an inertia of J_h2 + m l^2/3 + J_p + m_p l^2 =
    0.13383 kg m^2.
    """
    elements, exact = 8, np.array(exact)
    found = fx.frequencies(
        system(beam(0.5, 0.2, 1.0, elements), payload=payload, payload_inertia=inertia)
    )
    assert np.round(found[:2], 2) == pytest.approx(published)
    bound = (2 * np.pi * exact) ** 2 * 0.2 * (0.5 / elements) ** 4 / 1440
    assert np.all(
        np.abs(found[:3] / exact - 1) < 1.02 * bound + 2e-6
    )  # the exact values are printed to six digits


# B3: a rotating cantilever

ROTATING = {
    0: [3.51602, 22.0345, 61.6972],
    2: [3.62180, 22.5263, 62.2411],
    6: [4.26323, 26.1290, 66.4134],
}


def rotating(speed: float, stiffening: bool) -> np.ndarray:
    sys = system(beam(1.0, 1.0, 1.0, 8), stiffening=stiffening)
    rates = np.zeros(sys.n)
    rates[0] = speed
    return angular(sys, q=np.zeros(sys.n), qd=rates)[:3]


@pytest.mark.parametrize("speed", ROTATING)
def test_rotation_stiffens_a_cantilever(speed):
    """B3, bending in the plane of rotation, hub radius 0."""
    assert rotating(speed, True) == pytest.approx(ROTATING[speed], rel=1e-3)


def test_without_stiffening_rotation_softens_a_cantilever():
    """B3: the linear model has w^2 = w0^2 - g^2, and no first mode beyond g = 3.516."""
    rest = rotating(0, False)
    assert rotating(2, False) == pytest.approx(np.sqrt(rest**2 - 4), rel=1e-6)
    assert rotating(6, False)[0] == 0.0
    assert rotating(6, False)[1:] == pytest.approx(np.sqrt(rest[1:] ** 2 - 36), rel=1e-6)


# B4: static deflection


@pytest.mark.parametrize(
    ("load", "deflection", "shortening", "slope"),
    [(0.5, 0.162144, 0.015919, 0.244534), (1.0, 0.301721, 0.056433, 0.461352)],
)
@pytest.mark.parametrize(("elements", "near"), [(2, 1e-4), (4, 1e-5), (8, 6e-6)])
def test_a_dead_tip_load_bends_a_link_like_an_inextensible_line(
    elements, near, load, deflection, shortening, slope
):
    """B4, to six digits with 8 elements."""
    sys = unit_link(elements)
    x, y, angle = fx.tip_pose(sys, fx.static(sys, tip_force=(0.0, load)))
    assert y == pytest.approx(deflection, rel=near)
    assert 1 - x == pytest.approx(shortening, rel=near)
    assert angle == pytest.approx(slope, rel=near)


@pytest.mark.parametrize("stiffening", [True, False])
def test_small_loads_give_the_textbook_deflections(stiffening):
    """P L^3/(3 EI) and P L^2/(2 EI); M L^2/(2 EI) and M L/EI; own weight rhoA g L^4/(8 EI) and rhoA
    g L^3/(6 EI)."""
    length, mass, stiffness, small = 0.7, 0.3, 2.0, 1e-4
    link = beam(length, mass, stiffness, 4)
    arm, heavy = (
        system(link, stiffening=stiffening),
        system(link, gravity=(0.0, -small), stiffening=stiffening),
    )
    x, y, angle = fx.tip_pose(arm, fx.static(arm, tip_force=(0.0, small)))
    assert (x, y, angle) == pytest.approx(
        (length, small * length**3 / 3 / stiffness, small * length**2 / 2 / stiffness), rel=1e-6
    )
    x, y, angle = fx.tip_pose(arm, fx.static(arm, tip_moment=small))
    assert (x, y, angle) == pytest.approx(
        (length, small * length**2 / 2 / stiffness, small * length / stiffness), rel=1e-6
    )
    x, y, angle = fx.tip_pose(heavy, fx.static(heavy))
    sag = mass * small / stiffness * np.array([length**4 / 8, length**3 / 6])
    assert (x, y, angle) == pytest.approx((length, -sag[0], -sag[1]), rel=1e-6)


def test_an_axial_load_stiffens_or_softens_a_link():
    """Tension T and a small P at the tip: P (kL - tanh kL)/(T k), k^2 = T/EI; compression: P (tan
    kL - kL)/(T k)."""
    sys, small = unit_link(8), 1e-5
    for T in (2.0, 1.0):
        k = np.sqrt(T)
        pulled = fx.tip_pose(sys, fx.static(sys, tip_force=(T, small)))[1]
        pushed = fx.tip_pose(sys, fx.static(sys, tip_force=(-T, small)))[1]
        assert pulled == pytest.approx(small * (k - np.tanh(k)) / (T * k), rel=1e-5)
        assert pushed == pytest.approx(small * (np.tan(k) - k) / (T * k), rel=1e-4)


def test_the_first_frequency_vanishes_at_the_buckling_weight():
    """A column with a heavy payload buckles at m g = pi^2 EI/(4 L^2); below, w1^2 is nearly linear
    in the load."""

    def first(weight: float) -> float:
        sys = system(beam(1.0, 1e-3, 1.0, 8, start=np.pi / 2), payload=1.0, gravity=(0.0, -weight))
        return angular(sys, q=sys.start())[0]

    critical = np.pi**2 / 4
    assert first(1.01 * critical) == 0.0 and first(0.9999 * critical) < 0.02 * first(0.0)
    assert first(0.5 * critical) ** 2 / first(0.0) ** 2 == pytest.approx(0.5, abs=0.02)


# B5: spin-up

HUB = 1e9  # kg m^2: turns as told, whatever the arm does
W = 2 * np.pi / 15


def spin_up(stiffening: bool, elements: int, end: float = 25.0) -> fx.Run:
    torque = signals.Signal(
        np.array(
            [
                [0, 0.4 * HUB, 0, 0, 0, 0, 0, -0.4 * HUB, W, np.pi / 2],
                [15, 0, 0, 0, 0, 0, 0, 0, 0, 0],
            ]
        )
    )
    sys = system(beam(10.0, 1.2, 1.4e4, elements, hub_inertia_kg_m2=HUB), stiffening=stiffening)
    return fx.simulate(
        sys, np.linspace(0, end, round(100 * end) + 1), fx.Drive.force(torque), rtol=1e-9
    )


@pytest.mark.parametrize("elements", [4, 8])
def test_spin_up_is_stiffened_by_rotation(elements):
    """B5 (Kane; Simo and Vu-Quoc 1986), the inextensible column."""
    run = spin_up(True, elements)
    t = run.t
    psi = np.where(t <= 15, 0.4 * (t**2 / 2 + (np.cos(W * t) - 1) / W**2), 6 * t - 45)
    assert np.abs(run["joint/1/position"] - psi).max() < 1e-4
    along, w = by_hub(run)
    assert w == pytest.approx(run["link/1/tip_deflection"], abs=1e-9)
    assert w.min() == pytest.approx(-0.57376, abs=3e-5) and t[w.argmin()] == pytest.approx(
        6.76, abs=0.015
    )
    assert run["link/1/tip_slope"].min() == pytest.approx(-0.0773, abs=3e-5)
    assert w[[500, 1000]] == pytest.approx(
        [-0.46844, -0.36268], abs=1.5e-4 if elements == 4 else 2e-5
    )
    assert np.abs(w[t >= 15]).max() < 5e-3
    assert (along - 10).min() == pytest.approx(-0.0189, abs=2e-5)


def test_spin_up_diverges_without_stiffening():
    """B5: 6 rad/s is beyond the first frequency, 3.80 rad/s."""
    arm = system(beam(10.0, 1.2, 1.4e4, 1, modes=1), stiffening=False)
    drive = fx.Drive.prescribed(signals.Signal(np.array([[0, 0, 6.0, 0, 0, 0, 0, 0, 0, 0]])))
    run = fx.simulate(arm, [0.0, 2.0], drive, q0=[0.0, 1e-4], rtol=1e-4)
    growth = run["link/1/tip_deflection"][-1] / run["link/1/tip_deflection"][0]
    assert growth == pytest.approx(np.cosh(2.0 * np.sqrt(36 - 3.799**2)), rel=0.01)


# B6: a torque-driven arm


@pytest.mark.parametrize("method", ["explicit", "implicit"])
def test_a_torque_driven_arm_follows_the_inextensible_solution(method):
    """B6: +0.05 N m to 0.5 s, -0.05 to 1 s, then 0. The benchmark accepts 1 % of the largest
    value."""
    angle = [0.06110, 0.19744, 0.26326, 0.28841, 0.37001, 0.33200]
    tip = [-0.012954, -0.019457, 0.022566, 0.034247, -0.021678, 0.004119]
    t = np.linspace(0, 2, 2001)
    run = fx.simulate(
        bench_arm(), t, fx.Drive.force(signals.bang_bang(0.05, 1.0)), rtol=1e-8, method=method
    )
    at = [250, 500, 750, 1000, 1500, 2000]
    w = run["link/1/tip_deflection"]
    assert run["joint/1/position"][at] == pytest.approx(angle, abs=4e-3 * 0.37001)
    assert w[at] == pytest.approx(tip, abs=4e-3 * 0.0399)
    assert np.abs(w).max() == pytest.approx(0.0399, abs=1e-4) and t[
        np.abs(w).argmax()
    ] == pytest.approx(0.983, abs=2e-3)


# What acts in the joints


@pytest.mark.parametrize("amplitude", [0.1, 1.0, 2.5])
def test_a_rigid_pendulum_has_the_period_of_the_elliptic_integral(amplitude):
    """T = 4 sqrt(J/(m g l)) K(sin^2(a/2)); at T/4 it is at the bottom, after T back."""
    mass, centre, about_centre, g = 0.5, 0.3, 4e-3, 9.81
    period = (
        4
        * np.sqrt((about_centre + mass * centre**2) / (mass * g * centre))
        * ellipk(np.sin(amplitude / 2) ** 2)
    )
    arm = system(
        rigid(0.6, mass, centre, about_centre, start=amplitude - np.pi / 2), gravity=(0.0, -g)
    )
    for method in ("explicit", "implicit"):
        run = fx.simulate(arm, [0.0, period / 4, period / 2, period], rtol=1e-10, method=method)
        assert run["joint/1/position"] + np.pi / 2 == pytest.approx(
            amplitude * np.array([1, 0, -1, 1]), abs=1e-7
        )


@pytest.mark.parametrize(("alpha", "beta"), [(0.0, 0.0), (3.0, 0.0), (0.0, 2e-3), (1.0, 1e-3)])
def test_a_clamped_link_rings_down_with_rayleigh_damping(alpha, beta):
    """Mode 1 alone: 2 zeta w = alpha + beta w^2, and the logarithmic decrement 2 pi zeta/sqrt(1 -
    zeta^2)."""
    arm = system(
        beam(
            0.6, 0.2355, 0.5, 8, locked=True, modes=1, damping={"alpha_1_s": alpha, "beta_s": beta}
        ),
        payload=0.05,
    )
    w = angular(arm)[0]
    delta = (alpha + beta * w**2) / 2
    damped = np.sqrt(w**2 - delta**2)
    q0 = np.array([0.0, 1e-5])  # the deflection stays small enough for the linear answer
    t = np.linspace(0, 5, 51) * 2 * np.pi / damped
    run = fx.simulate(arm, t, q0=q0, rtol=1e-10)
    tip = run["link/1/tip_deflection"]
    exact = np.exp(-delta * t) * (np.cos(damped * t) + delta / damped * np.sin(damped * t))
    assert tip / tip[0] == pytest.approx(exact, abs=1e-6)
    assert np.log(tip[10] / tip[20]) == pytest.approx(delta * 2 * np.pi / damped, abs=1e-6)


def test_viscous_friction_slows_a_cart_exponentially():
    """v = v0 exp(-c t/m)."""
    cart = system(rigid(0.0, 2.0, 0.0, 0.0, "Pa", viscous_friction=0.8))
    t = np.linspace(0, 5, 21)
    run = fx.simulate(cart, t, qd0=[1.5], rtol=1e-10)
    assert run["joint/1/velocity"] == pytest.approx(1.5 * np.exp(-0.4 * t), rel=1e-8)
    assert run["joint/1/position"] == pytest.approx(1.5 / 0.4 * (1 - np.exp(-0.4 * t)), rel=1e-8)
    assert run["energy/loss"][-1] == pytest.approx(1.5**2 * (1 - np.exp(-4.0)), rel=1e-8)


@pytest.mark.parametrize("method", ["explicit", "implicit"])
def test_coulomb_friction_stops_a_cart_within_its_braking_distance(method):
    """v0^2 m/(2 f) after v0 m/f; then it stands."""
    cart = system(rigid(0.0, 2.0, 0.0, 0.0, "Pa", coulomb_friction=0.5))
    run = fx.simulate(cart, np.linspace(0, 5, 51), qd0=[0.6], rtol=1e-8, method=method)
    assert run["joint/1/position"][-1] == pytest.approx(0.6**2 * 2.0 / (2 * 0.5), rel=0.01)
    assert run["joint/1/velocity"][20] == pytest.approx(0.6 - 0.25 * run.t[20], rel=0.01)
    assert np.abs(run["joint/1/velocity"][run.t > 2.5]).max() < 1e-3


def test_a_rotor_adds_its_inertia_to_its_own_joint_only():
    """One joint: tau/(J + Jr). Two: M = [[J1 + J2, J2], [J2, J2 + Jr]]. A cart: F/(m + hub +
    rotor)."""
    shaft = system(rigid(0.0, 0.0, 0.0, 0.02, rotor_inertia=0.03))
    run = fx.simulate(shaft, [0.0, 2.0], fx.Drive.force(signals.constant(0.1)), rtol=1e-10)
    assert run["joint/1/position"][-1] == pytest.approx(0.1 / 0.05 * 2.0, rel=1e-9)
    two = system(rigid(0.0, 0.0, 0.0, 0.02), rigid(0.0, 0.0, 0.0, 0.04, rotor_inertia=0.03))
    assert two.mass(np.zeros(2)) == pytest.approx(np.array([[0.06, 0.04], [0.04, 0.07]]), rel=1e-12)
    cart = system(rigid(0.1, 0.6, 0.05, 0.0, "Pa", rotor_inertia=0.4, hub_mass_kg=0.5))
    run = fx.simulate(cart, [0.0, 1.0], fx.Drive.force(signals.constant(0.3)), rtol=1e-10)
    assert run["joint/1/position"][-1] == pytest.approx(0.3 / 1.5 / 2, rel=1e-9)


def test_a_pendulum_on_a_cart_has_the_textbook_frequency():
    """w^2 = (M + m) m g l/((M + m) J - m^2 l^2), J about the pivot."""
    M, m, centre, about_centre, g = 0.8, 0.3, 0.25, 2e-3, 9.81
    cart = system(
        rigid(0.0, M, 0.0, 0.0, "Pa"),
        rigid(0.5, m, centre, about_centre, start=-np.pi / 2),
        gravity=(0.0, -g),
    )
    J = about_centre + m * centre**2
    exact = np.sqrt((M + m) * m * g * centre / ((M + m) * J - (m * centre) ** 2)) / (2 * np.pi)
    assert fx.frequencies(cart, joints="free") == pytest.approx([0.0, exact], rel=1e-7, abs=1e-9)
