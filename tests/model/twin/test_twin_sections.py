"""Sections, damping ratios and deflection sensors: the solver against its twin."""

import numpy as np
import pytest

import flexura as fx
from flexura import signals, twin


@pytest.mark.slow
def test_a_tapered_tube_with_a_damping_ratio_agrees_with_the_twin():
    tube = {"shape": "tube", "wall_m": 0.0005}
    arm = {
        "length_m": 0.5,
        "elements": 8,
        "section": [
            tube | {"at_m": 0.0, "outer_diameter_m": 0.006},
            tube | {"at_m": 0.5, "outer_diameter_m": 0.004},
        ],
        "young_modulus_Pa": 7e10,
        "density_kg_m3": 2700.0,
        "damping": {"ratio": 0.02},
        "sensor": [{"name": "laser", "kind": "deflection", "at_m": 0.35}],
        "joint": {"type": "R", "hub_inertia_kg_m2": 1e-3},
    }
    made = fx.Robot.from_dict({"link": [arm], "payload": {"mass_kg": 0.02}})
    t, drive = np.linspace(0, 0.3, 61), fx.Drive.force(signals.step(0.05))
    own = fx.simulate(made, t, drive)
    other = twin.simulate(made, t, drive, elements=32, step_s=2e-4)
    for name in ("sensor/laser", "link/1/tip_deflection", "tip/x"):
        assert np.abs(own[name] - other[name]).max() < 1e-3 * np.ptp(own[name])
