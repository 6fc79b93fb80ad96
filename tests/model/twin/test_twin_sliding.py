"""The twin's sliders (Pa on a flexible link) and sleeves (Pb) against rigid chains, published
numbers and themselves."""

from functools import partial
from itertools import pairwise

import numpy as np
import pytest

import rigid_chain
from flexura import signals, twin
from flexura.errors import FlexuraError, InputError
from flexura.io import Run
from flexura.signals import Drive
from flexura.twin import solve
from flexura.twin.build import build
from flexura.twin.extrapolation import extrapolate
from flexura.twin.joints.mesh import mesh, sleeve_places
from flexura.twin.loads import actuation
from robots import beam, rigid, robot

let_go = partial(twin.simulate, start="straight")  # links straight at the start


def total_energy(run):
    return run["energy/kinetic"] + run["energy/strain"] + run["energy/potential"]


def error(a, b, channel):
    """Of the largest magnitude."""
    return abs(a[channel] - b[channel]).max() / abs(b[channel]).max()


# Kinematics: every joint against rigid links


def chain(kinds, flexible):
    """Stiff links in the given joints, with everything a joint can carry."""
    start = {
        "R": {"start": 0.3},
        "Pa": {"start": 0.25, "angle_rad": 0.8},
        "Pb": {"start": 0.28, "angle_rad": 0.5},
    }
    carries = {"hub_mass_kg": 0.3, "hub_inertia_kg_m2": 0.004, "rotor_inertia": 0.05}

    def link(kind, bends):
        keys = start[kind] | carries
        return (
            beam(0.5, 0.6, 2000.0, 4, kind, damping={"beta_s": 2e-4}, **keys)
            if bends
            else rigid(0.5, 0.3, 0.2, 0.01, kind, **keys)
        )

    bends = [flexible] * len(kinds) if isinstance(flexible, bool) else flexible
    return robot(*map(link, kinds, bends), gravity=(0.5, -2.0), payload=0.1, payload_inertia=1e-3)


def deviations_from_rigid(kinds, flexible, **keys):
    """Of the joints' positions, relative to how far each moves, and of the tip, relative to the
    robot's reach."""
    arm, t = chain(kinds, flexible), np.linspace(0, 0.35, 36)
    force = np.where(np.array(kinds) == "R", 0.4, 1.0) * ([1.0] + [-0.3] * (len(kinds) - 1))
    speeds = np.where(np.array(kinds) == "R", 1.0, 0.1) * ([1.0] + [-0.5] * (len(kinds) - 1))
    q, tip = rigid_chain.simulate(arm, t, force, speeds)
    run = let_go(arm, t, lambda t: force, qd0=speeds, **keys)
    moved = [
        abs(run[f"joint/{i}/position"] - each).max() / np.ptp(each) for i, each in enumerate(q, 1)
    ]
    return max(moved), max(abs(run["tip/x"] - tip[0]).max(), abs(run["tip/y"] - tip[1]).max()) / (
        0.5 * len(kinds)
    )


@pytest.mark.parametrize(
    "kinds", ["Pb", "R Pb", "Pa Pb", "Pb R", "Pb Pa", "Pb Pb", "R Pb Pa", "Pb Pb Pb", "Pb Pa R"]
)
def test_rigid_links_in_sleeves(kinds):
    joints, tip = deviations_from_rigid(kinds.split(), False, step_s=1e-4)
    assert joints < 1e-6 and tip < 1e-6


@pytest.mark.parametrize(
    ("kinds", "flexible"),
    [
        ("R Pa", [True, False]),
        ("R Pa", True),
        pytest.param("Pa Pa", True, marks=pytest.mark.slow),
        pytest.param("Pb R", [True, False], marks=pytest.mark.slow),
        ("R Pb", [False, True]),
        ("R Pb", [True, False]),
        pytest.param("Pa Pb", True, marks=pytest.mark.slow),
        pytest.param("Pb Pa", [True, False], marks=pytest.mark.slow),
        pytest.param("Pb Pb", [True, False], marks=pytest.mark.slow),
    ],
)
def test_stiff_links_on_which_joints_slide_move_as_rigid_ones(kinds, flexible):
    """What is left is the links' elasticity: 2e-4 of a joint's motion with EI = 2000 N m^2."""
    joints, tip = deviations_from_rigid(kinds.split(), flexible, hub_length_m=0.0375)
    assert joints < 5e-4 and tip < 5e-5


