"""The stepper of joint 2: a magnetic spring between the pulses' angle and the rotor.

    T = T_h sin(N (theta_c - theta)) - T_d sin(4 N theta) - d dtheta/dt

N = 50 pole pairs, a quarter of the full steps in a turn; T_h is the holding and T_d the detent
torque (the usual model of a two-phase hybrid stepper with constant currents). The spring is
periodic: a rotor dragged beyond half its period of 2 pi / N is caught 4 full steps off. Steps are
then lost, as on a rig.

Exudyn gets this torque as a linear spring of constant stiffness k. Its zero makes the torque exact
at the angle expected at the step's end. The remainder, (k - k')(theta - expected), is of second
order in the step.
"""

from __future__ import annotations

import math

import numpy as np

from ..sheets import StepperSheet


class MagneticSpring:
    """Torque and stiffness of the stepper, energised or with its detent only."""

    def __init__(self, stepper: StepperSheet) -> None:
        self.pole_pairs = stepper.full_steps_per_turn / 4
        self.holding_N_m, self.detent_N_m = stepper.holding_torque_N_m, stepper.detent_torque_N_m
        self.rad_per_step = 2 * math.pi / (stepper.full_steps_per_turn * stepper.microsteps)
        self.on_N_m = self.pole_pairs * self.holding_N_m
        self.off_N_m = max(4 * self.pole_pairs * self.detent_N_m, 1e-3 * self.on_N_m)

    def torque(self, command_rad: float, angle_rad: float, on: bool) -> float:
        """Torque on the rotor without its damping [N m].

        Args:
            command_rad: angle of the pulses [rad].
            angle_rad: angle of the rotor [rad].
            on: whether the stepper is energised.
        """
        n = self.pole_pairs
        detent = -self.detent_N_m * math.sin(4 * n * angle_rad)
        return detent + self.holding_N_m * math.sin(n * (command_rad - angle_rad)) if on else detent

    def torques(self, command_rad: np.ndarray, angle_rad: np.ndarray) -> np.ndarray:
        """Torques of the energised stepper (T,) [N m] at angles of pulses and rotor (T,) [rad]."""
        n = self.pole_pairs
        return self.holding_N_m * np.sin(n * (command_rad - angle_rad)) - self.detent_N_m * np.sin(
            4 * n * angle_rad
        )

    def stiffness(self, on: bool) -> float:
        """Stiffness k of the linear spring [N m/rad]."""
        return self.on_N_m if on else self.off_N_m

    def centre(self, command_rad: float, expected_rad: float, on: bool) -> float:
        """Zero of the linear spring [rad].

        Args:
            command_rad: angle of the pulses [rad].
            expected_rad: the rotor's angle expected at the step's end [rad].
            on: whether the stepper is energised.
        """
        return expected_rad + self.torque(command_rad, expected_rad, on) / self.stiffness(on)
