"""A column buckles under its payload, and under its own weight.

Equation (51): the second variation of the potential; its geometric stiffness is the axial force.
An upright clamped column loses its stability at these weights:

    payload:      W = pi^2 EI / (4 L^2),
    own weight:   W = (9 / 4) j^2 EI / L^2,    J(j) = 0, Bessel's function of order -1/3.

The second is Greenhill's answer of 1881, W = 7.8373 EI / L^2.
"""

import numpy as np
from scipy.optimize import brentq
from scipy.special import jv

import flexura as fx
from comparison import Comparison

LENGTH_M, STIFFNESS_N_M2, GRAVITY_M_S2, LIGHT_N = 1.2, 3.0, 9.81, 1e-8


def column(own_N: float, payload_N: float) -> fx.System:
    """The upright column with these weights."""
    link = {"length_m": LENGTH_M, "elements": 16, "joint": {"type": "R", "start_rad": np.pi / 2}}
    link["bending_stiffness_N_m2"] = STIFFNESS_N_M2
    link["mass_per_length_kg_m"] = own_N / LENGTH_M / GRAVITY_M_S2
    tables = {"link": [link], "gravity_m_s2": [0.0, -GRAVITY_M_S2]}
    tables["payload"] = {"mass_kg": payload_N / GRAVITY_M_S2}
    return fx.assemble(fx.Robot.from_dict(tables))


def share(system: fx.System) -> float:
    """The share of the weights beyond which there is no stable equilibrium."""
    try:
        fx.static(system)
    except fx.NoEquilibrium as error:
        return error.share
    return 1.0


unit_N = STIFFNESS_N_M2 / LENGTH_M**2
euler_N = np.pi**2 / 4 * unit_N
greenhill_N = 9 / 4 * brentq(lambda x: jv(-1 / 3, x), 1.0, 2.5) ** 2 * unit_N

show = Comparison(__doc__, bound=1e-5)
try_N = 20 * unit_N
show.add("critical payload [N]", try_N * share(column(LIGHT_N, try_N)), euler_N)
show.add("critical own weight [N]", try_N * share(column(try_N, 0.0)), greenhill_N)

if show.plot:
    axes = show.axes("weight [N]", "first frequency [Hz]", ylim=(0, 6))
    weights_N = np.linspace(0.2, greenhill_N, 80)
    for name, critical_N, make in (
        ("payload", euler_N, lambda weight: column(LIGHT_N, weight)),
        ("own weight", greenhill_N, lambda weight: column(weight, 0.0)),
    ):
        stable_N = weights_N[weights_N < 0.9999 * critical_N]
        first_Hz = [fx.frequencies(make(weight), count=1)[0] for weight in stable_N]
        (line,) = axes.plot(stable_N, first_Hz, label=name)
        axes.plot(critical_N, 0, "o", color=line.get_color(), clip_on=False)
    axes.plot([], [], "o", color="0.4", label="analytic critical weight")
show.end()