@pytest.mark.slow
@pytest.mark.parametrize(
    "kinds", ["R Pb", "Pb R", "Pb Pa", "Pb Pb", "R Pb Pa", "Pb Pb Pb", "Pb Pa R"]
)
def test_stiff_chains_of_all_joints_move_as_rigid_ones(kinds):
    joints, tip = deviations_from_rigid(kinds.split(), True)
    assert joints < 5e-4 and tip < 5e-5


# Bending: published numbers


SLEEVE_EI, SLEEVE_MASS, SLEEVE_LENGTH = 756.65, 4.015, 3.6
SLEEVE_LAW = signals.cycloid(3.6, 2.0, start=1.8)


def linear_link_leaving_its_sleeve(t, first, gravity):
    """Tip deflection of benchmark B9's equation by Galerkin's method, w = sum q_k u^2 P_k(2u - 1),
    u = x/l(t).

    rhoA (w_tt + 2 U w_xt + U^2 w_xx + U' (l - x) w_xx) + EI w_xxxx = -rhoA g, from rest with the
    first q's given.
    """
    n, mass, stiffness = 7, SLEEVE_MASS, SLEEVE_EI
    u, weights = np.polynomial.legendre.leggauss(20)
    u, weights = (u + 1) / 2, weights / 2
    legendre = (
        np.polynomial.Legendre.basis(k, domain=[0, 1]).convert(kind=np.polynomial.Polynomial)
        for k in range(n)
    )
    shapes = [np.polynomial.Polynomial([0, 0, 1]) * p for p in legendre]
    f, f1, f2 = (np.array([(p.deriv(d) if d else p)(u) for p in shapes]) for d in range(3))
    to_f = np.linalg.solve((f * weights) @ f.T, f * weights)  # a function's components
    one, first_u, second, second_u, second_uu = (
        to_f @ g.T for g in (f1, u * f1, f2, u * f2, u**2 * f2)
    )
    bending = np.linalg.solve((f * weights) @ f.T, (f2 * weights) @ f2.T) * stiffness / mass
    weight = np.concatenate([np.zeros(n), -gravity * to_f @ np.ones(len(u))])
    unit = np.eye(n)

    def matrix(s):
        l, U, a = SLEEVE_LAW(s)
        r = U / l
        w_tt = (2 * r**2 - a / l) * first_u + r**2 * second_uu
        w_xt = -r / l * (one + second_u)
        axial = r**2 * second + a / l * (second - second_u)
        stiffness = w_tt + 2 * U * w_xt + axial + bending / l**4
        return np.block([[0 * unit, unit], [-stiffness, 2 * r * (first_u - one)]])

    y, out, h = np.zeros(2 * n), [], 2.5e-4  # implicit midpoint rule
    y[: len(first)] = first
    for k in range(round(t[-1] / h) + 1):
        if np.isclose(k * h, t).any():
            out.append(y[:n] @ [p(1.0) for p in shapes])
        half = h / 2 * matrix((k + 0.5) * h)
        y = np.linalg.solve(np.eye(2 * n) - half, y + half @ y + h * weight)
    return np.array(out)


def test_a_link_leaving_its_sleeve():
    """B9's equation, checked against B9's numbers; then with a sudden weight instead, as the twin
    starts straight."""
    t = np.array([0.25, 0.50, 0.75, 1.00, 1.25, 1.50, 1.75, 2.00, 3.00])
    published = [
        -0.04204,
        0.03550,
        -0.04940,
        0.04403,
        0.05059,
        -0.01513,
        -0.06383,
        -0.05753,
        0.02941,
    ]
    bent = np.array([1.25, -0.25]) * 0.05  # 0.05 (3 u^2 - u^3)/2
    assert linear_link_leaving_its_sleeve(t, bent, 0.0) == pytest.approx(
        published, abs=1e-3 * 0.0638
    )

    arm = robot(
        beam(SLEEVE_LENGTH, SLEEVE_MASS, SLEEVE_EI, 4, "Pb", start=1.8), gravity=(0.0, -0.6)
    )
    t = np.linspace(0, 2, 81)
    run = let_go(arm, t, Drive.pd([SLEEVE_LAW], [1e7], [1e5]), step_s=1e-3)
    expected = linear_link_leaving_its_sleeve(t, [], 0.6)
    assert abs(run["joint/1/position"] - [SLEEVE_LAW(s)[0] for s in t]).max() < 1e-5
    assert abs(run["link/1/tip_deflection"] - expected).max() < 2e-3 * abs(expected).max()
    inside = abs(
        run["link/1/deflection/2"][t < 0.75]
    )  # at 0.9 m of 3.6 m, of which at least 1.6 m are inside: as straight as its guides
    assert inside.max() < 5e-4 * abs(expected).max() and np.all(run["link/1/angle"] == 0.0)


