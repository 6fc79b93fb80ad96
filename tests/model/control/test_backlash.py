"""Joints behind backlash: the core's contact against the Python one, and a wheel between flanks."""

import dataclasses

import numpy as np
import pytest

import flexura as fx
from flexura import signals
from flexura.control import Backlash, Contact

WHEEL = {"length_m": 0.0, "elements": 0, "mass_kg": 1.0, "inertia_kg_m2": 2e-3}


def wheel():
    link = WHEEL | {"joint": {"type": "R"}}
    return fx.Robot.from_dict({"name": "wheel", "link": [link]})


def test_a_wheel_swings_between_its_flanks():
    """Half a period at a flank, pi sqrt(J / k), and b / v from flank to flank, without a loss."""
    inertia, k, play, v = 2e-3, 50.0, 0.02, 0.5
    gear = Backlash((Contact(signals.constant(0.3), play, k),))
    half = np.pi * np.sqrt(inertia / k) + play / v
    t = half * np.arange(9)
    run = fx.simulate(wheel(), t, gear, q0=[0.3], qd0=[v], rtol=1e-9)
    np.testing.assert_allclose(run["joint/1/position"], 0.3, atol=1e-6)
    np.testing.assert_allclose(run["joint/1/velocity"], v * (-1.0) ** np.arange(9), rtol=1e-5)


def test_the_core_computes_what_python_computes():
    robot = fx.load("rig-r")
    q0 = np.zeros(fx.assemble(robot).n)
    gear = Backlash((Contact(signals.harmonic(0.3, 1.5), 2e-3, 400.0, 0.4),))
    t = np.linspace(0, 0.5, 101)
    run = fx.simulate(robot, t, gear, q0=q0, rtol=1e-7)
    x, v = run["joint/1/position"], run["joint/1/velocity"]
    forces = [gear(*row, 0.0)[0] for row in zip(t, x[:, None], v[:, None], strict=True)]
    assert np.ptp(forces) > 0.1 and 0.0 in forces
    np.testing.assert_allclose(run["joint/1/drive"], forces, atol=1e-9)
    plain = fx.simulate(robot, t, lambda t, x, v, tip: gear(t, x, v, tip), q0=q0, rtol=1e-7)
    assert np.abs(plain["joint/1/position"] - x).max() < 1e-5 * np.ptp(x)


def test_what_is_wrong_is_refused():
    contact = Contact(signals.constant(0.0), 1e-3, 400.0)
    with pytest.raises(fx.InputError, match="1 contacts or None"):
        fx.simulate(wheel(), [0.0, 0.1], Backlash((contact, None)))
    for key, value in (("play", -1e-3), ("stiffness", np.nan), ("motion", lambda t: t)):
        with pytest.raises(fx.InputError, match=key):
            dataclasses.replace(contact, **{key: value})
