"""The time loop: tolerances, breaks of drives, outputs, limits, interruptions and wrong
arguments."""

from __future__ import annotations

import itertools
import os
import signal as os_signal
import subprocess
import sys
import time

import numpy as np
import pytest

import flexura as fx
from flexura import signals
from flexura.simulation import integrator
from robots import beam, bench_arm, largest_difference, rigid, robot, system, two_link_arm

METHODS = ("explicit", "implicit", "exponential")
SMOOTH = fx.Drive.force(signals.polynomial(0.02, 0.3))


def cart(mass: float = 2.0, **joint) -> fx.System:
    return system(rigid(0.0, mass, 0.0, 0.0, "Pa", **joint))


def arm_with_friction() -> fx.System:
    """Two flexible links with gravity, damping and viscous friction."""
    links = (
        beam(
            0.4,
            0.3,
            1.0,
            2,
            hub_inertia_kg_m2=5e-3,
            viscous_friction=0.01,
            damping={"beta_s": 1e-4},
        ),
        beam(0.3, 0.2, 0.4, 2, hub_mass_kg=0.1, hub_inertia_kg_m2=1e-3, start=0.5),
    )
    return system(*links, payload=0.05, gravity=(0.0, -1.0))


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


# Ends before the end


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("kind", ["drive", "function"])
def test_a_joint_at_its_limit_ends_the_run(method, kind):
    """x = t^2/4 meets 0.1 m at 0.6325 s."""
    drive = fx.Drive.force(signals.constant(1.0)) if kind == "drive" else lambda t: [1.0]
    run = fx.simulate(cart(2.0, limits=[-0.05, 0.1]), np.linspace(0, 2, 201), drive, method=method)
    assert not run.complete
    assert run.t[-2] == pytest.approx(0.63, abs=1e-9) and len(run["tip/x"]) == len(run.t) == 65
    assert run.t[-1] == pytest.approx(2 * 0.1**0.5, rel=1e-6) and run["joint/1/position"][
        -1
    ] == pytest.approx(0.1, rel=1e-7)
    (event,) = run.meta["events"]
    assert (
        event["level"] == "ERROR"
        and "joint 1 left its limits" in event["text"]
        and event["t"] == run.t[-1]
    )


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("kind", ["drive", "function"])
@pytest.mark.parametrize(
    "case",
    [
        "the tip of link 1",
        "the root of link 1",
        "the sleeve's mouth",
        "out of the sleeve",
        "into the sleeve",
    ],
)
def test_the_end_of_a_link_ends_the_run_with_a_word(method, kind, case):
    """A slider on a flexible link, or a link in its sleeve, pulled to each end; the last state is
    there, at the end, and good."""
    rail = beam(0.4, 0.3, 20.0, 2, damping={"beta_s": 1e-3}, hub_inertia_kg_m2=0.01, locked=True)
    slider = rigid(0.1, 0.2, 0.0, 1e-3, type="Pa", start=0.2)
    sleeved = beam(0.4, 0.3, 20.0, 2, type="Pb", start=0.2, damping={"beta_s": 1e-5})
    short = beam(
        0.4, 0.3, 20.0, 1, type="Pb", start=0.05
    )  # undamped: beta omega^2 grows with 1/d^4
    robot, pull, joint, end, words = {
        "the tip of link 1": (
            [rail, slider],
            1.0,
            2,
            0.4,
            "joint 2 (Pa) reached the end of link 1, at 0.4 m",
        ),
        "the root of link 1": (
            [rail, slider],
            -1.0,
            2,
            0.0,
            "joint 2 (Pa) reached the end of link 1, at 0 m",
        ),
        "the sleeve's mouth": (
            [
                sleeved | {"joint": sleeved["joint"] | {"locked": True}},
                slider | {"joint": slider["joint"] | {"start": 0.3}},
            ],
            -1.0,
            2,
            0.2,
            "joint 2 (Pa) ran into the sleeve of link 1",
        ),
        "out of the sleeve": (
            [sleeved],
            1.0,
            1,
            0.4,
            "joint 1 (Pb) reached the end of link 1, at 0.4 m",
        ),
        "into the sleeve": (
            [short],
            -1.0,
            1,
            0.008,
            "joint 1 (Pb) reached the end of link 1, at 0.008 m",
        ),
    }[case]
    forces = [0.0] * (joint - 1) + [pull]
    drive = (
        fx.Drive.force(*(signals.constant(f) for f in forces))
        if kind == "drive"
        else lambda t: forces
    )
    run = fx.simulate(system(*robot), [0.0, 0.1, 5.0], drive, method=method, rtol=1e-7)
    assert not run.complete and [words in event["text"] for event in run.meta["events"]] == [True]
    assert (
        run[f"joint/{joint}/position"][-1] == pytest.approx(end, abs=1e-7)
        and run.t[-1] == run.meta["events"][0]["t"]
    )
    assert all(np.isfinite(run[name]).all() for name in run) and run.meta["energy_error"] < 1e-5


