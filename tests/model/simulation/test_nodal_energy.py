"""The jumps of energy where a node enters or leaves a sleeve, or a slider goes on to the next."""

from __future__ import annotations

import numpy as np
import pytest

import flexura as fx
from flexura import signals
from flexura.system.nodes import rest_node
from nodal_robots import (
    TAPER,
    in_a_sleeve,
    steady,
    total,
)
from robots import beam, rigid, system


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
