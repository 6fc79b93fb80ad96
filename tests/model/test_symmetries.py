"""Limits, symmetries, modes and small motions of random robots."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given

import flexura as fx
from flexura import signals
from identities import (
    close,
    drives,
    recursion,
    small_state,
)
from robots import (
    beam,
    few,
    forces,
    largest_difference,
    robots,
    seeds,
    system,
    turning,
    two_link_arm,
)

# Limits and symmetries


def stiffer(bot: fx.Robot, factor: float) -> fx.Robot:
    data = bot.to_dict()
    for link in data["link"]:
        if link.get("elements"):
            value = link["bending_stiffness_N_m2"]
            many = isinstance(value, list)
            link["bending_stiffness_N_m2"] = (
                [v | {"value": v["value"] * factor} for v in value] if many else value * factor
            )
            link["damping"] = {
                "beta_s": 1e-4
            }  # else the steps follow the ringing that a sudden load starts
    return fx.Robot.from_dict(data)


def stiff(bot: fx.Robot) -> fx.Robot:
    """The same robot with rigid links."""
    data = bot.to_dict()
    for link in data["link"]:
        for key in ("elements", "modes", "bending_stiffness_N_m2", "damping"):
            link.pop(key, None)
    return fx.Robot.from_dict(data)


@few
@given(robots(max_links=4, locked=True, stiffening=True), seeds)
def test_a_very_stiff_robot_moves_like_a_rigid_one(bot, seed):
    """EI x 1e6, implicit, against links without elements, until one of them reaches a limit."""
    hard, solid = fx.assemble(stiffer(bot, 1e6)), fx.assemble(stiff(bot))
    t = np.linspace(0, 0.5, 11)
    q, qd = hard.start(), np.zeros(hard.n)
    rates = 0.5 * forces(hard, seed) * ~solid.locked
    qd[hard.joint_rows] = rates
    a = fx.simulate(hard, t, drives(hard, seed), q, qd, rtol=1e-6, method="implicit")
    b = fx.simulate(solid, t, drives(solid, seed), qd0=rates, rtol=1e-9)
    rows = min(np.count_nonzero(np.isin(run.t, t)) for run in (a, b))
    assert rows > 1
    for i in range(1, len(bot.links) + 1):
        ours, theirs = (run[f"joint/{i}/position"][:rows] for run in (a, b))
        assert np.abs(ours - theirs).max() < 1e-4 * max(np.abs(theirs).max(), 0.1)


@few
@given(robots(max_links=4, gravity=False, stiffening=True, first="R"), seeds)
def test_without_gravity_the_base_may_be_turned(bot, seed):
    sys, angle = fx.assemble(bot), 0.8
    t, small = np.linspace(0, 0.1, 6), small_state(sys, seed)
    turned = {"q0": small["q0"] + angle * np.eye(sys.n)[0], "qd0": small["qd0"]}
    a, b = (
        fx.simulate(sys, t, drives(sys, seed), **s, rtol=1e-9, method="explicit")
        for s in (small, turned)
    )
    c, s = np.cos(angle), np.sin(angle)
    close(b["tip/x"], c * a["tip/x"] - s * a["tip/y"], 1e-8)
    close(b["tip/y"], s * a["tip/x"] + c * a["tip/y"], 1e-8)
    close(b["joint/1/position"] - angle, a["joint/1/position"], 1e-8)


@few
@given(robots(max_links=4, coulomb=True, stiffening=True), seeds)
def test_a_mirrored_robot_moves_mirrored(bot, seed):
    """y -> -y: angles, torques, deflections and gravity's y change sign; sliders and their forces
    do not."""
    data = bot.to_dict()
    data["gravity_m_s2"] = [bot.gravity_m_s2[0], -bot.gravity_m_s2[1]]
    for link in data["link"]:
        turns = link["joint"]["type"] == "R"
        if turns:
            link["joint"]["start_rad"] = -link["joint"].get("start_rad", 0.0)
        else:
            link["joint"]["angle_rad"] = -link["joint"].get("angle_rad", 0.0)
    sys, other = fx.assemble(bot), fx.assemble(fx.Robot.from_dict(data))
    sign = -np.ones(sys.n)
    sign[sys.joint_rows] = [-1.0 if link.joint.type == "R" else 1.0 for link in bot.links]
    small, tau = small_state(sys, seed), 0.2 * forces(sys, seed)
    flip = [-1.0 if link.joint.type == "R" else 1.0 for link in bot.links]
    t = np.linspace(0, 0.1, 6)
    a = fx.simulate(
        sys,
        t,
        fx.Drive.force(*(signals.constant(f) for f in tau)),
        **small,
        rtol=1e-9,
        method="explicit",
    )
    b = fx.simulate(
        other,
        t,
        fx.Drive.force(*(signals.constant(f) for f in tau * flip)),
        small["q0"] * sign,
        small["qd0"] * sign,
        rtol=1e-9,
        method="explicit",
    )
    close(b["tip/x"], a["tip/x"], 1e-8)
    close(b["tip/y"], -a["tip/y"], 1e-8)
    close(b.states, a.states * np.tile(sign, 2), 1e-8)


def whole_and_halves(elements: int, stiffness: float = 0.5) -> tuple[fx.System, fx.System]:
    whole = beam(0.6, 0.2355, stiffness, elements, hub_inertia_kg_m2=2e-3)
    first, second = (
        beam(0.3, 0.2355, stiffness, elements // 2, hub_inertia_kg_m2=2e-3),
        beam(0.3, 0.2355, stiffness, elements // 2, locked=True),
    )
    return system(whole, payload=0.05), system(first, second, payload=0.05)


def test_a_locked_joint_between_two_halves_of_a_link_changes_no_frequency():
    """Small motions: the same Hermite cubics, in one frame or in two."""
    one, two = whole_and_halves(8)
    for joints in ("locked", "free"):
        a, b = fx.frequencies(one, joints=joints), fx.frequencies(two, joints=joints)
        assert b == pytest.approx(a, rel=1e-8, abs=1e-7)


def test_a_locked_joint_between_two_halves_of_a_link_changes_nothing():
    """The same line in one frame or in two, at any bending: statics to round-off, a motion to its
    tolerance."""
    one, two = whole_and_halves(8)
    a, b = (fx.tip_pose(s, fx.static(s, tip_force=(0.0, 2.0))) for s in (one, two))
    assert b == pytest.approx(a, rel=1e-10) and a[2] > 0.5
    t, drive = np.linspace(0, 1, 51), signals.bang_bang(0.2, 1.0, rise_s=0.05)
    a, b = (
        fx.simulate(s, t, fx.Drive.force(drive, *[None] * (len(s.robot.links) - 1)), rtol=1e-10)
        for s in (one, two)
    )
    assert largest_difference(a, b, ["joint/1/position", "tip/x", "tip/y"]) < 1e-7


# A link's own modes


def moved_at_joint_two(modes: int | None) -> fx.Run:
    sys = fx.assemble(two_link_arm(12) if modes is None else two_link_arm(4, modes=modes))
    drive = fx.Drive.force(None, signals.bang_bang(0.1, 1.0, rise_s=0.1))
    return fx.simulate(sys, np.linspace(0, 1.5, 76), drive, rtol=1e-10, method="explicit")


def test_modes_converge_to_the_link():
    """Three modes and the two static shapes of the tip are within 2e-3 of a fine mesh; all of them
    are the link."""
    names = [f"joint/{i}/position" for i in (1, 2)] + [f"link/{i}/tip_deflection" for i in (1, 2)]
    mesh = moved_at_joint_two(None)
    error = {}
    for modes in (1, 2, 3, 8):
        run = moved_at_joint_two(modes)
        error[modes] = max(np.abs(run[c] - mesh[c]).max() / np.abs(mesh[c]).max() for c in names)
    assert error[8] < 1e-4
    assert error[3] < 2e-3
    assert error[8] < error[3] < error[2] < error[1]


# Linearisation


@few
@given(robots(max_links=3, friction=False, gravity=False, stiffening=True), seeds)
def test_frequencies_are_those_of_the_linearised_accelerations(bot, seed):
    """-d qdd/dq at rest, by differences of the kernel's recursion."""
    sys = fx.assemble(bot)
    q = sys.start()
    free = sys.free_rows
    none = np.zeros(len(bot.links))
    size = 1e-5 / turning(sys)  # steps that turn a link by about 1e-5 rad
    columns = []
    for e in np.diag(size)[free]:
        a, b = (recursion(sys, q + z, 0 * q, none) for z in (e, -e))
        columns.append(((b - a) / size)[free] / 2)
    columns = np.array(columns)
    squares = np.sort(np.linalg.eigvals(columns.T).real)
    found = (2 * np.pi * fx.frequencies(sys, q, joints="free")) ** 2
    # a full mesh has very stiff modes, whose round-off the slow ones share
    assert np.abs(found - squares).max() < 1e-6 * max(1.0, squares[-1])
    slow = squares > 1e-5 * squares[-1]
    assert found[slow] == pytest.approx(squares[slow], rel=1e-5)


def test_small_free_vibration_has_the_linearised_frequency():
    """Ten periods after release in one mode the link is back: the phase error is the
    frequency's."""
    arm = system(beam(0.6, 0.2355, 0.5, 4, locked=True, modes=4), payload=0.05)
    period = 1 / fx.frequencies(arm)[:3]
    for k, T in enumerate(period):
        q, small = np.zeros(arm.n), 1e-6
        q[1 + k] = small
        run = fx.simulate(arm, [0.0, 10 * T], q0=q, rtol=1e-12, method="explicit")
        assert run.states[-1, 1 + k] == pytest.approx(small, rel=1e-9)
        phase = run.states[-1, arm.n + 1 + k] / (small * 2 * np.pi / T)
        assert abs(phase) / (20 * np.pi) < 1e-7
