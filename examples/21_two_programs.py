"""A strip is let go under gravity: flexura, Exudyn, and the series of its modes.

Equation (87): the motion as a sum of modes. A clamped, level strip with a payload is let go
straight. A mode u(x) with u(L) = 1 has the modal mass M and the weight f, the integral of g u
over the mass. For small deflections the tip moves as

    y(t) = - sum of f / (M w^2) (1 - cos(w t))    over the modes,    w = b^2 sqrt(EI / m) / L^2,
    1 + cos b cosh b + r b (cos b sinh b - sin b cosh b) = 0,    r = payload / (m L).

`flexura.twin` builds the same robot in Exudyn, a program of its own.
"""

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

import flexura as fx
from comparison import Comparison
from flexura import twin

LENGTH_M, MASS_KG_M, STIFFNESS_N_M2, PAYLOAD_KG, GRAVITY_M_S2 = 0.6, 0.2355, 25.0, 0.05, 9.81
RATIO = PAYLOAD_KG / (MASS_KG_M * LENGTH_M)


def equation(b: float) -> float:
    return 1 / np.cosh(b) + np.cos(b) + RATIO * b * (np.cos(b) * np.tanh(b) - np.sin(b))


def shape(b: float, x: float) -> float:
    """The mode's place at x = 0 to 1."""
    s = (np.cos(b) + np.cosh(b)) / (np.sin(b) + np.sinh(b))
    return np.cosh(b * x) - np.cos(b * x) - s * (np.sinh(b * x) - np.sin(b * x))


def series(t: np.ndarray) -> np.ndarray:
    """The tip's place [m], from four modes."""
    y = np.zeros_like(t)
    for n in range(4):
        b = brentq(equation, n * np.pi + 1e-9, (n + 1) * np.pi, xtol=1e-14)
        first, second = (
            quad(lambda x, b, k: (shape(b, x) / shape(b, 1)) ** k, 0, 1, args=(b, k))[0]
            for k in (1, 2)
        )
        modal_kg = MASS_KG_M * LENGTH_M * second + PAYLOAD_KG
        force_N = GRAVITY_M_S2 * (MASS_KG_M * LENGTH_M * first + PAYLOAD_KG)
        w = b**2 * np.sqrt(STIFFNESS_N_M2 / MASS_KG_M) / LENGTH_M**2
        y -= force_N / modal_kg / w**2 * (1 - np.cos(w * t))
    return y


strip = {"length_m": LENGTH_M, "elements": 6, "joint": {"type": "R", "locked": True}}
strip |= {"mass_per_length_kg_m": MASS_KG_M, "bending_stiffness_N_m2": STIFFNESS_N_M2}
tables = {"link": [strip], "payload": {"mass_kg": PAYLOAD_KG}}
robot = fx.Robot.from_dict(tables | {"gravity_m_s2": [0.0, -GRAVITY_M_S2]})

t = np.linspace(0, 0.3, 301)
analytic = series(t)
runs = {
    "flexura": fx.simulate(robot, t, start="straight"),
    "Exudyn": twin.simulate(robot, t, start="straight"),
}

show = Comparison(__doc__, bound=2e-3)
size = np.abs(analytic).max()
for name, run in runs.items():
    for row in (50, 150, 300):
        show.add(f"{name}: y at {t[row]} s [m]", run["tip/y"][row], analytic[row], scale=size)
    difference = np.abs(run["tip/y"] - analytic).max()
    show.add(f"{name}: largest difference [m]", difference, 0.0, scale=size)

if show.plot:
    axes = show.axes("time [s]", "y of the tip [mm]")
    for name, style in (("flexura", "-"), ("Exudyn", "--")):
        axes.plot(t, 1e3 * runs[name]["tip/y"], style, label=name)
    axes.plot(t[::10], 1e3 * analytic[::10], "o", markersize=4, label="series of modes")
show.end()
