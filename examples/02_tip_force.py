"""A cantilever under a dead tip force takes the shape of the elastica.

Equation (50): static equilibrium under a force P that keeps its direction, across the straight
link. The tip's slope a follows from elliptic integrals of the modulus k:

    p = L sqrt(P / EI) = K(k) - F(f, k),    k^2 = (1 + sin a) / 2,    sin f = 1 / (k sqrt 2),
    x = L sqrt(2 sin a) / p,    y = L (1 - 2 (E(k) - E(f, k)) / p).

See Bisshopp and Drucker, Quarterly of Applied Mathematics 3 (1945), 272-275.
"""

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

import flexura as fx
from comparison import Comparison

LENGTH_M, STIFFNESS_N_M2 = 0.6, 0.5


def elastica(load: float) -> tuple[float, float, float]:
    """x, y [m] and slope [rad] of the tip; load = P L^2 / EI."""

    def too_long(slope: float) -> float:
        m = (1 + np.sin(slope)) / 2  # scipy's parameter is k^2
        return ellipk(m) - ellipkinc(np.arcsin(np.sqrt(0.5 / m)), m) - np.sqrt(load)

    slope = brentq(too_long, 1e-6, np.pi / 2 - 1e-9, xtol=1e-14)
    m = (1 + np.sin(slope)) / 2
    second = ellipe(m) - ellipeinc(np.arcsin(np.sqrt(0.5 / m)), m)
    x, y = np.sqrt(2 * np.sin(slope) / load), 1 - 2 * second / np.sqrt(load)
    return LENGTH_M * x, LENGTH_M * y, slope


strip = {"length_m": LENGTH_M, "elements": 16, "joint": {"type": "R"}}
strip |= {"mass_per_length_kg_m": 0.2355, "bending_stiffness_N_m2": STIFFNESS_N_M2}
system = fx.assemble(fx.Robot.from_dict({"name": "cantilever", "link": [strip]}))

show = Comparison(__doc__, bound=1e-5)
shapes = []
for load in (0.5, 2.0, 10.0):
    q = fx.static(system, tip_force=(0.0, load * STIFFNESS_N_M2 / LENGTH_M**2))
    for name, found, analytic in zip(
        ("x [m]", "y [m]", "slope [rad]"), fx.tip_pose(system, q), elastica(load)
    ):
        show.add(f"P L^2 / EI = {load:g}: {name}", found, analytic)
    shapes.append((load, *system.line(q, link=1)[:2]))

if show.plot:
    axes = show.axes("x [m]", "y [m]", aspect="equal")
    for load, x, y in shapes:
        (line,) = axes.plot(x, y, label=f"P L² / EI = {load:g}")
        axes.plot(*elastica(load)[:2], "o", color=line.get_color())
    axes.plot([], [], "o", color="0.4", label="analytic tip")
show.end()
