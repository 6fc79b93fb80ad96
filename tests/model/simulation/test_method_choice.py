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
