"""A motor at its joint: its friction from the balance of momentum over short windows.

While the motor slides one way, from t_1 to t_2, with F_V u the drive of its voltage:

    m (v_2 - v_1) = int F_V u(t - tau) dt - c (x_2 - x_1) - F_c sign(v) (t_2 - t_1) - int G dt

tau is the time from a voltage's report to its current. On a lead screw the motor turns a reflected
mass of 100 kg, which the strip hardly moves: m is the rotor's, and that of all that the joint
carries, as one rigid body, over the screw's and the gear's efficiency; G is 0. A geared motor that
turns its joint feels the links swing: m is the rotor's inertia, and G is what the motor gives to
its gear for the torque T of the identified strip, the bearing's friction in it. The gear drives the
links with the efficiency eta:

    G = T / eta     T v > 0,        G = T eta'     else

Slow samples and those just after a reversal are left out, because stiction and backlash act there.
A window is as uncertain as its velocities and the torque of the links.
"""

from __future__ import annotations

import numpy as np

import flexura as fx
from flexura.errors import InputError

from ..comparison.replay.lead_screw import backlash_output
from ..comparison.replay.smoothing import recorded_samples, resolution
from ..recordings.unit_conversion import velocity
from ..rig.axes import MotorAxis
from ..rig.plant.motor import JointLine
from .estimate import Estimate, Parameter, estimate

# slower is no sliding [m/s, rad/s]; what must have been travelled after a reversal [m, rad]
SLIDING = {"m": 5e-3, "rad": 0.05}
CLEAR_AFTER_REVERSAL = {"m": 2e-3, "rad": 0.05}
WINDOW_S = 0.05
MIN_SAMPLES = 200  # that slide
# the supply is measured through a divider, the motor's constant is that of the data sheet
VOLTAGE_UNCERTAINTY = 0.005
TORQUE_UNCERTAINTY = 0.02  # of the links' torque at a sample
CORRELATION_S = 0.4


def fit(
    experiment: fx.Run,
    robot: fx.Robot,
    axis: MotorAxis,
    line: JointLine,
    dead_zone_V: float,
    torque_N_m: np.ndarray | None = None,
    own_deviation: float = 0.0,
) -> Estimate:
    """Fit a motor's friction.

    Args:
        experiment: the run.
        robot: the robot of its files.
        axis: the joint.
        line: the joint by the rig file, where the fit starts; without its own friction, if a torque
            is given.
        dead_zone_V: dead zone of the motor's bridge [V].
        torque_N_m: what the gear gives to the joint (T,) [N m]; None: the joint carries one rigid
            body.
        own_deviation: standard deviation of the joint's own friction in it [N m].

    Returns:
        `coulomb` [N or N m], `viscous` with the back-EMF [N s/m or N m s/rad], `voltage_delay_s`.
        The joint's own friction is in them if no torque is given.

    Raises:
        InputError: too few samples slide.
    """
    position, voltage = f"joint/{axis.number}/position", f"joint/{axis.number}/voltage"
    t, x = recorded_samples(experiment.t, experiment[position], position)
    measured, clear_after = velocity(t, x), CLEAR_AFTER_REVERSAL[axis.unit]
    clear = np.abs(x - backlash_output(x, clear_after)) > 0.49 * clear_after
    slides = clear & (np.abs(measured) > SLIDING[axis.unit])
    if slides.sum() < MIN_SAMPLES:
        expected = (
            f"expected at least {MIN_SAMPLES} samples faster than {SLIDING[axis.unit]:g} "
            f"{axis.unit}/s and {clear_after:g} {axis.unit} after a turn"
        )
        if not experiment.complete:
            expected += f"; the run ended early, at {t[-1]:.3g} s"
        raise InputError(expected, key=position, value=int(slides.sum()))

    if torque_N_m is None:
        mass, given = line.moved(_carried(robot, axis)), np.zeros(len(t))
    else:
        mass = line.inertia
        given = _given(line, np.interp(t, experiment.t, torque_N_m), measured)
    size = max(2, round(WINDOW_S / float(np.median(np.diff(t)))))
    first = np.flatnonzero(_whole(slides, np.sign(measured), size))
    last = first + size
    change = mass * (measured[last] - measured[first]) + _over(_sum(t, given), first, last)
    noise = np.hypot(
        np.sqrt(2) * mass * _noise(t, x),
        TORQUE_UNCERTAINTY * _over(_sum(t, np.abs(given)), first, last),
    )
    braking = np.sign(measured[first]) * (t[last] - t[first])
    times, volts = recorded_samples(experiment.t, experiment[voltage], voltage)
    held = np.concatenate([times[:1], (times[1:] + times[:-1]) / 2, times[-1:]])
    drive = line.force_per_V * np.sign(volts) * np.maximum(np.abs(volts) - dead_zone_V, 0.0)
    impulse = np.concatenate([[0.0], np.cumsum(drive * np.diff(held))])

    def model(values: dict[str, float]) -> np.ndarray:
        begin, end = (
            np.interp(t[rows] - values["voltage_delay_s"], held, impulse) for rows in (first, last)
        )
        driven = values.get("volts", 1.0) * (end - begin)
        lost = (
            values["viscous"] * (x[last] - x[first])
            + (values["coulomb"] + values.get("own", 0.0)) * braking
        )
        out = np.zeros(len(t))
        out[first] = (change - driven + lost) / noise
        return out[None, :]

    parameters = (
        Parameter("coulomb", line.coulomb, 0.01, (line.coulomb / 10, 10 * line.coulomb)),
        Parameter("viscous", line.viscous, 0.01, (line.viscous / 10, 10 * line.viscous)),
        Parameter("voltage_delay_s", 1e-3, 2e-4, (-5e-3, 0.02), factor=False),
    )
    found = estimate(model, parameters, round(CORRELATION_S / float(np.median(np.diff(t)))))
    for what in ({"volts": 1 + VOLTAGE_UNCERTAINTY}, {"own": own_deviation / line.efficiency}):
        found = found.with_model_uncertainty(model(found.values | what) - found.residuals)
    return found


def _whole(slides: np.ndarray, sign: np.ndarray, size: int) -> np.ndarray:
    """Whether a window of `size` intervals that begins at a sample (T - size,) slides one way."""
    there = slides & (np.diff(sign, prepend=sign[0]) == 0)
    count = np.concatenate([[0], np.cumsum(there)])
    return count[size + 1 :] - count[: -size - 1] == size + 1


def _sum(t: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The integral of y (T,) up to each time, by the trapezoidal rule."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (y[1:] + y[:-1]) * np.diff(t))])


def _over(total: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    return total[last] - total[first]


def _given(line: JointLine, torque_N_m: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """What the motor gives to its gear (T,) [N m] for the torque that the joint takes from it."""
    driven = torque_N_m / line.efficiency
    return np.where(torque_N_m * speed > 0, driven, torque_N_m * line.back_driven)


def _carried(robot: fx.Robot, axis: MotorAxis) -> float:
    """Mass or inertia of all that the joint carries, without its rotor [kg or kg m^2]."""
    system = fx.assemble(robot)
    row = system.joint_rows[axis.number - 1]
    own = robot.links[axis.number - 1].joint.rotor_inertia
    return float(system.mass(system.start())[row, row]) - own


def _noise(t: np.ndarray, x: np.ndarray) -> float:
    """Standard deviation of the velocity due to the position's resolution [m/s]."""
    random = np.random.default_rng(0)
    white = (resolution(x) or 1e-6) / np.sqrt(12) * random.standard_normal(len(t))
    return float(np.std(velocity(t, white)))