@pytest.mark.parametrize("method", METHODS)
def test_a_joint_that_is_beyond_its_limit_only_within_a_step_is_caught_at_an_output(method):
    """x = 0.1 sin 2 pi t is beyond 0.0999 m from 0.2429 to 0.2571 s, and steps of a rigid cart are
    longer than that."""
    sys = cart(2.0, limits=[-0.2, 0.0999])
    run = fx.inverse(
        sys, [0.0, 0.25, 1.0], signals.harmonic(0.1, 1.0, -np.pi / 2), method=method, rtol=1e-3
    )
    assert not run.complete and "joint 1 left its limits" in run.meta["events"][0]["text"]
    assert run.t[-1] == pytest.approx(np.arcsin(0.999) / (2 * np.pi), rel=1e-6)
    assert run["joint/1/position"][-1] == pytest.approx(0.0999, rel=1e-6)


def test_a_joint_that_stays_inside_its_limits_does_not_end_the_run():
    run = fx.simulate(
        cart(2.0, limits=[-0.05, 0.1]),
        np.linspace(0, 0.63, 64),
        fx.Drive.force(signals.constant(1.0)),
    )
    assert run.complete and run.meta["events"] == [] and len(run) == 64


@pytest.mark.parametrize("method", METHODS)
def test_an_interrupted_run_keeps_what_it_has(method):
    sys, seen = bench_arm(), []

    def progress(done):
        seen.append(done)
        if done > 0.3:
            raise KeyboardInterrupt

    run = fx.simulate(
        sys, np.linspace(0, 20, 2001), SMOOTH, rtol=1e-8, method=method, progress=progress
    )
    assert not run.complete and 0.3 * 20 - 0.01 <= run.t[-1] < 20 and len(run.t) < 2001
    assert all(np.all(np.isfinite(run[name])) for name in run) and run.meta["energy_error"] < 1e-4
    assert run.meta["events"][-1]["level"] == "WARN" and 0 < run.meta["events"][-1]["t"] < 20


def test_an_interrupted_python_drive_keeps_what_it_has():
    def drive(t):
        if t > 0.5:
            raise KeyboardInterrupt
        return [0.01]

    try:
        run = fx.simulate(bench_arm(2), np.linspace(0, 1, 101), drive, method="explicit")
    except KeyboardInterrupt:
        pytest.fail("a run driven by a Python function is lost when it is interrupted")
    assert not run.complete and len(run) < 101 and run.meta["events"][-1]["level"] == "WARN"


