"""What moves a joint of the emulated rig: a motor behind its backlash, or a stepper's field.

Each gives Exudyn one linear spring for a step: stiffness, damping, and the zero that makes the
force right at the step's end. The motor's side touches a flank of the backlash b, or none while it
crosses it. The joint's own friction is an elastic-plastic spring that gives way by d and then
slides:

    F_motor = -k (x - s -+ b/2) - c (x' - s')    if x - s is beyond +-b/2, s = r angle
    F_own   = -(F_c / d) (x - z) - c_r x'        z follows x at no more than d
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ..axes import MotorAxis
from ..emulation import TrueParameters
from ..sheets import StepperSheet
from .motor import DCMotor, motor_data
from .stepper import MagneticSpring


class Spring(NamedTuple):
    """A joint's spring for one step; N and m, or N m and rad."""

    stiffness: float
    damping: float
    zero: float


class MotorDrive:
    """A geared DC motor at a joint, its screw if it has one, backlash and the joint's friction."""

    def __init__(
        self,
        axis: MotorAxis,
        truth: TrueParameters,
        start: float,
        step_s: float,
        dead_zone_V: float,
    ) -> None:
        """Set the drive up at rest.

        Args:
            axis: the joint.
            truth: factors on friction and backlash.
            start: position of the joint [m or rad].
            step_s: the plant's step [s].
            dead_zone_V: of the bridge [V].
        """
        guide = axis.guide
        self.motor = DCMotor(
            motor_data(axis),
            axis.efficiency,
            axis.screw_coulomb_N_m,
            axis.screw_viscous_N_m_s,
            truth.friction,
        )
        self._ratio, self._start, self._step_s = axis.transmission, start, step_s
        self._dead_zone_V = dead_zone_V
        self._half_backlash = 0.5 * truth.backlash * guide.backlash
        self._contact = guide.contact_stiffness, guide.contact_damping
        self._presliding = guide.presliding
        self._own_stiffness = truth.friction * guide.coulomb / guide.presliding
        self._own_damping = truth.friction * guide.viscous
        self._anchor = self._x = start
        self._flank: float | None = None
        self._load_N_m = 0.0

    @property
    def shaft(self) -> float:
        """The joint's position by the motor's encoder, without backlash [m or rad]."""
        return self._start + self._ratio * self.motor.angle_rad

    def advance(self, voltage: float, on: bool) -> None:
        """Let the motor run for a step under its mean voltage [V] and the last step's load."""
        voltage = math.copysign(max(0.0, abs(voltage) - self._dead_zone_V), voltage)
        self.motor.advance(self._step_s, voltage if on else None, self._load_N_m)

    def spring(self, here: float) -> Spring:
        """The joint's spring for a step from `here` [m or rad].

        One spring stands for motor and friction; its zero makes its force the sum of both: k x_0 +
        c s' = k_1 z + k_2 flank + c s'.
        """
        expected = 2 * here - self._x
        self._anchor = min(
            max(self._anchor, expected - self._presliding), expected + self._presliding
        )
        stiffness, damping, pull = (
            self._own_stiffness,
            self._own_damping,
            self._own_stiffness * self._anchor,
        )
        shaft, self._flank = self.shaft, None
        if expected - shaft >= self._half_backlash:
            self._flank = shaft + self._half_backlash
        elif shaft - expected >= self._half_backlash:
            self._flank = shaft - self._half_backlash
        if self._flank is not None:
            stiffness, damping = stiffness + self._contact[0], damping + self._contact[1]
            pull += (
                self._contact[0] * self._flank
                + self._contact[1] * self._ratio * self.motor.speed_rad_s
            )
        return Spring(stiffness, damping, pull / stiffness if stiffness else 0.0)

    def finish(self, before: float, after: float) -> None:
        """Take the positions at a step's begin and end [m or rad]: the load of the next."""
        self._x = before
        if self._flank is None:
            self._load_N_m = 0.0
            return
        stiffness, damping = self._contact
        slip = (after - before) / self._step_s - self._ratio * self.motor.speed_rad_s
        self._load_N_m = -self._ratio * (stiffness * (after - self._flank) + damping * slip)


class StepperDrive:
    """A stepper on the joint's axis."""

    def __init__(self, stepper: StepperSheet, start: float) -> None:
        self.field = MagneticSpring(stepper)
        self._start, self._theta = start, start
        self._damping = stepper.damping_N_m_s
        self._steps = self._command = 0.0
        self._on = False

    def advance(self, steps: float, on: bool) -> None:
        """Take a step's mean of the microsteps, and whether the driver is on.

        The command leads by half of its last change: a mean stands for the step's middle.
        """
        self._command = self._start + (1.5 * steps - 0.5 * self._steps) * self.field.rad_per_step
        self._steps, self._on = steps, on

    def spring(self, here: float) -> Spring:
        """The joint's spring for a step from `here` [rad]."""
        zero = self.field.centre(self._command, 2 * here - self._theta, self._on)
        return Spring(self.field.stiffness(self._on), self._damping, zero)

    def finish(self, before: float, after: float) -> None:
        """Take the positions at a step's begin and end [rad]."""
        self._theta = before
