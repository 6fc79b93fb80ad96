"""Tip inversion: the tip follows its path, judged on twice the elements and by open-loop replay."""

import numpy as np
import pytest

import flexura as fx
from flexura.errors import FlexuraError, InputError
from flexura.signals import paths
from flexura.simulation.trajectory.collocation import Mesh
from flexura.simulation.trajectory.zero_dynamics import zero_dynamics


def arm(elements=6, beta=2e-3, **link):
    data = fx.load("single-r").to_dict()
    data["link"][0] |= {"elements": elements, "damping": {"beta_s": beta}} | link
    return fx.Robot.from_dict(data)


def two_links(scale=1, beta=2e-3, elbow=0.6):
    data = fx.load("type-1-rr").to_dict()
    for link in data["link"]:
        link["elements"] *= scale
        link["damping"] = {"beta_s": beta}
    data["link"][1]["joint"]["start_rad"] = elbow
    return fx.Robot.from_dict(data)


def turn(duration):
    return lambda t: np.pi / 2 * paths.smooth_rise(t / duration)


def on_rigid_path(duration, by, elbow=0.6):
    """x and y of the rigid RR robot's tip."""

    def place(t):
        u = paths.smooth_rise(t / duration)
        first = by[0] * u
        second = first + elbow + by[1] * u
        return 0.3 * np.array([np.cos(first) + np.cos(second), np.sin(first) + np.sin(second)])

    return (lambda t: place(t)[0]), (lambda t: place(t)[1])


def replay(robot, run):
    joints = len(robot.links)
    motion = [run[f"joint/{i + 1}/position"] for i in range(joints)]
    return fx.inverse(robot, run.t, motion, rtol=1e-8)


def off_angle(run, path, duration):
    wanted = np.array([path(t) for t in np.clip(run.t, 0.0, duration)])
    angle = np.arctan2(run["tip/y"], run["tip/x"])
    return 0.6e3 * np.abs(angle - wanted).max()


def off_place(run, pair, duration):
    wanted = np.array([[f(t) for f in pair] for t in np.clip(run.t, 0.0, duration)])
    return 1e3 * np.hypot(*(np.column_stack([run["tip/x"], run["tip/y"]]) - wanted).T).max()


@pytest.mark.parametrize(("duration", "most_mm"), [(0.6, 1e-3), (0.45, 1e-2)])
def test_the_bench_arms_tip_turns_by_a_right_angle(duration, most_mm):
    t = np.linspace(0.0, duration, 301)
    run = fx.invert(arm(), t, turn(duration))
    assert run.complete and run.meta["iterations"] <= 10
    assert run.t[0] < -0.1 and run.t[-1] > duration + 0.1
    assert off_angle(run, turn(duration), duration) < most_mm / 10
    assert off_angle(replay(arm(12), run), turn(duration), duration) < most_mm
    # if the joint followed the tip's law, the tip would be off by decimetres
    plain = fx.inverse(arm(12), run.t, [lambda s: turn(duration)(np.clip(s, 0, duration))])
    assert off_angle(plain, turn(duration), duration) > 100


def test_the_drive_takes_the_arm_there_in_an_open_loop():
    t = np.linspace(0.0, 0.6, 301)
    run = fx.invert(arm(), t, turn(0.6))
    from_rest = fx.simulate(arm(12), run.t, [run["joint/1/drive"]], rtol=1e-9)
    assert off_angle(from_rest, turn(0.6), 0.6) < 1e-2


def test_two_flexible_links_follow_the_rigid_robots_path():
    pair = on_rigid_path(0.6, (0.8, -0.5))
    run = fx.invert(two_links(), np.linspace(0.0, 0.6, 301), pair)
    assert run.meta["tip_error_m"] < 1e-7
    assert off_place(replay(two_links(2), run), pair, 0.6) < 1e-3


def test_two_flexible_links_follow_a_quick_path():
    pair = on_rigid_path(0.45, (1.0, -0.7), elbow=0.8)
    run = fx.invert(two_links(elbow=0.8), np.linspace(0.0, 0.45, 301), pair)
    assert run.meta["exact"] and run.meta["tip_error_m"] < 1e-7
    assert off_place(replay(two_links(2, elbow=0.8), run), pair, 0.45) < 1e-3


