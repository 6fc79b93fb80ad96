"""Can this rig do what it is asked to do? The arithmetic, before anything moves.

A 251 rpm motor on a screw of 8 mm lead makes 33 mm/s; d1 = 0.012 m at 1 Hz takes 75 mm/s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

import flexura as fx
from flexura.errors import InputError

from .axes import motor_axes
from .board_axes import BoardAxis, board_axes
from .configuration import calibration, configuration, tip_per_bend
from .description import RigSetup
from .plant.motor import joint_line
from .sheets import MotorSheet

STEP_RATE_MAX_1_S = 4000.0  # what the firmware's step generator is made for
EDGE_RATE_MAX_1_S = 20000.0  # encoder edges of both encoders together that the firmware is made for


@dataclass(frozen=True)
class Check:
    """One check: what was found and what was expected, in words, and what to do if they differ."""

    what: str
    passed: bool
    found: str
    expected: str
    advice: str = ""


@dataclass(frozen=True)
class Peaks:
    """The largest position (both ways), speed and acceleration of a joint's motion, in m or rad."""

    lowest: float
    highest: float
    speed: float
    acceleration: float


def peaks(motion: fx.Signal, duration_s: float) -> Peaks:
    """Extremes of a motion, sampled 2000 times and at the signal's own breaks.

    Args:
        motion: the joint's position over time [m or rad].
        duration_s: end of the motion [s].
    """
    t = np.union1d(
        np.linspace(0.0, duration_s, 2001),
        motion.breaks[(motion.breaks >= 0) & (motion.breaks <= duration_s)],
    )
    r, v, a = np.array([motion(float(at)) for at in t]).T
    return Peaks(float(r.min()), float(r.max()), float(np.abs(v).max()), float(np.abs(a).max()))


def check_capability(setup: RigSetup, manoeuvre: fx.Manoeuvre | None = None) -> list[Check]:
    """Check whether a rig can follow a manoeuvre.

    Args:
        setup: the rig.
        manoeuvre: by default that of the rig file.

    Returns:
        One check for each requirement.
    """
    asked, settings = manoeuvre or setup.manoeuvre, configuration(setup)
    axes = board_axes(settings)
    motions: list[Peaks | None] = [
        peaks(joint.motion, asked.duration_s) if joint.motion is not None else None
        for joint in asked.drive.joints
    ]
    out = [*_always(setup)]
    for axis, peak in zip(axes, motions, strict=True):
        if peak is not None:
            check = _motor if axis.kind == "motor" else _stepper
            out += check(setup, settings, axis, peak, motions)
    encoders = [
        axis.counts * peak.speed
        for axis, peak in zip(axes, motions, strict=True)
        if peak and axis.encoder
    ]
    if len(encoders) == len(axes):
        out.append(_edges(sum(encoders)))
    return out


def scale_of(axis: BoardAxis) -> tuple[float, str, str]:
    """How a joint's position is printed: factor, unit, unit of the speed."""
    return (1e3, "mm", "mm/s") if axis.unit == "m" else (1.0, "rad", "rad/s")


def inertias(setup: RigSetup) -> np.ndarray:
    """The joints' mass matrix (J, J) of the straight robot [kg, kg m, kg m^2], without rotors."""
    system = fx.assemble(setup.robot)
    rows = system.joint_rows
    mass = np.asarray(system.mass(system.start()))[np.ix_(rows, rows)]
    return np.asarray(mass - np.diag([link.joint.rotor_inertia for link in setup.robot.links]))


def _needed(setup: RigSetup, axis: BoardAxis, motions: list[Peaks | None]) -> float:
    """The largest force or torque for the motions of all joints, straight links [N or N m]."""
    row = np.abs(inertias(setup)[axis.number - 1])
    return float(sum(m * peak.acceleration for m, peak in zip(row, motions, strict=True) if peak))


