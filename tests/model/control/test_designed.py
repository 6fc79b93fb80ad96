"""Gains files of controllers that are designed from the robot."""

import numpy as np
import pytest

import flexura as fx
from flexura.control import Designed, load_controller, load_gains
from flexura.errors import InputError
from flexura.signals import step

LQG = """
[controller]
type = "lqg"
rate_Hz = 500.0
modes = 2
follow = "tips"
measure = ["joint/1/position", "joint/2/position", "link/2/tip_deflection"]
effort_1_N_m = 6.0
effort_2_N_m = 1.2
position_1_rad = 0.01
deflection_m = 0.05
damping_s = 0.02
disturbance_1_N_m = 0.05
torque_max_1_N_m = 2.0
[controller.noise]
"joint/1/position" = 1e-4
"joint/2/position" = 1e-4
"link/2/tip_deflection" = 1e-5
"""
MOVES = [step(0.3), step(-0.2)]


def written(folder, text):
    (folder / "own.toml").write_text(text)
    return folder / "own.toml"


def test_a_file_is_the_call_that_it_names(tmp_path):
    found = load_controller(written(tmp_path, LQG))
    assert isinstance(found, Designed) and found.limits(2) == [2.0, np.inf]
    robot = fx.load("type-1-rr")
    data = robot.to_dict()
    for link in data["link"]:
        link["modes"] = 2
    law, design = fx.lqg(
        fx.Robot.from_dict(data),
        MOVES,
        [6.0, 1.2],
        500.0,
        measure=found.measure,
        limit=[2.0, 1e12],
        follow="tips",
        position=[0.01, 1.0],
        deflection=0.05,
        damping=0.02,
        disturbance=[0.05, 1.0],
        noise=found.noise,
    )
    own = found.sampled(robot, MOVES)
    assert own.rate_Hz == law.rate_Hz == 500.0
    assert np.array_equal(own.function.design.K, design.K)
    assert np.array_equal(own.function.design.L, design.L)
    found.write(tmp_path / "again.toml")
    assert load_controller(tmp_path / "again.toml") == found


def test_a_predictive_one(tmp_path):
    more = "intervals = 24\nspread = 2\nspeed_max_1_rad_s = 8.0\ndeflection_max_m = 0.04\n"
    text = LQG.replace('"lqg"', '"mpc"').replace("damping_s", more + "damping_s")
    law = load_controller(written(tmp_path, text)).sampled(fx.load("type-1-rr"), MOVES).function
    assert law.problem.spread == 2 and len(law.problem.h) == 24
    speeds = np.abs(law.problem.rows[:2]).max(axis=1)  # as shares of their limits
    assert 1 / speeds == pytest.approx([8.0, 1e12]) and len(law.problem.bound) == 4
    assert law.problem.limit == pytest.approx([2.0, 1e12])


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ('"lqg"', '"h-infinity"', "controller.type"),
        ("effort_1_N_m", "efort_1_N_m", "controller.efort_1_N_m"),
        ("deflection_m = 0.05", "deflection_m = 0.0", "controller.deflection_m"),
        ("deflection_m = 0.05", "intervals = 20", "controller.intervals"),
        ("damping_s = 0.02", "damping_s = -1", "controller.damping_s"),
        ("effort_2_N_m = 1.2", "effort_2_N_m = 1e-200", "controller.effort_2_N_m"),
        ("rate_Hz = 500.0", "rate_Hz = 1e11", "controller.rate_Hz"),
        ("modes = 2", "modes = 2.5", "controller.modes"),
        ('"tips"', '"hubs"', "controller.follow"),
        ('measure = ["joint/1/position", ', "measure = [1, ", "controller.measure"),
        ("[controller.noise]", "noise = 1\n[controller.other]", "controller.noise"),
        ("= 1e-5", "= 0", "controller.noise.link/2/tip_deflection"),
        ("[controller.noise]", "[output]\n[controller.noise]", "output"),
    ],
)
def test_a_wrong_file_names_what_is_wrong(tmp_path, old, new, key):
    with pytest.raises(InputError) as caught:
        load_controller(written(tmp_path, LQG.replace(old, new)))
    assert caught.value.key == key and "own.toml" in caught.value.file


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("effort_2_N_m", "effort_2_N", "controller.effort_2_N"),
        ("effort_2_N_m = 1.2\n", "", "controller.effort_2_N_m"),
        ("torque_max_1_N_m", "force_max_1_N", "controller.force_max_1_N"),
        ("torque_max_1_N_m", "torque_max_3_N_m", "controller.torque_max_3_N_m"),
        ("1_N_m = 6.0", "1_N_m = 6.0\neffort_1_N = 6.0", "controller.effort_1_N"),
        ("link/2/tip_deflection", "sensor/gauge", "controller.measure"),
        ('"link/2/tip_deflection" = 1e-5', "", "controller.noise.link/2/tip_deflection"),
        ('"link/2/tip_deflection" = 1e-5', '"tip" = 1', "controller.noise.tip"),
        ("damping_s = 0.02", "damping_s = 1e11", "controller"),
        ('"lqg"', '"mpc"\nintervals = 1', "controller.intervals"),
        ('"lqg"', '"mpc"\nhorizon_s = 0.001', "controller.horizon_s"),
    ],
)
def test_what_does_not_fit_the_robot_is_refused(tmp_path, old, new, key):
    found = load_controller(written(tmp_path, LQG.replace(old, new)))
    with pytest.raises(InputError) as caught:
        found.sampled(fx.load("type-1-rr"), MOVES)
    assert caught.value.key == key and "own.toml" in caught.value.file


def test_the_board_takes_none(tmp_path):
    with pytest.raises(InputError, match="PID"):
        load_gains(written(tmp_path, LQG))
