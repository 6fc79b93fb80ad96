"""The strip as seen by the flex sensor and by joint 2's encoder, for given parameters.

The carriage follows the motor behind the backlash, which the rail's friction widens by 2 F/k (k:
stiffness of the nut). Joint 2 is on the stepper's magnetic spring, about the angle of the pulses.
The native simulation of both gives the sensor's voltage,

    alpha = angle(s_0 + l) - angle(s_0),   sin angle = w'(s)
    U = U_cc R_f / (R_0 + g k alpha (1 + n alpha) + R_f)

taken tau late (the mean of conversions, the board's ticks). Offset and slow drift, a polynomial of
third degree over time, are projected out. Both residuals are in units of their noise.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import flexura as fx
from flexura import signals
from flexura.signals import JointDrive

from ..comparison.replay import lead_screw
from ..comparison.replay.simulate_experiment import joint_2_pulse_angle
from ..comparison.replay.smoothing import (
    initial_rest,
    recorded_samples,
    smoothing_spline,
    with_initial_rest,
)
from ..comparison.replay.stepper_relaxation import RelaxationState, simulate_with_stepper
from ..rig.description import Rig
from ..rig.emulation import Emulated
from ..rig.plant.flex_sensor import LOGIC_V
from ..rig.plant.stepper import MagneticSpring

DRIFT_DEGREE = 3  # degree of the polynomial that offset and drift may follow
MODES = 3
# relative to the holding torque; small, because derivatives are differences of such simulations
TORQUE_TOLERANCE = 5e-5
METHOD, RTOL = "implicit", 1e-3  # the cheapest where data break the drives every 2 ms
TORQUE_STEP_S = 2e-3  # between two values of the stepper's torque that the relaxation corrects


class StripModel:
    """One experiment's data and their simulation."""

    def __init__(
        self,
        experiment: fx.Run,
        rig: Rig,
        emulated: Emulated,
        robot: fx.Robot,
        friction: float = 1.0,
        until_s: float = np.inf,
    ) -> None:
        """Prepare the data.

        Args:
            experiment: the run.
            rig: its rig file.
            emulated: the table [emulated] of the rig file.
            robot: the nominal robot.
            friction: factor on the rail's friction.
            until_s: end of the data used, from their start [s].
        """
        part = experiment.t <= experiment.t[0] + until_s
        self.t = experiment.t[part]
        self.rig, self.emulated, self.robot = rig, emulated, robot
        self._times = np.concatenate([initial_rest(self.t), self.t])
        nut = smoothing_spline(
            *with_initial_rest(
                *recorded_samples(self.t, experiment["joint/1/position"][part], "joint/1/position")
            )
        )
        self._nut_m = np.array([nut(at)[0] for at in self._times])
        self._friction = friction
        self.pulses, _ = joint_2_pulse_angle(experiment)
        self.flex_V, self.joint_rad = (
            experiment["link/2/flex_voltage"][part],
            experiment["joint/2/position"][part],
        )
        tolerance = self.t < self.t[0] + 0.3
        self.flex_noise_V = max(float(np.nanstd(self.flex_V[tolerance])), 1e-4)
        self.joint_noise_rad = 2 * np.pi / (4 * rig.stepper.encoder_pulses) / np.sqrt(12)
        self._guess = RelaxationState(MagneticSpring(rig.stepper, emulated.stepper).on_N_m)

    def residuals(self, values: dict[str, float], elements: int | None = None) -> np.ndarray:
        """Residuals of flex voltage and joint 2, 0 for a missing sample.

        Args:
            values: parameters by name, as in `simulate`.
            elements: of the strip, by default those of the file.

        Returns:
            (2, T), in units of the noise.
        """
        run = self.simulate(values, elements)
        flex = (self.voltage(run, values) - self.flex_V) / self.flex_noise_V
        joint = (run["joint/2/position"] - self.joint_rad) / self.joint_noise_rad
        return np.stack(
            [_without_drift(self.t, flex, DRIFT_DEGREE), _without_drift(self.t, joint, 0)]
        )

    def simulate(
        self, values: dict[str, float], elements: int | None = None, rtol: float = RTOL
    ) -> fx.Run:
        """Simulate the experiment at its own times.

        Args:
            values: factors on the files' values, backlash [m], delay [s], by name.
            elements: of the strip, by default those of the file.
            rtol: tolerance.

        Returns:
            The run, with the bend under the sensor as `link/2/bend` [rad].
        """
        times = self._times
        nut = self.emulated.carriage.model_copy(update={"backlash_m": values["backlash_m"]})
        x = lead_screw.backlash_output(
            self._nut_m, lead_screw.backlash(nut, self._friction * values.get("give", 1.0))
        )
        moved = JointDrive(
            motion=signals.Signal(signals.table(times, x).segments[:-1]), prescribed=True
        )
        stepper = self.rig.stepper.model_copy(
            update={"holding_torque_N_m": self.rig.stepper.holding_torque_N_m * values["holding"]}
        )
        system = fx.assemble(
            with_stepper_damping(with_parameters(self.robot, values), self.emulated, elements)
        )
        q0 = system.start()
        q0[system.joint_rows] = x[0], self.pulses(times[0])[0]
        spring = MagneticSpring(stepper, self.emulated.stepper)
        run = simulate_with_stepper(
            (system, q0),
            times,
            moved,
            self.pulses,
            spring,
            rtol,
            state=self._guess,
            torque_step_s=TORQUE_STEP_S,
            method=METHOD,
            tolerance=TORQUE_TOLERANCE,
        )
        kept = slice(len(times) - len(self.t), None)
        channels = run.channels | {"link/2/bend": self._bend(system, run)}
        return fx.Run(
            self.t,
            {n: v[kept] for n, v in channels.items()},
            run.units | {"link/2/bend": "rad"},
            run.meta,
        )

    def _bend(self, system: fx.System, run: fx.Run) -> np.ndarray:
        """The bend under the sensor (T,) [rad] of a run that holds its states."""
        assert run.states is not None
        ends = np.array(
            [self.emulated.flex.from_m, self.emulated.flex.from_m + self.rig.flex.length_m]
        )
        low, high = system.angles(2, ends) @ run.states[:, : system.n].T
        return np.asarray(high - low)

    def voltage(self, run: fx.Run, values: dict[str, float]) -> np.ndarray:
        """The sensor's voltage (T,) [V] without offset and noise.

        Args:
            run: a run of `simulate`.
            values: parameters by name.
        """
        from scipy.interpolate import CubicSpline

        flex, emulated = self.rig.flex, self.emulated.flex
        a = run["link/2/bend"]
        ohm = flex.straight_ohm + values["flex_gain"] * flex.ohm_per_rad * a * (
            1 + emulated.nonlinearity_1_rad * a
        )
        volts = LOGIC_V * flex.divider_ohm / (ohm + flex.divider_ohm)
        return CubicSpline(self.t, volts)(self.t - values["delay_s"])


