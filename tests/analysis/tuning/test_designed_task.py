"""Tuning of controllers that are designed from the robot."""

import numpy as np
import pytest

import flexura as fx
from flexlab.tuning.closed_loop import controller_from_file
from flexlab.tuning.designed_task import DesignedTask, default_bounds
from flexlab.tuning.executor import make_executor
from flexlab.tuning.result import simulate_tuned
from flexlab.tuning.search_space import free_gain
from flexlab.tuning.task import perturbed_robots
from flexura.control import load_controller
from flexura.errors import InputError

FILE = """[controller]
type = "lqg"
rate_Hz = 200.0
follow = "tips"
effort_1_N_m = 1.0
position_1_rad = 0.02
deflection_m = 0.05
damping_s = 0.02
disturbance_1_N_m = 0.02
torque_max_1_N_m = 1.0
"""
MANOEUVRE = """name = "turn"
duration_s = 0.8
output_step_s = 0.01
[[joint]]
motion = { kind = "step", value = 0.5 }
"""
LINK = {
    "length_m": 0.6,
    "elements": 2,
    "modes": 2,
    "mass_per_length_kg_m": 0.2355,
    "bending_stiffness_N_m2": 0.5,
    "damping": {"beta_s": 2e-3},
    "joint": {"type": "R", "hub_inertia_kg_m2": 2e-3},
}


@pytest.fixture
def parts(tmp_path):
    (tmp_path / "own.toml").write_text(FILE)
    (tmp_path / "turn.toml").write_text(MANOEUVRE)
    robot = fx.Robot.from_dict({"link": [LINK], "payload": {"mass_kg": 0.05}})
    asked = fx.load_manoeuvre(tmp_path / "turn.toml", 1)
    return robot, asked, load_controller(tmp_path / "own.toml"), tmp_path / "own.toml"


def test_points_are_designs_of_the_nominal_robot(parts):
    robot, asked, design, _ = parts
    free = (free_gain("position_1_rad", 0.002, 0.2), free_gain("damping_s", 0.002, 0.2))
    task = DesignedTask(perturbed_robots(robot, (1.2,)), asked, design, free)
    assert len(task.controllers) == 2
    points = np.array([task.start(), [1.0, 0.5]])
    with make_executor(task, None, 1) as runs:
        metrics, reached = runs(points, np.full(2, np.inf))
    assert metrics.shape == (2, 2, 10) and np.all(reached == 1.0)
    assert np.isfinite(task.score(metrics, reached)).all()
    assert np.all(metrics[1, :, 6] < metrics[0, :, 6])  # a weak controller bends the link less
    _, response = simulate_tuned(task.systems[0], asked, task.tuned(task.values(points[:1])[0]))
    assert metrics[0, 0, 4] == pytest.approx(response.joints[0, 4], rel=0.02)
    other, _ = simulate_tuned(task.systems[1], asked, design, nominal=robot)
    own, _ = simulate_tuned(task.systems[1], asked, design)
    assert np.abs(other["joint/1/position"] - own["joint/1/position"]).max() > 1e-4
    assert other["joint/1/reference"][-1] == 0.5


def test_what_cannot_be_free_is_refused(parts):
    robot, asked, design, _ = parts
    assert {f.name for f in default_bounds(design)} == {
        "effort_1_N_m",
        "position_1_rad",
        "deflection_m",
        "damping_s",
    }
    for name in ("kp_1_N_m_rad", "modes", "horizon_s"):
        with pytest.raises(InputError, match="weight"):
            DesignedTask((robot,), asked, design, (free_gain(name, 1.0, 2.0),))
    with pytest.raises(InputError, match="above 0"):
        DesignedTask((robot,), asked, design, (free_gain("damping_s", -1.0, 2.0),))
    with pytest.raises(InputError, match="once"):
        DesignedTask((robot,), asked, design, (free_gain("damping_s", 1.0, 2.0),) * 2)


def test_a_file_controls_a_manoeuvre(parts):
    robot, asked, _, file = parts
    law = controller_from_file(fx.assemble(robot), asked, file)
    run = fx.simulate(robot, asked.t, law)
    assert run["joint/1/position"][-1] == pytest.approx(0.5, abs=0.05)
