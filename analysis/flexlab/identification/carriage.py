"""Joint 1: its friction from voltage and motor speed.

The motor turns a reflected mass of 100 kg, which the strip hardly moves. Joint 1 is therefore
identified by itself, as a rigid body on a rail:

    (m + J/r^2) v' = F_V u(t - tau) - c v - F_c tanh(v / v_0)

It is simulated natively and fitted in v; tau is the time from a voltage's report to its current.
Samples below 5 mm/s or less than 2 mm after a reversal are left out, because stiction and backlash
act there.
"""

from __future__ import annotations

import numpy as np

import flexura as fx
from flexura.errors import InputError
from flexura.signals import COLUMNS, Signal

from ..comparison.replay.lead_screw import backlash_output
from ..comparison.replay.simulate_experiment import hold_midpoints
from ..comparison.replay.smoothing import recorded_samples, resolution
from ..recordings.unit_conversion import velocity
from ..rig.plant.motor import JointLine
from .estimate import Estimate, Parameter, estimate

SLIDING_M_S, CLEAR_AFTER_REVERSAL_M = 5e-3, 2e-3
MIN_SAMPLES = 200  # that slide
# the supply is measured through a divider, the motor's constant is that of the data sheet
VOLTAGE_UNCERTAINTY = 0.005
CORRELATION_S = 0.4


def fit(
    experiment: fx.Run, robot: fx.Robot, line: JointLine, dead_zone_V: float, rtol: float = 1e-5
) -> Estimate:
    """Fit joint 1's friction.

    Args:
        experiment: the run.
        robot: the robot of its files.
        line: joint 1 by the rig file, where the fit starts.
        dead_zone_V: dead zone of the motor's bridge [V].
        rtol: tolerance of the simulations.

    Returns:
        Coulomb friction [N], viscous coefficient with the back-EMF [N s/m], and delay [s].

    Raises:
        InputError: too few samples slide.
    """
    t, x = recorded_samples(experiment.t, experiment["joint/1/position"], "joint/1/position")
    times, volts = recorded_samples(experiment.t, experiment["joint/1/voltage"], "joint/1/voltage")
    drive = hold_midpoints(
        times, line.force_N_V * np.sign(volts) * np.maximum(np.abs(volts) - dead_zone_V, 0.0)
    )
    measured = velocity(t, x)
    clear = np.abs(x - backlash_output(x, CLEAR_AFTER_REVERSAL_M)) > 0.49 * CLEAR_AFTER_REVERSAL_M
    weight = np.where(clear & (np.abs(measured) > SLIDING_M_S), 1 / _noise(t, x), 0.0)
    if (weight > 0).sum() < MIN_SAMPLES:
        expected = (
            f"expected at least {MIN_SAMPLES} samples faster than {SLIDING_M_S:g} m/s and "
            f"{CLEAR_AFTER_REVERSAL_M:g} m after a turn"
        )
        raise InputError(expected, key="joint/1/position", value=int((weight > 0).sum()))

    def model(values: dict[str, float]) -> np.ndarray:
        force = drive.segments * np.where(np.arange(COLUMNS) == 1, values.get("voltage", 1.0), 1.0)
        force[:, 0] += values["voltage_delay_s"]
        run = fx.simulate(_rail(robot, line, values), t, fx.Drive.force(Signal(force)), rtol=rtol)
        return np.nan_to_num((velocity(t, run["joint/1/position"]) - measured) * weight)[None, :]

    parameters = (
        Parameter("coulomb_N", line.coulomb_N, 0.01, (line.coulomb_N / 10, 10 * line.coulomb_N)),
        Parameter(
            "viscous_N_s_m",
            line.viscous_N_s_m,
            0.01,
            (line.viscous_N_s_m / 10, 10 * line.viscous_N_s_m),
        ),
        Parameter("voltage_delay_s", 1e-3, 2e-4, (-5e-3, 0.02), factor=False),
    )
    found = estimate(model, parameters, round(CORRELATION_S / float(np.median(np.diff(t)))))
    return found.with_model_uncertainty(
        model(found.values | {"voltage": 1 + VOLTAGE_UNCERTAINTY}) - found.residuals
    )


def _rail(robot: fx.Robot, line: JointLine, values: dict[str, float]) -> fx.System:
    """The carriage with all that it carries as one rigid body, from 0 and without limits."""
    system = fx.assemble(robot)
    moved = float(system.mass(system.start())[0, 0]) - robot.links[0].joint.rotor_inertia
    joint = {
        "type": "Pa",
        "rotor_mass_kg": line.reflected_mass_kg,
        "viscous_friction_N_s_m": values["viscous_N_s_m"],
        "coulomb_friction_N": values["coulomb_N"],
    }
    body = {"length_m": 0.0, "elements": 0, "mass_kg": moved, "joint": joint}
    return fx.assemble(fx.Robot.from_dict({"name": "carriage alone", "link": [body]}))


def _noise(t: np.ndarray, x: np.ndarray) -> float:
    """Standard deviation of the velocity due to the position's resolution [m/s]."""
    random = np.random.default_rng(0)
    white = (resolution(x) or 1e-6) / np.sqrt(12) * random.standard_normal(len(t))
    return float(np.std(velocity(t, white)))
