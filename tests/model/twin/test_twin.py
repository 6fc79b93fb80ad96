"""The twin against analytic answers, textbook equations and itself; never against the native
solver."""

import numpy as np
import pytest

from flexura import signals, twin
from flexura.signals import Drive
from twin_robots import G, beam, bench_arm, integrate, rig, rigid, robot, total_energy

# Beams


@pytest.mark.parametrize(("kind", "elements"), [("ancf", None), ("ge", 6)])
def test_a_torque_driven_arm_follows_the_inextensible_solution(kind, elements):
    """Bench arm, +0.05 N m to 0.5 s, -0.05 to 1 s, then 0; from Lagrange's equations with exact
    rotations."""
    t = np.array([0.25, 0.50, 0.75, 1.00, 1.50, 2.00])
    angle = [0.06110, 0.19744, 0.26326, 0.28841, 0.37001, 0.33200]
    tip = [-0.012954, -0.019457, 0.022566, 0.034247, -0.021678, 0.004119]
    run = twin.simulate(
        bench_arm(), t, Drive.force(signals.bang_bang(0.05, 1.0)), beam=kind, elements=elements
    )
    assert np.allclose(run["joint/1/position"], angle, atol=0.0025 * 0.37)
    assert np.allclose(run["link/1/tip_deflection"], tip, atol=0.01 * 0.0399)
    assert (
        run.meta["program"].startswith("Exudyn")
        and run.meta["complete"]
        and run.meta["source"] == "twin"
    )


def test_spin_up_is_stiffened_by_rotation():
    """Kane's and Simo & Vu-Quoc's spin-up to 6 rad/s, above the first frequency: lowest deflection
    -0.574 at 6.76 s."""
    rows = np.array(
        [
            [
                0.0,
                -0.4 * (15 / (2 * np.pi)) ** 2,
                0,
                0.2,
                0,
                0,
                0,
                0.4 * (15 / (2 * np.pi)) ** 2,
                2 * np.pi / 15,
                np.pi / 2,
            ],
        ]
    )
    hub = signals.Signal(rows)
    arm = robot(beam(10.0, 1.2, 1.4e4, elements=8))
    drive = Drive.pd([hub], [1e7], [1e5])
    run = twin.simulate(arm, np.linspace(0, 10, 501), drive, elements=10, step_s=1e-3)
    w = run["link/1/tip_deflection"]
    assert abs(run["joint/1/position"] - [hub(t)[0] for t in run.t]).max() < 1e-4
    assert w.min() == pytest.approx(-0.574, abs=1e-3) and run.t[w.argmin()] == pytest.approx(
        6.76, abs=0.03
    )
    assert w[250] == pytest.approx(-0.46844, abs=1e-3) and w[500] == pytest.approx(
        -0.36268, abs=1e-3
    )
    assert run["link/1/tip_slope"].min() == pytest.approx(-0.0773, abs=3e-4)


def test_free_vibration_has_the_frequency_of_a_cantilever_with_tip_mass():
    """Clamped (locked) link with mu = tip mass/(rhoA L) = 0.5: bL = 1.419964430."""
    length, mass, stiffness = 0.6, 0.2355, 0.5
    omega = 1.419964430**2 * np.sqrt(stiffness / mass) / length**2
    arm = robot(
        rigid(0.0, 1.0, 0.0, 1.0, viscous_friction=0.0),
        beam(length, mass, stiffness, locked=True),
        payload=mass * length / 2,
    ).replace({"link.1.joint.locked": True})
    t = np.linspace(0, 6 * np.pi / omega, 301)
    assert (
        abs(twin.simulate(arm, [0.0, 0.1], lambda t: [0.0, 0.0])["link/2/tip_deflection"]).max()
        < 1e-12
    )
    gravity = arm.replace(
        {"gravity_m_s2": [0.0, -0.05]}
    )  # a sudden uniform load: mostly the first mode, about its static value
    w = twin.simulate(gravity, t, start="straight")["link/2/tip_deflection"]
    shape = np.column_stack(
        [np.cos(k * t) for k in (omega, 4.111133386**2 * np.sqrt(stiffness / mass) / length**2)]
    )
    basis = np.column_stack([np.ones_like(t), shape])
    misfit = w - basis @ np.linalg.lstsq(basis, w, rcond=None)[0]
    load = mass * 0.05
    static = -(load * length**4 / 8 + mass * length / 2 * 0.05 * length**3 / 3) / stiffness
    assert abs(misfit).max() < 4e-3 * abs(w).max()
    assert np.linalg.lstsq(basis, w, rcond=None)[0][0] == pytest.approx(static, rel=2e-3)


