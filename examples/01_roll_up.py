"""An end moment rolls a link up into a circle.

Equations (2) and (3): the tangent's angle is linear in the unknowns, the place is its integral. A
moment M at the tip gives the constant curvature M / EI, whatever its size. The tip lies at

    x = r sin(L / r),    y = r (1 - cos(L / r)),    r = EI / M.

At M L / EI = 2 pi the link is a closed circle.
"""

import numpy as np

import flexura as fx
from comparison import Comparison

LENGTH_M, STIFFNESS_N_M2 = 0.5, 2.0

strip = {"length_m": LENGTH_M, "elements": 12, "joint": {"type": "R"}}
strip |= {"mass_per_length_kg_m": 0.2, "bending_stiffness_N_m2": STIFFNESS_N_M2}
system = fx.assemble(fx.Robot.from_dict({"name": "strip", "link": [strip]}))

show = Comparison(__doc__, bound=1e-9)
shapes = []
for name, angle in (("1/4 turn", np.pi / 2), ("1/2 turn", np.pi), ("1 turn", 2 * np.pi)):
    q = fx.static(system, tip_moment=angle * STIFFNESS_N_M2 / LENGTH_M)
    pose = fx.tip_pose(system, q)
    radius = LENGTH_M / angle
    show.add(f"{name}: x [m]", pose[0], radius * np.sin(angle), scale=LENGTH_M)
    show.add(f"{name}: y [m]", pose[1], radius * (1 - np.cos(angle)), scale=LENGTH_M)
    show.add(f"{name}: angle [rad]", pose[2], angle)
    shapes.append((name, *system.line(q, link=1)[:2]))

if show.plot:
    axes = show.axes("x [m]", "y [m]", aspect="equal")
    for name, x, y in shapes:
        axes.plot(x, y, label=name)
show.end()
