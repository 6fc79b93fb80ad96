"""Derivatives of runs by numbers of the robot file, beside differences of two runs."""

import numpy as np
import pytest

import flexura as fx
from flexura.errors import InputError


@pytest.mark.parametrize(
    "key", ["payload.mass_kg", "link.1.bending_stiffness_N_m2", "link.1.joint.hub_inertia_kg_m2"]
)
def test_a_derivative_is_that_of_differences(key):
    data = fx.load("single-r").to_dict()
    data["link"][0] |= {"damping": {"beta_s": 2e-3}, "elements": 3}
    robot = fx.Robot.from_dict(data)
    t = np.linspace(0.0, 0.4, 201)
    drive = [lambda s: 0.3 * np.sin(2 * np.pi * s / 0.4)]
    found = fx.parameter_derivatives(robot, t, drive, [key])[key]
    value = {"payload.mass_kg": 0.05, "link.1.bending_stiffness_N_m2": 0.5}.get(key, 2e-3)
    h = 1e-3 * value
    up, down = (
        fx.simulate(robot.replace({key: value + s * h}), t, drive, rtol=1e-11) for s in (1, -1)
    )
    for channel in ("joint/1/position", "joint/1/velocity", "link/1/tip_deflection", "tip/y"):
        slope = (up[channel] - down[channel]) / (2 * h)
        assert found[channel] == pytest.approx(slope, abs=2e-4 * np.abs(slope).max()), channel


@pytest.mark.parametrize("key", ["payload.mass_kg", "link.1.length_m"])
def test_a_channel_that_the_parameter_itself_changes(key):
    """A payload changes the shapes of modes, a length the place of the tip."""
    robot = fx.load("single-r").replace({"link.1.elements": 3, "link.1.modes": 1})
    t = np.linspace(0.0, 0.3, 151)
    drive = [lambda s: 0.3 * np.sin(2 * np.pi * s / 0.4)]
    found = fx.parameter_derivatives(robot, t, drive, [key])[key]
    value = robot.value(key)
    h = 1e-3 * value
    up, down = (
        fx.simulate(robot.replace({key: value + s * h}), t, drive, rtol=1e-11) for s in (1, -1)
    )
    for channel in ("link/1/tip_deflection", "tip/x", "tip/y"):
        slope = (up[channel] - down[channel]) / (2 * h)
        assert found[channel] == pytest.approx(slope, abs=2e-4 * np.abs(slope).max()), channel


def test_a_key_that_is_no_number_is_refused():
    with pytest.raises(InputError, match=r"payload\.mass"):
        fx.parameter_derivatives("single-r", [0.0, 0.1], [0.1], "payload.weight")
