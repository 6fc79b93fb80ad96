"""sliding = "nodal": where it is exact, where it only converges, its energy jumps, and how a run of pieces ends."""

from __future__ import annotations

import _thread

import numpy as np
import pytest

import flexura as fx
from flexura import nodal, signal
from flexura.approximate import by_bisection
from robots import beam, largest_difference, rigid, robot, system

TAPER = ([{"at_m": 0.0, "value": 0.3}, {"at_m": 0.8, "value": 0.15}], [{"at_m": 0.0, "value": 2.0}, {"at_m": 0.8, "value": 0.7}])
KEYS = {"hub_mass_kg": 0.1, "hub_inertia_kg_m2": 2e-3}
TOTAL = ("energy/kinetic", "energy/strain", "energy/potential")


def total(run: fx.Run) -> np.ndarray:
    return sum(run[name] for name in TOTAL)


def under_a_slider(elements: int, sliding: str, start: float, **keys) -> fx.System:
    """A swinging link, a slider with an arm on it, and a payload."""
    return system(
        beam(0.6, 0.2355, 0.5, elements, hub_inertia_kg_m2=2e-3),
        rigid(0.1, 0.05, 0.04, 1e-4, "Pa", start=start, angle_rad=0.7, hub_mass_kg=0.02, **keys),
        payload=0.01, gravity=(0.0, -1.0), stiffening=False, sliding=sliding,
    )  # fmt: skip


def in_a_sleeve(elements: int, sliding: str, start: float, stiffening: bool = False, **keys) -> fx.System:
    """An arm with a tapered link in a sleeve at its tip, and a link with a payload beyond."""
    sleeved = beam(
        0.8, *TAPER, elements, "Pb", start=start, angle_rad=0.3, damping={"alpha_1_s": 0.5, "beta_s": 1e-4}, **KEYS, **keys
    )
    return system(
        rigid(0.3, 0.5, 0.15, 0.01), sleeved, rigid(0.2, 0.1, 0.1, 1e-3, viscous_friction=0.01),
        payload=0.05, payload_inertia=1e-4, gravity=(0.5, -1.0), stiffening=stiffening, sliding=sliding,
    )  # fmt: skip


def cart_with_sleeve(elements: int, sliding: str, start: float, **keys) -> fx.System:
    """A link in a sleeve on the base, with a slider beyond that carries a point mass."""
    return system(
        beam(0.8, 0.3, 1.5, elements, "Pb", start=start, **keys),
        rigid(0.0, 0.05, 0.0, 0.0, "Pa", start=0.7, viscous_friction=0.3),
        gravity=(0.0, -2.0), stiffening=False, sliding=sliding,
    )  # fmt: skip


# Where it is exact --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["explicit", "implicit"])
def test_a_slider_held_on_a_node_rides_as_on_the_line(method):
    """At x_k the line has the node's displacement and slope; without stiffening nothing else differs."""
    t = np.linspace(0, 0.5, 51)
    a, b = (
        fx.simulate(
            under_a_slider(4, kind, 0.45, locked=True), t, fx.Drive.force(signal.step(0.1), None), rtol=1e-9, method=method
        )
        for kind in ("nodal", "continuous")
    )
    assert largest_difference(a, b) < (1e-9 if method == "explicit" else 1e-6)
    assert a.meta["energy_jumps"] == [] and list(a) == list(b) and a.units == b.units


@pytest.mark.parametrize("start", [0.8, 0.6, 0.4, 0.2])
def test_a_link_held_with_a_node_in_its_sleeve_is_a_link_of_the_free_length(start):
    """L - d = X_j: the n - j elements ahead are those of a continuous mesh of n - j elements."""
    t, push = np.linspace(0, 0.4, 41), fx.Drive.force(signal.step(0.2), None, signal.step(0.02))
    a = fx.simulate(in_a_sleeve(4, "nodal", start, locked=True), t, push, rtol=1e-9, method="explicit")
    b = fx.simulate(in_a_sleeve(round(5 * start), "continuous", start, locked=True), t, push, rtol=1e-9, method="explicit")
    assert largest_difference(a, b) < 1e-8
    for name in ("energy/kinetic", "energy/strain", "energy/work", "energy/loss", "joint/1/drive"):
        assert a[name] == pytest.approx(b[name], abs=1e-8 * np.abs(total(b)).max() + 1e-12)
    assert list(a) == list(b) and a.units == b.units


