"""The time loop: tolerances, outputs, and the breaks of drives."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import flexura as fx
from flexura import signals
from flexura.simulation import integrator
from moved_robots import METHODS, arm_with_friction, cart
from robots import beam, bench_arm, largest_difference, rigid, system, two_link_arm

# Accuracy


TOLERANCES = {
    "explicit": [1e-4, 1e-6, 1e-8, 1e-10],
    "implicit": [1e-3, 1e-5, 1e-7],
    "exponential": [1e-3, 1e-5, 1e-7, 1e-9],
}


@pytest.mark.parametrize(("method", "tolerances"), TOLERANCES.items())
@pytest.mark.parametrize("make", [bench_arm, arm_with_friction], ids=["bench arm", "two links"])
def test_the_error_falls_with_the_tolerance(method, tolerances, make):
    """Against rtol = 1e-12, after some periods: below a hundred times rtol, and smaller with every
    smaller rtol."""
    sys = make()
    drive = fx.Drive.force(signals.polynomial(0.02, 0.3), *[None] * (len(sys.robot.links) - 1))
    t = np.linspace(0, 1, 21)
    exact = fx.simulate(sys, t, drive, rtol=1e-12, method="explicit")
    errors = [
        largest_difference(exact, fx.simulate(sys, t, drive, rtol=rtol, method=method))
        for rtol in tolerances
    ]
    assert all(error < 100 * rtol for error, rtol in zip(errors, tolerances)), errors
    assert all(b < a or b < 1e-12 for a, b in itertools.pairwise(errors)), errors


def test_all_methods_agree():
    """Smooth drives; a jump would start the 222 Hz mode ringing, in which a small phase error
    counts 222 periods long."""
    sys = fx.assemble(two_link_arm(2))
    drive = fx.Drive.force(signals.polynomial(0.1, 0.3), signals.polynomial(0.05, 0.3))
    t = np.linspace(0, 1, 51)
    a, *others = (fx.simulate(sys, t, drive, rtol=1e-9, method=m) for m in METHODS)
    for b in others:
        assert (
            largest_difference(a, b, [name for name in a if a.units[name] in ("m", "rad")]) < 1e-7
        )
    assert tuple(run.meta["method"] for run in (a, *others)) == METHODS
    assert fx.simulate(sys, t, drive).meta["method"] in METHODS


@pytest.mark.parametrize(
    ("method", "order"), [("explicit", 7.0), ("implicit", 3.0), ("exponential", 5.0)]
)
def test_work_grows_with_accuracy_like_the_order_of_the_method(method, order):
    """Steps grow with (1/rtol)^(1/order), order 8, 4 and 6, where only accuracy bounds them: a
    rigid double pendulum."""
    sys = system(
        rigid(0.5, 1.0, 0.3, 0.02, start=1.0),
        rigid(0.4, 0.6, 0.2, 0.01, start=0.4),
        gravity=(0.0, -9.81),
    )
    steps = [
        fx.simulate(sys, [0.0, 5.0], rtol=rtol, method=method).meta["steps"]
        for rtol in (1e-5, 1e-9)
    ]
    assert order < np.log(1e4) / np.log(steps[1] / steps[0]) < 1.5 * order


# Outputs


@pytest.mark.parametrize("method", METHODS)
def test_results_do_not_depend_on_where_they_are_asked_for(method):
    """The implicit method makes the same steps whatever lies between the first and the last output;
    the explicit one may end a step on an output, which changes positions by no more than the
    tolerance allows."""
    sys, drive = arm_with_friction(), fx.Drive.force(signals.constant(0.02), None)
    few, many = np.array([0.0, 0.25, 0.5]), np.linspace(0, 0.5, 1001)
    odd = np.sort(np.append(np.random.default_rng(0).uniform(0, 0.5, 50), few))
    a, b, c = (
        fx.simulate(sys, t, drive, rtol=1e-7, method=method).states for t in (few, many, odd)
    )
    for other in (b[[0, 500, 1000]], c[np.isin(odd, few)]):
        if method == "implicit":
            assert np.array_equal(a, other)
        else:
            positions = a[:, : sys.n]
            assert np.abs(positions - other[:, : sys.n]).max() < 1e-7 * np.abs(positions).max()


@pytest.mark.parametrize("method", METHODS)
def test_results_between_steps_are_as_good_as_those_at_steps(method):
    """A run that ends at t, so steps on it, against one that interpolates there."""
    sys, drive = arm_with_friction(), fx.Drive.force(signals.constant(0.02), None)
    through = fx.simulate(sys, np.linspace(0, 0.5, 101), drive, rtol=1e-7, method=method)
    names = [name for name in through if "energy" not in name or "work" in name or "loss" in name]
    for k in (13, 37, 80):
        until = fx.simulate(sys, [0.0, through.t[k]], drive, rtol=1e-7, method=method)
        for name in names:
            assert until[name][-1] == pytest.approx(
                through[name][k], abs=1e-5 * np.abs(through[name]).max()
            ), name


@pytest.mark.parametrize("method", METHODS)
def test_results_do_not_depend_on_how_often_the_loop_is_left(method, monkeypatch):
    sys, t = arm_with_friction(), np.linspace(0, 0.3, 31)
    drive = fx.Drive.force(signals.bang_bang(0.05, 0.2), signals.harmonic(0.01, 3.0))
    runs = []
    for steps in (1, 7, 10**6):
        monkeypatch.setattr(integrator, "STEPS_A_CALL", steps)
        runs.append(fx.simulate(sys, t, drive, method=method))
    for run in runs[1:]:
        assert (
            np.array_equal(run.states, runs[0].states)
            and run.meta["steps"] == runs[0].meta["steps"]
        )


@pytest.mark.parametrize("method", METHODS)
def test_time_may_start_anywhere(method):
    """Without gravity and with the drive moved along, a run from t = 7 is a run from 0."""
    sys = bench_arm(4)
    t = np.linspace(0, 0.5, 26)
    a = fx.simulate(sys, t, fx.Drive.force(signals.bang_bang(0.02, 0.4)), rtol=1e-9, method=method)
    b = fx.simulate(
        sys, t + 7, fx.Drive.force(signals.bang_bang(0.02, 0.4, at_s=7.0)), rtol=1e-9, method=method
    )
    assert largest_difference(a, b) < 1e-6


def test_one_time_is_a_state_observed():
    sys = bench_arm(4)
    run = fx.simulate(sys, [3.0], q0=fx.static(sys, joints=[0.7], tip_force=(0.0, 0.1)))
    assert (
        len(run) == 1
        and run.complete
        and run["joint/1/position"][0] == 0.7
        and run["energy/strain"][0] > 0
    )


# Drives


@pytest.mark.parametrize("method", METHODS)
def test_jumps_of_a_force_are_met_exactly(method):
    """A cart under a piecewise constant force: x and v to round-off at any tolerance, from the sums
    of the parabolas."""
    at, force, mass = [0.0, 0.123, 0.124, 0.5, 0.77], [1.0, -3.0, 7.0, -2.0, 0.0], 2.0
    t = np.unique([*np.linspace(0, 1, 11), *at])
    run = fx.simulate(
        cart(mass), t, fx.Drive.force(signals.piecewise(at, force)), rtol=1e-2, method=method
    )
    ends = np.append(at[1:], np.inf)
    v = sum(f / mass * (np.clip(t, a, b) - a) for f, a, b in zip(force, at, ends))
    x = sum(
        f
        / mass
        * ((np.clip(t, a, b) - a) ** 2 / 2 + (np.clip(t, a, b) - a) * (t - np.clip(t, a, b)))
        for f, a, b in zip(force, at, ends)
    )
    assert run["joint/1/velocity"] == pytest.approx(v, abs=1e-13)
    assert run["joint/1/position"] == pytest.approx(x, abs=1e-13)


@pytest.mark.parametrize("method", METHODS)
def test_a_jump_shorter_than_any_step_is_not_missed(method):
    """An impulse of 1e-5 s: m v = F dt."""
    run = fx.simulate(
        cart(2.0),
        [0.0, 1.0],
        fx.Drive.force(signals.piecewise([0.0, 0.4, 0.40001], [0.0, 1e4, 0.0])),
        rtol=1e-3,
        method=method,
    )
    assert run["joint/1/velocity"][-1] == pytest.approx(0.05, rel=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_a_python_function_drives_like_the_same_drive(method):
    links = (
        rigid(0.1, 0.5, 0.05, 1e-3, viscous_friction=0.01),
        beam(0.3, 0.2, 0.4, 2, damping={"beta_s": 1e-3}),
    )
    sys, t = system(*links, payload=0.05), np.linspace(0, 0.12, 13)
    drive = fx.Drive.force(signals.polynomial(0.05, 0.1), signals.cycloid(0.01, 0.05))
    compiled = fx.simulate(sys, t, drive, rtol=1e-8, method=method)
    called = fx.simulate(sys, t, lambda s: drive(s, None, None), rtol=1e-8, method=method)
    assert largest_difference(compiled, called) < 1e-6
    for name in ("joint/1/drive", "joint/2/drive", "energy/work", "energy/loss"):
        assert called[name] == pytest.approx(
            compiled[name], abs=1e-6 * np.abs(compiled[name]).max()
        )


def test_a_python_function_sees_positions_velocities_and_the_tip():
    """PD control written in Python against the compiled one, and the last link's deflection as the
    run has it."""
    sys, t = arm_with_friction(), np.linspace(0, 0.3, 16)
    motions, kp, kd = (
        [signals.cycloid(0.3, 0.2), signals.cycloid(0.1, 0.2, start=0.5)],
        [20.0, 5.0],
        [0.5, 0.1],
    )
    drive = fx.Drive.pd(motions, kp, kd)
    seen = []

    def control(s, position, velocity, tip):
        seen.append((s, tip))
        r, rd, _ = np.array([m(s) for m in motions]).T
        return kp * (r - position) + kd * (rd - velocity)

    compiled, called = (
        fx.simulate(sys, t, d, rtol=1e-8, method="explicit") for d in (drive, control)
    )
    assert largest_difference(compiled, called) < 1e-6
    last = [tip for s, tip in seen if s == t[-1]]
    assert last and last[-1] == pytest.approx(called["link/2/tip_deflection"][-1], abs=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_stiff_gains_hold_a_cart_on_its_motion(method):
    """m x'' = kp (r - x) + kd (r' - x') with r a cycloid: the error of a well damped drive is m
    r''/kp to first order."""
    mass, kp, kd = 2.0, 1e6, 2e3
    r = signals.cycloid(0.3, 1.0)
    run = fx.simulate(
        cart(mass), np.linspace(0, 1, 101), fx.Drive.pd([r], [kp], [kd]), rtol=1e-8, method=method
    )
    error = np.array([r(s)[0] for s in run.t]) - run["joint/1/position"]
    lag = np.array([mass * r(s)[2] / kp for s in run.t])
    assert np.abs(error - lag)[10:].max() < 0.02 * np.abs(lag).max()


def test_the_implicit_method_steps_over_stiff_gains_and_damping():
    """The same robot with gains a hundred times stiffer takes hardly more implicit steps."""
    steps = []
    for kp in (1e4, 1e6):
        drive = fx.Drive.pd([signals.polynomial(0.3, 1.0)], [kp], [kp / 100])
        steps.append(
            fx.simulate(bench_arm(4), [0.0, 1.0], drive, rtol=1e-4, method="implicit").meta["steps"]
        )
    assert steps[1] < 2 * steps[0]


def test_a_locked_joint_does_not_move_whatever_its_drive():
    sys = system(
        beam(0.4, 0.3, 1.0, 2, hub_inertia_kg_m2=1e-3),
        beam(0.3, 0.2, 0.4, 2, start=0.5, locked=True),
        payload=0.05,
    )
    run = fx.simulate(
        sys,
        np.linspace(0, 0.2, 5),
        fx.Drive.force(signals.constant(0.02), signals.constant(1.0)),
        qd0=np.ones(sys.n) * 1e-3,
    )
    assert np.all(run["joint/2/position"] == 0.5) and np.all(run["joint/2/velocity"] == 0.0)
    assert run.meta["energy_error"] < 1e-5


@pytest.mark.parametrize("growth", [30.0, 60.0])
@pytest.mark.parametrize("rtol", [1e-5, 1e-6])
def test_numerical_damping_ends_where_the_robot_turns_as_fast_as_its_modes_swing(growth, rtol):
    """A soft strip is spun up until it wraps itself round: the modes that were damped at the start
    now carry the motion."""
    link = {"length_m": 1.0, "elements": 6, "mass_per_length_kg_m": 0.3, "joint": {"type": "R"}}
    strip = link | {"bending_stiffness_N_m2": 1.0, "damping": {"beta_s": 1e-4}}
    robot = fx.Robot.from_dict({"link": [strip], "payload": {"mass_kg": 0.1}})
    t, motion = np.linspace(0.0, 1.0, 51), lambda t: growth * t * t
    exact = fx.simulate(robot, t, fx.Drive.prescribed(motion), method="implicit", rtol=1e-9)
    found = fx.simulate(robot, t, fx.Drive.prescribed(motion), method="exponential", rtol=rtol)
    assert found.complete and not found.meta["events"]
    for name in ("tip/x", "tip/y"):
        assert found[name] == pytest.approx(exact[name], abs=5.0 * rtol), name
    lost = found["energy/numerical_loss"][-1] / found["energy/loss"][-1]
    assert abs(lost) < rtol
