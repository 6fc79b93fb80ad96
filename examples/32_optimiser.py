"""Any optimiser of Python over a population: the best damping of a joint.

Equation (108). A hub of inertia J on a spring k with viscous friction d is let go at x0. Optimisers
ask for the costs of many candidates at once: these are one `fx.Batch`, which the core advances on
all processors. The cost is the integral of x^2; with w^2 = k / J and the damping ratio z

    cost = x0^2 (1 + 4 z^2) / (4 z w),    least at z = 1/2,    d = sqrt(k J),    cost = x0^2 / w.
"""

import numpy as np
from scipy.integrate import simpson
from scipy.optimize import differential_evolution

import flexura as fx
from comparison import Comparison

INERTIA_KG_M2, STIFFNESS_N_M, START_RAD = 0.02, 2.0, 0.3
FRICTION = "link.1.joint.viscous_friction_N_m_s_rad"

joint = {"type": "R", "hub_inertia_kg_m2": INERTIA_KG_M2, "start_rad": START_RAD}
joint |= {"spring": {"stiffness_N_m_rad": STIFFNESS_N_M}, "viscous_friction_N_m_s_rad": 0.1}
link = {"length_m": 0.3, "mass_kg": 0.0, "inertia_kg_m2": 0.0, "joint": joint}
robot = fx.Robot.from_dict({"name": "a hub on a spring", "link": [link]})
t = np.linspace(0, 5, 2001)


def costs(candidates: np.ndarray) -> np.ndarray:
    """Costs (n,) of candidates (1, n), as `vectorized=True` asks for them."""
    batch = fx.Batch.vary(robot, {FRICTION: candidates[0]})
    return simpson(fx.simulate(batch, t, rtol=1e-8)["joint/1/position"] ** 2, x=t)


best = differential_evolution(
    costs, [(0.02, 1.0)], seed=1, vectorized=True, updating="deferred", maxiter=30, tol=1e-8
)
w = np.sqrt(STIFFNESS_N_M / INERTIA_KG_M2)

show = Comparison(__doc__, bound=1e-4)
show.add("best friction [N m s/rad]", best.x[0], np.sqrt(STIFFNESS_N_M * INERTIA_KG_M2))
show.add("its cost [rad^2 s]", best.fun, START_RAD**2 / w)
for z, found in zip((0.2, 0.8), costs(np.array([[0.2, 0.8]]) * 2 * w * INERTIA_KG_M2), strict=True):
    cost = START_RAD**2 * (1 + 4 * z**2) / (4 * z * w)
    show.add(f"cost at damping ratio {z:g} [rad^2 s]", found, cost)

if show.plot:
    axes = show.axes("friction [N m s/rad]", "cost [rad^2 s]")
    friction = np.linspace(0.05, 0.8, 60)
    axes.plot(friction, costs(friction[None]), label="population")
    axes.plot(best.x, [best.fun], "o", label="found")
show.end()
