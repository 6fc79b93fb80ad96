"""Least time from rest to rest: the limit of the drive, and what vibrates after it."""

import numpy as np
import pytest

import flexura as fx
from flexura.errors import InputError

INERTIA = 0.2355 * 0.6**3 / 3 + 0.05 * 0.36 + 2e-3  # of the rigid bench arm


def bench_arm(stiffness=0.5):
    data = fx.load("single-r").to_dict()
    data["link"][0] |= {"damping": {"beta_s": 2e-3}, "bending_stiffness_N_m2": stiffness}
    return fx.Robot.from_dict(data)


def bang_bang(most):
    return 2 * np.sqrt(INERTIA * np.pi / 2 / most)


def left(robot, t, u):
    """The largest deflection after the drives, linear between rows, [m]."""
    later = np.append(0.0, t[-1] + np.linspace(1e-9, 0.8, 401))
    drive = lambda s: [np.interp(s, t, u) if s < t[-1] else 0.0]
    run = fx.simulate(robot, later, drive, rtol=1e-8)
    return np.abs(run["link/1/tip_deflection"][1:]).max()


def unshaped(robot, most):
    T = bang_bang(most)
    h = 1e-6
    t = np.array([0.0, T / 2 - h, T / 2 + h, T - h, T])
    return left(robot, t, most * np.array([1.0, 1.0, -1.0, -1.0, 0.0]))


def test_a_coarse_motion_keeps_its_limits_and_ends_at_rest():
    most = 2.0
    run = fx.time_optimal(bench_arm(), [0.0], [np.pi / 2], {"drive": [most]}, intervals=40)
    u, slack = run["joint/1/drive"], run.meta["unshaped_m"]
    assert run.meta["duration_s"] == run.t[-1] <= 1.03 * bang_bang(most)
    assert np.abs(u).max() <= most * (1 + 1e-9) and u[-1] == 0.0
    assert left(bench_arm(), run.t, u) < 2e-3 * unshaped(bench_arm(), most)
    assert run.meta["residual_m"] < 2e-3 * slack
    assert run["joint/1/position"][-1] == pytest.approx(np.pi / 2, abs=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("most", [0.5, 2.0])
def test_the_bench_arm_is_as_quick_as_the_rigid_one_and_then_at_rest(most):
    run = fx.time_optimal(bench_arm(), [0.0], [np.pi / 2], {"drive": [most]})
    assert run.meta["duration_s"] <= 1.03 * bang_bang(most)
    assert left(bench_arm(), run.t, run["joint/1/drive"]) < 5e-3 * unshaped(bench_arm(), most)
    assert np.abs(run["joint/1/drive"]).max() <= most * (1 + 1e-9)


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize(("most", "ratio"), [(1.0, 1.18), (2.0, 1.30)])
def test_other_frequencies_are_nearly_at_rest_too(most, ratio):
    run = fx.time_optimal(bench_arm(), [0.0], [np.pi / 2], {"drive": [most]}, robust=0.1)
    assert run.meta["duration_s"] <= ratio * bang_bang(most)
    robots = [bench_arm(0.5 * f**2) for f in np.linspace(0.9, 1.1, 9)]
    reference = max(unshaped(robot, most) for robot in robots)
    for robot in robots:
        assert left(robot, run.t, run["joint/1/drive"]) < 0.02 * reference


@pytest.mark.slow
def test_two_joints_and_a_speed_limit():
    limits = {"drive": [10.0, 0.3], "speed": [1.0, 6.0]}
    run = fx.time_optimal("rig", [0.0, 0.0], [0.10, np.pi / 4], limits, intervals=20)
    for k, most in enumerate(limits["drive"], 1):
        assert np.abs(run[f"joint/{k}/drive"]).max() <= most * (1 + 1e-9)
    fast = {
        f"joint/{k}/velocity"
        for k, most in enumerate(limits["speed"], 1)
        if np.abs(run[f"joint/{k}/velocity"]).max() > most * (1 + 1e-2)
    }
    told = {e["text"].split()[0] for e in run.meta["events"] if e["name"] == "limit_exceeded"}
    assert told == fast  # between the program's nodes a limit may not be kept; the run says so
    assert run["tip/x"][-1] == pytest.approx(0.1 + 0.1 + 0.3 * np.cos(np.pi / 4), abs=1e-3)
    assert run.meta["residual_m"] < 5e-3 * run.meta["unshaped_m"]


@pytest.mark.parametrize(
    ("limits", "key"), [({}, "limits.drive"), ({"drive": [1.0], "force": 1.0}, "limits.force")]
)
def test_wrong_limits_are_named(limits, key):
    with pytest.raises(InputError) as caught:
        fx.time_optimal("single-r", [0.0], [1.0], limits)
    assert caught.value.key == key