_LONG = """
import numpy as np, flexura as fx
from flexura import signals
from robots import bench_arm
def progress(done):
    print("going", flush=True)
drive = fx.Drive.force(signals.polynomial(0.02, 0.3))
t = np.linspace(0, 3000, 3001)
run = fx.simulate(bench_arm(), t, drive, rtol=1e-8, method="explicit", progress=progress)
finite = all(np.all(np.isfinite(run[c])) for c in run)
print("end", run.complete, len(run.t), finite, run.meta["events"][-1]["text"])
"""


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_ctrl_c_ends_a_run_with_its_results():
    surroundings = os.environ | {"PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    program = subprocess.Popen(
        [sys.executable, "-c", _LONG], env=surroundings, stdout=subprocess.PIPE, text=True
    )
    try:
        assert program.stdout.readline() == "going\n"
        time.sleep(0.2)
        program.send_signal(os_signal.SIGINT)
        last = [line for line in program.communicate(timeout=60)[0].splitlines() if line != "going"]
    finally:
        program.kill()
    assert program.returncode == 0
    assert (
        len(last) == 1 and last[0].startswith("end False") and last[0].endswith("True interrupted")
    )


def test_progress_ascends_to_one():
    seen = []
    fx.simulate(bench_arm(), np.linspace(0, 2, 3), SMOOTH, method="explicit", progress=seen.append)
    assert len(seen) > 2 and seen == sorted(seen) and seen[0] > 0 and seen[-1] == 1.0


@pytest.mark.parametrize("method", METHODS)
def test_a_run_that_cannot_go_on_says_when_and_keeps_what_it_has(method):
    """A force of 1e300 N from 0.5 s on: no number is large enough for its work."""
    drive = fx.Drive.force(signals.piecewise([0.0, 0.5], [1.0, 1e300]))
    run = fx.simulate(cart(), np.linspace(0, 1, 11), drive, method=method)
    assert (
        not run.complete
        and 5 <= len(run) <= 7
        and run["joint/1/position"][4] == pytest.approx(0.04, rel=1e-9)
    )
    (event, *_) = run.meta["events"]
    assert (
        event["level"] == "ERROR"
        and "got no further than t = 0.5" in event["text"]
        and "joint 1" in event["text"]
    )


@pytest.mark.parametrize("method", METHODS)
def test_a_torque_that_bends_a_link_beyond_a_right_angle_is_a_motion_like_others(method):
    """50 N m on the bench arm, a hundred times EI / L: the two methods agree, and the energies
    balance."""
    drive, t = fx.Drive.force(signals.constant(50.0)), [0.0, 0.01, 0.02]
    run = fx.simulate(bench_arm(), t, drive, method=method, rtol=1e-7)
    assert (
        run.complete
        and run.meta["energy_error"] < 1e-4
        and abs(run["link/1/tip_slope"][-1]) > np.pi / 2
    )
    exact = fx.simulate(bench_arm(), t, drive, method="explicit", rtol=1e-10)
    assert run["tip/x"] == pytest.approx(exact["tip/x"], abs=1e-5)


# Wrong arguments


@pytest.mark.parametrize(
    ("key", "arguments"),
    [
        ("t_eval", {"t_eval": []}),
        ("t_eval", {"t_eval": [0.0, 0.0]}),
        ("t_eval", {"t_eval": [1.0, 0.5]}),
        ("t_eval", {"t_eval": [0.0, np.nan]}),
        ("t_eval", {"t_eval": [[0.0, 1.0]]}),
        ("t_eval", {"t_eval": 1.0}),
        ("rtol", {"rtol": 0.0}),
        ("rtol", {"rtol": -1e-6}),
        ("rtol", {"rtol": 1.0}),
        ("rtol", {"rtol": np.nan}),
        ("method", {"method": "rk4"}),
        ("q0", {"q0": [0.0]}),
        ("q0", {"q0": [np.nan, 0, 0, 0, 0]}),
        ("q0", {"q0": [3.0, 0, 0, 0, 0]}),  # beyond the limits
        ("qd0", {"qd0": np.zeros((5, 1))}),
        ("qd0", {"qd0": [np.inf, 0, 0, 0, 0]}),
        ("drive", {"drive": fx.Drive.none(2)}),
        ("drive", {"drive": lambda t, q: [0.0]}),
        ("drive", {"drive": lambda t: [0.0, 0.0]}),
        ("drive", {"drive": lambda t: [np.nan]}),
    ],
)
def test_wrong_arguments_are_refused_by_name(key, arguments):
    sys = system(beam(0.4, 0.3, 1.0, 2, limits=[-1.0, 1.0]))
    with pytest.raises(fx.InputError) as error:
        fx.simulate(sys, **({"t_eval": [0.0, 0.01]} | arguments))
    assert error.value.key == key and "expected" in str(error.value)


