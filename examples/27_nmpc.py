"""Predictive control of a cart, which is linear: the optimal cost, and limits.

Equations (131) and (132). Without limits in its way the law is that of a linear regulator, whatever
the horizon: for a mass m at the distance x0 the cost, the integral of (x / p)^2 + (u / e)^2, is

    sqrt(2 m) r^(1/4) q^(3/4) x0^2,    q = 1 / p^2,  r = 1 / e^2.

Far away the force is at its limit, x = u t^2 / (2 m), and then the speed at its own, until the cart
has to brake.
"""

import numpy as np
from scipy.integrate import simpson

import flexura as fx
from comparison import Comparison

MASS_KG, P, E, START_M, RATE_HZ = 0.8, 0.1, 2.0, 0.05, 200.0
LIMIT_N, SPEED_M_S, FAR_M = 1.5, 0.6, 1.0

cart = {"length_m": 0.1, "mass_kg": MASS_KG, "joint": {"type": "Pa"}}
robot = fx.Robot.from_dict({"name": "cart", "link": [cart]})
t = np.linspace(0, 4, 4001)


def course(end: float, **limits: float) -> fx.Run:
    """A run from 0 to a place."""
    ahead = {"intervals": 24, "horizon_s": 1.0, "disturbance": 0.01}
    law = fx.nmpc(robot, [end], E, RATE_HZ, position=P, **ahead, **limits)
    return fx.simulate(robot, t, law, rtol=1e-9)


show = Comparison(__doc__, bound=2e-3)
run = course(START_M)
cost = simpson(
    ((run["joint/1/position"] - START_M) / P) ** 2 + (run["joint/1/drive"] / E) ** 2, x=t
)
show.add("cost", cost, np.sqrt(2 * MASS_KG) * E**-0.5 * P**-1.5 * START_M**2)

run = course(FAR_M, limit=LIMIT_N, speed_limit=SPEED_M_S)
early = np.searchsorted(t, 0.25)
show.add("force at the start [N]", run["joint/1/drive"][0], LIMIT_N)
show.add(
    "place after 0.25 s [m]", run["joint/1/position"][early], LIMIT_N * t[early] ** 2 / 2 / MASS_KG
)
show.add("highest speed [m/s]", run["joint/1/velocity"].max(), SPEED_M_S)
show.add("largest force [N]", np.abs(run["joint/1/drive"]).max(), LIMIT_N)
show.add("end [m]", run["joint/1/position"][-1], FAR_M)
if show.plot:
    axes = show.axes("time [s]", "place [m], speed [m/s], force [N]")
    for name, label in (("position", "place"), ("velocity", "speed"), ("drive", "force")):
        axes.plot(t, run[f"joint/1/{name}"], label=label)
show.end()