@pytest.mark.parametrize(
    ("stiffness", "published"),
    [
        (
            0.5,
            [-0.07664, -0.07753, -0.09263, -0.12076, -0.12630, -0.11907, -0.12829],
        ),  # exact, 21 % of the link's length
        (25.0, [-0.0015526, -0.0015976, -0.0019377, -0.00244, -0.0025598]),
    ],
)
def test_a_slider_on_a_bent_link(stiffness, published):
    """Benchmark B10: a point of 0.05 kg from 0.1 m to 0.5 m in 1 s under gravity, from static
    equilibrium."""
    law = signals.cycloid(0.5, 1.0, start=0.1)
    arm = robot(
        beam(0.6, 0.2355, stiffness, 4, locked=True),
        rigid(0.0, 0.05, 0.0, 0.0, "Pa", start=0.1),
        gravity=(0.0, -9.81),
    )
    t = 0.25 * np.arange(len(published))

    def stand(motion):
        return Drive.pd([None, motion], [0.0, 1e6], [0.0, 1e4])

    def run(times):
        def new(robot, drive):
            return build(
                robot,
                "ancf",
                mesh(robot, None, None, times),
                np.zeros(2),
                actuation(drive, robot.start, np.zeros(2), np.array([0.0, 1.0])).gains,
            )

        damped, held = arm.replace({"link.1.damping.beta_s": 0.2}), stand(signals.constant(0.1))
        settle = solve.plan_steps(np.array([0.0, 4.0]), 2e-3, forced=True)
        (_, q, v, *_), _, _ = solve._solve(
            new(damped, held),
            actuation(held, arm.start, np.zeros(2), np.array([0.0, 1.0])),
            settle,
            None,
        )
        assert abs(v[-1]).max() < 1e-6

        def from_equilibrium():
            import exudyn

            moving = new(arm, stand(law))
            moving.mbs.systemData.SetODE2Coordinates(q[-1], exudyn.ConfigurationType.Initial)
            return moving

        act = actuation(stand(law), arm.start, np.zeros(2), np.array([0.0, 1.0]))
        return solve._run(from_equilibrium, act, t, 1e-3, 1, lambda fraction: None, "ANCF")[0]

    slid = extrapolate(run({}), {"Pa": run({"Pa": 2.0})})
    assert slid["link/1/tip_deflection"] == pytest.approx(published, abs=2e-3 * abs(min(published)))
    assert slid["joint/2/position"] == pytest.approx([law(s)[0] for s in t], abs=1e-6)


def test_a_bent_link_is_pushed_out_of_its_sleeve():
    """Benchmark B11: M^2/(2 EI) at the exit, 0.242104 N for 1 N at 0.5 m of a link of 0.5 N m^2;
    from the force that holds it.

    The beam's mesh makes it wobble by 1 % as the link moves through an element, so the mean over
    one element.
    """
    held = []
    for part in range(4):
        start = 0.5 + part / 4 * 1.0 / 32
        arm = robot(
            beam(1.0, 1e-5, 0.5, 4, "Pb", start=start, damping={"beta_s": 0.1}),
            payload=0.1,
            gravity=(0.0, -10.0),
        )
        run = let_go(
            arm, [0.0, 4.0], Drive.pd([signals.constant(start)], [1e5], [1e3]), step_s=4e-3
        )
        held.append(-run["joint/1/drive"][-1] * (0.5 / start) ** 2)
    assert np.mean(held) == pytest.approx(0.242104, rel=5e-3)


# Identities


