"""A linear-quadratic regulator on a robot of type IV: its cost is known beforehand.

Equation (75), here in continuous time, on the linear model x' = A x + B u. The robot is a rigid
carriage with a rigid arm at the angle b, so that A = [0, 1; 0, 0], B = [0; inverse of M] and

    M = [m1 + m2, -m2 c sin b; -m2 c sin b, J + m2 c^2].

The law u = -K x with K = R^-1 B' P minimises the integral of x' Q x + u' R u. From the start x0
this is x0' P x0, where P solves Riccati's equation. For one mass m at the distance x0

    K = [sqrt(q / r), sqrt(2 m sqrt(q / r))],    cost = sqrt(2 m) r^(1/4) q^(3/4) x0^2,

with the weights q of the place and r of the force.
"""

from collections.abc import Callable

import numpy as np
from scipy.integrate import simpson
from scipy.linalg import solve_continuous_are

import flexura as fx
from comparison import Comparison

CARRIAGE_KG, ARM_KG, CENTRE_M, INERTIA_KG_M2, ANGLE_RAD = 0.6, 0.2, 0.15, 2e-3, 1.0
Q, R = np.diag([1.0, 1.0, 0.0, 0.0]), np.diag([1e-3, 1e-1])

carriage = {"length_m": 0.1, "mass_kg": CARRIAGE_KG, "joint": {"type": "Pa"}}
arm = {"length_m": 0.3, "mass_kg": ARM_KG, "inertia_kg_m2": INERTIA_KG_M2}
arm |= {"centre_of_mass_m": CENTRE_M, "joint": {"type": "R", "start_rad": ANGLE_RAD}}
robot = fx.Robot.from_dict({"name": "rigid robot of type IV", "link": [carriage, arm]})
rest, t = np.array([0.0, ANGLE_RAD]), np.linspace(0, 6, 6001)


def course(robot: fx.Robot, law: Callable, start: np.ndarray) -> tuple[np.ndarray, float]:
    """Deviations (4, T) from a start [m, rad] under a law u = law(x), and the cost."""
    drive = lambda t, place, rate, deflection: law(np.concatenate([place - rest, rate]))
    run = fx.simulate(robot, t, drive, q0=rest + start, rtol=1e-9)
    x = np.array([run[f"joint/{i}/{name}"] for name in ("position", "velocity") for i in (1, 2)])
    x[1] -= ANGLE_RAD
    u = np.array([run["joint/1/drive"], run["joint/2/drive"]])
    return x, simpson(np.sum(x * (Q @ x), axis=0) + np.sum(u * (R @ u), axis=0), x=t)


coupling = -ARM_KG * CENTRE_M * np.sin(ANGLE_RAD)
mass = [[CARRIAGE_KG + ARM_KG, coupling], [coupling, INERTIA_KG_M2 + ARM_KG * CENTRE_M**2]]
A, B = np.eye(4, k=2), np.vstack([np.zeros((2, 2)), np.linalg.inv(mass)])
P = solve_continuous_are(A, B, Q, R)
K = np.linalg.solve(R, B.T @ P)

show = Comparison(__doc__, bound=1e-4)
linear = fx.linearize(robot)
for row, column in ((2, 0), (2, 1), (3, 1)):
    show.add(f"B{row + 1}{column + 1}", linear.B[row, column], B[row, column])
for start in ([1e-4, 0.0], [0.0, 1e-4], [1e-4, -2e-4]):  # small: the robot is not linear
    x, cost = course(robot, lambda x: -K @ x, start)
    show.add(f"cost from {start[0]:g} m, {start[1]:g} rad", cost, x[:, 0] @ P @ x[:, 0])

one = robot.replace({"link.2.joint.locked": True})
m, q, r = CARRIAGE_KG + ARM_KG, Q[0, 0], R[0, 0]
k, d = np.sqrt(q / r), np.sqrt(2 * m * np.sqrt(q / r))
_, cost = course(one, lambda x: [-k * x[0] - d * x[2], 0.0], [0.1, 0.0])
show.add("arm locked: cost from 0.1 m", cost, np.sqrt(2 * m) * r**0.25 * q**0.75 * 0.1**2)

if show.plot:
    axes = show.axes("time [s]", "deviation [0.1 mm, 0.1 mrad]", xlim=(0, 2))
    axes.plot(t, 1e4 * x[0], label="carriage")
    axes.plot(t, 1e4 * x[1], label="arm")
show.end()