def test_between_two_nodes_a_link_is_clamped_at_the_last_node_at_rest():
    """The static tip deflection P l^3/(3 EI) has the length l from X_j, not the free length."""
    arm = system(beam(0.8, 0.3, 1.5, 4, "Pb", start=0.5), sliding="nodal", stiffening=False)
    q = fx.static(arm, tip_force=(0.0, 0.1))
    assert fx.tip_pose(arm, q) == pytest.approx([0.5, 0.1 * 0.6**3 / 3 / 1.5, 0.1 * 0.6**2 / 2 / 1.5], rel=1e-9)
    assert np.all(q[1:3] == 0.0) and arm.labels[2] == "link 1 node 1 slope [rad]"
    one = system(beam(0.6, 0.3, 1.5, 3, locked=True), stiffening=False)
    assert fx.frequencies(arm) == pytest.approx(fx.frequencies(one), rel=1e-9)


@pytest.mark.parametrize("start", [0.75, 0.5, 0.3, 0.1])
def test_a_tapered_link_keeps_its_mass_wherever_it_is_cut(start):
    """M of the joints, straight: that of the continuous link at the same d, whose inertia is exact."""
    cut, smooth = in_a_sleeve(4, "nodal", start), in_a_sleeve(4, "continuous", start)
    piece = nodal.at(cut, cut.start())
    M, joints = piece.system.mass(piece.part(cut.start())), piece.system.joint_rows[piece.hubs]
    expected = smooth.mass(smooth.start())
    assert M[np.ix_(joints, joints)] == pytest.approx(expected[np.ix_(smooth.joint_rows, smooth.joint_rows)], rel=1e-10)


@pytest.mark.parametrize("build", [lambda: under_a_slider(4, "nodal", 0.35), lambda: in_a_sleeve(5, "nodal", 0.45)])
def test_from_static_equilibrium_nothing_moves(build):
    held = build().robot
    held = fx.assemble(held.replace({f"link.{i}.joint.locked": True for i in range(1, len(held.links) + 1)}))
    q = fx.static(held)
    run = fx.simulate(held, [0.0, 0.05, 0.1], q0=q, rtol=1e-9)
    assert np.abs(run.states[:, : held.n] - q).max() < 1e-8 and np.abs(q).max() > 1e-3


def test_a_robot_that_slides_on_nothing_flexible_is_the_same_in_both_ways():
    links = beam(0.5, 0.2, 1.0, 2, modes=2), rigid(0.2, 0.3, 0.1, 1e-3, "Pb", start=0.1)
    t, push = np.linspace(0, 0.3, 11), fx.Drive.force(signal.step(0.1), signal.step(0.5))
    a, b = (fx.simulate(system(*links, sliding=kind), t, push) for kind in ("nodal", "continuous"))
    assert largest_difference(a, b) == 0.0 and "energy_jumps" not in a.meta


# Where it only converges --------------------------------------------------------------------------------------------------


def errors(build, motion, t: np.ndarray, name: str, counts: tuple[int, ...]) -> list[float]:
    """Largest errors of `name` with nodal meshes, relative to the largest value on a continuous one."""
    out = []
    for elements, kind in ((8, "continuous"), *((n, "nodal") for n in counts)):
        sys = build(elements, kind)
        run = fx.simulate(sys, t, fx.Drive.prescribed(*motion), q0=fx.static(sys), rtol=1e-6, method="explicit")
        assert run.complete
        out.append(run[name])
    return [float(np.abs(y - out[0]).max() / np.abs(out[0]).max()) for y in out[1:]]


def test_a_slider_converges_with_the_spacing_of_the_nodes():
    """It sits up to l_e from where it is: first order."""

    def build(elements, kind):
        bridge = beam(0.6, 0.2355, 2.0, elements, locked=True, damping={"alpha_1_s": 20.0})
        return system(bridge, rigid(0.0, 0.05, 0.0, 0.0, "Pa", start=0.3), gravity=(0.0, -2.0), stiffening=False, sliding=kind)

    coarse, middle, fine = errors(
        build, (None, signal.cycloid(0.5, 0.3, start=0.3)), np.linspace(0, 0.3, 61), "tip/y", (3, 6, 12)
    )
    assert fine < 0.65 * middle < 0.65 * 0.65 * coarse and fine > 1e-3


