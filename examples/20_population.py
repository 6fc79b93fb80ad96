"""A thousand pendulums, as one population.

Equation (81): what `rtol` is relative to; for a rigid robot, to a thousandth of the tip's path. A
pendulum that is let go at the amplitude a has the angle q at time t, with Jacobi's function sn:

    sin(q / 2) = k sn(K(k) - w t, k),    k = sin(a / 2),    w = sqrt(g / l).

The bound holds for every pendulum at every time. Errors grow near the upright position, since
neighbouring motions part there.
"""

import numpy as np
from scipy.special import ellipj, ellipk

import flexura as fx
from comparison import Comparison

LENGTH_M, GRAVITY_M_S2, COUNT, RTOL = 0.3, 9.81, 1000, 1e-6

arm = {"length_m": LENGTH_M, "mass_kg": 0.5, "centre_of_mass_m": LENGTH_M}
arm |= {"joint": {"type": "R"}}
robot = fx.Robot.from_dict({"link": [arm], "gravity_m_s2": [0.0, -GRAVITY_M_S2]})

amplitudes = np.linspace(0.1, 3.1, COUNT)
batch = fx.Batch.vary(robot, {"link.1.joint.start": amplitudes - np.pi / 2})
t = np.linspace(0, 10, 201)
found = fx.simulate(batch, t, rtol=RTOL)["joint/1/position"] + np.pi / 2  # (1000, 201)

k2 = np.sin(amplitudes / 2)[:, None] ** 2
sn = ellipj(ellipk(k2) - np.sqrt(GRAVITY_M_S2 / LENGTH_M) * t, k2)[0]
analytic = 2 * np.arcsin(np.sqrt(k2) * sn)
errors = np.abs(found - analytic).max(axis=1) / amplitudes

show = Comparison(__doc__, bound=1e-5)
for k in (0, 250, 500, 750, 999):
    name = f"a = {amplitudes[k]:.3f} rad: angle at 10 s [rad]"
    show.add(name, found[k, -1], analytic[k, -1], scale=amplitudes[k])
show.add("all: largest error / amplitude", errors.max(), 0.0, scale=1.0)

if show.plot:
    axes = show.axes("amplitude [rad]", "largest error in 10 s / amplitude", yscale="log")
    axes.plot(amplitudes, errors, ".", markersize=3, label="a pendulum")
    axes.axhline(RTOL, color="0.4", linestyle="--", label="rtol")
show.end()