def test_a_sleeve_clamps_at_its_exit():
    """A static beam of Hermite cubics through a sleeve's points ends as a beam clamped at the exit,
    wherever its nodes are."""

    def shift(delta, phase):
        nodes = np.arange(-30, 7) - phase
        stiffness = np.zeros((2 * len(nodes),) * 2)
        cubic = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
        for e in range(len(nodes) - 1):
            stiffness[2 * e : 2 * e + 4, 2 * e : 2 * e + 4] += cubic
        rows = []
        for place in sleeve_places(delta, 8 * delta, 1.0):
            e, row = int(np.floor(place - nodes[0])), np.zeros(2 * len(nodes))
            u = place - nodes[e]
            row[2 * e : 2 * e + 4] = (
                1 - 3 * u**2 + 2 * u**3,
                u - 2 * u**2 + u**3,
                3 * u**2 - 2 * u**3,
                u**3 - u**2,
            )
            rows.append(row)
        held, none = np.array(rows), np.zeros((len(rows),) * 2)
        moment = np.eye(len(stiffness) + len(rows))[len(stiffness) - 1]
        slope = np.linalg.solve(np.block([[stiffness, held.T], [held, none]]), moment)[
            len(stiffness) - 1
        ]
        return (slope - nodes[-1]) / delta  # slope = M (free length + shift)/EI

    for delta, spread in ((1.5, 1e-3), (3.0, 1e-3)):
        shifts = [shift(delta, phase) for phase in np.arange(0.01, 1, 0.05)]
        assert abs(np.mean(shifts)) < 1e-3 and np.std(shifts) < spread


def test_a_locked_slider_at_the_tip_is_a_locked_revolute():
    t = np.linspace(0, 0.5, 51)
    first = beam(0.5, 0.3, 2.0, 4, hub_inertia_kg_m2=5e-3, damping={"beta_s": 5e-4})
    carries = {"hub_mass_kg": 0.1, "hub_inertia_kg_m2": 1e-3, "locked": True}
    slid = robot(
        first, beam(0.3, 0.2, 0.5, 4, "Pa", start=0.5, angle_rad=0.9, **carries), payload=0.05
    )
    fixed = robot(first, beam(0.3, 0.2, 0.5, 4, start=0.9, **carries), payload=0.05)
    drive = Drive.force(signals.bang_bang(0.3, 0.4, rise_s=0.05), None)
    a, b = let_go(slid, t, drive), let_go(fixed, t, drive, elements=32, step_s=2.5e-4)
    for name, within in (
        ("joint/1/position", 1e-3),
        ("link/1/tip_deflection", 5e-3),
        ("link/2/tip_deflection", 5e-3),
        ("tip/y", 1e-3),
    ):
        assert error(a, b, name) < within, name
    assert a["joint/2/position"] == pytest.approx(np.full(51, 0.5), abs=1e-9)


def test_a_locked_sleeve_is_a_clamp():
    """The free part of a link in a locked sleeve on a moving arm; the rest as a rigid link behind
    it."""
    t = np.linspace(0, 0.5, 51)
    arm = rigid(0.3, 0.5, 0.1, 0.02)
    sleeve = robot(
        arm, beam(0.4, 0.2, 0.5, 4, "Pb", start=0.25, angle_rad=0.6, locked=True), payload=0.02
    )
    tail = rigid(0.0, 0.03, -0.075, 0.03 * 0.15**2 / 12, locked=True, start=0.6)
    clamped = robot(arm, tail, beam(0.25, 0.2, 0.5, 4, locked=True), payload=0.02)
    drive = [Drive.force(signals.bang_bang(0.1, 0.4, rise_s=0.05), *[None] * k) for k in (1, 2)]
    a, b = (
        let_go(sleeve, t, drive[0]),
        let_go(clamped, t, drive[1], elements=12, step_s=2.5e-4),
    )
    assert error(a, b, "joint/1/position") < 2e-4 and error(a, b, "tip/y") < 2e-4
    w, expected = a["link/2/tip_deflection"], b["link/3/tip_deflection"]
    assert abs(w - expected).max() < 5e-3 * abs(expected).max() and abs(expected).max() > 1e-3
    assert a["link/2/x"] == pytest.approx(
        b["link/3/x"] - 0.15 * np.cos(b["link/3/angle"]), abs=1e-5
    )
    assert (
        error(
            a,
            Run(b.t, {"link/2/angle": b["link/3/angle"]}, {"link/2/angle": "rad"}),
            "link/2/angle",
        )
        < 2e-4
    )


