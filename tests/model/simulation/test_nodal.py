"""sliding = "nodal": where it is exact, and where it only converges.

The motions are short: the dense equations are slow.
"""

from __future__ import annotations

import numpy as np
import pytest

import flexura as fx
from flexura import signals
from nodal_robots import (
    DAMPED,
    KEYS,
    TAPER,
    in_a_sleeve,
    under_a_slider,
)
from robots import beam, largest_difference, rigid, system

# Where it is exact


def cut_in_two(node: int, elements: int, stiffening: bool) -> fx.System:
    """`in_a_sleeve` as a robot of fixed structure: a rigid link in the sleeve and, on a locked
    joint, the elements beyond."""
    behind, mass = 0.8 * node / elements, TAPER[0]
    at = lambda table, s: np.interp(s, [0.0, 0.8], [v["value"] for v in table])
    xi, w = np.polynomial.legendre.leggauss(4)
    s, dm = behind / 2 * (1 + xi), behind / 2 * w * at(mass, behind / 2 * (1 + xi))
    m, centre = float(dm.sum()), float(dm @ s / max(dm.sum(), 1e-300))
    inside = rigid(
        0.8, m, centre, float(dm @ (s - centre) ** 2), "Pb", start=0.8, angle_rad=0.3, **KEYS
    )
    rest = [
        [{"at_m": x, "value": float(at(v, behind + x))} for x in (0.0, 0.8 - behind)] for v in TAPER
    ]
    beyond = beam(
        0.8 - behind, *rest, elements - node, "Pa", start=behind, locked=True, damping=DAMPED
    )
    return system(
        rigid(0.3, 0.5, 0.15, 0.01),
        inside,
        beyond,
        rigid(0.2, 0.1, 0.1, 1e-3, viscous_friction=0.01),
        payload=0.05,
        payload_inertia=1e-4,
        gravity=(0.5, -1.0),
        stiffening=stiffening,
    )


@pytest.mark.parametrize("stiffening", [False, True])
@pytest.mark.parametrize(("start", "node"), [(0.75, 0), (0.5, 1), (0.3, 2), (0.1, 3)])
def test_a_sleeved_link_is_a_rigid_one_with_the_elements_beyond_the_last_node_at_rest(
    start, node, stiffening
):
    """All equations, in any state, bent by up to a radian."""
    arm, two = in_a_sleeve(4, "nodal", start, stiffening), cut_in_two(node, 4, stiffening)
    fixed = arm.fixed(arm.start())
    assert fixed.nodes == (0, node, 0)
    rows = np.setdiff1d(np.arange(arm.n), fixed.assembly.structure.resting)
    own = np.setdiff1d(np.arange(two.n), [2])  # without the locked joint
    random = np.random.default_rng(node)
    q, qd = arm.start(), np.zeros(arm.n)
    q[rows] += 0.3 * random.normal(size=len(rows)) * (rows != 1)
    qd[rows] = random.normal(size=len(rows))
    p, pd = two.start(), np.zeros(two.n)
    p[own], pd[own] = q[rows], qd[rows]
    a, b = fixed.assembly, two.assembly
    pairs = (
        (a.mass(q)[np.ix_(rows, rows)], b.mass(p)[np.ix_(own, own)]),
        (a.bias(q, qd)[rows], b.bias(p, pd)[own]),
        (a.gravity(q)[rows], b.gravity(p)[own]),
        (a.elastic(q)[rows], b.elastic(p)[own]),
        (a.damping(q)[np.ix_(rows, rows)], b.damping(p)[np.ix_(own, own)]),
        (a.energies(q, qd), b.energies(p, pd)),
    )
    for mine, theirs in pairs:
        assert np.asarray(mine) == pytest.approx(
            np.asarray(theirs), abs=1e-12 * max(np.abs(theirs).max(), 1e-9)
        )
    terms = a.terms(q, qd)
    assert terms.forces == pytest.approx(a.bias(q, qd) + a.gravity(q), abs=1e-12)