@pytest.mark.slow
def test_a_bent_arm_does_not_reach_as_far_as_a_straight_one():
    # the same motion from another elbow: the rigid elbow is straight at 0.302 s, the links bent
    t = np.linspace(0.0, 0.45, 301)
    pair = on_rigid_path(0.45, (1.0, -0.7))
    run = fx.invert(two_links(), t, pair)
    (event,) = (e for e in run.meta["events"] if e["name"] == "nearest")
    assert not run.meta["exact"] and "about t = 0.300 s the path passes a singular" in event["text"]
    far = fx.assemble(two_links(2))
    bent = replay(two_links(2), run)
    row = np.abs(bent.t - 0.302).argmin()
    q = bent.states[row, : far.n]

    def reach(elbow):
        q[far.joint_rows[1]] = elbow
        return np.hypot(*fx.tip_pose(far, q)[:2])

    # what the elbow's best angle leaves is what the tip lacks
    short = 0.6 - max(reach(elbow) for elbow in np.linspace(-0.2, 0.2, 801))
    assert short == pytest.approx(1.38e-4, abs=2e-6)
    assert run.meta["tip_error_m"] == pytest.approx(short, abs=2e-6)


@pytest.mark.parametrize("beta", [0.0, 2e-4])
@pytest.mark.parametrize(
    "path",
    [
        paths.line((0.38, 0.1), (0.42, 0.2), 0.6),
        paths.circle((0.35, 0.15), 0.04, 0.6),
        paths.polyline([(0.38, 0.1), (0.42, 0.1), (0.4, 0.15)], 0.9),
    ],
    ids=["line", "circle", "polyline"],
)
def test_a_carriage_with_a_flexible_strip_draws(path, beta):
    data = fx.load("rig").to_dict()
    data["link"][1]["damping"] = {"beta_s": beta}
    robot = fx.Robot.from_dict(data)
    end = float(path[0].breaks[-1])
    run = fx.invert(robot, np.linspace(0.0, end, 301), path)
    assert off_place(run, [lambda t, s=s: s(t)[0] for s in path], end) < 1e-3


def test_a_zero_on_the_axis_is_named():
    data = fx.load("two-link-arm").to_dict()
    data["link"][1]["joint"]["start_rad"] = 0.6
    robot = fx.Robot.from_dict(data)
    start = fx.tip_pose(robot, fx.static(robot))[:2]
    with pytest.raises(FlexuraError, match=r"zero on the imaginary axis.*1\d\d\.\d rad/s"):
        fx.invert(robot, np.linspace(0, 1, 101), paths.line(start, start + [-0.05, 0.05], 1.0))


def test_zeros_are_those_of_the_state_space():
    system = fx.assemble(arm())
    lin = fx.linearize(system)
    c = lin.outlook[[lin.outputs.index("tip/y")]]
    mine = zero_dynamics(lin.M, lin.G, lin.K, c, system.elastic_rows, system.joint_rows).zeros
    theirs = lin.zeros("joint/1/drive", "tip/y")
    assert np.sort_complex(mine[:12]) == pytest.approx(np.sort_complex(theirs[:12]), rel=1e-6)


def test_postures_have_their_tip_where_it_should_be():
    heavy = fx.Robot.from_dict(fx.load("type-1-rr").to_dict() | {"gravity_m_s2": [0.0, -9.81]})
    q = fx.inverse_kinematics(heavy, (0.35, 0.3), joints=[0.2, 0.8])
    system = fx.assemble(heavy)
    assert fx.tip_pose(heavy, q)[:2] == pytest.approx([0.35, 0.3], abs=1e-12)
    assert np.abs((system.elastic(q) + system.gravity(q))[system.elastic_rows]).max() < 1e-10
    assert q[system.joint_rows[1]] > 0 and np.abs(q[system.elastic_rows]).max() > 1e-3
    rows = fx.inverse_kinematics(heavy, [(0.35, 0.3), (0.3, 0.3)], joints=[0.2, 0.8])
    assert rows.shape == (2, system.n) and rows[0] == pytest.approx(q, abs=1e-10)
    with pytest.raises(FlexuraError, match="within reach"):
        fx.inverse_kinematics(heavy, (0.7, 0.0), joints=[0.2, 0.8])


@pytest.mark.parametrize("tip", [(0.3, 0.4), (-0.3, 0.5), (0.6, -0.6), (0.0, 0.1)])
def test_a_stretched_arm_begins_with_its_elbow_to_the_left(tip):
    q = fx.inverse_kinematics("two-link-arm", tip)
    assert fx.tip_pose("two-link-arm", q)[:2] == pytest.approx(tip, abs=1e-12)
    assert q[fx.assemble("two-link-arm").joint_rows[1]] > 0


