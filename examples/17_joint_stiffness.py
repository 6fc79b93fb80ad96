"""A proportional gain at the joint is a spring at the root of a link.

Equation (49): gains act like stiffness and damping in an implicit step. A link on a hinge with
the spring k has the frequencies b^2 sqrt(EI / m) / L^2, where with r = k L / EI

    b (cos b sinh b - sin b cosh b) + r (1 + cos b cosh b) = 0.

r = 0 belongs to a pinned link, infinite r to a clamped one. The run begins in the first mode, so
that the joint's angle is a cosine.
"""

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import brentq

import flexura as fx
from comparison import Comparison
from flexura.signals import constant

LENGTH_M, MASS_KG_M, STIFFNESS_N_M2 = 0.6, 0.2355, 0.5

strip = {"length_m": LENGTH_M, "elements": 12, "joint": {"type": "R"}}
strip |= {"mass_per_length_kg_m": MASS_KG_M, "bending_stiffness_N_m2": STIFFNESS_N_M2}
system = fx.assemble(fx.Robot.from_dict({"name": "strip on a hinge", "link": [strip]}))
straight = np.zeros(system.n)


def first_root(r: float) -> float:
    def equation(b: float) -> float:
        bending = b * (np.cos(b) * np.sinh(b) - np.sin(b) * np.cosh(b))
        return bending + r * (1 + np.cos(b) * np.cosh(b))

    return brentq(equation, 1e-6, 1.8751040687, xtol=1e-14)


show = Comparison(__doc__, bound=2e-6)
courses = []
for r in (0.1, 1.0, 10.0):
    gain = r * STIFFNESS_N_M2 / LENGTH_M  # N m/rad
    w = first_root(r) ** 2 * np.sqrt(STIFFNESS_N_M2 / MASS_KG_M) / LENGTH_M**2

    stiffness = system.stiffness()
    stiffness[0, 0] += gain
    squares, shapes = eigh(stiffness, system.mass(straight))
    show.add(
        f"k L / EI = {r:g}: by the matrices [Hz]", np.sqrt(squares[0]) / 2 / np.pi, w / 2 / np.pi
    )

    q0 = 1e-4 * shapes[:, 0] / shapes[0, 0]
    t = np.linspace(0, 2 * np.pi / w, 201)
    drive = fx.Drive.pd([constant(0.0)], kp=[gain], kd=[0.0])
    run = fx.simulate(system, t, drive, q0=q0, rtol=1e-8, method="implicit")
    angle = run["joint/1/position"] / q0[0]
    # A quarter of the period: where the angle passes zero, by linear interpolation.
    k = int(np.flatnonzero(angle[:100] > 0)[-1])
    quarter = t[k] + (t[k + 1] - t[k]) * angle[k] / (angle[k] - angle[k + 1])
    show.add(f"k L / EI = {r:g}: by simulation [Hz]", 0.25 / quarter, w / 2 / np.pi)
    show.add(f"k L / EI = {r:g}: angle / first", angle[-1], 1.0)
    courses.append((r, w, t, angle))

if show.plot:
    axes = show.axes("time [s]", "joint angle / first")
    for r, w, t, angle in courses:
        (line,) = axes.plot(t, angle, label=f"k L / EI = {r:g}")
        axes.plot(t[::20], np.cos(w * t[::20]), "o", markersize=4, color=line.get_color())
    axes.plot([], [], "o", markersize=4, color="0.4", label="analytic")
show.end()
