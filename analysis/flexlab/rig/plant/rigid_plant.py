"""A plant without elasticity: motors, screw, stepper, switches and sensors, the links straight.

`flexura flash --emulated` and the firmware's tests use it. A motor follows its line of speed over
voltage with a time constant and a dead zone; the stepper takes every step.

    tau dv/dt = r omega0 (u - sign(u) u_f) / (U0 - u_f) - v         (v = 0 at rest, if |u| <= u_f)
"""

from __future__ import annotations

import math

from ...board.emulator.emulated import Outputs, Sensors
from ..board_axes import board_axes
from ..configuration import configuration
from ..description import RigSetup
from ..sheets import MotorSheet

TIME_CONSTANT_S = 0.04  # mechanical, motor with what it moves; assumed
STARTS_AT_V = 1.0  # the motors' data: starts to turn


class RigidPlant:
    """The rig's drives as a plant (`board.emulated.Plant`). Public fields may be set.

    `positions`: of the joints [m, rad]. `blocked`: joints that are held, numbers from 1.
    """

    def __init__(
        self, setup: RigSetup, start: float = 0.0, settings: dict[str, float] | None = None
    ) -> None:
        """Set up the plant at rest.

        Args:
            setup: the rig.
            start: position of joint 1 [m or rad].
            settings: of the board, by default those of the rig.
        """
        settings = settings or configuration(setup)
        rig = setup.rig
        self.supply_V = rig.driver.supply_V
        self.positions, self.speeds = [start, 0.0], [0.0, 0.0]
        self.blocked: set[int] = set()
        self.joint_reversed = False  # a coil of the stepper is swapped
        self.ends = setup.limits[0]  # where the switches are; the joint goes on beyond them
        self.flex_V = 5.0 * settings["flex_zero"]
        self.emergency_stop = False
        self._divider = settings["supply_divider"]
        travel = rig.screw.lead_m / (2 * math.pi) if rig.screw else 1.0
        self._per_V = [_speed_for_V(rig.motor, travel)]
        if rig.motor_2:
            self._per_V.append(_speed_for_V(rig.motor_2, 1.0))
        self._counts = [axis.counts for axis in board_axes(settings)]
        self._rad_per_step = 1 / settings["stepper_steps_per_rad"] if rig.stepper else 0.0
        self._steps = 0.0
        self._sensors = Sensors()

    def advance(self, seconds: float, outputs: Outputs) -> Sensors:
        """Advance the plant with the board's outputs; returns what its inputs then see.

        Args:
            seconds: time to advance [s].
            outputs: of the board, constant in this time.
        """
        for k, per_V in enumerate(self._per_V):
            self._turn(k, per_V, seconds, outputs.duty[k] if outputs.motor_on[k] else 0.0)
        taken, self._steps = outputs.steps - self._steps, outputs.steps
        if 2 not in self.blocked:
            self.positions[1] += (-taken if self.joint_reversed else taken) * self._rad_per_step
        sensors = self._sensors
        counts = [c * at for c, at in zip(self._counts, self.positions, strict=False)]
        sensors.encoder_1, sensors.encoder_2 = counts[0], (counts[1:] or [0.0])[0]
        sensors.flex_V, sensors.supply_V = self.flex_V, self.supply_V / self._divider
        here = self.positions[0]
        sensors.limit_low, sensors.limit_high = here <= self.ends[0], here >= self.ends[1]
        sensors.emergency_stop = self.emergency_stop
        return sensors

    def _turn(self, k: int, per_V: float, seconds: float, duty: float) -> None:
        u = duty * self.supply_V
        drive = math.copysign(max(0.0, abs(u) - STARTS_AT_V), u)
        kept = math.exp(-seconds / TIME_CONSTANT_S)
        blocked, before = k + 1 in self.blocked, self.speeds[k]
        speed = 0.0 if blocked else drive * per_V * (1 - kept) + before * kept
        # a creep of 0.1 % of the speed at 1 V is rest
        if drive == 0.0 and abs(speed) < 1e-3 * per_V:
            speed = 0.0
        self.speeds[k] = speed
        if not blocked:
            self.positions[k] += 0.5 * (before + speed) * seconds


def _speed_for_V(motor: MotorSheet, travel: float) -> float:
    """Speed of a joint for a volt beyond the starting voltage [m/s or rad/s]."""
    turn = motor.no_load_speed_rpm * 2 * math.pi / 60
    return travel * turn / (motor.rated_voltage_V - STARTS_AT_V)
