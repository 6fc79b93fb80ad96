"""A rigid pendulum swings through large angles.

Equation (27), the balance of energy: potential energy becomes kinetic energy and back. With the
inertia J about the pivot, the distance l of the centre of mass and the amplitude a, period and
largest rate are

    T = 4 sqrt(J / (m g l)) K(sin(a / 2)),    w^2 = 2 m g l (1 - cos a) / J,

with the complete elliptic integral K of that modulus.
"""

import numpy as np
from scipy.special import ellipk

import flexura as fx
from comparison import Comparison

MASS_KG, CENTRE_M, INERTIA_KG_M2, GRAVITY_M_S2 = 0.5, 0.3, 4e-3, 9.81

pivot_kg_m2 = INERTIA_KG_M2 + MASS_KG * CENTRE_M**2
moment_N_m = MASS_KG * GRAVITY_M_S2 * CENTRE_M

show = Comparison(__doc__, bound=1e-10)
courses = []
for degrees in (30, 120, 170):
    amplitude = np.radians(degrees)
    link = {"length_m": 2 * CENTRE_M, "mass_kg": MASS_KG, "centre_of_mass_m": CENTRE_M}
    link |= {"inertia_kg_m2": INERTIA_KG_M2}
    link["joint"] = {"type": "R", "start_rad": amplitude - np.pi / 2}  # from the vertical downwards
    robot = fx.Robot.from_dict({"link": [link], "gravity_m_s2": [0.0, -GRAVITY_M_S2]})

    period_s = 4 * np.sqrt(pivot_kg_m2 / moment_N_m) * ellipk(np.sin(amplitude / 2) ** 2)
    rate = np.sqrt(2 * moment_N_m * (1 - np.cos(amplitude)) / pivot_kg_m2)
    run = fx.simulate(robot, np.linspace(0, period_s, 201), rtol=1e-10)
    angle = run["joint/1/position"] + np.pi / 2
    for name, row, expected in (("T/4", 50, 0.0), ("T/2", 100, -amplitude), ("T", 200, amplitude)):
        show.add(f"{degrees} deg: angle at {name} [rad]", angle[row], expected, scale=amplitude)
    show.add(f"{degrees} deg: rate at T/4 [rad/s]", run["joint/1/velocity"][50], -rate)
    courses.append((degrees, run.t / period_s, np.degrees(angle)))

if show.plot:
    axes = show.axes("time / period", "angle [deg]")
    for degrees, t, angle in courses:
        axes.plot(t, angle, label=f"amplitude {degrees} deg")
    axes.plot([0.25, 0.5, 0.75], [0, -170, 0], "o", color="0.4", label="analytic, 170 deg")
show.end()
