"""What ends a run early: limits, interruptions, steps that are too short."""

from __future__ import annotations

import os
import signal as os_signal
import subprocess
import sys
import time

import numpy as np
import pytest

import flexura as fx
from flexura import signals
from moved_robots import METHODS, SMOOTH, cart
from robots import beam, bench_arm, rigid, system


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


def test_a_loop_that_runs_away_is_named():
    """A sampled damping that turns a light link's speed round at each tick, and adds to it."""
    link = {"length_m": 0.5, "mass_per_length_kg_m": 0.2, "joint": {"type": "R", "start_rad": 0.1}}
    robot, gain = fx.Robot.from_dict({"link": [link]}), 8.0
    inertia = 0.2 * 0.5**3 / 3
    wild = fx.Sampled(lambda t, x, v, w: [-gain * inertia * 100.0 * v[0]], 100.0)
    run = fx.simulate(robot, np.linspace(0.0, 0.05, 6), wild, qd0=[1.0])
    [event] = [e for e in run.meta["events"] if e["name"] == "fast"]
    k = int(np.argmax(np.abs(run["joint/1/velocity"]) * 0.5 > 1000.0))
    assert run.complete and event["t"] == run.t[k] and "joint 1" in event["text"]
    assert np.abs(run["joint/1/velocity"][:5]) == pytest.approx((gain - 1.0) ** np.arange(5))
