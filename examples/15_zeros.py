"""Poles and zeros of a free link that is driven at its root.

Equation (56), the transmission zeros. In units of sqrt(EI / m) / L^2

    poles are those of a pinned link:                         i b^2,      tan b = tanh b,
    zeros from torque to angle, those of a clamped link:      i b^2,      cos b cosh b = -1,
    zeros from torque to tip are real:                        +-2 y^2,    tan y = -tanh y.

Zeros with a positive real part limit every feedback of the tip's place.
"""

import numpy as np
from scipy.optimize import brentq

import flexura as fx
from comparison import Comparison

LENGTH_M, MASS_KG_M, STIFFNESS_N_M2 = 0.6, 0.2355, 0.5
UNIT_RAD_S = np.sqrt(STIFFNESS_N_M2 / MASS_KG_M) / LENGTH_M**2

pinned = lambda b: np.sin(b) - np.tanh(b) * np.cos(b)
clamped = lambda b: np.cos(b) + 1 / np.cosh(b)
tip = lambda y: np.sin(y) + np.tanh(y) * np.cos(y)

strip = {"length_m": LENGTH_M, "elements": 32, "joint": {"type": "R"}}
strip |= {"mass_per_length_kg_m": MASS_KG_M, "bending_stiffness_N_m2": STIFFNESS_N_M2}
linear = fx.linearize(fx.Robot.from_dict({"name": "free link", "link": [strip]}))

poles = np.sort(linear.poles.imag)
poles = poles[poles > 1e-3 * UNIT_RAD_S]
angle = np.sort(linear.zeros("joint/1/drive", "joint/1/position").imag)
angle = angle[angle > 0]
place = np.sort(linear.zeros("joint/1/drive", "tip/y").real)
place = place[place > 1e-3 * UNIT_RAD_S]

show = Comparison(__doc__, bound=2e-5)
for k in range(3):
    b = brentq(pinned, np.pi * (k + 1), np.pi * (k + 1.5), xtol=1e-14)
    show.add(f"pole {k + 1} [rad/s]", poles[k], b**2 * UNIT_RAD_S)
for k in range(3):
    b = brentq(clamped, np.pi * k + 1e-9, np.pi * (k + 1), xtol=1e-14)
    show.add(f"zero {k + 1} to the angle [rad/s]", angle[k], b**2 * UNIT_RAD_S)
for k in range(2):
    y = brentq(tip, np.pi * (k + 0.5), np.pi * (k + 1), xtol=1e-14)
    show.add(f"zero {k + 1} to the tip [1/s]", place[k], 2 * y**2 * UNIT_RAD_S)

if show.plot:
    axes = show.axes("frequency [Hz]", "place / torque [m / N m]", xscale="log", yscale="log")
    hertz = np.geomspace(0.5, 60, 600)
    rows = [linear.outputs.index(name) for name in ("joint/1/position", "tip/y")]
    gain = np.array([np.abs(linear.transfer(2j * np.pi * f)[rows, 0]) for f in hertz])
    axes.plot(hertz, LENGTH_M * gain[:, 0], label="angle x length")
    axes.plot(hertz, gain[:, 1], label="tip")
    for k in range(2):
        b = brentq(pinned, np.pi * (k + 1), np.pi * (k + 1.5))
        label = None if k else "analytic pole"
        axes.axvline(b**2 * UNIT_RAD_S / (2 * np.pi), color="0.6", linestyle=":", label=label)
show.end()
