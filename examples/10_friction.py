"""Coulomb friction stops a cart.

Equations (57) and (28): the friction force is f tanh(v / v0) with v0 = 1 mm/s, and its loss. A
cart of mass m with the first speed u has

    v = v0 asinh(sinh(u / v0) exp(-f t / (m v0))),
    distance until rest = (m / f) (u^2 / 2 + pi^2 v0^2 / 12),    loss = m u^2 / 2.
"""

import numpy as np

import flexura as fx
from comparison import Comparison

MASS_KG, FRICTION_N, SPEED_M_S, SMOOTH_M_S = 2.0, 0.5, 0.6, 1e-3


def speed(t: np.ndarray) -> np.ndarray:
    """v [m/s] at t [s]; sinh(u / v0) is too large for a number, so its logarithm is used."""
    exponent = SPEED_M_S / SMOOTH_M_S - np.log(2) - FRICTION_N * t / (MASS_KG * SMOOTH_M_S)
    small = np.minimum(exponent, 20.0)
    return SMOOTH_M_S * np.where(exponent > 20, exponent + np.log(2), np.arcsinh(np.exp(small)))


cart = {"length_m": 0.0, "mass_kg": MASS_KG}
cart["joint"] = {"type": "Pa", "coulomb_friction_N": FRICTION_N}
robot = fx.Robot.from_dict({"name": "cart", "link": [cart]})
t = np.linspace(0, 3, 301)
run = fx.simulate(robot, t, qd0=[SPEED_M_S], rtol=1e-9)

show = Comparison(__doc__, bound=1e-7)
for time_s in (1.0, 2.0, 2.39, 2.4, 2.41):
    row = round(100 * time_s)
    found = run["joint/1/velocity"][row]
    show.add(f"speed at {time_s} s [m/s]", found, speed(t)[row], scale=max(found, SMOOTH_M_S))
distance = MASS_KG / FRICTION_N * (SPEED_M_S**2 / 2 + np.pi**2 * SMOOTH_M_S**2 / 12)
show.add("distance until rest [m]", run["joint/1/position"][-1], distance)
show.add("loss [J]", run["energy/loss"][-1], MASS_KG * SPEED_M_S**2 / 2)

if show.plot:
    axes = show.axes("time [s]", "speed [m/s]", yscale="log", ylim=(1e-6, 1))
    axes.plot(t, run["joint/1/velocity"], label="simulated")
    axes.plot(t[::6], speed(t[::6]), "o", markersize=4, label="analytic")
show.end()
