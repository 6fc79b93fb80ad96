"""A tip that turns by a right angle in 0.6 s, and rests before and after.

Equation (116), stable inversion. The joint begins before the tip does. How far it moves before the
path begins, from one time to an earlier one, falls with the slowest zero z > 0 of (56):

    ln(q(t_1) / q(t_2)) = z (t_1 - t_2),      zeros of a free link with a mass at its tip.

A run of a mesh that is twice as fine, under the drives alone, shows that the tip stays on its path.
"""

import numpy as np

import flexura as fx
from comparison import Comparison

DURATION_S, LENGTH_M = 0.6, 0.6
strip = fx.load("single-r").to_dict()
strip["link"][0]["damping"] = {"beta_s": 2e-3}
robot = fx.Robot.from_dict(strip)

path = lambda t: np.pi / 2 * fx.signals.paths.smooth_rise(t / DURATION_S)
run = fx.invert(robot, np.linspace(0.0, DURATION_S, 301), path)

zeros = fx.linearize(robot).zeros("joint/1/drive", "tip/y")
slowest = zeros.real[zeros.real > 0].min()
early, late = np.searchsorted(run.t, [-0.12, -0.06])
moved = np.abs(run["joint/1/position"][[early, late]])
rate = np.log(moved[1] / moved[0]) / (run.t[late] - run.t[early])

strip["link"][0]["elements"] *= 2
finer = fx.simulate(fx.Robot.from_dict(strip), run.t, [run["joint/1/drive"]], rtol=1e-9)
angle = np.arctan2(finer["tip/y"], finer["tip/x"])
wanted = np.array([path(t) for t in np.clip(run.t, 0.0, DURATION_S)])

show = Comparison(__doc__, bound=1e-3)
show.add("rate before the path [1/s]", rate, slowest)
show.add("reached angle, drives alone [rad]", angle[-1], np.pi / 2)
show.add("1 + largest deviation [rad]", 1 + np.abs(angle - wanted).max(), 1.0)
if show.plot:
    axes = show.axes("t [s]", "angle [rad]")
    axes.plot(run.t, wanted, label="asked of the tip")
    axes.plot(run.t, angle, "--", label="the tip of twice the elements, drives alone")
    axes.plot(run.t, run["joint/1/position"], label="joint")
show.end()
