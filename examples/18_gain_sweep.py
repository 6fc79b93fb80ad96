"""Many gains on one joint: the overshoot of a step.

Equation (58) with one unknown: J q'' = kp (1 - q) - kd q'. A batch has one arm with many gains.
With the damping ratio z = kd / (2 sqrt(kp J)) and w = sqrt(kp / J)

    overshoot = exp(-pi z / sqrt(1 - z^2)),    time of the peak = pi / (w sqrt(1 - z^2)).
"""

import numpy as np

import flexura as fx
from comparison import Comparison
from flexura.signals import constant

INERTIA_KG_M2, GAIN_N_M = 0.02, 8.0

arm = {"length_m": 0.4, "mass_kg": 0.0, "inertia_kg_m2": INERTIA_KG_M2, "joint": {"type": "R"}}
robot = fx.Robot.from_dict({"name": "rigid arm", "link": [arm]})
ratios = np.linspace(0.05, 0.95, 19)
w = np.sqrt(GAIN_N_M / INERTIA_KG_M2)
rates = [2 * z * np.sqrt(GAIN_N_M * INERTIA_KG_M2) for z in ratios]
drives = [fx.Drive.pd([constant(1.0)], kp=[GAIN_N_M], kd=[kd]) for kd in rates]


def peak(t: np.ndarray, channels: dict[str, np.ndarray]) -> dict[str, float]:
    """Overshoot and its time, by the parabola through the largest value and its neighbours."""
    angle = channels["joint/1/position"]
    k = int(angle.argmax())
    before, most, after = angle[k - 1 : k + 2]
    shift = (before - after) / (before - 2 * most + after) / 2
    return {"height": most - (before - after) * shift / 4 - 1, "at_s": t[k] + shift * (t[1] - t[0])}


t = np.linspace(0, 0.6, 1201)
batch = fx.Batch.of([(robot, drive) for drive in drives])
found = fx.simulate(batch, t, rtol=1e-9, reduce=peak)

show = Comparison(__doc__, bound=1e-5)
root = np.sqrt(1 - ratios**2)
heights, times = np.exp(-np.pi * ratios / root), np.pi / w / root
for k in (1, 5, 9, 13):
    show.add(f"z = {ratios[k]:.2f}: overshoot [rad]", found["height"][k], heights[k])
    show.add(f"z = {ratios[k]:.2f}: time of the peak [s]", found["at_s"][k], times[k])
show.add(
    "19 overshoots: largest error [rad]",
    np.abs(found["height"] - heights).max(),
    0.0,
    scale=1,
)

if show.plot:
    axes = show.axes("damping ratio", "overshoot [rad]")
    axes.plot(ratios, heights, label="analytic")
    axes.plot(ratios, found["height"], "o", markersize=4, label="simulated")
show.end()
