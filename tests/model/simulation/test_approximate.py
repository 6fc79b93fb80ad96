"""The dissertation's two approximate ways of inverse dynamics, against the exact one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given

import flexura as fx
from flexura.signals import constant, cycloid, piecewise, step, trapezoidal
from flexura.simulation.approximate_inverse import (
    rigid_feedforward,
    rigid_robot,
    shoot_by_bisection,
)
from robots import beam, few, rigid, robots, system

B7 = {0.10: 0.043175, 0.25: 0.33398, 0.40: 0.61167, 0.50: 0.44220, 0.60: -0.09519}  # N m


def bench(**keys) -> fx.System:
    """The bench arm with four modes of eight elements: 0.1 % in the torque of B7."""
    return system(beam(0.6, 0.2355, 0.5, 8, hub_inertia_kg_m2=2e-3, modes=4), payload=0.05, **keys)


def cart(**keys) -> fx.System:
    """A cart, and a stiff flexible link across its motion on a pivot with friction."""
    pivot = {
        "hub_inertia_kg_m2": 2e-3,
        "viscous_friction": 0.01,
        "coulomb_friction": 0.01,
        "start": 1.5,
    } | keys
    return system(
        rigid(0.1, 0.6, 0.05, 5e-4, "Pa"), beam(0.3, 0.157, 1.5, 2, modes=2, **pivot), payload=0.02
    )


@few
@given(robots(max_links=4))
def test_the_rigid_robot_has_the_masses_of_the_flexible_one(robot):
    """Its mass matrix is the joints' block of the flexible robot's, at the straight start."""
    sys, stiff = fx.assemble(robot), fx.assemble(rigid_robot(robot))
    assert stiff.n == len(robot.links)
    found, wanted = (
        stiff.mass(stiff.start()),
        sys.mass(sys.start())[np.ix_(sys.joint_rows, sys.joint_rows)],
    )
    assert found == pytest.approx(wanted, rel=1e-9, abs=1e-12 * np.abs(wanted).max())


def test_the_rigid_robot_needs_a_third_of_the_bench_arms_torque():
    """B7: at most 0.36474 N m; the flexible arm under it does not follow."""
    t = np.linspace(0.0, 1.0, 1001)
    motion = [cycloid(np.pi / 2, 1.0)]
    run = rigid_feedforward(bench(), t, motion)
    assert run["joint/1/drive"].max() == pytest.approx(0.36474, abs=2e-5)
    inertia = 2e-3 + 0.2355 * 0.6**3 / 3 + 0.05 * 0.6**2
    assert run["joint/1/drive"] == pytest.approx([inertia * motion[0](s)[2] for s in t], abs=1e-6)
    assert run.complete and run.meta["energy_error"] < 1e-5
    off = np.abs(run["joint/1/position"] - [motion[0](s)[0] for s in t])
    assert off.max() > 0.05


@pytest.mark.parametrize("coulomb", [0.0, 0.01])
def test_a_rigid_robot_follows_its_own_drives_and_a_flexible_one_the_better_the_stiffer(coulomb):
    """Accelerations of a trapezoid jump: the splines end where a motion has a break. Without stick
    and slip the error is proportional to 1/EI."""
    t, motion = (
        np.linspace(0.0, 1.0, 201),
        [trapezoidal(0.05, 0.8, 0.2), trapezoidal(2.2, 0.7, 0.2, 1.5)],
    )
    wanted = np.array([[m(s)[0] for m in motion] for s in t])

    def errors(robot: fx.Robot) -> np.ndarray:
        run = rigid_feedforward(fx.assemble(robot), t, motion, rtol=1e-9)
        return np.array(
            [np.abs(run[f"joint/{i}/position"] - wanted[:, i - 1]).max() for i in (1, 2)]
        )

    robot = cart(coulomb_friction=coulomb).robot
    assert errors(rigid_robot(robot)).max() < (1e-7 if coulomb else 1e-12)
    soft, stiff = (
        errors(robot.replace({"link.2.bending_stiffness_N_m2": EI})) for EI in (15.0, 1500.0)
    )
    assert np.all(soft > 1e-6) and np.all(stiff < 0.3 * soft)
    if not coulomb:
        assert stiff * 100 == pytest.approx(soft, rel=0.15)


def test_bisection_finds_the_torque_of_the_bench_arm():
    """B7 at the middles of the steps, where a held force is right to third order in the step; hub
    angle after each."""
    sys, motion, errors = bench(), [cycloid(np.pi / 2, 1.0)], []
    for h in (0.008, 0.004):
        t = np.arange(0.0, 0.64, h)
        run, exact = (
            shoot_by_bisection(sys, t, motion),
            fx.inverse(sys, t + h / 2, motion, rtol=1e-9),
        )
        off = np.abs(run["joint/1/position"] - [motion[0](s)[0] for s in t]).max()
        errors.append((np.abs(run["joint/1/drive"] - exact["joint/1/drive"])[:-1].max(), off))
        assert (
            run.complete
            and run.meta["energy_error"] < 1e-5
            and run.meta["evaluations"] > 20 * len(t)
        )
    for at, torque in B7.items():
        assert np.interp(at, t[:-1] + h / 2, run["joint/1/drive"][:-1]) == pytest.approx(
            torque, abs=1e-3
        ), at
    assert np.log2(np.divide(*errors)) == pytest.approx([3.0, 3.0], abs=0.4)
    assert errors[1][0] < 3e-4 and errors[1][1] < 3e-5


def test_bisection_of_two_joints_and_its_replay():
    """Both joints' errors below 1e-4 of their way; the drives it found return its motion through
    `simulate`."""
    sys, motion = cart(), [cycloid(0.05, 0.3), cycloid(2.2, 0.3, 1.5)]
    t = np.linspace(0.0, 0.36, 181)
    run = shoot_by_bisection(sys, t, motion, rtol=1e-8)
    for i, way in ((1, 0.05), (2, 0.7)):
        assert (
            np.abs(run[f"joint/{i}/position"] - [motion[i - 1](s)[0] for s in t]).max() < 1e-4 * way
        )
    drives = fx.Drive.force(*(piecewise(t[:-1], run[f"joint/{i}/drive"][:-1]) for i in (1, 2)))
    replay = fx.simulate(sys, t, drives, rtol=1e-8)
    for i in (1, 2):
        assert replay[f"joint/{i}/position"] == pytest.approx(run[f"joint/{i}/position"], abs=1e-6)


def test_a_locked_joint_stays_and_needs_no_drive():
    sys = cart(locked=True)
    run = shoot_by_bisection(sys, np.linspace(0.0, 0.1, 51), [cycloid(0.05, 0.3), constant(1.5)])
    assert (
        np.ptp(run["joint/2/position"]) == 0
        and np.abs(run["joint/1/position"] - [cycloid(0.05, 0.3)(s)[0] for s in run.t]).max() < 1e-6
    )


@pytest.mark.slow
def test_steps_too_long_for_the_modes_are_refused():
    """The first mode of the light-hubbed link has a period of 8 ms."""
    sys = system(beam(0.3, 0.157, 0.3333, 4, hub_inertia_kg_m2=1e-6), payload=0.02)
    with pytest.raises(fx.FlexuraError, match="expected shorter steps"):
        shoot_by_bisection(sys, np.linspace(0.0, 2.0, 101), [cycloid(0.5, 1.0)])


def test_reaching_a_limit_ends_the_run():
    sys = system(rigid(0.1, 0.6, 0.05, 5e-4, "Pa", limits=[-0.01, 0.03]))
    run = shoot_by_bisection(sys, np.linspace(0.0, 1.0, 51), [cycloid(0.05, 1.0)])
    assert (
        not run.complete
        and "left its limits" in run.meta["events"][0]["text"]
        and run["joint/1/position"].max() <= 0.03
    )
    assert np.ptp(run["joint/1/position"]) > 0.025 and run.meta["events"][0]["t"] == run.t[-1]


def test_a_motion_that_jumps_is_refused():
    for way in (shoot_by_bisection, rigid_feedforward):
        with pytest.raises(fx.InputError, match="jumps"):
            way(bench(), [0.0, 1.0], [step(1.0, 0.5)])


def test_sleeves_and_sliders_are_bisected_too():
    """Type III: a sleeved strip, drives in the middles of the steps against the exact ones."""
    link = beam(0.4, 0.157, 0.3333, 4, "Pb", start=0.25, modes=2)
    sys = system(rigid(0.2, 0.2, 0.1, 1e-3), link, payload=0.02)
    t, motion = np.arange(0.0, 0.3, 0.002), [cycloid(0.4, 0.25), cycloid(0.3, 0.25, 0.25)]
    run, exact = shoot_by_bisection(sys, t, motion), fx.inverse(sys, t + 0.001, motion, rtol=1e-9)
    for i in (1, 2):
        needed = exact[f"joint/{i}/drive"][:-1]
        assert run[f"joint/{i}/drive"][:-1] == pytest.approx(
            needed, abs=0.01 * np.abs(needed).max()
        )


def test_a_robot_with_all_joints_locked_is_refused():
    with pytest.raises(fx.InputError, match="free to move"):
        shoot_by_bisection(
            system(beam(0.6, 0.2355, 0.5, 2, locked=True)), [0.0, 0.1], [constant(0.0)]
        )