def _motor(
    setup: RigSetup,
    settings: dict[str, float],
    axis: BoardAxis,
    peak: Peaks,
    motions: list[Peaks | None],
) -> list[Check]:
    """Checks of a joint with a motor.

    Speed by the motor's line n = n0 U / U0 (1 - M / (M0 U / U0)), torque M = F r / efficiency.
    """
    rig, what = setup.rig, axis.what
    motor = rig.motor if axis.number == 1 else rig.motor_2
    assert motor is not None
    screw = rig.screw if axis.number == 1 else None
    part = min(settings["voltage_max_V"], rig.driver.supply_V) / motor.rated_voltage_V
    per_turn = screw.lead_m if screw else 2 * math.pi
    free = part * motor.no_load_speed_rpm / 60 * per_turn
    needed = _needed(setup, axis, motions)
    torque = needed * per_turn / (2 * math.pi * (screw.efficiency if screw else 1.0))
    stall = part * motor.stall_torque_N_m
    loaded = free * max(0.0, 1 - torque / stall)
    rpm = 60 / per_turn
    factor, unit, speed_unit = scale_of(axis)
    shaft, force = ("screw", f"{needed:.3g} N") if screw else ("gear", f"{needed:.3g} N m")
    return [
        Check(
            f"{what} speed",
            peak.speed <= loaded,
            f"{factor * peak.speed:.4g} {speed_unit} = {rpm * peak.speed:.0f} rpm of the {shaft}",
            f"{factor * loaded:.4g} {speed_unit} = {rpm * loaded:.0f} rpm under load, "
            f"{factor * free:.4g} {speed_unit} without",
            "a motor of a lower gear ratio, or a slower motion",
        ),
        Check(
            f"{what} force" if screw else f"{what} torque",
            torque <= 0.5 * stall,
            f"{torque:.3f} N m at the {shaft} for {force} at {peak.acceleration:.2f} "
            f"{axis.unit}/s^2",
            f"half of {stall:.2f} N m at rest",
            "a stronger motor or a slower motion",
        ),
        _inside(f"{what} range", peak, setup.limits[axis.number - 1], factor, unit),
        _below(
            f"{what} speed limit",
            peak.speed,
            settings[axis.names["speed"]],
            axis.names["speed"],
            factor,
            speed_unit,
        ),
    ]


def _stepper(
    setup: RigSetup,
    settings: dict[str, float],
    axis: BoardAxis,
    peak: Peaks,
    motions: list[Peaks | None],
) -> list[Check]:
    assert setup.rig.stepper is not None
    rate, what = peak.speed * axis.setpoints, axis.what
    strip = setup.robot.links[-1]
    # the rotor turns with the joint
    torque = (inertias(setup)[1, 1] + strip.joint.rotor_inertia) * peak.acceleration
    holding = setup.rig.stepper.holding_torque_N_m
    limits = (
        ("speed limit", peak.speed, "speed_max_2_rad_s", "rad/s"),
        ("rate limit", peak.speed, "rate_max_2_rad_s", "rad/s"),
        ("acceleration", peak.acceleration, "acceleration_max_2_rad_s2", "rad/s^2"),
    )
    return [
        Check(
            "step rate",
            rate <= STEP_RATE_MAX_1_S,
            f"{rate:.0f} microsteps/s",
            f"{STEP_RATE_MAX_1_S:.0f} microsteps/s",
            "fewer microsteps in a full step, or a slower motion",
        ),
        Check(
            "stepper torque",
            bool(torque <= 0.5 * holding),
            f"{torque:.3f} N m for the straight strip with its payload",
            f"half of {holding:.2f} N m holding torque",
            "a stronger stepper or a slower motion",
        ),
        _inside(f"{what} range", peak, setup.limits[1], 1.0, "rad"),
        *[
            _below(f"{what} {name}", found, settings[key], key, 1.0, unit)
            for name, found, key, unit in limits
        ],
    ]


def _edges(rate: float) -> Check:
    return Check(
        "encoder edges",
        rate <= EDGE_RATE_MAX_1_S,
        f"{rate:.0f} 1/s",
        f"{EDGE_RATE_MAX_1_S:.0f} 1/s",
        "encoders of fewer pulses, or a slower motion",
    )


