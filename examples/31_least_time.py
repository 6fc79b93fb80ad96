"""The least time from rest to rest, with and without a limit of the speed.

Equation (122). A rigid link of inertia J turns by an angle b under a torque of at most u. The best
is u and then -u, and where its speed is limited to v, a part at that speed between:

    T = 2 sqrt(J b / u),    T = b / v + J v / u.

Found drives are linear in 640 intervals; to reverse one takes an interval.
"""

import numpy as np

import flexura as fx
from comparison import Comparison

INERTIA_KG_M2, ANGLE_RAD, TORQUE_N_M, SPEED_RAD_S = 0.02, 1.2, 0.5, 4.0

joint = {"type": "R", "hub_inertia_kg_m2": INERTIA_KG_M2}
link = {"length_m": 0.5, "mass_kg": 0.0, "inertia_kg_m2": 0.0, "joint": joint}
robot = fx.Robot.from_dict({"name": "a link", "link": [link]})
J, b, u, v = INERTIA_KG_M2, ANGLE_RAD, TORQUE_N_M, SPEED_RAD_S

show = Comparison(__doc__, bound=2e-3)
free = fx.time_optimal(robot, [0.0], [b], {"drive": [u]}, intervals=640)
held = fx.time_optimal(robot, [0.0], [b], {"drive": [u], "speed": [v]}, intervals=640)
show.add("least time [s]", free.meta["duration_s"], 2 * np.sqrt(J * b / u))
show.add("least time, speed limited [s]", held.meta["duration_s"], b / v + J * v / u)
show.add("its largest speed [rad/s]", held["joint/1/velocity"].max(), v)

if show.plot:
    axes = show.axes("time [s]", "speed [rad/s]")
    axes.plot(free.t, free["joint/1/velocity"], label="torque limited")
    axes.plot(held.t, held["joint/1/velocity"], label="torque and speed limited")
show.end()