def test_the_mesh_holds_polynomials_and_their_derivatives():
    mesh = Mesh(np.array([0.0, 0.1, 0.25, 0.3, 0.5, 0.8, 1.0]))
    f = lambda t: np.column_stack([t**5 - t**2, 3 * t**4])
    c = mesh.through(f(mesh.t), f(mesh.nodes[[0, -1]]))
    t = np.linspace(0, 1, 30)
    q, v, a = mesh.at(t, c)
    assert q == pytest.approx(f(t), abs=1e-12)
    assert v[:, 0] == pytest.approx(5 * t**4 - 2 * t, abs=1e-11)
    assert a[:, 0] == pytest.approx(20 * t**3 - 2, abs=1e-10)
    assert [mesh.signal(c[:, 0])(x)[2] for x in t[:-1]] == pytest.approx(a[:-1, 0], abs=1e-9)


def test_derivatives_of_forces_are_those_of_differences():
    system = fx.assemble(two_links())
    n, core = system.n, system.equations
    q, v, a = np.random.default_rng(3).normal(size=(3, 1, n)) * 0.3
    force, by_q, by_v, by_a, tip, tip_by_q = core.force_derivatives(q, v, a)
    at = lambda q, v, a: core.forces(q[0], v[0], a[0], True, True, True)
    assert force[0] == pytest.approx(at(q, v, a), rel=1e-12)
    assert tip[0] == pytest.approx(fx.tip_pose(system, q[0])[:2], abs=1e-14)
    h = 1e-6
    for k, e in enumerate(np.eye(n)):
        up, down = q + h * e, q - h * e
        slope = (at(up, v, a) - at(down, v, a)) / (2 * h)
        assert by_q[0][:, k] == pytest.approx(slope, abs=1e-7 * np.abs(by_q).max())
        slope = (at(q, v + h * e, a) - at(q, v - h * e, a)) / (2 * h)
        assert by_v[0][:, k] == pytest.approx(slope, abs=1e-6 * np.abs(by_v).max())
        places = [fx.tip_pose(system, x[0])[:2] for x in (up, down)]
        assert tip_by_q[0][:, k] == pytest.approx((places[0] - places[1]) / (2 * h), abs=1e-8)
    assert by_a[0] == pytest.approx(system.mass(q[0]), abs=1e-12)


@pytest.mark.parametrize(
    ("tip", "key"),
    [
        ((lambda t: t, lambda t: t), "tip"),
        ("line", "tip"),
        (lambda t: t, "tip"),  # it ends with a velocity
        ([1.0, 2.0, 3.0], "tip"),
    ],
)
def test_wrong_paths_are_refused(tip, key):
    with pytest.raises(InputError) as caught:
        fx.invert(arm(), np.linspace(0.0, 1.0, 11), tip)
    assert caught.value.key.startswith(key)


def test_a_coarse_path_has_the_joints_motion_before_and_after_it():
    run = fx.invert(arm(), [0.0, 0.6], turn(0.6))
    assert run.t[0] < -0.1 and run.t[-1] > 0.7
    assert run.meta["exact"] and run.meta["tip_error_m"] < 1e-6


@pytest.mark.filterwarnings("error")
def test_an_arm_that_is_straight_at_first_bends_its_elbow():
    path = paths.line((0.45, 0.2), (0.4, 0.25), 0.6)
    run = fx.invert("type-1-rr", np.linspace(0.0, 0.6, 121), path)
    assert run.meta["tip_error_m"] < 1e-7 and run["joint/2/position"].min() > 0.3
    right = fx.inverse_kinematics("type-1-rr", (0.45, 0.2), joints=[0.6, -0.6])
    assert right[fx.assemble("type-1-rr").joint_rows[1]] < -0.3


@pytest.mark.filterwarnings("error")
def test_steps_that_overshoot_pass_without_warnings():
    robot = fx.load("type-2-rpa")
    start = fx.tip_pose(robot, fx.static(robot))[:2]
    path = paths.line(start, start + [-0.01, 0.01], 1.0)
    assert fx.invert(robot, np.linspace(0.0, 1.0, 121), path).meta["tip_error_m"] < 1e-7


@pytest.mark.parametrize("place", [(0.9, 0.0), (0.6, 0.0)])
def test_a_place_out_of_reach_is_named(place):
    with pytest.raises(InputError, match=r"tip = \(0\.[69], 0\.0\): expected a place within reach"):
        fx.inverse_kinematics("type-1-rr", place)


def test_the_dissertations_model_is_refused():
    plain = fx.Robot.from_dict(arm().to_dict() | {"stiffening": False})
    with pytest.raises(InputError, match="stiffening"):
        fx.invert(plain, np.linspace(0.0, 1.0, 11), turn(1.0))
