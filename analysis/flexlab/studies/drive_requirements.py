"""What a motion takes of each drive: force, speed, power and energy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import flexura as fx


@dataclass(frozen=True)
class Effort:
    """One drive over a run. Force [N or N m], speed [m/s or rad/s]; power = force * speed [W],
    positive into the robot.

    `rms` is the root of the mean square over time; `energy_in_J` the integral of the positive
    power, `energy_net_J` of all of it.
    """

    joint: int
    unit: str
    speed_unit: str
    peak: float
    peak_at_s: float
    rms: float
    peak_speed: float
    peak_power_W: float
    energy_in_J: float
    energy_net_J: float


def efforts(run: fx.Run) -> list[Effort]:
    """One row a joint, by the trapezoidal rule on the run's times. Raises InputError for a run
    without drives."""
    joints = [
        int(name.split("/")[1])
        for name in run
        if name.startswith("joint/") and name.endswith("/drive")
    ]
    if not joints or len(run) < 2:
        raise fx.InputError("expected a run of two instants or more with a channel joint/i/drive")
    return [_effort(run, i) for i in joints]


def _effort(run: fx.Run, i: int) -> Effort:
    force, speed = run[f"joint/{i}/drive"], run[f"joint/{i}/velocity"]
    power, k = force * speed, int(np.abs(force).argmax())
    over = lambda values: float(np.trapezoid(values, run.t))
    return Effort(
        joint=i,
        unit=run.units[f"joint/{i}/drive"],
        speed_unit=run.units[f"joint/{i}/velocity"],
        peak=float(force[k]),
        peak_at_s=float(run.t[k]),
        rms=float(np.sqrt(over(force**2) / (run.t[-1] - run.t[0]))),
        peak_speed=float(np.abs(speed).max()),
        peak_power_W=float(power.max()),
        energy_in_J=over(np.maximum(power, 0.0)),
        energy_net_J=over(power),
    )