def test_a_sleeve_converges_with_the_spacing_of_the_nodes():
    """The link is up to l_e longer than its free length, and swings so much slower: first order, from far away."""

    def build(elements, kind):
        return system(beam(0.6, 0.2355, 2.0, elements, "Pb", start=0.3), gravity=(0.0, -2.0), stiffening=False, sliding=kind)

    name = "link/1/tip_deflection"
    coarse, middle, fine = errors(build, (signal.cycloid(0.36, 0.05, start=0.3),), np.linspace(0, 0.05, 41), name, (4, 8, 16))
    assert fine < 0.65 * middle < 0.65 * 0.65 * coarse and fine > 0.1


@pytest.mark.parametrize(
    ("elements", "start", "motion", "window", "tip_mm"),
    [
        (4, 0.20, signal.harmonic(-0.05, 1.0, offset=0.25), (1.0, 2.0), 10.0),
        (8, 0.20, signal.harmonic(-0.05, 1.0, offset=0.25), (0.3, 1.0), 13.3),
        (8, 0.25, signal.constant(0.25), (1.0, 2.0), 5.0),
        (4, 0.40, signal.constant(0.40), (1.0, 2.0), 34.0),
    ],
)
def test_the_dissertations_type_iii_as_an_independent_program_has_it(elements, start, motion, window, tip_mm):
    """Node-wise assembly of the linear model written for the reference: a link shaken at 1 Hz, 0.40 m, 20 g at its tip."""
    strip = {
        "length_m": 0.4, "elements": elements, "section": {"width_m": 0.02, "height_m": 0.001}, "young_modulus_Pa": 2e11,
        "density_kg_m3": 7850.0, "damping": {"alpha_1_s": 1.0}, "joint": {"type": "Pb", "hub_mass_kg": 0.3, "start": start},
    }  # fmt: skip
    arm = system(rigid(0.2, 0.2, 0.1, 0.2 * 0.2**2 / 12), strip, payload=0.02, stiffening=False, sliding="nodal")
    t = np.linspace(0, window[1], round(1000 * window[1]) + 1)
    run = fx.inverse(arm, t, [signal.harmonic(np.pi / 6, 1.0, -np.pi / 2), motion], method="explicit")
    peak = 1e3 * np.abs(run["link/2/tip_deflection"][t >= window[0]]).max()
    assert peak == pytest.approx(tip_mm, abs=0.05 if tip_mm < 20 else 0.5)  # the digits given


# Energy -------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("stiffening", [False, True])
@pytest.mark.parametrize(("start", "force", "says"), [(0.6, -1.7, "entered"), (0.4, 0.9, "left")])
def test_energy_balances_between_the_jumps(start, force, says, stiffening):
    """A free robot under drives, its link pulled into its sleeve or pushed out: work, friction, damping and jumps are all."""
    arm = in_a_sleeve(5, "nodal", start, stiffening, viscous_friction=0.2)
    push = fx.Drive.force(signal.harmonic(0.3, 1.0), signal.constant(force), signal.harmonic(0.02, 2.0))
    run = fx.simulate(arm, np.linspace(0, 0.4, 81), push, rtol=1e-11, method="explicit")
    jumps = run.meta["energy_jumps"]
    assert run.complete and len(jumps) >= 1 and run.meta["energy_error"] < 1e-8
    assert [e["t"] for e in run.meta["events"]] == [j["t"] for j in jumps]
    assert all(f"{says} its sleeve" in j["text"] for j in jumps)
    size, scale = max(abs(j["J"]) for j in jumps), np.abs(total(run)).max()
    if says == "entered":  # what the node moved and bent with is gone
        assert size > 1e-3 * scale
    else:  # the element that becomes free is straight and at rest; the stiffening terms' sums get one more point
        assert size < (1e-7 if stiffening else 1e-14) * scale


def test_a_jump_is_the_difference_of_the_energies_on_its_two_sides():
    """Seen from outside: outputs just before and after, the work between them taken off."""
    arm = in_a_sleeve(5, "nodal", 0.55, True)
    motion = fx.Drive.prescribed(signal.harmonic(0.3, 1.0, -np.pi / 2), signal.cycloid(0.3, 0.5, start=0.55), None)
    jumps = fx.simulate(arm, np.linspace(0, 0.5, 6), motion, rtol=1e-9, method="explicit").meta["energy_jumps"]
    assert len(jumps) == 2
    t = np.concatenate([[0.0], *([j["t"] - 1e-7, j["t"] + 1e-7] for j in jumps), [0.5]])
    run = fx.simulate(arm, t, motion, rtol=1e-9, method="explicit")
    rest = np.diff(total(run) - run["energy/work"] + run["energy/loss"])
    assert rest[[1, 3]] == pytest.approx([j["J"] for j in jumps], rel=1e-5)
    assert rest[[0, 2, 4]] == pytest.approx(0.0, abs=1e-8 * np.abs(total(run)).max())