@pytest.mark.parametrize("stiffening", [False, True])
def test_a_slider_on_the_last_node_is_a_body_at_the_tip(stiffening):
    """At d = L the hub has the tip's place and angle: so has a joint R."""
    sliding = under_a_slider(4, "nodal", 0.6, stiffening, locked=True)
    tip = system(
        beam(0.6, 0.2355, 0.5, 4, hub_inertia_kg_m2=2e-3),
        rigid(0.1, 0.05, 0.04, 1e-4, start=0.7, hub_mass_kg=0.02, locked=True),
        payload=0.01,
        gravity=(0.0, -1.0),
        stiffening=stiffening,
    )
    q = np.append(0.3 * np.random.default_rng(1).normal(size=sliding.n - 1), 0.6)
    p = np.append(q[:-1], 0.7)
    a, b, own = sliding.fixed(q).assembly, tip.assembly, slice(-1)
    assert a.mass(q)[own, own] == pytest.approx(b.mass(p)[own, own], rel=1e-12, abs=1e-15)
    assert a.bias(q, 2 * q * (q != 0.6))[own] == pytest.approx(
        b.bias(p, 2 * q * (q != 0.6))[own], abs=1e-12
    )
    assert a.gravity(q)[own] == pytest.approx(b.gravity(p)[own], abs=1e-13)


def test_a_slider_held_on_a_node_rides_as_on_the_line():
    """At x_k the line has the node's displacement and slope; the spaces of the mesh and of the
    polynomials differ by little."""
    t = np.linspace(0, 0.05, 6)
    push = fx.Drive.force(signals.harmonic(0.1, 5.0), None)
    a, b = (
        fx.simulate(under_a_slider(4, kind, 0.45, locked=True), t, push, rtol=1e-6)
        for kind in ("nodal", "continuous")
    )
    assert (
        largest_difference(a, b, ["joint/1/position", "tip/x", "tip/y", "link/1/tip_deflection"])
        < 1e-3
    )
    assert a.meta["energy_jumps"] == [] and list(a) == list(b) and a.units == b.units


def test_between_two_nodes_a_link_is_clamped_at_the_last_node_at_rest():
    """The static tip deflection P l^3/(3 EI) has the length l from X_j, not the free length."""
    arm = system(beam(0.8, 0.3, 1.5, 4, "Pb", start=0.5), sliding="nodal", stiffening=False)
    q = fx.static(arm, tip_force=(0.0, 0.1))
    assert fx.tip_pose(arm, q) == pytest.approx(
        [0.5, 0.1 * 0.6**3 / 3 / 1.5, 0.1 * 0.6**2 / 2 / 1.5], rel=1e-9
    )
    assert np.all(q[1:3] == 0.0) and arm.labels[2] == "link/1/element/1/bubble [rad]"
    one = system(beam(0.6, 0.3, 1.5, 3, locked=True), stiffening=False)
    assert fx.frequencies(arm) == pytest.approx(fx.frequencies(one), rel=1e-9)
    assert fx.frequencies(arm, count=2) == pytest.approx(fx.frequencies(one)[:2], rel=1e-9)


@pytest.mark.parametrize("start", [0.75, 0.5, 0.3, 0.1])
def test_a_tapered_link_keeps_its_mass_wherever_it_is_cut(start):
    """M of the joints, straight: that of the continuous link at the same d, whose inertia is
    exact."""
    cut, smooth = in_a_sleeve(4, "nodal", start), in_a_sleeve(4, "continuous", start)
    M, joints = cut.fixed(cut.start()).mass(cut.start()), np.ix_(cut.joint_rows, cut.joint_rows)
    expected = smooth.mass(smooth.start())
    assert M[joints] == pytest.approx(
        expected[np.ix_(smooth.joint_rows, smooth.joint_rows)], rel=1e-10
    )


@pytest.mark.parametrize(
    "build", [lambda: under_a_slider(4, "nodal", 0.35), lambda: in_a_sleeve(5, "nodal", 0.45)]
)
def test_from_static_equilibrium_nothing_moves(build):
    held = build().robot
    held = fx.assemble(
        held.replace({f"link.{i}.joint.locked": True for i in range(1, len(held.links) + 1)})
    )
    q = fx.static(held)
    run = fx.simulate(held, [0.0, 0.01, 0.02], q0=q, rtol=1e-6)
    assert np.abs(run.states[:, : held.n] - q).max() < 1e-8 and np.abs(q).max() > 1e-3


