"""The shipped rig's plant: how it is advanced, and what is read from its vibration."""

import math
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from flexlab import rig
from flexlab.board.emulator.emulated import Outputs
from flexlab.rig.axes import motor_axes
from flexlab.rig.emulation import TrueParameters
from flexlab.rig.plant.mechanics import STEP_S
from flexlab.rig.plant.motor import motor_data

ROOT = Path(__file__).resolve().parents[2]
BENCH = rig.load(ROOT / "firmware" / "rig.toml")
AXIS = motor_axes(BENCH.rig)[0]
DATA = motor_data(AXIS)
SAME = TrueParameters()
STIFF = 1e9, 0.0
QUIET = {"emulated__sensor__noise_V": 0.0, "emulated__sensor__drift_V": 0.0}


def run(plant, seconds, outputs, window=STEP_S):
    """Advance a plant; `outputs(t)` gives duty and steps. Returns t, carriage, nut, joint, tip
    deflection."""
    rows = np.empty((round(seconds / window), 5))
    out = Outputs(motor_on=(True, True), stepper_on=True)
    for k in range(len(rows)):
        duty, out.steps = outputs(k * window)
        out.duty = duty, 0.0
        plant.advance(window, out)
        rows[k] = (
            (k + 1) * window,
            plant.positions[0],
            plant.motor.shaft,
            plant.positions[1],
            plant.tip_deflection_m,
        )
    return rows.T


def vibration(t, y, guess):
    """Frequency [Hz] and decay rate [1/s] of a decaying oscillation about a constant, by least
    squares."""

    def residual(p):
        return p[0] * np.exp(-p[3] * t) * np.sin(2 * math.pi * p[2] * t + p[1]) + p[4] - y

    size = np.ptp(y) / 2
    begin = [[size, phase, guess, 0.1, y.mean()] for phase in range(0, 6, 2)]
    fits = [least_squares(residual, each, x_scale=[size, 1, 1, 1, size]) for each in begin]
    return min(fits, key=lambda fit: fit.cost).x[2:4]
