"""sliding = "nodal": where it is exact, where it only converges, its energy jumps, and how a run
goes on and ends.

The motions are short: the dense equations are slow.
"""

from __future__ import annotations

import _thread

import numpy as np
import pytest

import flexura as fx
from flexura import signals
from flexura.system.nodes import nodes_at, rest_node
from robots import beam, largest_difference, rigid, robot, system

TAPER = (
    [{"at_m": 0.0, "value": 0.3}, {"at_m": 0.8, "value": 0.15}],
    [{"at_m": 0.0, "value": 2.0}, {"at_m": 0.8, "value": 0.7}],
)
KEYS = {"hub_mass_kg": 0.1, "hub_inertia_kg_m2": 2e-3}
DAMPED = {"alpha_1_s": 0.5, "beta_s": 1e-4}
TOTAL = ("energy/kinetic", "energy/strain", "energy/potential")


def total(run: fx.Run) -> np.ndarray:
    return sum(run[name] for name in TOTAL)


def steady(start: float, rate: float) -> signals.Signal:
    """Motion at a constant rate."""
    return signals.Signal(np.array([[0.0, start, rate, 0, 0, 0, 0, 0, 0, 0]]))


def under_a_slider(
    elements: int, sliding: str, start: float, stiffening: bool = False, **keys
) -> fx.System:
    """A swinging link, a slider with an arm on it, and a payload."""
    return system(
        beam(0.6, 0.2355, 0.5, elements, hub_inertia_kg_m2=2e-3),
        rigid(0.1, 0.05, 0.04, 1e-4, "Pa", start=start, angle_rad=0.7, hub_mass_kg=0.02, **keys),
        payload=0.01,
        gravity=(0.0, -1.0),
        stiffening=stiffening,
        sliding=sliding,
    )


def in_a_sleeve(
    elements: int, sliding: str, start: float, stiffening: bool = False, **keys
) -> fx.System:
    """An arm with a tapered link in a sleeve at its tip, and a link with a payload beyond."""
    sleeved = beam(
        0.8, *TAPER, elements, "Pb", start=start, angle_rad=0.3, damping=DAMPED, **KEYS, **keys
    )
    return system(
        rigid(0.3, 0.5, 0.15, 0.01),
        sleeved,
        rigid(0.2, 0.1, 0.1, 1e-3, viscous_friction=0.01),
        payload=0.05,
        payload_inertia=1e-4,
        gravity=(0.5, -1.0),
        stiffening=stiffening,
        sliding=sliding,
    )


def cart_with_sleeve(elements: int, start: float, slider: float = 0.7, **keys) -> fx.System:
    """A link in a sleeve on the base, with a slider beyond that carries a point mass."""
    return system(
        beam(0.8, 0.3, 1.5, elements, "Pb", start=start, **keys),
        rigid(0.0, 0.05, 0.0, 0.0, "Pa", start=slider, viscous_friction=0.3),
        gravity=(0.0, -2.0),
        stiffening=False,
        sliding="nodal",
    )


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
    run = fx.inverse(
        arm, t, [signals.harmonic(np.pi / 6, 1.0, -np.pi / 2), motion], rtol=1e-5, method="implicit"
    )
    peak = 1e3 * np.abs(run["link/2/tip_deflection"][t >= window[0]]).max()
    assert peak == pytest.approx(tip_mm, abs=0.05 if tip_mm < 20 else 0.5)  # the digits given


# Energy


