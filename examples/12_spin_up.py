"""A link on a hub is spun up to 6 rad/s: with and without foreshortening.

Equation (7) is the linear line, `stiffening = false`. It has no foreshortening, so that
centrifugal forces do not stiffen it. With the rate w of the hub, small deflections v obey

    w = 0.4 (t - T sin(2 pi t / T) / (2 pi)),    T = 15 s,    N = m w^2 (L^2 - x^2) / 2,
    m (v_tt - w^2 v) + EI v'''' - (N v')' = -m x w_t,

and on the linear line the same without N. This script solves both in four clamped modes. The
linear line diverges at speeds above the first natural frequency, 3.80 rad/s. See Kane, Ryan and
Banerjee, J. Guidance 10 (1987), 139-151; Simo and Vu-Quoc, J. Appl. Mech. 53 (1986), 849-854.
"""

import numpy as np
from numpy.polynomial import Polynomial as P
from scipy.integrate import solve_ivp
from scipy.linalg import eigh

import flexura as fx
from comparison import Comparison

LENGTH_M, MASS_KG_M, STIFFNESS_N_M2, END_S = 10.0, 1.2, 1.4e4, 15.0
HEAVY_KG_M2 = 1e9  # the hub turns as told, whatever the link does
PULSE = 2 * np.pi / END_S


def linear(t: np.ndarray, stiffening: bool) -> np.ndarray:
    """Tip deflection [m] by the linear equation in four clamped modes, from powers of x / L."""
    powers = [P.basis(k) for k in range(2, 10)]
    over = lambda p: p.integ()(1.0)
    matrix = lambda form: np.array([[over(form(p, q)) for q in powers] for p in powers])
    squares, modes = eigh(matrix(lambda p, q: p.deriv(2) * q.deriv(2)), matrix(lambda p, q: p * q))
    squares, modes = squares[:4] * STIFFNESS_N_M2 / MASS_KG_M / LENGTH_M**4, modes[:, :4]
    pull = matrix(lambda p, q: P([0.5, 0, -0.5]) * p.deriv() * q.deriv())
    pull = stiffening * modes.T @ pull @ modes - np.eye(4)
    load = LENGTH_M * modes.T @ [over(P([0, 1]) * p) for p in powers]

    def slopes(time: float, z: np.ndarray) -> np.ndarray:
        speed = 0.4 * (time - np.sin(PULSE * time) / PULSE)
        force = -0.4 * (1 - np.cos(PULSE * time)) * load - speed**2 * pull @ z[:4]
        return np.concatenate([z[4:], force - squares * z[:4]])

    z = solve_ivp(slopes, t[[0, -1]], np.zeros(8), "DOP853", t, rtol=1e-8, atol=1e-10).y
    return modes.sum(axis=0) @ z[:4]


def spun(t: np.ndarray, stiffening: bool, modes: int) -> np.ndarray:
    """Tip deflection [m] by flexura, with so many of the link's own modes."""
    link = {"length_m": LENGTH_M, "elements": 4, "mass_per_length_kg_m": MASS_KG_M}
    link |= {"bending_stiffness_N_m2": STIFFNESS_N_M2, "modes": modes}
    link["joint"] = {"type": "R", "hub_inertia_kg_m2": HEAVY_KG_M2}
    robot = fx.Robot.from_dict({"link": [link], "stiffening": stiffening})
    torque = lambda time: [0.4 * HEAVY_KG_M2 * (1 - np.cos(PULSE * time))]
    run = fx.simulate(robot, t, torque, rtol=1e-7)
    return run["link/1/tip_deflection"]


show = Comparison(__doc__, bound=2e-3)
t = np.linspace(0, 15, 1501)
exact, small = spun(t, True, modes=3), linear(t, True)
show.add("lowest tip deflection [m]", exact.min(), small.min())
show.add("at [s]", t[exact.argmin()], t[small.argmin()])
show.add("lowest, published [m]", exact.min(), -0.57376)
for time_s in (5, 10):
    show.add(f"at {time_s} s [m]", exact[100 * time_s], small[100 * time_s])
early = t[:1001:10]
without, diverging = spun(early, False, modes=2), linear(early, False)
for time_s in (5, 8, 10):
    show.add(f"linear line at {time_s} s [m]", without[10 * time_s], diverging[10 * time_s])

if show.plot:
    axes = show.axes("time [s]", "tip deflection [m]", ylim=(-4, 1))
    axes.plot(t, exact, label="exact line")
    axes.plot(early, without, label="linear line")
    axes.plot(t[::50], small[::50], "o", markersize=4, label="small deflections, stiffened")
show.end()