def test_a_slider_that_goes_on_to_the_next_node_falls_by_their_difference():
    """m g (w_3 - w_2) + m (w_3'^2 - w_2'^2)/2, from the unknowns, which stay as they are."""
    mass, g = 0.05, 9.81
    bridge = system(
        beam(0.6, 0.2355, 0.5, 4, locked=True), rigid(0.0, mass, 0.0, 0.0, "Pa", start=0.29),
        gravity=(0.0, -g), stiffening=False, sliding="nodal",
    )  # fmt: skip
    roll = fx.Drive.prescribed(None, signal.Signal(np.array([[0, 0.29, 0.2, 0, 0, 0, 0, 0, 0, 0]])))
    jump = fx.simulate(bridge, [0.0, 0.1], roll, q0=fx.static(bridge)).meta["energy_jumps"][0]
    assert jump["t"] == pytest.approx(0.05, abs=1e-7) and "node 3 of link 1" in jump["text"]
    run = fx.simulate(bridge, [0.0, jump["t"]], roll, q0=fx.static(bridge), rtol=1e-9)
    q, qd = np.split(run.states[-1], 2)
    assert jump["J"] == pytest.approx(mass * (g * (q[5] - q[3]) + (qd[5] ** 2 - qd[3] ** 2) / 2), rel=1e-5)
    assert jump["J"] < -1e-3


def test_a_node_that_enters_is_put_to_rest_and_one_that_leaves_starts_from_rest():
    arm = in_a_sleeve(5, "nodal", 0.55)
    there_and_back = signal.harmonic(0.1, 1.0, 0.0, offset=0.45)
    run = fx.inverse(arm, np.linspace(0, 1, 401), [signal.harmonic(0.3, 1.0, -np.pi / 2), there_and_back, signal.constant(0.0)])
    behind = 0.8 - run["joint/2/position"]
    for k in range(1, 6):
        row = arm.joint_rows[1] + 2 * k - 1
        own = run.states[:, [row, row + 1, arm.n + row, arm.n + row + 1]]
        inside = behind >= 0.8 * k / 5 + 1e-8
        assert np.all(own[inside] == 0.0) and (np.all(own[1:][~inside[1:]] != 0.0) or k == 5)
    assert run.complete and [j["text"].split(" its")[0] for j in run.meta["energy_jumps"]] == [
        "node 2 of link 2 entered", "node 2 of link 2 left",
    ]  # fmt: skip


# Chains, drives and ends --------------------------------------------------------------------------------------------------


def test_a_slider_on_a_link_in_a_sleeve_counts_along_the_whole_link():
    """Both move; the slider's position, limits and drive are along the link, wherever it is cut."""
    cart = cart_with_sleeve(8, "nodal", 0.45)
    out, back = signal.cycloid(0.65, 0.5, start=0.45), signal.cycloid(0.45, 0.5, start=0.7)
    t = np.linspace(0, 0.5, 101)
    run = fx.inverse(cart, t, [out, back], rtol=1e-9, method="explicit")
    assert run.complete and run.meta["energy_error"] < 1e-8
    assert run["joint/2/position"] == pytest.approx([back(s)[0] for s in t], abs=1e-8)
    hub = run["link/2/x"] - run["link/1/x"]
    assert hub == pytest.approx(run["joint/2/position"], abs=1e-12)  # (d, w_k): no shortening
    said = " ".join(j["text"] for j in run.meta["energy_jumps"])
    assert "node 3 of link 1 left its sleeve" in said and "joint 2 (Pa) went on to node 5 of link 1" in said
    follow = fx.Drive.pd([out, back], kp=[4e3, 4e3], kd=[60, 60])
    near = fx.simulate(cart, t, follow, rtol=1e-7)
    assert near.complete and near["joint/2/position"] == pytest.approx(run["joint/2/position"], abs=3e-3)