def test_both_beams_agree_on_the_rig():
    t = np.linspace(0, 1, 101)
    drive = Drive.force(
        signals.bang_bang(0.5, 0.8, rise_s=0.05), signals.bang_bang(2e-3, 0.8, rise_s=0.05)
    )
    runs = [twin.simulate(rig(), t, drive, beam=kind) for kind in ("ancf", "ge")]
    for name in runs[0]:
        a, b = (run[name] for run in runs)
        assert abs(a - b).max() <= 5e-4 * max(abs(a).max(), 1e-7), name


@pytest.mark.parametrize("kind", ["ancf", "ge"])
def test_energy_is_conserved_in_free_motion(kind):
    arm = robot(
        beam(0.5, 0.2, 0.1, hub_inertia_kg_m2=0.02, start=0.3),
        beam(
            0.4, 0.2, 0.05, hub_mass_kg=0.3, hub_inertia_kg_m2=1e-3, rotor_inertia=2e-3, start=-0.4
        ),
        payload=0.1,
        payload_inertia=1e-4,
        gravity=(0.0, -2.0),
    )
    run = twin.simulate(
        arm, np.linspace(0, 1, 101), qd0=[1.0, -0.5], beam=kind, step_s=2.5e-4, start="straight"
    )
    exchanged = np.ptp(run["energy/potential"])
    assert abs(total_energy(run) - total_energy(run)[0]).max() < 1e-3 * exchanged
    assert np.ptp(run["energy/strain"]) > 0.02 * exchanged


def test_a_locked_joint_makes_two_links_one():
    t = np.linspace(0, 0.5, 51)
    whole = robot(beam(0.6, 0.2355, 0.5, hub_inertia_kg_m2=2e-3), payload=0.05)
    halves = robot(
        beam(0.3, 0.2355, 0.5, hub_inertia_kg_m2=2e-3),
        beam(0.3, 0.2355, 0.5, locked=True),
        payload=0.05,
    )
    one = twin.simulate(whole, t, Drive.force(signals.constant(0.05)), elements=8)
    two = twin.simulate(halves, t, lambda t: [0.05, 0.0], elements=4, step_s=one.meta["step_s"])
    assert abs(two["joint/2/position"]).max() < 1e-9
    for name in ("tip/x", "tip/y", "joint/1/position"):
        assert abs(one[name] - two[name]).max() < 1e-5 * abs(one["tip/y"]).max(), name
    assert (
        abs(one["link/1/deflection/4"] - two["link/1/tip_deflection"]).max()
        < 2e-5 * abs(one["link/1/tip_deflection"]).max()
    )


@pytest.mark.parametrize("kind", ["ancf", "ge"])
def test_a_locked_joint_stays_at_its_start(kind):
    arm = robot(
        rigid(0.2, 0.5, 0.1, 1e-3, "Pa", start=-0.3, locked=True),
        beam(0.3, 0.2, 0.5, start=0.7, locked=True),
        rigid(0.1, 0.1, 0.05, 1e-4, start=-0.5, locked=True),
        gravity=(1.0, -2.0),
    )
    run = twin.simulate(arm, np.linspace(0, 0.2, 11), beam=kind)
    for i, start in enumerate((-0.3, 0.7, -0.5), 1):
        assert (
            abs(run[f"joint/{i}/position"] - start).max() < 1e-9
            and abs(run[f"joint/{i}/velocity"]).max() < 1e-6
        )
    assert abs(run["link/2/tip_deflection"]).max() > 1e-3


def test_bending_damping_is_proportional_to_stiffness():
    """D = beta K: the first mode of a clamped link decays with beta omega^2/2."""
    length, mass, stiffness, beta = 0.5, 0.2, 1.0, 2e-3
    omega = 1.875104069**2 * np.sqrt(stiffness / mass) / length**2
    arm = robot(beam(length, mass, stiffness, beta=beta, locked=True), gravity=(0.0, -0.1))
    t = np.linspace(0, 8 * np.pi / omega, 401)
    w = twin.simulate(arm, t, start="straight")["link/1/tip_deflection"]
    zeta = beta * omega / 2
    static = -mass * 0.1 * length**4 / 8 / stiffness
    phase = omega * np.sqrt(1 - zeta**2) * t
    first = w[-200:] / static - 1
    basis = np.exp(-zeta * omega * t[-200:, None]) * np.column_stack(
        [np.cos(phase[-200:]), np.sin(phase[-200:])]
    )
    amplitudes, *_ = np.linalg.lstsq(basis, first, rcond=None)
    assert np.hypot(*amplitudes) == pytest.approx(
        1.0, abs=0.03
    )  # the first mode's part in the static shape
    assert abs(first - basis @ amplitudes).max() < 5e-3 * abs(first).max()