@pytest.mark.parametrize("stiffening", [False, True])
@pytest.mark.parametrize(
    ("start", "rate", "says"), [(0.483, -0.6, "entered"), (0.477, 0.6, "left")]
)
def test_energy_balances_between_the_jumps(start, rate, says, stiffening):
    """A free robot under drives, its link sliding into its sleeve or out: work, friction, damping
    and jumps are all."""
    arm = in_a_sleeve(5, "nodal", start, stiffening, viscous_friction=0.2)
    push = fx.Drive.force(
        signals.harmonic(0.3, 1.0), signals.constant(rate), signals.harmonic(0.02, 2.0)
    )
    qd, q = np.zeros(arm.n), arm.start()
    qd[0], qd[1], q[6:8] = 1.0, rate, 0.02
    if says == "left":
        q[6:8] = 0.0
        q[8:10] = 0.02
    run = fx.simulate(arm, np.linspace(0, 0.012, 13), push, q, qd, rtol=1e-8, method="explicit")
    jumps = run.meta["energy_jumps"]
    assert run.complete and len(jumps) == 1 and run.meta["energy_error"] < 1e-7
    assert [e["t"] for e in run.meta["events"]] == [j["t"] for j in jumps]
    assert f"{says} its sleeve" in jumps[0]["text"] and 0 < jumps[0]["t"] < 0.012
    size, scale = abs(jumps[0]["J"]), np.abs(total(run)).max()
    if says == "entered":  # what the node moved and bent with is gone
        assert size > 1e-4 * scale
    else:  # the element that becomes free is straight and at rest
        assert size < 1e-14 * scale


def test_a_jump_is_the_difference_of_the_energies_on_its_two_sides():
    """Seen from outside: outputs just before and after, the work between them taken off."""
    arm = in_a_sleeve(5, "nodal", 0.483, True)
    q = arm.start()
    q[6:8] = 0.05
    motion = fx.Drive.prescribed(signals.harmonic(0.3, 1.0, -np.pi / 2), steady(0.483, -0.6), None)
    jump = fx.simulate(arm, [0.0, 0.008], motion, q, rtol=1e-8).meta["energy_jumps"][0]
    assert jump["t"] == pytest.approx(0.005, abs=1e-7) and abs(jump["J"]) > 1e-4
    run = fx.simulate(arm, [0.0, jump["t"] - 1e-7, jump["t"] + 1e-7, 0.008], motion, q, rtol=1e-8)
    rest = np.diff(total(run) - run["energy/work"] + run["energy/loss"])
    assert rest[1] == pytest.approx(jump["J"], rel=1e-4)
    assert rest[[0, 2]] == pytest.approx(0.0, abs=1e-7 * np.abs(total(run)).max())


def test_a_slider_that_goes_on_to_the_next_node_falls_by_their_difference():
    """m g (w_3 - w_2) + m (w_3'^2 - w_2'^2)/2, from the unknowns, which stay as they are."""
    mass, g = 0.05, 9.81
    bridge = system(
        beam(0.6, 0.2355, 0.5, 4, locked=True),
        rigid(0.0, mass, 0.0, 0.0, "Pa", start=0.29),
        gravity=(0.0, -g),
        stiffening=False,
        sliding="nodal",
    )
    roll = fx.Drive.prescribed(None, steady(0.29, 1.0))
    run = fx.simulate(bridge, [0.0, 0.02], roll, q0=fx.static(bridge), rtol=1e-7)
    jump = run.meta["energy_jumps"][0]
    assert jump["t"] == pytest.approx(0.01, abs=1e-7) and "node 3 of link 1" in jump["text"]
    run = fx.simulate(bridge, [0.0, jump["t"]], roll, q0=fx.static(bridge), rtol=1e-7)
    w, rate = (
        bridge.fixed(bridge.start()).line(y, 1, [0.3, 0.45])[1] for y in np.split(run.states[-1], 2)
    )
    assert jump["J"] == pytest.approx(
        mass * (g * (w[1] - w[0]) + (rate[1] ** 2 - rate[0] ** 2) / 2), rel=1e-5
    )
    assert jump["J"] < -1e-3


def test_a_node_that_enters_is_put_to_rest_and_no_other_is_moved():
    link = system(beam(0.8, *TAPER, 5, "Pb", start=0.5), sliding="nodal", stiffening=False).fixed(
        np.r_[0.5, np.zeros(10)]
    )
    assert link.nodes == (1,)
    y = np.r_[0.5, 0.0, 0.0, np.random.default_rng(3).normal(size=8)]
    z, s = y.copy(), 0.8 * np.arange(6) / 5
    rest_node(link.assembly.structure, 0, 2, z)
    before, after = (np.array(link.line(q, 1, s)[1:]) for q in (y, z))
    assert np.all(z[:5] == [0.5, 0, 0, 0, 0]) and after[:, 2] == pytest.approx(0.0, abs=1e-15)
    assert after[:, 3:] == pytest.approx(before[:, 3:], abs=1e-14)