def with_parameters(robot: fx.Robot, values: dict[str, float]) -> fx.Robot:
    """The robot with changed parameters.

    Args:
        robot: the nominal robot.
        values: factors `stiffness`, `damping`, `payload` and, if given, `mass` of the strip;
            `gyration_m`, radius of gyration of the payload [m].
    """
    strip = robot.links[1]
    heavy = "density_kg_m3" if strip.density_kg_m3 is not None else "mass_per_length_kg_m"
    given = "young_modulus_Pa" if strip.young_modulus_Pa is not None else "bending_stiffness_N_m2"
    mass = values["payload"] * robot.payload.mass_kg
    times = lambda key, factor: _times(robot.to_dict()["link"][1][key], factor)
    return robot.replace(
        {
            f"link.2.{given}": times(given, values["stiffness"]),
            f"link.2.{heavy}": times(heavy, values.get("mass", 1.0)),
            "link.2.damping.beta_s": values["damping"] * strip.damping.beta_s,
            "payload.mass_kg": mass,
            "payload.inertia_kg_m2": values["payload"] * robot.payload.inertia_kg_m2
            + mass * values.get("gyration_m", 0.0) ** 2,
        }
    )


def _times(value: Any, factor: float) -> Any:
    """A number of a robot file, or its list along the link, times a factor."""
    return (
        [entry | {"value": factor * entry["value"]} for entry in value]
        if isinstance(value, list)
        else factor * value
    )


def with_stepper_damping(
    robot: fx.Robot, emulated: Emulated, elements: int | None = None
) -> fx.Robot:
    """The robot with the strip's lowest modes and the stepper's damping in joint 2."""
    strip = robot.links[1]
    return robot.replace(
        {
            "link.2.modes": MODES,
            "link.2.elements": elements or strip.elements,
            "link.2.joint.viscous_friction": strip.joint.viscous_friction
            + emulated.stepper.damping_N_m_s,
        }
    )


def _without_drift(t: np.ndarray, y: np.ndarray, degree: int) -> np.ndarray:
    """y (T,) less the polynomial of a degree that fits it best; 0 for a missing sample."""
    there = np.isfinite(y)
    A = np.polynomial.legendre.legvander(2 * (t - t[0]) / (t[-1] - t[0]) - 1, degree)
    Q, _ = np.linalg.qr(A[there])
    out = np.zeros(len(y))
    out[there] = y[there] - Q @ (Q.T @ y[there])
    return out
