"""An LQG controller of a rigid arm: margins of its loop in closed form.

Equations (128), (129) and (130), here nearly in continuous time, for one moment of inertia J. The
regulator's and the filter's poles are those of Butterworth at the speeds

    a = sqrt(u / (p J)),    b = sqrt(d / (v J)),

with the deviations p of the position and u of the torque that count alike, and the standard
deviations d of what disturbs the torque and v of the measured position. The loop is

    l(s) = a b (sqrt(2) (a + b) s + a b) / (s^2 (s^2 + sqrt(2) (a + b) s + (a + b)^2)).

Its margins follow from roots of polynomials.
"""

import numpy as np

import flexura as fx
from comparison import Comparison
from flexura.control import loop_figures

J, P, U, D, V, RATE_HZ = 0.05, 0.1, 2.0, 0.02, 1e-3, 2e4

link = {"length_m": 0.4, "mass_kg": 0.2, "centre_of_mass_m": 0.0, "inertia_kg_m2": J}
robot = fx.Robot.from_dict({"name": "rigid arm", "link": [link | {"joint": {"type": "R"}}]})
law, design = fx.lqg(robot, [0.0], U, RATE_HZ, position=P, disturbance=D, noise=V)
margins = loop_figures(design).margins[0]

a, b = np.sqrt(U / (P * J)), np.sqrt(D / (V * J))
above = np.polynomial.Polynomial([a * b, np.sqrt(2) * (a + b)]) * a * b
below = np.polynomial.Polynomial([0, 0, (a + b) ** 2, np.sqrt(2) * (a + b), 1])


def loop(s: complex) -> complex:
    """l(s)."""
    return above(s) / below(s)


def squared(p: np.polynomial.Polynomial) -> np.polynomial.Polynomial:
    """|p(j w)|^2 as a polynomial in w."""
    at = p.coef * 1j ** np.arange(len(p.coef))
    return np.polynomial.Polynomial(at.real) ** 2 + np.polynomial.Polynomial(at.imag) ** 2


def positive(roots: np.ndarray) -> np.ndarray:
    """Those that are real and above 0."""
    return roots[(np.abs(roots.imag) < 1e-9 * np.abs(roots)) & (roots.real > 0)].real


(crossover,) = positive((squared(above) - squared(below)).roots())
phase = np.angle(-loop(1j * crossover))
# the imaginary part of above(j w) times the conjugate of below(j w), over w^3
c = np.sqrt(2) * (a + b)
turn = np.sqrt((a + b) ** 2 - a * b)
high = -1 / loop(1j * turn).real
w = np.geomspace(0.1, 1e4, 400_001)
S = 1 / (1 + loop(1j * w))

show = Comparison(__doc__, bound=1e-4)
show.add("regulator: fastest pole [1/s]", np.abs(np.log(design.poles)).max() * RATE_HZ, a)
show.add("filter: fastest pole [1/s]", np.abs(np.log(design.observer_poles)).max() * RATE_HZ, b)
show.add("crossover [Hz]", margins.crossover_Hz, crossover / (2 * np.pi))
show.add("phase margin [rad]", margins.phase_rad, abs(phase))
show.add("delay margin [s]", margins.delay_s, phase / crossover)
show.add("highest gain", margins.gain[1], high)
show.add("peak of the sensitivity", margins.sensitivity, np.abs(S).max())
show.add("disc margin", margins.disc, 1 / np.abs(S - 0.5).max())
if show.plot:
    response = loop_figures(design).responses[0].values
    axes = show.axes("real part", "imaginary part", xlim=(-3, 1), ylim=(-2, 2))
    axes.plot(response.real, response.imag, label="flexura")
    axes.plot(loop(1j * w).real, loop(1j * w).imag, "--", label="closed form")
    axes.plot([-1], [0], "+", color="black")
show.end()
