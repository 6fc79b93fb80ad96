"""A driven link in python-control: frequency response and margins of a PD loop.

Equation (53). `fx.linearize(robot).to_control()` has the names of drives and channels. A rigid
link of inertia J turns with viscous friction d, so that from torque to angle

    G(s) = 1 / (J s^2 + d s).

With the controller kp + kd s and kd = kp J / d, the loop is kp / (d s): an integrator, whose phase
margin is a right angle at w = kp / d. With kp alone the gain is 1 at w, the phase margin is m:

    w^2 = (-d^2 + sqrt(d^4 + 4 J^2 kp^2)) / (2 J^2),    tan m = d / (J w).
"""

import control
import numpy as np

import flexura as fx
from comparison import Comparison

INERTIA_KG_M2, FRICTION_N_M_S, KP_N_M = 0.02, 0.05, 0.8

joint = {"type": "R", "viscous_friction_N_m_s_rad": FRICTION_N_M_S}
link = {"length_m": 0.5, "mass_kg": 0.0, "inertia_kg_m2": 0.0, "joint": joint}
link["joint"]["hub_inertia_kg_m2"] = INERTIA_KG_M2
robot = fx.Robot.from_dict({"name": "a link with friction", "link": [link]})

plant = fx.linearize(robot).to_control()["joint/1/position", "joint/1/drive"]
J, d, kp = INERTIA_KG_M2, FRICTION_N_M_S, KP_N_M

show = Comparison(__doc__, bound=1e-8)
for omega in (0.5, 5.0, 50.0):
    found, exact = plant(1j * omega), 1 / (-J * omega**2 + 1j * d * omega)
    show.add(f"magnitude at {omega:g} rad/s [rad/(N m)]", abs(found), abs(exact))
    show.add(f"phase at {omega:g} rad/s [rad]", np.angle(found), np.angle(exact))

w = np.sqrt((-(d**2) + np.sqrt(d**4 + 4 * J**2 * kp**2)) / (2 * J**2))
_, margin, _, crossing = control.margin(kp * plant)
show.add("P: crossing [rad/s]", crossing, w)
show.add("P: phase margin [deg]", margin, np.degrees(np.arctan2(d, J * w)))
_, margin, _, crossing = control.margin(control.tf([kp * J / d, kp], [1]) * plant)
show.add("PD: crossing [rad/s]", crossing, kp / d)
show.add("PD: phase margin [deg]", margin, 90.0)

if show.plot:
    at = np.geomspace(0.1, 100, 200)
    axes = show.axes("frequency [rad/s]", "magnitude of the loop", xscale="log", yscale="log")
    axes.plot(at, np.abs(kp * plant(1j * at)), label="P")
    axes.plot(at, np.abs((kp + 1j * at * kp * J / d) * plant(1j * at)), label="PD")
show.end()
