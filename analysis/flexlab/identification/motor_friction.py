"""A motor at its joint: its friction from voltage and speed.

On the lead screw the motor turns a reflected mass of 100 kg, which the strip hardly moves. Such a
joint is identified by itself, with all that it carries as one rigid body of the mass m:

    (m + J/r^2) v' = F_V u(t - tau) - c v - F_c tanh(v / v_0)

The links on a geared motor that turns its joint swing, and other motors move them. Their torque
T(t) on the gear is that of the identified strip; the gear drives them with the efficiency eta:

    J v' = K u(t - tau) / R - c v - F_c tanh(v / v_0) - T / eta       T v > 0
    J v' = K u(t - tau) / R - c v - F_c tanh(v / v_0) - T eta'        else

Both are simulated natively and fitted in v; tau is the time from a voltage's report to its current.
Slow samples and those just after a reversal are left out, because stiction and backlash act there.
"""

from __future__ import annotations

import numpy as np

import flexura as fx
from flexura import signals
from flexura.errors import InputError
from flexura.signals import COLUMNS, Signal

from ..comparison.replay.lead_screw import backlash_output
from ..comparison.replay.simulate_experiment import hold_midpoints
from ..comparison.replay.smoothing import recorded_samples, resolution
from ..recordings.unit_conversion import velocity
from ..rig.axes import MotorAxis
from ..rig.plant.motor import JointLine, back_driven_efficiency, motor_data
from .estimate import Estimate, Parameter, estimate

# slower is no sliding [m/s, rad/s]; what must have been travelled after a reversal [m, rad]
SLIDING = {"m": 5e-3, "rad": 0.05}
CLEAR_AFTER_REVERSAL = {"m": 2e-3, "rad": 0.02}
MIN_SAMPLES = 200  # that slide
# the supply is measured through a divider, the motor's constant is that of the data sheet
VOLTAGE_UNCERTAINTY = 0.005
CORRELATION_S = 0.4
NOTHING = 1e-9  # kg m^2: the inertia of a body that is not there


def fit(
    experiment: fx.Run,
    robot: fx.Robot,
    axis: MotorAxis,
    line: JointLine,
    dead_zone_V: float,
    torque_N_m: np.ndarray | None = None,
    rtol: float = 1e-5,
) -> Estimate:
    """Fit a joint's friction.

    Args:
        experiment: the run.
        robot: the robot of its files.
        axis: the joint.
        line: the joint by the rig file, where the fit starts.
        dead_zone_V: dead zone of the motor's bridge [V].
        torque_N_m: what the gear gives to the links (T,) [N m]; None: they are one rigid body.
        rtol: tolerance of the simulations.

    Returns:
        `coulomb` [N or N m], `viscous` with the back-EMF [N s/m or N m s/rad], `voltage_delay_s`.

    Raises:
        InputError: too few samples slide.
    """
    position, voltage = f"joint/{axis.number}/position", f"joint/{axis.number}/voltage"
    t, x = recorded_samples(experiment.t, experiment[position], position)
    times, volts = recorded_samples(experiment.t, experiment[voltage], voltage)
    drive = hold_midpoints(
        times, line.force_per_V * np.sign(volts) * np.maximum(np.abs(volts) - dead_zone_V, 0.0)
    )
    measured, clear_after = velocity(t, x), CLEAR_AFTER_REVERSAL[axis.unit]
    clear = np.abs(x - backlash_output(x, clear_after)) > 0.49 * clear_after
    weight = np.where(clear & (np.abs(measured) > SLIDING[axis.unit]), 1 / _noise(t, x), 0.0)
    if (weight > 0).sum() < MIN_SAMPLES:
        expected = (
            f"expected at least {MIN_SAMPLES} samples faster than {SLIDING[axis.unit]:g} "
            f"{axis.unit}/s and {clear_after:g} {axis.unit} after a turn"
        )
        raise InputError(expected, key=position, value=int((weight > 0).sum()))

    loads, moved = [], NOTHING
    if torque_N_m is None:
        moved = _carried(robot, axis)
    else:
        speed = np.interp(experiment.t, t, measured)
        taken = signals.table(experiment.t, -_given(axis, torque_N_m, speed))
        loads = [fx.Load(link=1, at_m=0.0, moment_N_m=taken)]

    def model(values: dict[str, float]) -> np.ndarray:
        force = drive.segments * np.where(np.arange(COLUMNS) == 1, values.get("volts", 1.0), 1.0)
        force[:, 0] += values["voltage_delay_s"]
        alone = _alone(axis, line, values, moved)
        run = fx.simulate(alone, t, fx.Drive.force(Signal(force)), loads=loads, rtol=rtol)
        return np.nan_to_num((velocity(t, run["joint/1/position"]) - measured) * weight)[None, :]

    parameters = (
        Parameter("coulomb", line.coulomb, 0.01, (line.coulomb / 10, 10 * line.coulomb)),
        Parameter("viscous", line.viscous, 0.01, (line.viscous / 10, 10 * line.viscous)),
        Parameter("voltage_delay_s", 1e-3, 2e-4, (-5e-3, 0.02), factor=False),
    )
    found = estimate(model, parameters, round(CORRELATION_S / float(np.median(np.diff(t)))))
    return found.with_model_uncertainty(
        model(found.values | {"volts": 1 + VOLTAGE_UNCERTAINTY}) - found.residuals
    )


def _given(axis: MotorAxis, torque_N_m: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """What the motor gives to its gear (T,) [N m] for the torque that the links take from it."""
    forward = motor_data(axis).gear_efficiency * axis.efficiency
    back = back_driven_efficiency(motor_data(axis).gear_efficiency)
    back *= back_driven_efficiency(axis.efficiency)
    return np.where(torque_N_m * speed > 0, torque_N_m / forward, torque_N_m * back)


def _carried(robot: fx.Robot, axis: MotorAxis) -> float:
    """Mass or inertia of all that the joint carries, without its rotor [kg or kg m^2]."""
    system = fx.assemble(robot)
    row = system.joint_rows[axis.number - 1]
    own = robot.links[axis.number - 1].joint.rotor_inertia
    return float(system.mass(system.start())[row, row]) - own


def _alone(axis: MotorAxis, line: JointLine, values: dict[str, float], moved: float) -> fx.System:
    """The joint and a rigid body of `moved` [kg or kg m^2], from 0 and without limits."""
    if axis.turns:
        joint = {
            "type": "R",
            "rotor_inertia_kg_m2": line.inertia,
            "viscous_friction_N_m_s_rad": values["viscous"],
            "coulomb_friction_N_m": values["coulomb"],
        }
        body = {"mass_kg": 1e-6, "inertia_kg_m2": moved}
    else:
        joint = {
            "type": "Pa",
            "rotor_mass_kg": line.inertia,
            "viscous_friction_N_s_m": values["viscous"],
            "coulomb_friction_N": values["coulomb"],
        }
        body = {"mass_kg": moved}
    link = {"length_m": 0.0, "elements": 0, "joint": joint, **body}
    return fx.assemble(fx.Robot.from_dict({"name": "joint alone", "link": [link]}))


def _noise(t: np.ndarray, x: np.ndarray) -> float:
    """Standard deviation of the velocity due to the position's resolution [m/s]."""
    random = np.random.default_rng(0)
    white = (resolution(x) or 1e-6) / np.sqrt(12) * random.standard_normal(len(t))
    return float(np.std(velocity(t, white)))
