"""A rigid two-link arm falls freely under gravity.

Equations (40), (41) and (42): mass matrix, bias and gravity in M(q) q'' + h(q, q') + G(q) = 0. For
two uniform rods textbooks have

    a = m1 l1^2 / 3 + m2 l1^2,    b = m2 l2^2 / 3,    c = m2 l1 l2 / 2,
    M11 = a + b + 2 c cos q2,    M12 = b + c cos q2,    M22 = b,
    h1 = -c sin q2 (2 q1' q2' + q2'^2),    h2 = c sin q2 q1'^2,
    G1 = (m1 / 2 + m2) g l1 cos q1 + G2,    G2 = (m2 / 2) g l2 cos(q1 + q2).

SciPy integrates these equations. The simulation of flexura does not form them.
"""

import numpy as np
from scipy.integrate import solve_ivp

import flexura as fx
from comparison import Comparison

(L1, L2), (M1, M2), G = (0.5, 0.3), (0.8, 0.4), 9.81  # m, kg, m/s^2
a, b, c = M1 * L1**2 / 3 + M2 * L1**2, M2 * L2**2 / 3, M2 * L1 * L2 / 2


def textbook(q: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """M (2, 2), h (2,) and G (2,)."""
    cosine, sine = c * np.cos(q[1]), c * np.sin(q[1])
    mass = np.array([[a + b + 2 * cosine, b + cosine], [b + cosine, b]])
    bias = sine * np.array([-(2 * rates[0] + rates[1]) * rates[1], rates[0] ** 2])
    second = M2 * G * L2 / 2 * np.cos(q[0] + q[1])
    return mass, bias, np.array([(M1 / 2 + M2) * G * L1 * np.cos(q[0]) + second, second])


def slopes(t: float, z: np.ndarray) -> np.ndarray:
    mass, bias, gravity = textbook(z[:2], z[2:])
    return np.concatenate([z[2:], np.linalg.solve(mass, -bias - gravity)])


def rod(length: float, mass: float) -> dict:
    link = {"length_m": length, "mass_kg": mass, "inertia_kg_m2": mass * length**2 / 12}
    return link | {"joint": {"type": "R"}}


robot = fx.Robot.from_dict({"link": [rod(L1, M1), rod(L2, M2)], "gravity_m_s2": [0.0, -G]})
system = fx.assemble(robot)

show = Comparison(__doc__, bound=1e-9)
q, rates = np.array([0.7, -1.9]), np.array([2.0, -3.0])
mass, bias, gravity = textbook(q, rates)
for row, column in ((0, 0), (0, 1), (1, 1)):
    name = f"M{row + 1}{column + 1} [kg m^2]"
    show.add(name, system.mass(q)[row, column], mass[row, column])
for row in (0, 1):
    show.add(f"h{row + 1} [N m]", system.bias(q, rates)[row], bias[row])
    show.add(f"G{row + 1} [N m]", system.gravity(q)[row], gravity[row])

t = np.linspace(0, 1.5, 301)
run = fx.simulate(system, t, rtol=1e-10)
z = solve_ivp(slopes, (0, 1.5), np.zeros(4), "DOP853", t, rtol=1e-12, atol=1e-12).y
x, y = (L1 * f(z[0]) + L2 * f(z[0] + z[1]) for f in (np.cos, np.sin))
show.add("x of the tip at 1.5 s [m]", run["tip/x"][-1], x[-1])
show.add("y of the tip at 1.5 s [m]", run["tip/y"][-1], y[-1])

if show.plot:
    axes = show.axes("x [m]", "y [m]", aspect="equal")
    axes.plot(run["tip/x"], run["tip/y"], label="path of the tip")
    axes.plot(x[::15], y[::15], "o", markersize=4, label="textbook, every 75 ms")
show.end()
