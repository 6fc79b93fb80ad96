"""A measured robot fitted to one of its step runs, and judged on all others.

Three numbers are fitted: the strip's modulus, its damping ratio, and the gauge's gain. The gauge's
filter is the maker's: of second order, 2 Hz, damping ratio 0.9 (`wcfa` and `zetaf` in
`lqr_full_10deg.mat`). It is why the measured gauge follows 0.1 s late.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import flexura as fx

from ..identification import Identification, identify_robot
from .measured import GAUGE, Measured, ring

FIT_ON = "lqg_step_10deg"
FILTER = {f"{GAUGE}.cutoff_Hz": 2.0, f"{GAUGE}.cutoff_ratio": 0.9}
DAMPING_RATIO = 0.1  # to begin with


@dataclass(frozen=True)
class Predicted:
    """One run by the fitted robot: `ring_Hz` measured, `simulated_Hz` predicted, `rms_of_peak` the
    RMS deviation of the gauge by its largest measured value, `gauge` (T,) as predicted [rad]."""

    name: str
    ring_Hz: float
    simulated_Hz: float
    rms_of_peak: float
    gauge: np.ndarray

    @property
    def deviation(self) -> float:
        """The predicted ring against the measured one, relative."""
        return self.simulated_Hz / self.ring_Hz - 1


@dataclass(frozen=True)
class MeasuredFit:
    """The fit to run `name`, and its predictions of all runs."""

    name: str
    found: Identification
    runs: tuple[Predicted, ...]


def angle_per_strain(robot: fx.Robot) -> float:
    """What the maker's conversion makes of a strain: L / (3 e), with e the gauge's distance [rad].

    Raises:
        InputError: the robot has no such sensor.
    """
    link = robot.links[0]
    gauge = next((s for s in link.sensor if f"sensor/{s.name}" == GAUGE), None)
    if gauge is None or not gauge.distance_m:
        raise fx.InputError(
            'expected a sensor of kind "strain" with the name strain_gauge',
            key="link[1].sensor",
            file=robot.name,
        )
    return link.length_m / (3 * abs(gauge.distance_m))


def measured_fit(
    robot: fx.Robot,
    found: Sequence[Measured],
    name: str | None = None,
    progress: Callable[[float], None] = lambda fraction: None,
) -> MeasuredFit:
    """Fit the robot to one run, and predict all.

    Args:
        robot: one flexible link on a joint R, with a strain sensor `strain_gauge`.
        found: the runs.
        name: of the run that is fitted, or how it begins; None: the first 10 degree step under LQG,
            or without one the first run.
        progress: called with the finished fraction.

    Returns:
        The fit.

    Raises:
        InputError: no such run, or no such sensor.
    """
    per_strain = angle_per_strain(robot)
    chosen = next((m for m in found if m.name.startswith(name or FIT_ON)), None)
    if chosen is None and name is not None:
        names = ", ".join(m.name for m in found)
        raise fx.InputError(f"expected one of {names}", key="--fit-on", value=name)
    chosen = chosen or found[0]
    fitted = identify_robot(
        robot,
        chosen.experiment,
        {
            "link.1.young_modulus_Pa": None,
            "link.1.damping.ratio": DAMPING_RATIO,
            f"{GAUGE}.gain": per_strain,
        },
        fix=FILTER,
        channels=[GAUGE],
        progress=lambda fraction: progress(0.6 * fraction),
    )
    runs = []
    for k, m in enumerate(found, 1):
        t, y = m.experiment.t, m.experiment[GAUGE]
        z = fitted.readings(m.experiment)[GAUGE]
        rms = float(np.sqrt(np.mean((z - y) ** 2)) / np.abs(y).max())
        runs.append(Predicted(m.name, m.ring_Hz, ring(t, z), rms, z))
        progress(0.6 + 0.4 * k / len(found))
    return MeasuredFit(chosen.name, fitted, tuple(runs))


def numbers(fit: MeasuredFit) -> dict[str, Any]:
    """The figures for JSON."""
    return {
        "fitted_on": fit.name,
        "parameters": [
            {"name": q.name, "unit": q.unit, "value": q.value, "low": q.low, "high": q.high}
            for q in fit.found.quantities
        ],
        "fixed": FILTER,
        "findings": list(fit.found.findings),
        "runs": [
            {
                "run": p.name,
                "ring_Hz": p.ring_Hz,
                "simulated_Hz": p.simulated_Hz,
                "deviation": p.deviation,
                "rms_of_peak": p.rms_of_peak,
            }
            for p in fit.runs
        ],
    }
