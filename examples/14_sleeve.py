"""A bent link is pushed out of its sleeve.

Equation (36): a link that slides through a sleeve (Pb). The force M^2 / (2 EI) pushes it out, with
the bending moment M at the exit. Here a payload of weight P hangs at the tip of a light, level
link. At the free length d the moment is M = P x with

    d sqrt(P / EI) = K(k) - F(f, k),    k^2 = (1 + sin a) / 2,    sin f = 1 / (k sqrt 2),
    x = sqrt(2 sin(a) EI / P).

The drive holds the link with the opposite force.
"""

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipk, ellipkinc

import flexura as fx
from comparison import Comparison

LENGTH_M, STIFFNESS_N_M2, PAYLOAD_KG, GRAVITY_M_S2 = 1.0, 0.5, 0.1, 9.81
WEIGHT_N = PAYLOAD_KG * GRAVITY_M_S2


def push(d: float) -> float:
    """The force out of the sleeve [N] at the free length d [m]."""

    def too_long(slope: float) -> float:
        m = (1 + np.sin(slope)) / 2
        arc = ellipk(m) - ellipkinc(np.arcsin(np.sqrt(0.5 / m)), m)
        return arc - d * np.sqrt(WEIGHT_N / STIFFNESS_N_M2)

    slope = brentq(too_long, 1e-9, np.pi / 2 - 1e-9, xtol=1e-14)
    moment = WEIGHT_N * np.sqrt(2 * np.sin(slope) * STIFFNESS_N_M2 / WEIGHT_N)
    return moment**2 / (2 * STIFFNESS_N_M2)


rod = {"length_m": LENGTH_M, "elements": 6, "joint": {"type": "Pb", "start_m": 0.5}}
rod |= {"mass_per_length_kg_m": 1e-7, "bending_stiffness_N_m2": STIFFNESS_N_M2}
tables = {"link": [rod], "payload": {"mass_kg": PAYLOAD_KG}}
system = fx.assemble(fx.Robot.from_dict(tables | {"gravity_m_s2": [0.0, -GRAVITY_M_S2]}))

show = Comparison(__doc__, bound=1e-5)
lengths = (0.2, 0.4, 0.6, 0.8)
held = [fx.holding(system, fx.static(system, joints=[d]))[0] for d in lengths]
for d, force in zip(lengths, held):
    show.add(f"drive at d = {d} m [N]", force, -push(d))

if show.plot:
    axes = show.axes("free length [m]", "force out of the sleeve [N]")
    d = np.linspace(0.05, 1.0, 96)
    axes.plot(d, [push(length) for length in d], label="M² / 2EI, elastica")
    axes.plot(lengths, [-force for force in held], "o", label="flexura")
    axes.plot(
        d, (WEIGHT_N * d) ** 2 / (2 * STIFFNESS_N_M2), "--", color="0.6", label="small deflections"
    )
show.end()
