"""A swinging rod takes a payload up and lets it go.

Equations (137) and (138): what is taken up was at rest. A rod turns about an axis without friction,
J its inertia there, and takes up a mass m at its tip, dJ = m L^2. Angular momentum is kept:

    w1 = w J / (J + dJ),    T - T1 = J dJ w^2 / (2 (J + dJ)).

What is let go takes dJ w1^2 / 2 along, and the rod keeps its speed. A force across the tip that
turns with it has brought the rod to speed before: w = F L t / J, by (133) and (134).
"""

import numpy as np

import flexura as fx
from comparison import Comparison

LENGTH_M, MASS_KG, PAYLOAD_KG, FORCE_N, UNTIL_S = 0.5, 0.4, 0.15, 2.0, 0.2
TAKEN_S, GONE_S = 0.5, 0.8
inertia, added = MASS_KG * LENGTH_M**2 / 3, PAYLOAD_KG * LENGTH_M**2

rod = {"length_m": LENGTH_M, "mass_kg": MASS_KG, "inertia_kg_m2": MASS_KG * LENGTH_M**2 / 12}
robot = fx.Robot.from_dict({"link": [rod | {"joint": {"type": "R"}}]})
thrust = fx.signals.piecewise([0.0, UNTIL_S], [FORCE_N, 0.0])
t = np.linspace(0.0, 1.0, 201)
run = fx.simulate(
    robot,
    t,
    rtol=1e-10,
    loads=[fx.Load(link=1, force_N=[0.0, thrust], frame="link")],
    payloads=[fx.PayloadChange(TAKEN_S, PAYLOAD_KG), fx.PayloadChange(GONE_S, 0.0)],
)
before = FORCE_N * LENGTH_M * UNTIL_S / inertia
after = before * inertia / (inertia + added)

show = Comparison(__doc__, bound=1e-8)
speed = run["joint/1/velocity"]
show.add("speed before [rad/s]", speed[t < TAKEN_S][-1], before)
show.add("speed after it is taken up [rad/s]", speed[t > TAKEN_S][0], after)
show.add("speed at the end [rad/s]", speed[-1], after)
lost = inertia * added * before**2 / (2 * (inertia + added))
taken, gone = run.meta["energy_jumps"]
show.add("energy of the impact [J]", taken["impact_J"], lost)
show.add("energy let go [J]", -gone["J"], added * after**2 / 2)
if show.plot:
    axes = show.axes("time [s]", "speed [rad/s]")
    axes.plot(t, speed, label="flexura")
    axes.plot([TAKEN_S, t[-1]], [after, after], ":", label="J w / (J + dJ)")
show.end()
