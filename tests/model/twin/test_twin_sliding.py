"""The twin's sliders (Pa on a flexible link) and sleeves (Pb) against rigid chains, and against
themselves."""

from itertools import pairwise

import numpy as np
import pytest

import rigid_chain
from flexura import signals
from flexura.io import Run
from flexura.signals import Drive
from flexura.twin.extrapolation import extrapolate
from flexura.twin.joints.mesh import sleeve_places
from robots import beam, rigid, robot
from twin_runs import error, let_go, soft, total_energy

# Kinematics: every joint against rigid links

STEP_S = 2e-4  # of stiff links: half of it changes no deviation by more than 0.1 %


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
    joints, tip = deviations_from_rigid(kinds.split(), flexible, hub_length_m=0.0375, step_s=STEP_S)
    assert joints < 5e-4 and tip < 5e-5


@pytest.mark.slow
@pytest.mark.parametrize(
    "kinds", ["R Pb", "Pb R", "Pb Pa", "Pb Pb", "R Pb Pa", "Pb Pb Pb", "Pb Pa R"]
)
def test_stiff_chains_of_all_joints_move_as_rigid_ones(kinds):
    joints, tip = deviations_from_rigid(kinds.split(), True, step_s=STEP_S)
    assert joints < 5e-4 and tip < 5e-5


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