def test_a_robot_that_slides_on_nothing_flexible_is_the_same_in_both_ways():
    links = beam(0.5, 0.2, 1.0, 2, modes=2), rigid(0.2, 0.3, 0.1, 1e-3, "Pb", start=0.1)
    t, push = np.linspace(0, 0.3, 11), fx.Drive.force(signals.step(0.1), signals.step(0.5))
    a, b = (fx.simulate(system(*links, sliding=kind), t, push) for kind in ("nodal", "continuous"))
    assert largest_difference(a, b) == 0.0 and "energy_jumps" not in a.meta


# Where it only converges


def test_a_slider_converges_with_the_spacing_of_the_nodes():
    """It hangs on a node that is up to l_e ahead of it: the sag is wrong to first order."""
    sag = []
    for elements, kind in ((6, "continuous"), (6, "nodal"), (12, "nodal"), (24, "nodal")):
        bridge = system(
            beam(0.6, 0.2355, 2.0, elements, locked=True),
            rigid(0.0, 0.05, 0.0, 0.0, "Pa", start=0.301),
            gravity=(0.0, -2.0),
            stiffening=False,
            sliding=kind,
        )
        sag.append(fx.tip_pose(bridge, fx.static(bridge))[1])
    error = np.abs(np.array(sag[1:]) / sag[0] - 1)
    assert np.all(error[1:] < 0.6 * error[:-1]) and error[-1] > 1e-3


def test_a_sleeve_converges_with_the_spacing_of_the_nodes():
    """The link is up to l_e longer than its free length: its frequency is too low to first
    order."""
    f = []
    for elements, kind in (
        (8, "continuous"),
        (4, "nodal"),
        (8, "nodal"),
        (16, "nodal"),
        (32, "nodal"),
    ):
        link = system(
            beam(0.6, 0.2355, 2.0, elements, "Pb", start=0.3049), stiffening=False, sliding=kind
        )
        f.append(fx.frequencies(link, count=1)[0])
    error = 1 - np.array(f[1:]) / f[0]
    assert np.all(error > 0) and error[0] < 0.6 and error[-1] < 0.1 and np.all(np.diff(error) < 0)
    l = 0.6 - 0.6 * np.array([1, 3, 7, 15]) / np.array([4, 8, 16, 32])
    assert np.array(f[1:]) / f[0] == pytest.approx((0.3049 / l) ** 2, rel=1e-3)


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize(
    ("elements", "start", "motion", "window", "tip_mm"),
    [
        (4, 0.20, signals.harmonic(-0.05, 1.0, offset=0.25), (1.0, 2.0), 10.0),
        (8, 0.20, signals.harmonic(-0.05, 1.0, offset=0.25), (0.3, 1.0), 13.3),
        (8, 0.25, signals.constant(0.25), (1.0, 2.0), 5.0),
        (4, 0.40, signals.constant(0.40), (1.0, 2.0), 34.0),
    ],
)
def test_the_dissertations_type_iii_as_an_independent_program_has_it(
    elements, start, motion, window, tip_mm
):
    """Node-wise assembly of the linear model written for the reference: a link shaken at 1 Hz, 0.40
    m, 20 g at its tip."""
    strip = {
        "length_m": 0.4,
        "elements": elements,
        "section": {"width_m": 0.02, "height_m": 0.001},
        "young_modulus_Pa": 2e11,
        "density_kg_m3": 7850.0,
        "damping": {"alpha_1_s": 1.0},
        "joint": {"type": "Pb", "hub_mass_kg": 0.3, "start_m": start},
    }
    arm = system(
        rigid(0.2, 0.2, 0.1, 0.2 * 0.2**2 / 12),
        strip,
        payload=0.02,
        stiffening=False,
        sliding="nodal",
    )
    t = np.linspace(0, window[1], round(500 * window[1]) + 1)
    run = fx.inverse(arm, t, [signals.harmonic(np.pi / 6, 1.0, -np.pi / 2), motion], rtol=1e-5)
    peak = 1e3 * np.abs(run["link/2/tip_deflection"][t >= window[0]]).max()
    assert peak == pytest.approx(tip_mm, abs=0.05 if tip_mm < 20 else 0.5)  # the digits given
