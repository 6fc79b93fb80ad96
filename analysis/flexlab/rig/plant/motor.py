"""The DC motor of joint 1 with its gear and the lead screw, driven by a voltage, held back by
friction and by the nut's force.

All is referred to the output shaft, which turns the screw: omega [rad/s], i [A], and

    L di/dt = u - R i - K omega                           R = U0 / I_stall,  K = (U0 - R I0) /
    omega0 J domega/dt = K i - T_f - M_load                      T_f = K I0 and what the screw adds;
    K U_start / R until it turns M_load = F lead / (2 pi eta)  where the motor drives the load, eta
    = eta_gear eta_screw,
             F lead / (2 pi) eta'  where the load drives the motor, eta' = max(0, 2 - 1/eta) of each
    eta_gear = M_stall / (K (I_stall - I0)),  so that the shaft's torque at rest is the data sheet's

With K for both torque and back-EMF (a motor without losses but friction), the no-load point and the
stall point of the data sheet are met exactly; a screw that loses as much either way has eta' = 2 -
1/eta (no less than 0: self-locking).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from flexura.errors import InputError

from ..description import Bench, Rig
from ..emulation import Emulated, EmulatedMotor

# the current is exact for a constant speed; far below the mechanical time constant of 30 ms
SUBSTEP_S = 2.5e-4


@dataclass(frozen=True)
class MotorData:
    """What the motor's data sheet comes to, at the output shaft; `starts_N_m`: static friction."""

    resistance_ohm: float
    inductance_H: float
    constant_N_m_A: float  # = V s/rad
    inertia_kg_m2: float
    friction_N_m: float
    starts_N_m: float
    gear_efficiency: float


def motor_data(rig: Rig, more: EmulatedMotor) -> MotorData:
    """From the data sheet's no-load and stall points. Raises InputError where no motor has both."""
    motor = rig.motor
    if motor.no_load_current_A >= motor.stall_current_A:
        expected = f"expected less than the current at rest, {motor.stall_current_A:g} A"
        raise InputError(expected, key="motor.no_load_current_A", value=motor.no_load_current_A)
    ohm = resistance(rig)
    constant = (motor.rated_voltage_V - ohm * motor.no_load_current_A) / (
        motor.no_load_speed_rpm * 2 * math.pi / 60
    )
    most = constant * (motor.stall_current_A - motor.no_load_current_A)
    if motor.stall_torque_N_m > most:
        expected = (
            f"expected at most {most:.3g} N m, what speed and currents allow without any "
            f"loss in the gear"
        )
        raise InputError(expected, key="motor.stall_torque_N_m", value=motor.stall_torque_N_m)
    return MotorData(
        ohm,
        more.inductance_H,
        constant,
        more.rotor_inertia_kg_m2 * motor.gear_ratio**2,
        constant * motor.no_load_current_A,
        constant * more.starts_at_V / ohm,
        motor.stall_torque_N_m / most,
    )


def resistance(rig: Rig) -> float:
    """R [ohm], of the motor at rest."""
    return rig.motor.rated_voltage_V / rig.motor.stall_current_A


def backwards(efficiency: float) -> float:
    """The efficiency of a gear or screw driven by its load, if it loses as much as when it drives
    it."""
    return max(0.0, 2 - 1 / efficiency)


