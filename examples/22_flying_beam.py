"""A soft beam flies freely in the plane: its centre of mass obeys the force alone.

Equation (39): places and velocities of all points. Two massless sliders at right angles and a
hinge leave the beam free. A force P along x and a torque N act at its lower end until t = s.
Whatever the bending, the centre of mass moves as

    x = P t^2 / (2 m) until s,  then  x = P s (t - s / 2) / m,    y constant,

and the beam keeps the energy P X + N A, where X and A are place and angle of its lower end at s.
The problem is that of Simo and Vu-Quoc, J. Appl. Mech. 53 (1986), 849-863, without stretching.
"""

import numpy as np

import flexura as fx
from comparison import Comparison
from flexura.signals import piecewise

LENGTH_M, MASS_KG_M, STIFFNESS_N_M2 = 1.0, 0.5, 0.3
FORCE_N, TORQUE_N_M, PUSH_S, END_S = 3.0, -0.8, 0.4, 0.8
MASS_KG = MASS_KG_M * LENGTH_M

rail = {"length_m": 3.0, "mass_kg": 0.0, "joint": {"type": "Pa", "angle_rad": np.pi / 2}}
point = {"length_m": 0.0, "mass_kg": 0.0, "joint": {"type": "Pa", "start_m": 1.5}}
beam = {"length_m": LENGTH_M, "elements": 8, "joint": {"type": "R"}}
beam |= {"mass_per_length_kg_m": MASS_KG_M, "bending_stiffness_N_m2": STIFFNESS_N_M2}
system = fx.assemble(fx.Robot.from_dict({"name": "free beam", "link": [rail, point, beam]}))

push, turn = piecewise([0, PUSH_S], [FORCE_N, 0]), piecewise([0, PUSH_S], [TORQUE_N_M, 0])
t = np.linspace(0, END_S, 161)
run = fx.simulate(system, t, fx.Drive.force(push, None, turn), rtol=1e-8)

nodes, weights = np.polynomial.legendre.leggauss(40)
places = (1 + nodes) / 2 * LENGTH_M
lines = [system.line(state[: system.n], 3, places)[:2] for state in run.states]
centre = np.array(lines) @ weights / 2  # (T, 2)

x = FORCE_N / MASS_KG * np.where(t < PUSH_S, t**2 / 2, PUSH_S * (t - PUSH_S / 2))
show = Comparison(__doc__, bound=2e-5)
for row in (40, 80, 120, 160):
    show.add(f"centre of mass at {t[row]:.1f} s: x [m]", centre[row, 0], x[row])
    show.add(f"centre of mass at {t[row]:.1f} s: y [m]", centre[row, 1], centre[0, 1])
at = round(PUSH_S / (t[1] - t[0]))
work = FORCE_N * run["link/3/x"][at] + TORQUE_N_M * run["joint/3/position"][at]
show.add("energy at the end [J]", run["energy/kinetic"][-1] + run["energy/strain"][-1], work)

if show.plot:
    axes = show.axes("x [m]", "y [m]", aspect="equal")
    for row in range(0, 161, 16):
        bent = system.line(run.states[row, : system.n], 3)[:2]
        axes.plot(*bent, color="C0" if t[row] <= PUSH_S else "C1")
    axes.plot(x[::16], np.full(11, centre[0, 1]), "k.", label="centre of mass, analytic")
    axes.plot([], [], color="C0", label="under force and torque")
    axes.plot([], [], color="C1", label="free")
show.end()
