"""A robot as an FMU that another program moves, from step to step.

Equation (100), the accounts of work and losses. fmpy gives the torque of a link's joint, another
one every 10 ms, and the FMU holds it. The torques' work is a sum over the steps,

    W = sum_k u_k (q(t_k+1) - q(t_k)),

and what the link has taken up is its energy and what is lost. The tip is where `simulate` puts it.
"""

import pathlib
import tempfile

import fmpy
import numpy as np

import flexura as fx
from comparison import Comparison
from flexura.interchange import fmu

STEP_S = 0.01
strip = fx.load("single-r").to_dict()
strip["link"][0]["damping"] = {"beta_s": 2e-3}
robot = fx.Robot.from_dict(strip)

t = np.linspace(0.0, 0.6, 61)
torque = 0.3 * np.sin(2 * np.pi * t / 0.6)
inputs = np.array(list(zip(t, torque)), [("time", float), ("joint/1/drive", float)])
energies = ["energy/kinetic", "energy/strain", "energy/loss", "energy/numerical_loss"]
outputs = ["joint/1/position", "tip/x", "tip/y", "energy/work", *energies]

with tempfile.TemporaryDirectory() as folder:
    file = pathlib.Path(folder, "strip.fmu")
    file.write_bytes(fmu(robot, fmi=3, rtol=1e-8))
    found = fmpy.simulate_fmu(
        str(file), stop_time=t[-1], output_interval=STEP_S, input=inputs, output=outputs
    )

work = float(torque[:-1] @ np.diff(found["joint/1/position"]))
taken = sum(float(found[name][-1]) for name in energies)
held = fx.Sampled(lambda now: [torque[round(now / STEP_S)]], 1 / STEP_S)
run = fx.simulate(robot, t, held, rtol=1e-10)

show = Comparison(__doc__, bound=1e-5)
show.add("work of the torques [J]", found["energy/work"][-1], work)
show.add("energy and losses [J]", taken, work)
show.add("tip x at the end [m]", found["tip/x"][-1], run["tip/x"][-1])
show.add("tip y at the end [m]", found["tip/y"][-1], run["tip/y"][-1])
if show.plot:
    axes = show.axes("time [s]", "tip y [m]")
    axes.plot(run.t, run["tip/y"], color="0.6", linewidth=4, label="flexura")
    axes.plot(found["time"], found["tip/y"], label="FMU in fmpy")
show.end()
