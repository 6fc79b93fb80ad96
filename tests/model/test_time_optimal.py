"""Least time from rest to rest: the limit of the drive, and what vibrates after it."""

import numpy as np
import pytest

import flexura as fx
from flexura.errors import InputError
from flexura.simulation.trajectory.limits import KEPT, read_limits
from flexura.simulation.trajectory.plant_motion import linear_drive

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
@pytest.mark.parametrize("most", [0.5, 1.0, 2.0])
def test_the_bench_arm_is_as_quick_as_the_rigid_one_and_then_at_rest(most):
    run = fx.time_optimal(bench_arm(), [0.0], [np.pi / 2], {"drive": [most]})
    ratio = run.meta["duration_s"] / bang_bang(most)
    share = left(bench_arm(), run.t, run["joint/1/drive"]) / unshaped(bench_arm(), most)
    print(f"u = {most}: {ratio:.3f} of the rigid bang-bang, {100 * share:.2f} % of its residual")
    assert ratio <= 1.03 and share < 5e-3
    assert np.abs(run["joint/1/drive"]).max() <= most * (1 + 1e-9)


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize(("most", "ratio"), [(0.5, 1.15), (1.0, 1.18), (2.0, 1.30)])
def test_other_frequencies_are_nearly_at_rest_too(most, ratio):
    run = fx.time_optimal(bench_arm(), [0.0], [np.pi / 2], {"drive": [most]}, robust=0.1)
    found = run.meta["duration_s"] / bang_bang(most)
    robots = [bench_arm(0.5 * f**2) for f in np.linspace(0.9, 1.1, 9)]
    reference = max(unshaped(robot, most) for robot in robots)
    share = max(left(robot, run.t, run["joint/1/drive"]) for robot in robots) / reference
    print(f"u = {most}: {found:.3f} of the rigid bang-bang, {100 * share:.2f} % within +-10 %")
    assert found <= ratio and share < 0.02


def shares(robot, start, limits, run):
    """The largest drives, speeds and deflections in shares of their limits, by explicit steps on
    rows that are not those of the run."""
    joints = range(1, len(start) + 1)
    t = np.linspace(0.0, run.t[-1], 3 * len(run) + 1)
    drive = fx.Drive.force(*(linear_drive(run.t, run[f"joint/{k}/drive"]) for k in joints))
    exact = fx.simulate(robot, t, drive, fx.static(robot, start), rtol=1e-9, method="explicit")
    assert exact.complete
    most = {f"joint/{k}/drive": limits["drive"][k - 1] for k in joints}
    if "speed" in limits:
        most |= {f"joint/{k}/velocity": limits["speed"][k - 1] for k in joints}
    if "deflection_m" in limits:
        tips = [name for name in exact if name.endswith("/tip_deflection")]
        most |= dict.fromkeys(tips, limits["deflection_m"])
    return {name: np.abs(exact[name]).max() / size for name, size in most.items()}


RIG = {"drive": [10.0, 0.3], "speed": [1.0, 6.0]}  # its nodes alone would let joint 2 reach 8 rad/s
RR = {"drive": [0.888, 0.0978], "speed": [3.0, 10.0], "deflection_m": 0.01}
LIMITED = {
    "bench": (None, [0.0], [np.pi / 2], {"drive": [1.0], "speed": [6.0], "deflection_m": 0.22}, 20),
    "rig-r": ("rig-r", [0.0], [np.pi / 3], {"drive": [0.3], "deflection_m": 0.055}, 40),
    "rig": ("rig", [0.0, 0.0], [0.10, np.pi / 4], RIG, 20),
    "rig bent": ("rig", [0.0, 0.0], [0.10, np.pi / 4], RIG | {"deflection_m": 0.02}, 40),
    "type-1-rr": ("type-1-rr", [0.0, 0.6], [0.8, 0.1], RR, 40),
}
QUICK = {"bench"}


@pytest.mark.parametrize(
    "case", [k if k in QUICK else pytest.param(k, marks=pytest.mark.slow) for k in LIMITED]
)
def test_limits_hold_between_the_nodes_of_the_drives(case):
    name, start, end, limits, intervals = LIMITED[case]
    robot = fx.load(name) if name else bench_arm()
    run = fx.time_optimal(robot, start, end, limits, intervals=intervals)
    found = shares(robot, start, limits, run)
    print({name: round(float(share), 5) for name, share in found.items()}, run.t[-1])
    assert max(found.values()) <= 1 + 1.1e-3
    # no limit is kept by going slowly: a drive is at its limit, and so is what its table limits
    assert max(v for k, v in found.items() if k.endswith("drive")) > 0.999
    assert max(v for k, v in found.items() if not k.endswith("drive")) > 0.98
    assert not [e for e in run.meta["events"] if e["name"] == "limit_exceeded"]
    assert run.meta["residual_m"] < 5e-3 * run.meta["unshaped_m"]
    for k, place in enumerate(end, 1):
        assert run[f"joint/{k}/position"][-1] == pytest.approx(place, abs=2e-3)


def test_a_small_deflection_takes_its_time():
    limits = {"drive": [0.5], "deflection_m": 0.02}
    run = fx.time_optimal("single-r", [0.0], [1.0], limits, intervals=40)
    assert np.abs(run["link/1/tip_deflection"]).max() <= 0.02 * (1 + KEPT)
    assert 0.7 < run.meta["duration_s"] < 2.0 and not run.meta["events"]


def test_a_run_beyond_a_limit_is_labelled():
    limits = read_limits({"drive": [2.0], "speed": 3.0, "deflection_m": None}, 1)
    for peak, named in ((3.0 * (1 + 0.9 * KEPT), []), (3.1, ["joint/1/velocity"])):
        speed = np.array([0.0, -peak, 0.0])
        run = fx.Run(
            np.array([0.0, 0.1, 0.2]),
            {"joint/1/drive": np.array([1.0, -2.0, 0.0]), "joint/1/velocity": speed},
            {"joint/1/drive": "N m", "joint/1/velocity": "rad/s"},
        )
        events = limits.exceeded(run)
        assert [e["text"].split()[0] for e in events] == named
        assert all(e["t"] == 0.1 and e["name"] == "limit_exceeded" for e in events)


@pytest.mark.parametrize(
    ("limits", "key"),
    [
        ({}, "limits.drive"),
        ({"drive": [1.0], "force": 1.0}, "limits.force"),
        # within these a motion would last thousands of periods
        ({"drive": [1e-7]}, "limits.drive"),
        ({"drive": [0.5], "speed": [1e-4]}, "limits.speed"),
        ({"drive": [0.5], "deflection_m": 1e-6}, "limits.deflection_m"),
    ],
)
def test_wrong_limits_are_named(limits, key):
    with pytest.raises(InputError) as caught:
        fx.time_optimal("single-r", [0.0], [1.0], limits)
    assert caught.value.key == key
