"""The drives of a polar arm along a given motion.

Equation (59): the row of a joint. For a joint that is held to a motion it gives the drive. A
slider of mass m moves at r along an arm that turns by a, with the inertia J about the pivot:

    torque = (J + m r^2) a'' + 2 m r r' a' + (m_arm L / 2 + m r) g cos a,
    force  = m (r'' - r a'^2 + g sin a).

Both joints move along cycloids; a signal gives its value and two derivatives.
"""

import numpy as np

import flexura as fx
from comparison import Comparison
from flexura.signals import cycloid

LENGTH_M, ARM_KG, SLIDER_KG, GRAVITY_M_S2 = 0.8, 1.5, 0.6, 9.81

arm = {"length_m": LENGTH_M, "mass_kg": ARM_KG, "inertia_kg_m2": ARM_KG * LENGTH_M**2 / 12}
arm["joint"] = {"type": "R"}
slider = {"length_m": 0.0, "mass_kg": SLIDER_KG, "joint": {"type": "Pa", "start_m": 0.2}}
robot = fx.Robot.from_dict({"link": [arm, slider], "gravity_m_s2": [0.0, -GRAVITY_M_S2]})

turn, slide = cycloid(np.pi / 2, 1.0), cycloid(0.7, 0.8, start=0.2)
t = np.linspace(0, 1, 401)
run = fx.inverse(robot, t, [turn, slide])

a, a_t, a_tt = np.array([turn(time) for time in t]).T
r, r_t, r_tt = np.array([slide(time) for time in t]).T
torque = (ARM_KG * LENGTH_M**2 / 3 + SLIDER_KG * r**2) * a_tt + 2 * SLIDER_KG * r * r_t * a_t
torque += (ARM_KG * LENGTH_M / 2 + SLIDER_KG * r) * GRAVITY_M_S2 * np.cos(a)
force = SLIDER_KG * (r_tt - r * a_t**2 + GRAVITY_M_S2 * np.sin(a))

show = Comparison(__doc__, bound=1e-12)
for name, unit, found, analytic in (
    ("torque", "N m", run["joint/1/drive"], torque),
    ("force", "N", run["joint/2/drive"], force),
):
    size = np.abs(analytic).max()
    for row in (100, 200, 300):
        show.add(f"{name} at {t[row]:.2f} s [{unit}]", found[row], analytic[row], scale=size)
    show.add(f"{name}: lowest [{unit}]", found.min(), analytic.min(), scale=size)
    show.add(f"{name}: highest [{unit}]", found.max(), analytic.max(), scale=size)

if show.plot:
    axes = show.axes("time [s]", "drive [N m, N]")
    for name, found, analytic in (
        ("torque", "joint/1/drive", torque),
        ("force", "joint/2/drive", force),
    ):
        (line,) = axes.plot(t, run[found], label=f"{name} ({run.units[found]})")
        axes.plot(t[::20], analytic[::20], "o", markersize=4, color=line.get_color())
    axes.plot([], [], "o", markersize=4, color="0.4", label="textbook")
show.end()
