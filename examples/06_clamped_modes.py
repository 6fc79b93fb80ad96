"""Natural frequencies and modes of a cantilever with a mass at its tip.

Equation (54) gives the frequencies. With the mass per length m and r = payload / (m L) they are

    w = b^2 sqrt(EI / m) / L^2,
    1 + cos b cosh b + r b (cos b sinh b - sin b cosh b) = 0.

Equation (18) scales the modes to unit mass. Without a payload the tip then moves by 2 / sqrt(m L)
in every mode.
"""

import numpy as np
from scipy.optimize import brentq

import flexura as fx
from comparison import Comparison

LENGTH_M, MASS_KG_M, STIFFNESS_N_M2 = 0.6, 0.2355, 0.5


def root(number: int, r: float) -> float:
    """The root b of a mode: between (n - 1) pi and n pi."""

    def equation(b: float) -> float:
        tip = np.cos(b) * np.tanh(b) - np.sin(b)  # all terms are divided by cosh b
        return 1 / np.cosh(b) + np.cos(b) + r * b * tip

    return brentq(equation, (number - 1) * np.pi + 1e-9, number * np.pi, xtol=1e-14)


show = Comparison(__doc__, bound=1e-5)
for r in (0.0, 0.5, 5.0):
    strip = {"length_m": LENGTH_M, "elements": 32, "joint": {"type": "R"}}
    strip |= {"mass_per_length_kg_m": MASS_KG_M, "bending_stiffness_N_m2": STIFFNESS_N_M2}
    payload = {"mass_kg": r * MASS_KG_M * LENGTH_M}
    robot = fx.Robot.from_dict({"name": "cantilever", "link": [strip], "payload": payload})
    for number, hertz in enumerate(fx.frequencies(robot, count=3), 1):
        w = root(number, r) ** 2 * np.sqrt(STIFFNESS_N_M2 / MASS_KG_M) / LENGTH_M**2
        show.add(f"payload / m L = {r:g}: frequency {number} [Hz]", hertz, w / (2 * np.pi))

system = fx.assemble(robot.replace({"payload.mass_kg": 0.0}))
modes = fx.modes(system, count=3)
small = 1e-6  # so that the line is straight to the last digit
shapes = [system.line(small * shape, link=1)[1] / small for shape in modes.shapes.T]
for number, shape in enumerate(shapes, 1):
    tip = 2 / np.sqrt(MASS_KG_M * LENGTH_M)
    show.add(f"mode {number}: tip [1/sqrt(kg)]", abs(shape[-1]), tip)

if show.plot:
    axes = show.axes("x / L", "deflection / that of the tip, no payload")
    for number, shape in enumerate(shapes, 1):
        label = f"mode {number}, {modes.frequencies_Hz[number - 1]:.2f} Hz"
        axes.plot(np.linspace(0, 1, len(shape)), shape / shape[-1], label=label)
show.end()
