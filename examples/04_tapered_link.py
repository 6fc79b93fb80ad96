"""A tapered link bends under a tip force.

Equations (9) and (11): the strain energy of an element whose stiffness changes along it. The
height falls linearly from h0 to h1 and the width b is constant, so that EI = E b h^3 / 12. Under a
small tip force P the tip has the deflection w and the slope a,

    w = 12 P / (E b c^3) [ln(h0 / h1) + 2 h1 / h0 - h1^2 / (2 h0^2) - 3 / 2],
    a = 6 P / (E b c^2) (1 - h1 / h0)^2 / h1,    c = (h0 - h1) / L.
"""

import numpy as np

import flexura as fx
from comparison import Comparison

LENGTH_M, WIDTH_M, ROOT_M, MODULUS_PA, FORCE_N = 0.4, 0.02, 0.004, 7.0e10, 1e-3

show = Comparison(__doc__, bound=1e-6)
shapes = []
for ratio in (0.75, 0.5, 0.25):
    link = {
        "length_m": LENGTH_M,
        "elements": 64,
        "section": [
            {"at_m": 0.0, "width_m": WIDTH_M, "height_m": ROOT_M},
            {"at_m": LENGTH_M, "width_m": WIDTH_M, "height_m": ratio * ROOT_M},
        ],
        "young_modulus_Pa": MODULUS_PA,
        "density_kg_m3": 2700.0,
        "joint": {"type": "R"},
    }
    system = fx.assemble(fx.Robot.from_dict({"name": "tapered link", "link": [link]}))
    q = fx.static(system, tip_force=(0.0, FORCE_N))
    _, y, angle = fx.tip_pose(system, q)

    taper = (1 - ratio) * ROOT_M / LENGTH_M
    w = 12 * FORCE_N / (MODULUS_PA * WIDTH_M * taper**3)
    w *= -np.log(ratio) + 2 * ratio - ratio**2 / 2 - 1.5
    a = 6 * FORCE_N / (MODULUS_PA * WIDTH_M * taper**2) * (1 - ratio) ** 2 / (ratio * ROOT_M)
    show.add(f"h1 / h0 = {ratio}: deflection [m]", y, w)
    show.add(f"h1 / h0 = {ratio}: slope [rad]", angle, a)
    shapes.append((ratio, w, *system.line(q, link=1)[:2]))

if show.plot:
    axes = show.axes("x [m]", "deflection [µm]")
    for ratio, w, x, y in shapes:
        (line,) = axes.plot(x, 1e6 * y, label=f"h1 / h0 = {ratio}")
        axes.plot(LENGTH_M, 1e6 * w, "o", color=line.get_color())
    axes.plot([], [], "o", color="0.4", label="closed form")
show.end()