def test_a_python_drive_sees_the_whole_robot():
    t = np.linspace(0, 0.06, 7)
    cart = cart_with_sleeve(4, "nodal", 0.599)
    gains, targets = ([50.0, 30.0], [4.0, 2.0]), [signal.constant(0.7), signal.constant(0.5)]

    def law(time_s, position, velocity, tip_deflection):
        assert position.shape == velocity.shape == (2,)
        return np.multiply(gains[0], [0.7, 0.5] - position) - np.multiply(gains[1], velocity)

    a = fx.simulate(cart, t, law, rtol=1e-7, method="explicit")
    b = fx.simulate(cart, t, fx.Drive.pd(targets, *gains), rtol=1e-7, method="explicit")
    assert largest_difference(a, b) < 1e-4 and len(a.meta["energy_jumps"]) == len(b.meta["energy_jumps"]) > 0
    assert a.meta["drive"] == "Python function" and b.meta["drive"][0]["kp"] == 50.0
    with pytest.raises(fx.InputError, match=r"drive = .*expected 2 finite forces"):
        fx.simulate(cart, t, lambda time_s: [0.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("start", "force", "text"),
    [
        ({}, (2.0, 0.0), "joint 1 (Pb) reached the end of link 1, at 0.8 m"),
        ({}, (0.0, -0.5), "joint 2 (Pa) ran into the sleeve of link 1"),
        ({}, (0.0, 0.5), "joint 2 (Pa) reached the end of link 1, at 0.8 m"),
        ({"limits": [0.3, 0.6]}, (2.0, 0.0), "joint 1 left its limits, 0.3 to 0.6 m"),
    ],
)
def test_the_end_of_a_link_and_a_limit_stop_a_run(start, force, text):
    cart = cart_with_sleeve(4, "nodal", 0.45, **start)
    run = fx.simulate(cart, np.linspace(0, 2, 201), fx.Drive.force(*(signal.constant(f) for f in force)))
    last = run.meta["events"][-1]
    assert not run.complete and last["level"] == "ERROR" and last["text"].startswith(text) and last["t"] == run.t[-1] < 2.0
    d, s = run["joint/1/position"], run["joint/2/position"]
    assert np.all(np.diff(run.t) > 0)
    assert start or min(0.8 - d.max(), 0.8 - s.max(), (s + d).min() - 0.8) == pytest.approx(0.0, abs=2e-9)


@pytest.mark.parametrize("after", [0.02, 0.3])
def test_ctrl_c_keeps_what_was_finished(after):
    cart = cart_with_sleeve(4, "nodal", 0.45)

    def stop(done: float) -> None:
        if done > after:
            _thread.interrupt_main()

    t = np.linspace(0, 5, 501)
    run = fx.inverse(cart, t, [signal.harmonic(0.1, 1.0, offset=0.5), signal.constant(0.7)], method="explicit", progress=stop)
    assert not run.complete and run.meta["events"][-1]["text"] == "interrupted"
    assert 1 <= len(run.t) < len(t) and np.array_equal(run.t, t[: len(run.t)])


def test_progress_goes_from_piece_to_piece():
    seen = []
    cart = cart_with_sleeve(8, "nodal", 0.45)
    fx.inverse(cart, np.linspace(0, 1, 11), [signal.harmonic(0.1, 1.0, offset=0.35), signal.constant(0.7)], progress=seen.append)
    assert seen == sorted(seen) and seen[-1] == 1.0 and seen[0] < 0.5


@pytest.mark.parametrize(("link", "where"), [(1, 0), (2, 1)])
def test_modes_are_refused_where_nodes_are_counted(link, where):
    links = [beam(0.6, 0.2, 0.5, 4), rigid(0.0, 0.05, 0.0, 0.0, "Pa", start=0.2)]
    if where:
        links = [rigid(0.1, 0.1, 0.05, 1e-3), beam(0.6, 0.2, 0.5, 4, "Pb", start=0.3)]
    links[where]["modes"] = 3
    robot(*links)
    with pytest.raises(fx.InputError, match=rf"link\[{link}\]\.modes = 3: expected absent with sliding = \"nodal\""):
        robot(*links, sliding="nodal")


def test_matrices_are_refused_where_they_change_from_node_to_node():
    cart = cart_with_sleeve(4, "nodal", 0.45)
    zero = np.zeros(cart.n)
    for call in (cart.mass, cart.gravity, cart.elastic, lambda q: cart.bias(q, q), lambda q: cart.stiffness()):
        with pytest.raises(fx.InputError, match="sliding = 'nodal': expected \"continuous\""):
            call(zero)
    with pytest.raises(fx.InputError, match="sliding = 'nodal'"):
        by_bisection(cart, [0.0, 0.01], [signal.constant(0.45), signal.constant(0.7)])