class Motor:
    """The motor's state: current, speed and angle of the output shaft.

    `coulomb_N_m`, `viscous_N_m_s`: friction of the screw; `screw_efficiency` of what it drives;
    `friction`: a factor on all of the motor's and the screw's friction.
    """

    def __init__(
        self,
        data: MotorData,
        screw_efficiency: float = 1.0,
        coulomb_N_m: float = 0.0,
        viscous_N_m_s: float = 0.0,
        friction: float = 1.0,
    ) -> None:
        self.current_A = self.speed_rad_s = self.angle_rad = 0.0
        self.data = data
        self.slides_N_m = friction * (data.friction_N_m + coulomb_N_m)
        self.starts_N_m = friction * (max(data.starts_N_m, data.friction_N_m) + coulomb_N_m)
        self.viscous_N_m_s = friction * viscous_N_m_s
        self._driving = 1 / (data.gear_efficiency * screw_efficiency)
        self._driven = backwards(data.gear_efficiency) * backwards(screw_efficiency)

    def advance(self, seconds: float, voltage: float | None, load_N_m: float = 0.0) -> None:
        """Turn with this voltage at the terminals (None: open) against this torque of the load at
        the screw, without friction."""
        data = self.data
        count = max(1, round(seconds / SUBSTEP_S))
        step = seconds / count
        kept = math.exp(-step * data.resistance_ohm / data.inductance_H)
        i, omega, angle, k = self.current_A, self.speed_rad_s, self.angle_rad, data.constant_N_m_A
        for _ in range(count):
            if voltage is None:
                mean = i = 0.0
            else:
                final = (voltage - k * omega) / data.resistance_ohm
                mean, i = i, final + (i - final) * kept
                mean = 0.5 * (mean + i)
            drive = k * mean
            way = omega or drive - load_N_m
            drive -= load_N_m * (self._driving if way * load_N_m > 0 else self._driven)
            before = omega
            if before == 0.0 and abs(drive) <= self.starts_N_m:
                continue
            friction = math.copysign(self.slides_N_m, before or drive)
            omega = (before + step * (drive - friction) / data.inertia_kg_m2) / (
                1 + step * self.viscous_N_m_s / data.inertia_kg_m2
            )
            if omega * before < 0:
                omega = 0.0
            angle += 0.5 * (before + omega) * step
        self.current_A, self.speed_rad_s, self.angle_rad = i, omega, angle


@dataclass(frozen=True)
class JointLine:
    """Joint 1 as a linear motor with friction, F = force_N_V u - viscous v - coulomb sign v on mass
    `reflected_mass_kg` and the robot's own: what the rig's data come to at the joint, its
    inductance, dead zone and the nut's play left out. `static_N` holds at rest; `rail_N` of it and
    of `coulomb_N` is the rail's, which the nut crossing its play does not feel."""

    force_N_V: float
    viscous_N_s_m: float
    coulomb_N: float
    reflected_mass_kg: float
    static_N: float
    rail_N: float


def joint_line(bench: Bench, friction: float = 1.0) -> JointLine:
    """The rig's nominal line of joint 1; `friction`: a factor on all Coulomb and viscous friction
    (not on the back-EMF).

    With r = lead / (2 pi): force K / (R r), back-EMF K^2 / (R r^2), mass J / r^2. The rail's
    friction, which the motor always drives, counts 1 / (eta_gear eta_screw) times.
    """
    return line(bench.rig, bench.emulated, friction)


def line(rig: Rig, more: Emulated, friction: float = 1.0) -> JointLine:
    """As `joint_line`, for a rig file's tables without the files that they name."""
    data, r = motor_data(rig, more.motor), rig.screw.lead_m / (2 * math.pi)
    efficiency = data.gear_efficiency * rig.screw.efficiency
    rail = more.carriage.coulomb_friction_N / efficiency
    coulomb = (data.friction_N_m + more.screw.coulomb_friction_N_m) / r + rail
    static = (max(data.starts_N_m, data.friction_N_m) + more.screw.coulomb_friction_N_m) / r + rail
    viscous = (
        more.screw.viscous_friction_N_m_s / r**2 + more.carriage.viscous_friction_N_s_m / efficiency
    )
    return JointLine(
        data.constant_N_m_A / (data.resistance_ohm * r),
        data.constant_N_m_A**2 / (data.resistance_ohm * r**2) + friction * viscous,
        friction * coulomb,
        data.inertia_kg_m2 / r**2,
        friction * static,
        friction * rail,
    )