def _stalls(setup: RigSetup, settings: dict[str, float]) -> list[Check]:
    """A joint that rests within its friction must not pass for a blocked one.

    A rig file without the constants that only the emulator needs does not tell.
    """
    try:
        lines = {axis.number: joint_line(axis) for axis in motor_axes(setup.rig)}
    except InputError:
        return []
    out = []
    for number, line in lines.items():
        holds = line.static / line.force_per_V + (setup.rig.driver.dead_zone_V or 0.0)
        out.append(
            Check(
                f"motor {number} at rest",
                holds < settings["stall_voltage_V"],
                f"friction holds it up to {holds:.2f} V",
                f"{settings['stall_voltage_V']:g} V before it counts as blocked",
                "setting stall_voltage_V above that",
            )
        )
    return out


def _always(setup: RigSetup) -> list[Check]:
    rig, settings = setup.rig, configuration(setup)
    out = []
    motors: list[tuple[str, MotorSheet]] = [("", rig.motor)]
    if rig.motor_2:
        motors.append((" 2", rig.motor_2))
    blocked = "the carriage is" if rig.screw else "it is"
    for number, motor in motors:
        part = min(settings["voltage_max_V"], rig.driver.supply_V) / motor.rated_voltage_V
        stall = part * motor.stall_current_A
        out.append(
            Check(
                f"motor{number} current",
                stall <= rig.driver.current_max_A,
                f"{stall:.1f} A when {blocked} blocked",
                f"{rig.driver.current_max_A:.1f} A of the driver",
                "a lower voltage_max_V or a stronger driver",
            )
        )
    out += _stalls(setup, settings)
    out.append(
        Check(
            "supply",
            settings["supply_min_V"] < rig.driver.supply_V < settings["supply_max_V"],
            f"{rig.driver.supply_V:g} V",
            f"{settings['supply_min_V']:g} to {settings['supply_max_V']:g} V before a fault",
            "settings supply_min_V and supply_max_V around the supply",
        )
    )
    if rig.sensor:
        zero, name = settings["flex_zero"], _sensor_name(setup)
        out.append(
            Check(
                f"{name} at rest",
                settings["flex_min"] < zero < settings["flex_max"],
                f"reads {zero:.3f} of full scale",
                f"{settings['flex_min']:g} to {settings['flex_max']:g} before a fault",
                "another divider_ohm or zero_V, or settings flex_min and flex_max around it",
            )
        )
    fitted = calibration(setup)
    if fitted is not None:
        count_mm = 1e3 * abs(fitted.c1_m) / 1024
        about = f" ({tip_per_bend(setup):.3f} m for a radian of bend)" if rig.flex else ""
        out.append(
            Check(
                f"{_sensor_name(setup)}'s resolution",
                count_mm <= 4.0,
                f"{count_mm:.2f} mm of tip deflection for a count of 10 bits{about}",
                "4 mm",
                "a divider_ohm near the sensor's resistance"
                if rig.flex
                else "an amplifier of a higher gain",
            )
        )
    return out


def _sensor_name(setup: RigSetup) -> str:
    """The strip's sensor in words."""
    rig = setup.rig
    return "flex sensor" if rig.flex else "strain gauge" if rig.strain_gauge else "accelerometer"


def _inside(what: str, peak: Peaks, limits: tuple[float, float], factor: float, unit: str) -> Check:
    good = limits[0] <= peak.lowest and peak.highest <= limits[1]
    return Check(
        what,
        good,
        f"{factor * peak.lowest:.4g} to {factor * peak.highest:.4g} {unit}",
        f"{factor * limits[0]:.4g} to {factor * limits[1]:.4g} {unit}",
        "a smaller motion, or another start",
    )


def _below(what: str, found: float, limit: float, setting: str, factor: float, unit: str) -> Check:
    return Check(
        what,
        found < limit,
        f"{factor * found:.4g} {unit}",
        f"{factor * limit:.4g} {unit}",
        f"a higher {setting}",
    )