def soft(**keys):
    """PbPa that coasts under gravity: a slider with inertia on a soft link that leaves a sleeve."""
    return robot(
        beam(0.9, 0.5, 4.0, 4, "Pb", start=0.5, damping={"beta_s": 0.0}),
        rigid(0.2, 0.2, 0.1, 2e-3, "Pa", start=0.7, angle_rad=1.0, hub_mass_kg=0.1),
        gravity=(0.0, -1.0),
        payload=0.05,
        **keys,
    )


def test_energy_is_conserved_through_sleeve_and_hub():
    run = let_go(
        soft(), np.linspace(0, 0.5, 51), qd0=[0.3, 0.2], hub_length_m=0.0675, step_s=2.5e-4
    )
    drift, strain = (
        abs(total_energy(run) - total_energy(run)[0]).max(),
        np.ptp(run["energy/strain"]),
    )
    assert drift < 1e-3 * strain and strain > 0.02 * np.ptp(run["energy/kinetic"])
    assert np.ptp(run["joint/1/position"]) > 0.1 and np.ptp(run["joint/2/position"]) > 0.02


def test_the_error_is_of_second_order_in_the_step():
    arm, t = soft().replace({"link.1.damping.beta_s": 1e-3}), np.linspace(0, 0.2, 21)
    runs = [
        let_go(arm, t, qd0=[0.3, 0.2], hub_length_m=0.0675, step_s=h) for h in (2e-3, 1e-3, 5e-4)
    ]
    for name in ("joint/1/position", "joint/2/position", "link/1/tip_deflection"):
        first, second = (abs(a[name] - b[name]).max() for a, b in pairwise(runs))
        assert 2 < first / second < 5, name
        assert first < 5e-4 * abs(runs[0][name]).max()


def test_the_error_of_a_hub_is_of_first_order_in_its_length_and_that_of_a_sleeve_of_second():
    t = np.linspace(0, 0.4, 41)
    slider = robot(
        beam(0.8, 0.7, 5.0, 4, hub_inertia_kg_m2=0.05, damping={"beta_s": 5e-4}),
        rigid(0.2, 0.2, 0.15, 5e-3, "Pa", start=0.3, angle_rad=1.0),
    )
    sleeve = robot(
        beam(0.9, 0.7, 5.0, 4, "Pb", start=0.4, damping={"beta_s": 5e-4}),
        payload=0.2,
        gravity=(0.0, -1.0),
    )
    push = Drive.force(*2 * [signals.bang_bang(0.5, 0.4, rise_s=0.1)])
    pull = Drive.pd([signals.cycloid(0.6, 0.4, start=0.4)], [1e6], [1e4])
    for arm, drive, delta, name, low, high in (
        (slider, push, 0.0125, "joint/2/position", 1.8, 2.5),
        (sleeve, pull, 1.5 * 0.9 / 24, "link/1/tip_deflection", 3.0, 4.5),
    ):
        y = [
            let_go(arm, t, drive, elements=24, hub_length_m=k * delta, step_s=5e-4)[name]
            for k in (1, 2, 4)
        ]
        assert low < np.linalg.norm(y[2] - y[1]) / np.linalg.norm(y[1] - y[0]) < high, name


def test_extrapolation_takes_both_errors_away():
    t = np.linspace(0, 1, 5)

    def run(hub, sleeve):
        values = {"joint/1/position": 1 + t + 0.1 * hub * t + 0.3 * sleeve**2 * t**2}
        return Run(
            t, values, {"joint/1/position": "m"}, {"hub_length_m": [hub, sleeve], "wall_s": 1.0}
        )

    exact = extrapolate(run(0.1, 0.2), {"Pa": run(0.2, 0.2), "Pb": run(0.1, 0.4)})
    assert exact["joint/1/position"] == pytest.approx(1 + t, abs=1e-14)
    assert (
        exact.meta["extrapolation"] == pytest.approx({"Pa": 0.01 / 2.022, "Pb": 0.012 / 2.022})
        and exact.meta["wall_s"] == 3.0
    )


