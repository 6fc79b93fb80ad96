"""A slider crosses a link that it bends by its weight.

Equation (30): a slider (Pa) rides on the line of the link before it. That link is clamped, level
and light. A slider of weight P at the abscissa s pushes outwards along the link with the force

    F = P sin(a),

where a is the slope at s: that of the elastica of length s under a dead force P at its end,

    s sqrt(P / EI) = K(k) - F(f, k),    k^2 = (1 + sin a) / 2,    sin f = 1 / (k sqrt 2).

The drive holds it with -F. If the slider crosses from s0 to s1, the work of the drive less the
loss is minus the integral of F from s0 to s1. A light link has fast modes: the steps are implicit.
"""

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ellipk, ellipkinc

import flexura as fx
from comparison import Comparison
from flexura.signals import cycloid

LENGTH_M, STIFFNESS_N_M2, SLIDER_KG, GRAVITY_M_S2 = 0.6, 0.5, 0.2, 9.81
WEIGHT_N = SLIDER_KG * GRAVITY_M_S2


def force(s: float) -> float:
    """F [N] at s [m]."""

    def too_long(slope: float) -> float:
        m = (1 + np.sin(slope)) / 2
        arc = ellipk(m) - ellipkinc(np.arcsin(np.sqrt(0.5 / m)), m)
        return arc - s * np.sqrt(WEIGHT_N / STIFFNESS_N_M2)

    return WEIGHT_N * np.sin(brentq(too_long, 1e-9, np.pi / 2 - 1e-9, xtol=1e-14))


rail = {"length_m": LENGTH_M, "elements": 10, "joint": {"type": "R", "locked": True}}
rail |= {"mass_per_length_kg_m": 1e-5, "bending_stiffness_N_m2": STIFFNESS_N_M2}
rail["damping"] = {"beta_s": 0.05}
slider = {"length_m": 0.0, "mass_kg": SLIDER_KG, "joint": {"type": "Pa", "start_m": 0.1}}
robot = fx.Robot.from_dict({"link": [rail, slider], "gravity_m_s2": [0.0, -GRAVITY_M_S2]})
system = fx.assemble(robot)

show = Comparison(__doc__, bound=5e-4)
for s in (0.2, 0.4, 0.6):
    held = fx.holding(system, fx.static(system, joints=[0.0, s]))[1]
    show.add(f"holding force at {s} m [N]", held, -force(s))

t = np.linspace(0, 5, 501)
way = cycloid(0.5, 1.0, start=0.1)
run = fx.simulate(
    system, t, fx.Drive.prescribed(None, way), q0=fx.static(system), method="implicit"
)
work = run["energy/work"][-1] - run["energy/loss"][-1]
show.add("crossing: work less loss [J]", work, -quad(force, 0.1, 0.5)[0])
show.add("crossing: force at 5 s [N]", run["joint/2/drive"][-1], -force(0.5))

if show.plot:
    axes = show.axes("place of the slider [m]", "drive [N]")
    places = np.linspace(0.1, 0.5, 41)
    axes.plot(run["joint/2/position"], run["joint/2/drive"], label="crossing in 1 s")
    axes.plot(places, [-force(s) for s in places], "k--", label="at rest, elastica")
show.end()
