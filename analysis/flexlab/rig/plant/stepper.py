"""The stepper of joint 2: a magnetic spring between the angle that the pulses command and the
rotor.

    T = T_h sin(N (theta_c - theta)) - T_d sin(4 N theta) - d dtheta/dt          N = 50: pole pairs,
    full steps in a turn / 4

(the usual model of a two-phase hybrid stepper with constant currents; T_d is the detent torque).
The spring is periodic: a rotor dragged beyond half its period of 2 pi / N is caught 4 full steps
off, so that steps are lost, as on a rig.

Exudyn gets this torque as a linear spring of constant stiffness k about a place that makes it exact
at the angle expected at the step's end; the remainder, (k - k')(theta - expected), is of the order
of the step squared and dies with it.
"""

from __future__ import annotations

import math

import numpy as np

from ..description import Stepper
from ..emulation import EmulatedStepper


class MagneticSpring:
    """Torque and stiffness of the energised stepper, or of the switched-off one with nothing but
    its detent."""

    def __init__(self, stepper: Stepper, more: EmulatedStepper) -> None:
        self.pole_pairs = stepper.full_steps_per_turn / 4
        self.holding_N_m, self.detent_N_m = stepper.holding_torque_N_m, more.detent_torque_N_m
        self.rad_per_step = 2 * math.pi / (stepper.full_steps_per_turn * stepper.microsteps)
        self.on_N_m = self.pole_pairs * self.holding_N_m
        self.off_N_m = max(4 * self.pole_pairs * self.detent_N_m, 1e-3 * self.on_N_m)

    def torque(self, command_rad: float, angle_rad: float, on: bool) -> float:
        """Torque on the rotor [N m] without its damping."""
        n = self.pole_pairs
        detent = -self.detent_N_m * math.sin(4 * n * angle_rad)
        return detent + self.holding_N_m * math.sin(n * (command_rad - angle_rad)) if on else detent

    def torques(self, command_rad: np.ndarray, angle_rad: np.ndarray) -> np.ndarray:
        """The same of many angles (T,), energised."""
        n = self.pole_pairs
        return self.holding_N_m * np.sin(n * (command_rad - angle_rad)) - self.detent_N_m * np.sin(
            4 * n * angle_rad
        )

    def stiffness(self, on: bool) -> float:
        """The stiffness k of the linear spring [N m/rad]."""
        return self.on_N_m if on else self.off_N_m

    def centre(self, command_rad: float, expected_rad: float, on: bool) -> float:
        """Where that spring must have its zero, for this command and the angle expected at the
        step's end [rad]."""
        return expected_rad + self.torque(command_rad, expected_rad, on) / self.stiffness(on)