@pytest.mark.parametrize("kind", ["ancf", "ge"])
def test_a_tapered_link_has_the_exact_static_deflection(kind):
    """A link whose EI falls linearly: mean of the sudden-load response is the static one, integral
    of M x/EI."""
    length, load = 0.5, 0.2
    taper = {"at_m": 0.0, "value": 2.0}, {"at_m": length, "value": 0.5}
    link = beam(length, 1e-3, 1.0, locked=True, beta=0.02) | {"bending_stiffness_N_m2": list(taper)}
    arm = robot(link, payload=0.1, gravity=(0.0, -load))
    run = twin.simulate(arm, np.array([0.0, 2.0]), beam=kind, step_s=1e-3, start="straight")
    coarse = twin.simulate(
        arm, np.array([0.0, 2.0]), beam=kind, step_s=1e-3, elements=6, start="straight"
    )
    x = np.linspace(0, length, 20001)
    moment = 0.1 * load * (length - x) + 1e-3 * load * (length - x) ** 2 / 2
    exact = -np.trapezoid(moment * (length - x) / (2.0 - 3.0 * x), x)
    error, coarse_error = (r["link/1/tip_deflection"][-1] / exact - 1 for r in (run, coarse))
    assert run.meta["elements"] == [24] and abs(error) < 1e-3 and abs(coarse_error) < 1e-2


# Joints and rigid links against textbook equations


def double_pendulum(m, centre, J, L, rotor=0.0, g=G):
    """Rates of absolute angles a, b and their velocities; relative rotor inertia in the second
    joint."""

    def rates(t, y):
        a, b, ad, bd = y
        h = m[1] * L * centre[1]
        M = np.array(
            [
                [J[0] + m[0] * centre[0] ** 2 + m[1] * L**2 + rotor, h * np.cos(a - b) - rotor],
                [h * np.cos(a - b) - rotor, J[1] + m[1] * centre[1] ** 2 + rotor],
            ]
        )
        f = [
            -h * np.sin(a - b) * bd**2 - (m[0] * centre[0] + m[1] * L) * g * np.cos(a),
            h * np.sin(a - b) * ad**2 - m[1] * centre[1] * g * np.cos(b),
        ]
        return [ad, bd, *np.linalg.solve(M, f)]

    return rates


@pytest.mark.parametrize("rotor", [0.0, 0.05])
def test_a_rigid_double_pendulum(rotor):
    m, c, J, L = (1.2, 0.8), (0.2, 0.3), (0.02, 0.03), 0.5
    second = rigid(0.6, m[1], c[1], J[1], start=0.5, rotor_inertia=rotor)
    arm = robot(rigid(L, m[0], c[0], J[0], start=0.4), second, gravity=(0, -G))
    t = np.linspace(0, 1.5, 151)
    run = twin.simulate(arm, t, qd0=[1.0, 2.0], step_s=5e-5)
    a, b, ad, bd = integrate(double_pendulum(m, c, J, L, rotor), [0.4, 0.9, 1.0, 3.0], t)
    assert abs(run["joint/1/position"] - a).max() < 1e-5
    assert abs(run["joint/2/position"] - (b - a)).max() < 1e-5
    assert abs(run["joint/2/velocity"] - (bd - ad)).max() < 1e-4
    assert abs(run["tip/y"] - (L * np.sin(a) + 0.6 * np.sin(b))).max() < 1e-5
    assert abs(total_energy(run) - total_energy(run)[0]).max() < 1e-5
    assert np.ptp(run["joint/2/position"]) > np.pi  # angles go on over whole turns


def test_a_cart_with_a_rigid_pendulum():
    """Pa on the base with hub mass and rotor, then R; both driven."""
    M, m, c, J, tau = 1.0, 0.5, 0.25, 0.01, (2.0, 0.3)
    cart = robot(
        rigid(0.1, 0.3, 0.05, 1e-3, "Pa", start=0.2, hub_mass_kg=0.5, rotor_inertia=0.2),
        rigid(0.5, m, c, J, start=-1.0),
        gravity=(0, -G),
    )
    t = np.linspace(0, 1, 101)
    run = twin.simulate(cart, t, lambda t: tau, qd0=[0.1, -0.2], step_s=5e-5)

    def rates(t, y):
        _, a, xd, ad = y
        matrix = [[M + m, -m * c * np.sin(a)], [-m * c * np.sin(a), J + m * c**2]]
        return [
            xd,
            ad,
            *np.linalg.solve(
                matrix, [tau[0] + m * c * np.cos(a) * ad**2, tau[1] - m * G * c * np.cos(a)]
            ),
        ]

    x, a, xd, _ = integrate(rates, [0.2, -1.0, 0.1, -0.2], t)
    assert (
        abs(run["joint/1/position"] - x).max() < 1e-5
        and abs(run["joint/1/velocity"] - xd).max() < 1e-4
    )
    assert abs(run["joint/2/position"] - a).max() < 1e-5
    assert np.all(run["joint/1/drive"] == 2.0) and np.all(run["joint/2/drive"] == 0.3)


