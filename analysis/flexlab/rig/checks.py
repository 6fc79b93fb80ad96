"""Can this rig do what it is asked to do? The arithmetic, before anything moves.

A 251 rpm motor on a screw of 8 mm lead makes 33 mm/s; d1 = 0.012 m at 1 Hz takes 75 mm/s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

import flexura as fx

from .description import RigSetup, calibration, configuration, tip_per_bend

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
    asked = manoeuvre or setup.manoeuvre
    motions: list[Peaks | None] = [
        peaks(joint.motion, asked.duration_s) if joint.motion is not None else None
        for joint in asked.drive.joints
    ]
    out = [*_always(setup)]
    if motions[0] is not None:
        out += _carriage(setup, motions[0])
    if motions[1] is not None:
        out += _rotary(setup, motions[1])
    if motions[0] is not None and motions[1] is not None:
        out.append(_edges(setup, motions[0], motions[1]))
    return out


def _carriage(setup: RigSetup, peak: Peaks) -> list[Check]:
    """Checks of joint 1.

    Speed by the motor's line n = n0 U / U0 (1 - M / (M0 U / U0)), torque M = F lead / (2 pi
    efficiency).
    """
    rig, settings = setup.rig, configuration(setup)
    motor, screw = rig.motor, rig.screw
    part = min(settings["voltage_max_V"], rig.driver.supply_V) / motor.rated_voltage_V
    free = part * motor.no_load_speed_rpm / 60 * screw.lead_m
    mass = moved_mass(setup)
    torque = mass * peak.acceleration * screw.lead_m / (2 * math.pi * screw.efficiency)
    stall = part * motor.stall_torque_N_m
    loaded = free * max(0.0, 1 - torque / stall)
    rpm = 60 / screw.lead_m
    return [
        Check(
            "carriage speed",
            peak.speed <= loaded,
            f"{1e3 * peak.speed:.1f} mm/s = {rpm * peak.speed:.0f} rpm of the screw",
            f"{1e3 * loaded:.1f} mm/s = {rpm * loaded:.0f} rpm under load, {1e3 * free:.1f} mm/s "
            f"without",
            "a motor of a lower gear ratio, a screw of a larger lead, or a slower motion",
        ),
        Check(
            "carriage force",
            torque <= 0.5 * stall,
            f"{torque:.3f} N m at the screw for {mass:.2f} kg at {peak.acceleration:.2f} m/s^2",
            f"half of {stall:.2f} N m at rest",
            "a stronger motor or a slower motion",
        ),
        _inside("carriage range", peak, setup.limits[0], 1e3, "mm"),
        _below(
            "carriage speed limit",
            peak.speed,
            settings["speed_max_1_m_s"],
            "speed_max_1_m_s",
            1e3,
            "mm/s",
        ),
    ]


def _rotary(setup: RigSetup, peak: Peaks) -> list[Check]:
    settings = configuration(setup)
    rate = peak.speed * settings["stepper_steps_per_rad"]
    strip, payload = setup.robot.links[1], setup.robot.payload
    x = np.linspace(0.0, strip.length_m, 201)
    inertia = (
        float(np.trapezoid(strip.mass_per_length(x) * x**2, x))
        + payload.mass_kg * strip.length_m**2
    )
    inertia += payload.inertia_kg_m2 + strip.joint.hub_inertia_kg_m2 + strip.joint.rotor_inertia
    torque, holding = inertia * peak.acceleration, setup.rig.stepper.holding_torque_N_m
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
            torque <= 0.5 * holding,
            f"{torque:.3f} N m for the straight strip with its payload",
            f"half of {holding:.2f} N m holding torque",
            "a stronger stepper or a slower motion",
        ),
        _inside("joint 2 range", peak, setup.limits[1], 1.0, "rad"),
        _below(
            "joint 2 speed limit",
            peak.speed,
            settings["speed_max_2_rad_s"],
            "speed_max_2_rad_s",
            1.0,
            "rad/s",
        ),
        _below(
            "joint 2 rate limit",
            peak.speed,
            settings["rate_max_2_rad_s"],
            "rate_max_2_rad_s",
            1.0,
            "rad/s",
        ),
        _below(
            "joint 2 acceleration",
            peak.acceleration,
            settings["acceleration_max_2_rad_s2"],
            "acceleration_max_2_rad_s2",
            1.0,
            "rad/s^2",
        ),
    ]


def _edges(setup: RigSetup, one: Peaks, two: Peaks) -> Check:
    settings = configuration(setup)
    rate = (
        one.speed * settings["motor_counts_per_m"] + two.speed * settings["stepper_counts_per_rad"]
    )
    advice = "encoders of fewer pulses, or a slower motion"
    return Check(
        "encoder edges",
        rate <= EDGE_RATE_MAX_1_S,
        f"{rate:.0f} 1/s",
        f"{EDGE_RATE_MAX_1_S:.0f} 1/s",
        advice,
    )


def _always(setup: RigSetup) -> list[Check]:
    rig, settings = setup.rig, configuration(setup)
    part = min(settings["voltage_max_V"], rig.driver.supply_V) / rig.motor.rated_voltage_V
    stall = part * rig.motor.stall_current_A
    fitted = calibration(setup)
    count_mm = 1e3 * abs(fitted.c1_m) / 1024
    return [
        Check(
            "motor current",
            stall <= rig.driver.current_max_A,
            f"{stall:.1f} A when the carriage is blocked",
            f"{rig.driver.current_max_A:.1f} A of the driver",
            "a lower voltage_max_V or a stronger driver",
        ),
        Check(
            "supply",
            settings["supply_min_V"] < rig.driver.supply_V < settings["supply_max_V"],
            f"{rig.driver.supply_V:g} V",
            f"{settings['supply_min_V']:g} to {settings['supply_max_V']:g} V before a fault",
            "settings supply_min_V and supply_max_V around the supply",
        ),
        Check(
            "flex sensor at rest",
            settings["flex_min"] < fitted.zero < settings["flex_max"],
            f"reads {fitted.zero:.3f} of full scale",
            f"{settings['flex_min']:g} to {settings['flex_max']:g} before a fault",
            "another divider_ohm, or settings flex_min and flex_max around it",
        ),
        Check(
            "flex sensor's resolution",
            count_mm <= 4.0,
            f"{count_mm:.2f} mm of tip deflection for a count of 10 bits "
            f"({tip_per_bend(setup):.3f} m for a radian of bend)",
            "4 mm",
            "a divider_ohm near the sensor's resistance",
        ),
    ]


def moved_mass(setup: RigSetup) -> float:
    """The mass that joint 1 moves [kg], without the motor's own inertia."""
    carriage, strip = setup.robot.links
    x = np.linspace(0.0, strip.length_m, 201)
    own = carriage.mass_kg
    if own is None:
        along = np.linspace(0.0, carriage.length_m, 201)
        own = float(np.trapezoid(carriage.mass_per_length(along), along))
    hubs = sum(link.joint.hub_mass_kg for link in (carriage, strip))
    return (
        own + hubs + float(np.trapezoid(strip.mass_per_length(x), x)) + setup.robot.payload.mass_kg
    )


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
