"""Least time from rest to rest: the limit of the drive, and what vibrates after it."""

import numpy as np
import pytest

import flexura as fx
from flexura.errors import InputError


@pytest.mark.slow
def test_the_bench_arm_is_as_quick_as_the_rigid_one_and_then_at_rest():
    robot, most = fx.load("single-r"), 1.0
    run = fx.time_optimal(robot, [0.0], [np.pi / 2], {"drive": [most]})
    inertia = 0.2355 * 0.6**3 / 3 + 0.05 * 0.36 + 2e-3
    assert run.meta["duration_s"] <= 1.03 * 2 * np.sqrt(inertia * np.pi / 2 / most)
    assert run.meta["residual_m"] < 5e-3 * run.meta["unshaped_m"]
    assert np.abs(run["joint/1/drive"]).max() <= most * (1 + 1e-9)
    assert run["joint/1/position"][-1] == pytest.approx(np.pi / 2, abs=1e-3)


@pytest.mark.parametrize(
    ("limits", "key"), [({}, "limits.drive"), ({"drive": [1.0], "force": 1.0}, "limits.force")]
)
def test_wrong_limits_are_named(limits, key):
    with pytest.raises(InputError) as caught:
        fx.time_optimal("single-r", [0.0], [1.0], limits)
    assert caught.value.key == key
