"""A plant without elasticity: motor, screw, stepper, switches and sensors, the strip straight.

`flexura flash --emulated` and the firmware's tests use it. The motor follows its line of speed over
voltage with a time constant and a dead zone; the stepper takes every step.

    tau dv/dt = lead n0 (u - sign(u) u_f) / (60 (U0 - u_f)) - v     (v = 0 at rest, if |u| <= u_f)
"""

from __future__ import annotations

import math

from ...board.emulator.emulated import Outputs, Sensors
from ..description import RigSetup, configuration

TIME_CONSTANT_S = 0.04  # mechanical, motor with screw and carriage; assumed
STARTS_AT_V = 1.0  # the motor's data: starts to turn


class RigidPlant:
    """The rig's drives as a plant (`board.emulated.Plant`). Public fields may be set."""

    def __init__(
        self, setup: RigSetup, start_m: float = 0.0, settings: dict[str, float] | None = None
    ) -> None:
        """Set up the plant at rest.

        Args:
            setup: the rig.
            start_m: position of the carriage [m].
            settings: of the board, by default those of the rig.
        """
        settings = settings or configuration(setup)
        motor = setup.rig.motor
        self.supply_V = setup.rig.driver.supply_V
        self.carriage_m, self.speed_m_s, self.joint_rad = start_m, 0.0, 0.0
        self.blocked = False  # the carriage is held
        self.joint_blocked = False  # joint 2 is held: steps are lost
        self.joint_reversed = False  # a coil of the stepper is swapped
        self.ends_m = setup.limits[0]  # where the switches are; the carriage goes on beyond them
        self.flex_V = 5.0 * settings["flex_zero"]
        self.emergency_stop = False
        self._divider = settings["supply_divider"]
        self._m_s_for_V = (
            setup.rig.screw.lead_m
            * motor.no_load_speed_rpm
            / 60
            / (motor.rated_voltage_V - STARTS_AT_V)
        )
        self._counts_per_m, self._counts_per_rad = (
            settings["motor_counts_per_m"],
            settings["stepper_counts_per_rad"],
        )
        self._rad_per_step = 1 / settings["stepper_steps_per_rad"]
        self._steps = 0.0
        self._sensors = Sensors()

    def advance(self, seconds: float, outputs: Outputs) -> Sensors:
        """Advance the plant with the board's outputs; returns what its inputs then see.

        Args:
            seconds: time to advance [s].
            outputs: of the board, constant in this time.
        """
        u = outputs.duty * self.supply_V if outputs.motor_on else 0.0
        drive = math.copysign(max(0.0, abs(u) - STARTS_AT_V), u)
        kept = math.exp(-seconds / TIME_CONSTANT_S)
        before = self.speed_m_s
        self.speed_m_s = (
            0.0 if self.blocked else drive * self._m_s_for_V * (1 - kept) + before * kept
        )
        if drive == 0.0 and abs(self.speed_m_s) < 1e-4:
            self.speed_m_s = 0.0
        self.carriage_m += 0.5 * (before + self.speed_m_s) * seconds if not self.blocked else 0.0
        taken, self._steps = outputs.steps - self._steps, outputs.steps
        if not self.joint_blocked:
            self.joint_rad += (-taken if self.joint_reversed else taken) * self._rad_per_step
        sensors = self._sensors
        sensors.encoder_1 = self.carriage_m * self._counts_per_m
        sensors.encoder_2 = self.joint_rad * self._counts_per_rad
        sensors.flex_V, sensors.supply_V = self.flex_V, self.supply_V / self._divider
        sensors.limit_low, sensors.limit_high = (
            self.carriage_m <= self.ends_m[0],
            self.carriage_m >= self.ends_m[1],
        )
        sensors.emergency_stop = self.emergency_stop
        return sensors