def test_a_node_that_leaves_starts_from_rest():
    arm = in_a_sleeve(5, "nodal", 0.485)
    back_and_forth = signals.harmonic(0.01, 20.0, 0.0, offset=0.475)
    t = np.linspace(0, 0.05, 51)
    run = fx.inverse(
        arm, t, [signals.harmonic(0.3, 1.0, -np.pi / 2), back_and_forth, signals.constant(0.0)]
    )
    behind = 0.8 - run["joint/2/position"]
    for k in range(1, 6):
        row = arm.joint_rows[1] + 2 * k - 1
        own = run.states[:, [row, row + 1, arm.n + row, arm.n + row + 1]]
        inside = behind >= 0.8 * k / 5 + 1e-8
        assert np.all(own[inside] == 0.0) and np.all(own[1:][~inside[1:]] != 0.0)
    assert run.complete and [j["text"].split(" its")[0] for j in run.meta["energy_jumps"]] == [
        "node 2 of link 2 entered",
        "node 2 of link 2 left",
    ]


# Chains, drives and ends


def test_a_slider_on_a_link_in_a_sleeve_counts_along_the_whole_link():
    """Both move; the slider's position, limits and drive are along the link, wherever the sleeve
    is."""
    cart = cart_with_sleeve(4, 0.395, 0.605)
    out, back = steady(0.395, 0.5), steady(0.605, -0.4)
    t = np.linspace(0, 0.03, 16)
    run = fx.inverse(cart, t, [out, back], rtol=1e-6)
    assert run.complete and run.meta["energy_error"] < 1e-5
    assert run["joint/2/position"] == pytest.approx([back(s)[0] for s in t], abs=1e-12)
    hub = run["link/2/x"] - run["link/1/x"]
    assert hub == pytest.approx(run["joint/2/position"], abs=1e-12)  # (d, w_k): no shortening
    said = " ".join(j["text"] for j in run.meta["energy_jumps"])
    assert (
        "node 2 of link 1 left its sleeve" in said
        and "joint 2 (Pa) went on to node 3 of link 1" in said
    )


def test_the_node_under_a_slider_stays_ahead_of_the_sleeve():
    cart = cart_with_sleeve(4, 0.41, 0.395)
    assert nodes_at(cart.robot, cart.robot.start) == (1, 2)
    run = fx.inverse(
        cart,
        [0.0, 0.03],
        [steady(0.41, -0.5), signals.constant(0.595)],
        q0=np.r_[0.41, np.zeros(8), 0.595],
    )
    assert run.complete and len(run.meta["energy_jumps"]) == 1


def test_a_python_drive_sees_the_whole_robot():
    t = np.linspace(0, 0.02, 5)
    cart = cart_with_sleeve(4, 0.599)
    gains, targets = ([50.0, 30.0], [4.0, 2.0]), [signals.constant(0.7), signals.constant(0.5)]

    def law(time_s, position, velocity, tip_deflection):
        assert position.shape == velocity.shape == (2,)
        return np.multiply(gains[0], [0.7, 0.5] - position) - np.multiply(gains[1], velocity)

    a = fx.simulate(cart, t, law, rtol=1e-10, method="explicit")
    b = fx.simulate(cart, t, fx.Drive.pd(targets, *gains), rtol=1e-10, method="explicit")
    assert (
        largest_difference(a, b) < 1e-9
        and len(a.meta["energy_jumps"]) == len(b.meta["energy_jumps"]) > 0
    )
    assert a.meta["drive"] == "Python function" and b.meta["drive"][0]["kp"] == 50.0
    with pytest.raises(fx.InputError, match=r"drive = .*expected 2 finite forces"):
        fx.simulate(cart, t, lambda time_s: [0.0, 0.0, 0.0])