@pytest.mark.parametrize("call", [fx.static, fx.frequencies])
def test_wrong_arguments_of_statics_and_frequencies_are_refused(call):
    sys = system(beam(0.4, 0.3, 1.0, 2))
    with pytest.raises(fx.InputError):
        call(sys, joints=[0.0, 1.0] if call is fx.static else "loose")
    with pytest.raises(fx.InputError):
        call(sys, **({"tip_force": (np.nan, 0.0)} if call is fx.static else {"q": [0.0]}))


@pytest.mark.parametrize("load", [3.0, 5.0, 50.0])
def test_no_unstable_equilibrium_is_taken_for_the_answer(load):
    """Beyond pi^2 EI/(4 L^2) = 2.47 N the nearly straight link is unstable, and bent against the
    force across it: an error, or the buckled shape."""
    sys = system(beam(1.0, 1.0, 1.0, 4))
    try:
        q = fx.static(sys, tip_force=(-load, 0.1))
    except fx.FlexuraError:
        return
    assert fx.tip_pose(sys, q)[1] > 0.1


def test_a_simulation_loads_no_integrators_of_scipy_and_no_twin():
    """What a run of the compiled core does not need costs no time at the start."""
    code = (
        "import sys, flexura as fx\n"
        "from robots import rigid, system\n"
        "fx.simulate(system(rigid(0.1, 1.0, 0.05, 0.0)), [0.0, 0.1])\n"
        "print(*(name for name in ('numba', 'exudyn', 'scipy.integrate', 'matplotlib') if name in "
        "sys.modules))"
    )
    surroundings = os.environ | {"PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=surroundings,
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    assert done.stdout.split() == []


# Memory


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="Linux")
def test_repeated_runs_do_not_grow():
    def size() -> float:
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20

    sys, t = arm_with_friction(), np.linspace(0, 0.05, 2001)
    drive = fx.Drive.force(signals.constant(0.02), None)
    for _ in range(10):
        fx.simulate(sys, t, drive)
    before = size()
    for _ in range(60):
        fx.simulate(sys, t, drive)
    assert size() - before < 10  # MiB; the results of one run take 1


def test_two_systems_do_not_share_anything():
    """Runs made in turns are the runs made alone."""
    a, b = bench_arm(4), fx.assemble(robot(beam(0.3, 0.2, 0.4, 4), payload=0.1))
    alone = fx.simulate(a, [0.0, 0.2], SMOOTH)
    fx.simulate(b, [0.0, 0.2], SMOOTH)
    assert np.array_equal(fx.simulate(a, [0.0, 0.2], SMOOTH).states, alone.states)


def test_numerical_damping_can_be_switched_off():
    """Then its account is zero and the energy stays; with it the account says what it took."""
    strip = robot(beam(0.5, 0.2, 5.0, 6))
    start = fx.static(strip, joints=[0.0], tip_force=(0.0, 0.5))
    asked = {"q0": start, "rtol": 1e-4, "method": "exponential"}
    damped = fx.simulate(strip, np.linspace(0, 0.5, 11), fx.Drive.none(1), **asked)
    free = fx.simulate(
        strip, np.linspace(0, 0.5, 11), fx.Drive.none(1), numerical_damping=False, **asked
    )
    assert damped["energy/numerical_loss"][-1] > 0.0 and np.all(
        free["energy/numerical_loss"] == 0.0
    )
    assert max(damped.meta["energy_error"], free.meta["energy_error"]) < 1e-3
