"""How a run from node to node goes on and ends."""

from __future__ import annotations

import _thread

import numpy as np
import pytest

import flexura as fx
from flexura import signals
from flexura.system.nodes import nodes_at
from nodal_robots import (
    cart_with_sleeve,
    steady,
)
from robots import beam, largest_difference, rigid, robot


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
