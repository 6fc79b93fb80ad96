"""A shaped motion leaves a mode at rest.

Equation (88), one mode: y'' + w^2 y = -G a(t). A cart with the acceleration a carries a link
across its rail; y is the tip's deflection, and G = 1.56598 in the first mode. The acceleration of
a cycloid of length A and duration T is one sine with n = 2 pi / T. It leaves the amplitude

    R = 2 G A n^3 |sin(w T / 2)| / (2 pi w |n^2 - w^2|).

Input shaping for the frequency f multiplies R by |cos(w / (4 f))| (ZV) or by the square of that
(ZVD). See Singer and Seering, J. Dyn. Syst. Meas. Control 112 (1990), 76-82.
"""

import numpy as np

import flexura as fx
from comparison import Comparison
from flexura.signals import cycloid, zv, zvd

LENGTH_M, MASS_KG_M, STIFFNESS_N_M2, WAY_M, TIME_S = 0.6, 0.2355, 0.5, 1e-3, 0.6

cart = {"length_m": 0.01, "mass_kg": 1.0, "joint": {"type": "Pa"}}
strip = {"length_m": LENGTH_M, "elements": 16, "modes": 1}
strip |= {"mass_per_length_kg_m": MASS_KG_M, "bending_stiffness_N_m2": STIFFNESS_N_M2}
strip["joint"] = {"type": "R", "start_rad": np.pi / 2, "locked": True}
system = fx.assemble(fx.Robot.from_dict({"name": "strip on a cart", "link": [cart, strip]}))

b = 1.8751040687119611  # of a cantilever: cos b cosh b = -1
s = (np.sinh(b) - np.sin(b)) / (np.cosh(b) + np.cos(b))
w, n = b**2 * np.sqrt(STIFFNESS_N_M2 / MASS_KG_M) / LENGTH_M**2, 2 * np.pi / TIME_S
mode_Hz = w / (2 * np.pi)
unshaped_m = 2 * (4 * s / b) * WAY_M * n**3 / (2 * np.pi * w)
unshaped_m *= abs(np.sin(w * TIME_S / 2) / (n**2 - w**2))

plain = cycloid(WAY_M, TIME_S)
cases = {
    "cycloid": (plain, 1.0),
    "ZV, right": (zv(plain, mode_Hz), 0.0),
    "ZV, 10 % wrong": (zv(plain, 1.1 * mode_Hz), abs(np.cos(np.pi / 2.2))),
    "ZVD, 10 % wrong": (zvd(plain, 1.1 * mode_Hz), np.cos(np.pi / 2.2) ** 2),
    "ZVD, 30 % wrong": (zvd(plain, 1.3 * mode_Hz), np.cos(np.pi / 2.6) ** 2),
}

show = Comparison(__doc__, bound=2e-6)
t = np.linspace(0, 2.5, 1001)
courses = []
for name, (motion, factor) in cases.items():
    run = fx.simulate(system, t, fx.Drive.prescribed(motion, None), rtol=1e-8)
    tip = run["link/2/tip_deflection"]
    after = t > t[-1] - 2 * np.pi / w  # one period, after all motions have ended
    waves = np.array([np.cos(w * t[after]), np.sin(w * t[after])]).T
    residual = np.linalg.norm(np.linalg.lstsq(waves, tip[after], rcond=None)[0])
    show.add(f"{name}: residual [m]", residual, factor * unshaped_m, scale=unshaped_m)
    courses.append((name, tip))

if show.plot:
    axes = show.axes("time [s]", "tip deflection [mm]")
    for name, tip in courses[:4]:
        axes.plot(t, 1e3 * tip, label=name)
show.end()
