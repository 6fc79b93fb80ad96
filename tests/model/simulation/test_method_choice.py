"""What the method "auto" takes where a fast transient hides how long steps may be."""

import numpy as np
import pytest

import flexura as fx


def test_a_fast_transient_at_the_start_does_not_decide_for_the_whole_run():
    """A sleeved link let go straight under gravity: its material's damping dies out in 10 ns, which
    no trial of 60 passes outlasts. Implicit steps, which take under a thousand, have the motion."""
    robot = fx.load("type-8-pbpa").replace({"gravity_m_s2": (0.0, -9.81)})
    motion = fx.signals.polynomial(0.4, 1.0, start=0.35)
    drive = fx.Drive.pd([motion, motion], kp=[320.0, 100.0], kd=[18.0, 5.6])
    t = np.linspace(0.0, 1.0, 51)
    auto = fx.simulate(robot, t, drive, start="straight", max_steps=5000)
    implicit = fx.simulate(robot, t, drive, start="straight", method="implicit")
    assert auto.complete and auto.meta["method"] == "implicit"
    for name in ("joint/1/position", "joint/2/position", "tip/x", "tip/y"):
        assert auto[name] == pytest.approx(implicit[name], abs=1e-6), name


def test_a_long_run_by_the_method_of_a_strong_damper_is_compared_with_others():
    """The joint's gain asks for implicit steps. An undamped link with a heavy payload rings, and
    implicit steps follow it with ten times the evaluations of exponential ones."""
    joint = {"type": "R", "start_rad": 0.3, "hub_inertia_kg_m2": 1.0}
    link = {"length_m": 1.0, "elements": 6, "mass_per_length_kg_m": 1.0, "joint": joint}
    robot = fx.Robot.from_dict(
        {
            "gravity_m_s2": [0.0, -9.81],
            "link": [link | {"bending_stiffness_N_m2": 1e6}],
            "payload": {"mass_kg": 100.0, "inertia_kg_m2": 1.0},
        }
    )
    drive = fx.Drive.pd([fx.signals.cycloid(0.8, 0.8, start=0.3)], kp=[1e6], kd=[1e5])
    t = np.linspace(0.0, 0.3, 4)
    exponential = fx.simulate(robot, t, drive, method="exponential")
    most = 2 * int(exponential.meta["evaluations"])
    auto = fx.simulate(robot, t, drive, max_steps=most)
    assert auto.complete and auto.meta["evaluations"] <= most
    assert auto["tip/y"] == pytest.approx(exponential["tip/y"], abs=1e-6)