def test_a_slider_on_a_turning_rail_and_its_reaction():
    """Pa on a rigid link: the drive acts along the rail on the slider and back on the rail, with a
    fixed angle and a rotor."""
    J1, m, J2, f, rotor, gamma, c = 0.05, 0.7, 2e-3, 1.5, 0.1, 0.7, 0.04
    arm = robot(
        rigid(1.0, 0.0, 0.0, J1),
        rigid(0.1, m, c, J2, "Pa", angle_rad=gamma, start=0.3, rotor_inertia=rotor),
    )
    t = np.linspace(0, 0.5, 51)
    run = twin.simulate(arm, t, lambda t: (0.0, f), qd0=[2.0, -0.5], step_s=5e-5)
    along, across = c * np.cos(gamma), c * np.sin(gamma)

    def rates(t, y):
        _, d, w, v = (
            # T = 1/2 (J1 + J2 + m ((d + along)^2 + across^2)) w^2 + 1/2 m (v^2 - 2 v w across) +
            # 1/2 rotor v^2
            y
        )
        M = [[J1 + J2 + m * ((d + along) ** 2 + across**2), -m * across], [-m * across, m + rotor]]
        return [
            w,
            v,
            *np.linalg.solve(M, [-2 * m * (d + along) * v * w, f + m * (d + along) * w**2]),
        ]

    th, d, _, v = integrate(rates, [0.0, 0.3, 2.0, -0.5], t)
    assert abs(run["joint/1/position"] - th).max() < 1e-5
    assert (
        abs(run["joint/2/position"] - d).max() < 1e-5
        and abs(run["joint/2/velocity"] - v).max() < 1e-4
    )
    assert abs(run["link/2/angle"] - th - gamma).max() < 1e-5


@pytest.mark.parametrize("kind", ["ancf", "ge"])
def test_a_stiff_flexible_link_on_a_carriage_moves_as_a_rigid_one(kind):
    """Pa on the base with a flexible link at a fixed angle across the rail: constant force, all
    masses move along x."""
    arm = robot(beam(0.3, 0.2, 500.0, "Pa", angle_rad=1.2, hub_mass_kg=0.5, start=0.1), payload=0.1)
    t = np.linspace(0, 0.5, 51)
    run = twin.simulate(arm, t, Drive.force(signals.constant(0.6)), beam=kind)
    total = 0.5 + 0.06 + 0.1
    assert np.allclose(run["joint/1/position"], 0.1 + 0.6 / total * t**2 / 2, atol=5e-6)
    assert np.allclose(run["link/1/angle"], 1.2) and np.allclose(run["link/1/y"], 0.0, atol=1e-9)


def test_viscous_friction_gives_an_exponential_decay():
    t = np.linspace(0, 2, 21)
    run = twin.simulate(robot(rigid(0.1, 2.0, 0.0, 1.0, "Pa", viscous_friction=3.0)), t, qd0=[1.5])
    assert np.allclose(run["joint/1/velocity"], 1.5 * np.exp(-1.5 * t), atol=1e-6)


def test_coulomb_friction_stops_a_carriage_and_holds_it():
    t = np.linspace(0, 2, 201)
    run = twin.simulate(
        robot(rigid(0.1, 2.0, 0.0, 1.0, "Pa", coulomb_friction=4.0)), t, lambda t: [2.0], qd0=[1.0]
    )
    sliding = t < 0.99
    assert np.allclose(run["joint/1/velocity"][sliding], 1 - t[sliding], atol=1e-5)
    assert np.all(abs(run["joint/1/velocity"][t > 1.01]) < 1e-3)


def test_a_massless_rigid_link_hangs_a_pendulum():
    arm = robot(
        rigid(0.3, 0.0, 0.0, 0.0, locked=True),
        rigid(0.4, 0.0, 0.0, 0.0, start=-1.5),
        payload=0.5,
        gravity=(0, -G),
    )
    t = np.linspace(0, 1, 51)
    run = twin.simulate(arm, t, step_s=1e-4)
    a, _ = integrate(lambda t, y: [y[1], -G / 0.4 * np.cos(y[0])], [-1.5, 0.0], t)
    assert abs(run["joint/2/position"] - a).max() < 1e-5