def test_meta_tells_of_hub_lengths_and_extrapolation(tmp_path):
    fractions = []
    run = let_go(soft(), [0.0, 0.05], qd0=[0.3, 0.2], progress=fractions.append)
    sleeve, hub = 1.5 * 0.9 / 32, 0.5 * 0.9 / 32
    assert run.meta["hub_length_m"] == pytest.approx([sleeve, hub]) and set(
        run.meta["extrapolation"]
    ) == {"Pa", "Pb"}
    assert run.meta["hub_lengths_m"]["Pa"][1] == pytest.approx([sleeve, 2 * hub])
    assert run.meta["hub_lengths_m"]["Pb"][1] == pytest.approx([2 * sleeve, hub])
    assert fractions == sorted(fractions) and fractions[-1] == pytest.approx(1.0)
    run.save(tmp_path)
    assert Run.read(tmp_path).meta == run.meta
    assert "extrapolation" not in let_go(soft(), [0.0, 0.05], hub_length_m=0.05).meta


# Drives and ends


def test_pd_control_as_data_and_as_a_function_and_the_sensed_deflection():
    seen = []
    drive = Drive.pd([None, signals.cycloid(0.6, 0.3, start=0.5)], [0.0, 300.0], [0.0, 20.0])

    def function(t, position, velocity, tip):
        seen.append(tip)
        return drive(t, position, velocity)

    arm = robot(
        rigid(0.2, 0.5, 0.1, 0.01, start=0.4, locked=True),
        beam(
            0.9,
            0.5,
            20.0,
            4,
            "Pb",
            start=0.5,
            angle_rad=0.3,
            coulomb_friction=0.05,
            viscous_friction=0.5,
            rotor_inertia=0.1,
        ),
        gravity=(0.0, -2.0),
        payload=0.1,
    )
    t = np.linspace(0, 0.3, 31)
    one, two = (
        let_go(arm, t, each, hub_length_m=0.0675, step_s=5e-4) for each in (drive, function)
    )
    for name in ("joint/2/position", "joint/2/drive", "link/2/tip_deflection"):
        assert abs(one[name] - two[name]).max() < 1e-6 * abs(one[name]).max(), name
    assert seen[-1] == pytest.approx(two["link/2/tip_deflection"][-1], rel=1e-6)


def test_friction_stops_a_link_in_its_sleeve():
    arm = robot(beam(0.8, 1.0, 50.0, 4, "Pb", start=0.4, coulomb_friction=0.8, hub_mass_kg=5.0))
    t = np.linspace(0, 0.6, 61)
    run = let_go(arm, t, qd0=[0.4], hub_length_m=0.06)
    moving = t < 0.38
    assert run["joint/1/velocity"][moving] == pytest.approx(
        0.4 - t[moving], abs=1e-4
    )  # 0.8 N on 0.8 kg
    assert abs(run["joint/1/velocity"][t > 0.42]).max() < 1e-3 and run["joint/1/position"][
        -1
    ] == pytest.approx(0.48, abs=1e-3)


@pytest.mark.parametrize(
    ("arm", "speeds", "joint"),
    [
        (robot(beam(0.5, 0.5, 20.0, 4, "Pb", start=0.45)), [1.0], 1),
        (robot(beam(0.5, 0.5, 20.0, 4, "Pb", start=0.1)), [-1.0], 1),
        (
            robot(beam(0.5, 0.5, 20.0, 4), rigid(0.0, 0.1, 0.0, 0.0, "Pa", start=0.45)),
            [0.0, 1.0],
            2,
        ),
        (
            robot(beam(0.5, 0.5, 20.0, 4), rigid(0.0, 0.1, 0.0, 0.0, "Pa", start=0.05)),
            [0.0, -1.0],
            2,
        ),
    ],
)
def test_sliding_off_the_end_is_an_error_with_its_time(arm, speeds, joint, capfd):
    with pytest.raises(
        FlexuraError, match=rf"joint {joint} slid off the end of its link at t = 0\.(05|1)"
    ):
        let_go(arm, [0.0, 0.2], qd0=speeds)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("change", "arguments", "key"),
    [
        ({"link.1.joint.start": 0.0}, {}, r"link\[1\]\.joint\.start"),
        ({"link.1.joint.start": 0.91}, {}, r"link\[1\]\.joint\.start"),
        ({"link.2.joint.start": -0.1}, {}, r"link\[2\]\.joint\.start"),
        ({}, {"beam": "ge"}, "beam"),
        ({}, {"hub_length_m": 0.0}, "hub_length_m"),
    ],
)
def test_what_cannot_slide_is_refused_by_name(change, arguments, key):
    with pytest.raises(InputError, match=key):
        let_go(soft().replace(change), [0.0, 0.1], **arguments)
