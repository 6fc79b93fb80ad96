"""A level link sags under its own weight.

Equation (42): gravity's generalised forces. With the mass per length m, a light link has the tip

    y = -m g L^4 / (8 EI),    slope = -m g L^3 / (6 EI).

A heavy link obeys the equation of large deflections, which this script solves by shooting:

    EI a'' = m g (L - s) cos a,    a(0) = a'(L) = 0,    x' = cos a,    y' = sin a.

The torque that holds the joint is m g times the integral of x over the link.
"""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import flexura as fx
from comparison import Comparison

LENGTH_M, STIFFNESS_N_M2, GRAVITY_M_S2 = 1.0, 1.0, 9.81


def heavy(load: float) -> np.ndarray:
    """x, y, slope of the tip and the integral of x, for L = EI = 1 and load = m g L^3 / EI."""

    def course(curvature: float) -> np.ndarray:
        slopes = lambda s, z: [
            z[1],
            load * (1 - s) * np.cos(z[0]),
            np.cos(z[0]),
            np.sin(z[0]),
            z[2],
        ]
        start = [0, curvature, 0, 0, 0]
        return solve_ivp(slopes, (0, 1), start, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]

    a = course(brentq(lambda curvature: course(curvature)[1], -load, 0, xtol=1e-12))
    return np.array([a[2], a[3], a[0], a[4]])


show = Comparison(__doc__, bound=2e-5)
shapes = []
for load in (1e-3, 2.0, 20.0):
    strip = {"length_m": LENGTH_M, "elements": 12, "joint": {"type": "R"}}
    strip["mass_per_length_kg_m"] = load * STIFFNESS_N_M2 / LENGTH_M**3 / GRAVITY_M_S2
    strip["bending_stiffness_N_m2"] = STIFFNESS_N_M2
    system = fx.assemble(
        fx.Robot.from_dict({"link": [strip], "gravity_m_s2": [0.0, -GRAVITY_M_S2]})
    )
    q = fx.static(system)
    x, y, slope = fx.tip_pose(system, q)
    torque = fx.holding(system)[0]
    analytic = [LENGTH_M, -load / 8, -load / 6, load / 2]
    if load > 0.01:
        analytic = heavy(load) * [1, 1, 1, load]
    for name, found, expected in zip(
        ("x [m]", "y [m]", "slope [rad]", "torque [N m]"), (x, y, slope, torque), analytic
    ):
        show.add(f"m g L^3 / EI = {load:g}: {name}", found, expected)
    shapes.append((load, analytic[:2], *system.line(q, link=1)[:2]))

if show.plot:
    axes = show.axes("x [m]", "y [m]", aspect="equal")
    for load, tip, x, y in shapes:
        (line,) = axes.plot(x, y, label=f"m g L³ / EI = {load:g}")
        axes.plot(*tip, "o", color=line.get_color())
    axes.plot([], [], "o", color="0.4", label="analytic tip")
show.end()
