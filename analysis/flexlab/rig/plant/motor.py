"""A DC motor with its gear, and a lead screw if it drives one, driven by a voltage.

All is referred to the output shaft, which turns at omega [rad/s]; r is the transmission:

    L di/dt = u - R i - K omega               R = U0 / I_stall,  K = (U0 - R I0) / omega0
    J domega/dt = K i - T_f - M_load          T_f = K I0 and the screw's friction
    T_f = K U_start / R and the screw's friction at rest
    M_load = F r / eta                        the motor drives the load, eta = eta_gear eta_screw
    M_load = F r eta'                         the load drives the motor, eta' = max(0, 2 - 1/eta)
    eta_gear = M_stall / (K (I_stall - I0))   so that the torque at rest is the data sheet's

K is both the torque and the back-EMF constant: a motor without losses but friction meets the data
sheet's no-load and stall points exactly. A screw that loses as much either way has
eta' = 2 - 1/eta, no less than 0 (self-locking).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from flexura.errors import InputError

from ..axes import MotorAxis
from ..sheets import MotorSheet

# the current is exact for a constant speed; far below the mechanical time constant of 30 ms
SUBSTEP_S = 2.5e-4


@dataclass(frozen=True)
class MotorData:
    """The motor at the output shaft; `breakaway_N_m` is its static friction."""

    resistance_ohm: float
    inductance_H: float
    constant_N_m_A: float  # = V s/rad
    inertia_kg_m2: float
    friction_N_m: float
    breakaway_N_m: float
    gear_efficiency: float


def motor_data(axis: MotorAxis) -> MotorData:
    """Constants of the motor from the data sheet's no-load and stall points.

    Args:
        axis: the joint.

    Raises:
        InputError: no motor has both points, or rotor, inductance or starting voltage are missing.
    """
    motor, key = axis.motor, axis.table
    if motor.no_load_current_A >= motor.stall_current_A:
        expected = f"expected less than the current at rest, {motor.stall_current_A:g} A"
        raise InputError(expected, key=f"{key}.no_load_current_A", value=motor.no_load_current_A)
    ohm = resistance(motor)
    constant = (motor.rated_voltage_V - ohm * motor.no_load_current_A) / (
        motor.no_load_speed_rpm * 2 * math.pi / 60
    )
    max_torque = constant * (motor.stall_current_A - motor.no_load_current_A)
    if motor.stall_torque_N_m > max_torque:
        expected = (
            f"expected at most {max_torque:.3g} N m, what speed and currents allow without any "
            f"loss in the gear"
        )
        raise InputError(expected, key=f"{key}.stall_torque_N_m", value=motor.stall_torque_N_m)
    given = motor.inductance_H, motor.rotor_inertia_kg_m2, motor.starts_at_V
    names = ("inductance_H", "rotor_inertia_kg_m2", "starts_at_V")
    for name, value in zip(names, given, strict=True):
        if value is None:
            raise InputError(
                "missing: the motor cannot be simulated without it", key=f"{key}.{name}"
            )
    inductance, inertia, starts = (float(value or 0.0) for value in given)
    return MotorData(
        ohm,
        inductance,
        constant,
        inertia * motor.gear_ratio**2,
        constant * motor.no_load_current_A,
        constant * starts / ohm,
        motor.stall_torque_N_m / max_torque,
    )


def resistance(motor: MotorSheet) -> float:
    """Resistance R of a motor at rest [ohm]."""
    return motor.rated_voltage_V / motor.stall_current_A


def back_driven_efficiency(efficiency: float) -> float:
    """Efficiency of a gear or screw that its load drives, with the same losses as driven."""
    return max(0.0, 2 - 1 / efficiency)


class DCMotor:
    """State of the motor: current [A], speed [rad/s] and angle [rad] of the output shaft."""

    def __init__(
        self,
        data: MotorData,
        screw_efficiency: float = 1.0,
        coulomb_N_m: float = 0.0,
        viscous_N_m_s: float = 0.0,
        friction: float = 1.0,
    ) -> None:
        """Set up the motor at rest.

        Args:
            data: constants of the motor.
            screw_efficiency: of the screw, for the load.
            coulomb_N_m: Coulomb friction of the screw [N m].
            viscous_N_m_s: viscous friction of the screw [N m s/rad].
            friction: factor on all friction of motor and screw.
        """
        self.current_A = self.speed_rad_s = self.angle_rad = 0.0
        self.data = data
        self.sliding_N_m = friction * (data.friction_N_m + coulomb_N_m)
        self.breakaway_N_m = friction * (max(data.breakaway_N_m, data.friction_N_m) + coulomb_N_m)
        self.viscous_N_m_s = friction * viscous_N_m_s
        self._driving = 1 / (data.gear_efficiency * screw_efficiency)
        self._back_driving = back_driven_efficiency(data.gear_efficiency) * back_driven_efficiency(
            screw_efficiency
        )

    def advance(self, seconds: float, voltage: float | None, load_N_m: float = 0.0) -> None:
        """Advance the motor.

        Args:
            seconds: time to advance [s].
            voltage: at the terminals [V]; None: open.
            load_N_m: torque of the load at the screw, without friction [N m].
        """
        data = self.data
        count = max(1, round(seconds / SUBSTEP_S))
        step = seconds / count
        decay = math.exp(-step * data.resistance_ohm / data.inductance_H)
        i, omega, angle, k = self.current_A, self.speed_rad_s, self.angle_rad, data.constant_N_m_A
        for _ in range(count):
            if voltage is None:
                mean = i = 0.0
            else:
                steady_A = (voltage - k * omega) / data.resistance_ohm
                mean, i = i, steady_A + (i - steady_A) * decay
                mean = 0.5 * (mean + i)
            drive = k * mean
            direction = omega or drive - load_N_m
            drive -= load_N_m * (self._driving if direction * load_N_m > 0 else self._back_driving)
            before = omega
            if before == 0.0 and abs(drive) <= self.breakaway_N_m:
                continue
            friction = math.copysign(self.sliding_N_m, before or drive)
            omega = (before + step * (drive - friction) / data.inertia_kg_m2) / (
                1 + step * self.viscous_N_m_s / data.inertia_kg_m2
            )
            if omega * before < 0:
                omega = 0.0
            angle += 0.5 * (before + omega) * step
        self.current_A, self.speed_rad_s, self.angle_rad = i, omega, angle


@dataclass(frozen=True)
class JointLine:
    """A joint with a motor as a linear motor with friction: F = force_per_V u - viscous v -
    coulomb sign v.

    F [N or N m] acts on `inertia` [kg or kg m^2], the rotor's at the joint, and the robot's own.
    Inductance, dead zone and backlash are left out. `static` holds at rest. `guide` is the joint's
    own part of `coulomb` and `static`; it is missing while the motor crosses the backlash.
    `efficiency` is that of gear and screw, `back_driven` where the load drives them.
    """

    force_per_V: float
    viscous: float
    coulomb: float
    inertia: float
    static: float
    guide: float
    efficiency: float
    back_driven: float

    def moved(self, load: float) -> float:
        """What the motor moves at the joint with a rigid load [kg or kg m^2].

        The motor drives its load against the joint's friction, so that the load's inertia counts
        1 / efficiency times.

        Args:
            load: mass or inertia of the load.
        """
        return self.inertia + load / self.efficiency


def joint_line(
    axis: MotorAxis, friction: float = 1.0, own: float | None = None, *, delayed: bool = False
) -> JointLine:
    """A joint with a motor as a linear motor, from the rig's nominal data.

    Force K / (R r), back-EMF K^2 / (R r^2), inertia J / r^2. The motor always drives the joint's
    own friction, which counts 1 / (eta_gear eta_screw) times.

    With an inductance L the current is late by tau = L / R. For motions slower than tau the voltage
    acts later by tau, and so does the back-EMF c_E v: -c_E v(t - tau) = -c_E v + c_E tau v'. Who
    delays the voltage by tau sees the inertia J / r^2 - c_E tau.

    Args:
        axis: the joint.
        friction: factor on Coulomb and viscous friction, not on the back-EMF.
        own: factor on the joint's own friction; None: the same.
        delayed: for a voltage that acts later by L / R.
    """
    data, r, guide = motor_data(axis), axis.transmission, axis.guide
    efficiency = data.gear_efficiency * axis.efficiency
    own = friction if own is None else own
    rail = own * guide.coulomb / efficiency
    coulomb = friction * (data.friction_N_m + axis.screw_coulomb_N_m) / r + rail
    breakaway = max(data.breakaway_N_m, data.friction_N_m) + axis.screw_coulomb_N_m
    viscous = friction * axis.screw_viscous_N_m_s / r**2 + own * guide.viscous / efficiency
    back_emf = data.constant_N_m_A**2 / (data.resistance_ohm * r**2)
    late_s = data.inductance_H / data.resistance_ohm if delayed else 0.0
    return JointLine(
        data.constant_N_m_A / (data.resistance_ohm * r),
        back_emf + viscous,
        coulomb,
        data.inertia_kg_m2 / r**2 - back_emf * late_s,
        friction * breakaway / r + rail,
        rail,
        efficiency,
        back_driven_efficiency(data.gear_efficiency) * back_driven_efficiency(axis.efficiency),
    )
