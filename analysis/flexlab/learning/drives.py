"""From the joints' motions to the references with which the drives make them.

A motor's force bears rotor, friction, the links' load and what the gear loses of it. The board's
controller gives its voltage at a reference that is found by inversion (125).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

import flexura as fx
from flexura import signals
from flexura.control import JointLoop, JointSpring

from ..rig import Check, RigSetup
from ..rig.axes import MotorAxis, motor_axes
from ..rig.configuration import calibration
from ..rig.plant.motor import joint_line
from ..rig.plant.stepper import MagneticSpring
from .knowledge import Knowledge

STEP_S = 0.002  # of the drives' inversion
SLOWEST = 0.005  # of a joint's largest speed: below, it rests
REACH_S = 0.08  # a joint that rests is pushed so long before it moves
ROUND_S = 0.1  # in which a friction's sign changes
SOFT = 0.3  # of a joint's own friction, over which the flank changes
REACHES = 0.95  # of the largest voltage may be asked


@dataclass(frozen=True)
class DriveInverse:
    """What joint motions ask of the drives.

    Attributes:
        references: of the joints at the motions' times (T, J) [m or rad].
        checks: of voltages and the sensor's range.
    """

    references: np.ndarray
    checks: list[Check]


def loops(
    setup: RigSetup, settings: dict[str, float], holding: float = 1.0
) -> list[JointLoop | JointSpring]:
    """What moves the joints: the board's controllers of motors, and a stepper's magnetic spring.

    Args:
        setup: the rig.
        settings: the board's settings, by name.
        holding: factor on the stepper's holding torque.
    """
    out: list[JointLoop | JointSpring] = []
    for axis in motor_axes(setup.rig):
        n, unit = axis.number, axis.unit
        gain = lambda name, n=n: settings.get(f"{name[:2]}_{n}_{name[3:]}", 0.0)
        out.append(
            JointLoop(
                joint_line(axis).force_per_V,
                gain(f"kp V_{unit}"),
                gain(f"ki V_{unit}_s"),
                gain(f"kd V_s_{unit}"),
                gain(f"kv V_s_{unit}"),
                gain("kc V"),
            )
        )
    if setup.rig.stepper:
        out.append(JointSpring(holding * MagneticSpring(setup.rig.stepper).on_N_m))
    return out


def sticks_within(setup: RigSetup, settings: dict[str, float], axis: MotorAxis) -> float:
    """How far from its set-point friction holds a joint, until its controller's gain moves it.

    Args:
        setup: the rig.
        settings: the board's settings, by name.
        axis: the joint, on a motor.

    Returns:
        The distance [m or rad]; the integral gain is not counted.
    """
    line, dead = joint_line(axis), setup.rig.driver.dead_zone_V or 0.0
    gain = settings[f"kp_{axis.number}_V_{axis.unit}"]
    return float((line.coulomb / line.force_per_V + dead) / gain) if gain else math.inf


def friction_side(velocity: np.ndarray) -> np.ndarray:
    """The sign of a joint's velocity (T,), smooth, also shortly before it moves.

    A joint at rest sticks, so that it is pushed before it moves. After that it is not: a push as
    large as its friction would let it slip in one trial and not in the next.

    Args:
        velocity: every STEP_S (T,).
    """
    moving = np.abs(velocity) > SLOWEST * np.abs(velocity).max()
    if not moving.any():
        return np.zeros(len(velocity))
    places = np.flatnonzero(moving)
    at = np.arange(len(velocity))
    after = places[np.clip(np.searchsorted(places, at), 0, len(places) - 1)]
    soon = (after >= at) & (after - at <= REACH_S / STEP_S)
    sign = np.where(soon, np.sign(velocity[after]), 0.0)
    window = np.hanning(round(ROUND_S / STEP_S) + 2)[1:-1]
    padded = np.pad(sign, len(window), mode="edge")
    smooth = np.convolve(padded, window / window.sum(), mode="same")
    return np.asarray(smooth[len(window) : -len(window)])


def drive_inverse(
    setup: RigSetup,
    settings: dict[str, float],
    system: fx.System,
    knowledge: Knowledge,
    t: np.ndarray,
    motions: np.ndarray,
    beyond: np.ndarray | None = None,
) -> DriveInverse:
    """The references with which the joints move so, by the model (125).

    Args:
        setup: the rig.
        settings: the board's settings, by name.
        system: the identified robot without motors.
        knowledge: of friction and backlash.
        t: times (T,) [s].
        motions: of the joints (T, J) [m or rad]; of a stepper, of its pulses.
        beyond: how far beyond its last place each joint will stick (J,) [m or rad]; default 0.
    """
    from scipy.interpolate import CubicSpline

    fine = np.arange(0.0, t[-1] + STEP_S / 2, STEP_S)
    courses = [CubicSpline(t, column) for column in motions.T]
    links = fx.inverse(
        system, fine, [signals.table(t, column) for column in motions.T]
    ).uninterrupted()
    references, checks = motions.copy(), [_sensor_range(setup, settings, links)]
    controllers = loops(setup, settings)
    for axis in motor_axes(setup.rig):
        i, course = axis.number - 1, courses[axis.number - 1]
        controller = controllers[i]
        assert isinstance(controller, JointLoop)
        side = friction_side(course(fine, 1))
        load = links[f"joint/{axis.number}/drive"]
        volts = _voltage(setup, axis, knowledge, course, fine, load, side)
        shaft = course(fine) + _behind(axis, knowledge, course(fine, 1), load, side)
        asked = controller.reference(STEP_S, shaft, volts, side)
        asked = _held(asked, shaft, course(fine, 1), 0.0 if beyond is None else beyond[i])
        references[:, i] = np.interp(t, fine, asked)
        most, limit = float(np.abs(volts).max()), REACHES * settings["voltage_max_V"]
        what = f"motor {axis.number} voltage"
        expected = f"at most {limit:.4g}"
        checks.append(Check(what, most <= limit, f"{most:.4g} V", expected, "a slower motion"))
    return DriveInverse(references, checks)


def _held(asked: np.ndarray, shaft: np.ndarray, velocity: np.ndarray, beyond: float) -> np.ndarray:
    """The reference (T,), where the shaft sticks from shortly after the joint's last motion on.

    Friction holds the joint while the links still swing. A motor that answered them, or that was
    asked to be elsewhere, would push the joint until it slips.
    """
    moving = np.flatnonzero(np.abs(velocity) > SLOWEST * np.abs(velocity).max())
    rests = (moving[-1] if len(moving) else 0) + round(REACH_S / STEP_S)
    after = (np.arange(len(asked)) - rests) * STEP_S / ROUND_S
    share = 0.5 + 0.5 * np.cos(np.pi * np.clip(after, 0.0, 1.0))
    there = shaft[min(rests, len(shaft) - 1)] + beyond
    return np.asarray(there + share * (asked - there))


def _voltage(
    setup: RigSetup,
    axis: MotorAxis,
    knowledge: Knowledge,
    course: object,
    t: np.ndarray,
    load: np.ndarray,
    side: np.ndarray,
) -> np.ndarray:
    """The voltage (T,) [V] that moves a motor's joint against a load, with the bridge's dead
    zone."""
    assert callable(course)
    line = joint_line(axis, *knowledge.friction_of(axis))
    loss = (1 / line.efficiency - 1) * np.abs(load)
    loss = np.where(load * side < 0, np.minimum(loss, np.abs(load)), loss)
    force = line.inertia * course(t, 2) + line.viscous * course(t, 1) + load
    volts = (force + (line.coulomb + loss) * side) / line.force_per_V
    dead = setup.rig.driver.dead_zone_V or 0.0
    return np.asarray(volts + dead * np.tanh(volts / max(dead, 1e-9)) if dead else volts)


def _behind(
    axis: MotorAxis, knowledge: Knowledge, rate: np.ndarray, load: np.ndarray, side: np.ndarray
) -> np.ndarray:
    """How far the motor's side of the gear or nut is ahead of the joint (T,) [m or rad].

    It touches the flank on which it pushes links and the joint's own friction.
    """
    guide, friction = axis.guide, knowledge.friction_of(axis).own
    own = friction * guide.coulomb
    pushed = load + own * side + friction * guide.viscous * rate
    flank = np.tanh(pushed / max(SOFT * own, 1e-9))
    play = knowledge.values.get("backlash", 1.0) * guide.backlash
    return np.asarray(0.5 * play * flank + pushed / guide.contact_stiffness)


def _sensor_range(setup: RigSetup, settings: dict[str, float], links: fx.Run) -> Check:
    """Whether the strip's sensor stays within the readings at which the board stops."""
    bent = links[f"link/{setup.strip}/tip_deflection"]
    found = f"{1e3 * bent.min():.4g} to {1e3 * bent.max():.4g} mm"
    fitted = calibration(setup)
    if fitted is None or not setup.rig.flex:
        return Check("deflection", True, found, "any")
    readings = np.array([settings["flex_min"], settings["flex_max"]])
    low, high = np.sort(fitted.c1_m * (readings - fitted.zero))
    inside = bool(low <= bent.min() and bent.max() <= high)
    expected = f"{1e3 * low:.4g} to {1e3 * high:.4g}"
    return Check("deflection", inside, found, expected, "a slower motion")