def test_a_node_is_passed_once_by_a_free_joint_and_the_implicit_method():
    cart = cart_with_sleeve(2, 0.395)
    qd = np.zeros(cart.n)
    qd[0] = 0.5
    run = fx.simulate(cart, [0.0, 0.02], qd0=qd, rtol=1e-4, method="implicit")
    assert run.complete and [j["text"] for j in run.meta["energy_jumps"]] == [
        "node 1 of link 1 left its sleeve"
    ]


@pytest.mark.parametrize(
    ("d", "s", "keys", "force", "text"),
    [
        (0.78, 0.7, {}, (20.0, 0.0), "joint 1 (Pb) reached the end of link 1, at 0.8 m"),
        (0.3, 0.51, {}, (0.0, -1.0), "joint 2 (Pa) ran into the sleeve of link 1"),
        (0.3, 0.79, {}, (0.0, 1.0), "joint 2 (Pa) reached the end of link 1, at 0.8 m"),
        (0.59, 0.7, {"limits": [0.3, 0.6]}, (20.0, 0.0), "joint 1 left its limits, 0.3 to 0.6 m"),
    ],
)
def test_the_end_of_a_link_and_a_limit_stop_a_run(d, s, keys, force, text):
    cart = cart_with_sleeve(4, d, s, **keys)
    run = fx.simulate(
        cart,
        np.linspace(0, 2, 201),
        fx.Drive.force(*(signals.constant(f) for f in force)),
        rtol=1e-4,
    )
    last = run.meta["events"][-1]
    assert (
        not run.complete
        and last["level"] == "ERROR"
        and last["text"].startswith(text)
        and last["t"] == run.t[-1] < 2.0
    )
    d, s = run["joint/1/position"], run["joint/2/position"]
    assert np.all(np.diff(run.t) > 0)
    assert keys or min(0.8 - d.max(), 0.8 - s.max(), (s + d).min() - 0.8) == pytest.approx(
        0.0, abs=2e-9
    )


def test_ctrl_c_keeps_what_was_finished():
    cart = cart_with_sleeve(4, 0.45)

    def stop(done: float) -> None:
        if done > 0.002:
            _thread.interrupt_main()

    t = np.linspace(0, 5, 5001)
    motions = [signals.harmonic(0.1, 1.0, -np.pi / 2, offset=0.45), signals.constant(0.7)]
    run = fx.inverse(cart, t, motions, rtol=1e-4, method="explicit", progress=stop)
    assert not run.complete and run.meta["events"][-1]["text"] == "interrupted"
    assert 1 <= len(run.t) < len(t) and np.array_equal(run.t, t[: len(run.t)])


def test_progress_goes_from_node_to_node():
    seen = []
    cart = cart_with_sleeve(4, 0.395)
    run = fx.inverse(
        cart,
        [0.0, 0.02],
        [steady(0.395, 1.0), signals.constant(0.7)],
        rtol=1e-4,
        progress=seen.append,
    )
    assert (
        len(run.meta["energy_jumps"]) == 1
        and seen == sorted(seen)
        and seen[-1] == 1.0
        and seen[0] < 0.5
    )


@pytest.mark.parametrize(("link", "where"), [(1, 0), (2, 1)])
def test_modes_are_refused_where_nodes_are_counted(link, where):
    links = [beam(0.6, 0.2, 0.5, 4), rigid(0.0, 0.05, 0.0, 0.0, "Pa", start=0.2)]
    if where:
        links = [rigid(0.1, 0.1, 0.05, 1e-3), beam(0.6, 0.2, 0.5, 4, "Pb", start=0.3)]
    links[where]["modes"] = 3
    robot(*links)
    with pytest.raises(
        fx.InputError, match=rf"link\[{link}\]\.modes = 3: expected absent with sliding = \"nodal\""
    ):
        robot(*links, sliding="nodal")


def test_matrices_are_refused_where_they_change_from_node_to_node():
    cart = cart_with_sleeve(4, 0.45)
    zero = np.zeros(cart.n)
    for call in (
        cart.mass,
        cart.gravity,
        cart.elastic,
        lambda q: cart.bias(q, q),
        lambda q: cart.stiffness(),
    ):
        with pytest.raises(fx.InputError, match="sliding = 'nodal': expected \"continuous\""):
            call(zero)
