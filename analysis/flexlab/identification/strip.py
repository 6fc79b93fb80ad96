"""The strip as seen by its sensor and by a stepper's encoder, for given parameters.

A joint on a lead screw follows the motor behind the backlash, which the joint's friction widens by
2 F/k (k: stiffness of the contact). A joint that a geared motor turns is on the teeth of the gear;
its bearing's friction brakes the links. A joint with a stepper is on its magnetic spring, about the
angle of the pulses. The native simulation of all gives the sensor's voltage; of a flex sensor

    alpha = angle(s_0 + l) - angle(s_0)
    U = U_cc R_f / (R_0 + g k alpha (1 + n alpha) + R_f)

taken tau late (the mean of conversions, the board's ticks). Offset and slow drift, a polynomial of
third degree over time, are projected out. Residuals are in units of their noise.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import flexura as fx
from flexura import signals
from flexura.control import Backlash, Contact
from flexura.errors import InputError
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
from ..recordings.unit_conversion import voltage_channel
from ..rig.axes import Friction, motor_axes
from ..rig.description import Rig, strip_of
from ..rig.plant.stepper import MagneticSpring
from ..rig.plant.strip_sensor import StripSensor
from ..rig.sensors import Flex, StrainGauge

DRIFT_DEGREE = 3  # degree of the polynomial that offset and drift may follow
MODES, MODES_BEFORE = 3, 1  # of the last link, and of one before it
# relative to the holding torque; small, because derivatives are differences of such simulations
TORQUE_TOLERANCE = 5e-5
METHOD, RTOL = "implicit", 1e-3  # the cheapest where data break the drives every 2 ms
# contacts begin and end within a step: differences of such simulations must be smooth
GEAR_METHOD, GEAR_RTOL = "auto", 1e-4
TORQUE_STEP_S = 2e-3  # between two values of the stepper's torque that the relaxation corrects
BEARING = "bearing"  # the factor on the friction of bearings that gears turn
CURVATURE_STEP = 1e-3  # of the link's length: between the slopes whose difference is a curvature


class StripModel:
    """One experiment's data and their simulation."""

    def __init__(
        self,
        experiment: fx.Run,
        rig: Rig,
        robot: fx.Robot,
        friction: dict[int, Friction] | None = None,
        until_s: float = np.inf,
    ) -> None:
        """Prepare the data.

        Args:
            experiment: the run.
            rig: its rig file.
            robot: the nominal robot.
            friction: factors on the friction of joints with motors, by their numbers.
            until_s: end of the data used, from their start [s].

        Raises:
            InputError: the rig has no flex sensor and no strain gauge.
        """
        if not isinstance(rig.sensor, Flex | StrainGauge):
            raise InputError("expected a rig with a flex sensor or a strain gauge", key="rig.flex")
        part = experiment.t <= experiment.t[0] + until_s
        self.t = experiment.t[part]
        self.rig, self.robot, self.link = rig, robot, strip_of(robot)
        self.sensor = rig.sensor
        self._times = np.concatenate([initial_rest(self.t), self.t])
        self._friction = friction or {}
        self._shafts = {}
        for axis in motor_axes(rig):
            name = f"joint/{axis.number}/position"
            samples = recorded_samples(self.t, experiment[name][part], name)
            self._shafts[axis] = smoothing_spline(*with_initial_rest(*samples))
        self._shaft_positions = {
            axis: signals.evaluate_many(shaft.segments, self._times)[0]
            for axis, shaft in self._shafts.items()
        }
        kind = "flex" if isinstance(rig.sensor, Flex) else "strain_gauge"
        self.sensor_V = experiment[voltage_channel(self.link, kind)][part]
        resting = self.t < self.t[0] + 0.3
        self.sensor_noise_V = max(float(np.nanstd(self.sensor_V[resting])), 1e-4)
        self.stepper = rig.stepper
        self.encoder = bool(rig.stepper and rig.stepper.encoder_pulses)
        if self.stepper:
            self.pulses, _ = joint_2_pulse_angle(experiment)
            self._guess = RelaxationState(MagneticSpring(self.stepper).on_N_m)
        if self.stepper and self.stepper.encoder_pulses:
            self.joint_rad = experiment["joint/2/position"][part]
            counts = 4 * self.stepper.encoder_pulses
            self.joint_noise_rad = 2 * np.pi / counts / np.sqrt(12)

    def residuals(self, values: dict[str, float], elements: int = 0) -> np.ndarray:
        """Residuals of the sensor's voltage and of a stepper's encoder, 0 for a missing sample.

        Args:
            values: parameters by name, as in `simulate`.
            elements: more (or less) elements of each link than the file's.

        Returns:
            (1, T) or (2, T), in units of the noise.
        """
        run = self.simulate(values, elements)
        sensor = (self.voltage(run, values) - self.sensor_V) / self.sensor_noise_V
        out = [_without_drift(self.t, sensor, DRIFT_DEGREE)]
        if self.encoder:
            joint = (run["joint/2/position"] - self.joint_rad) / self.joint_noise_rad
            out.append(_without_drift(self.t, joint, 0))
        return np.stack(out)

    def simulate(self, values: dict[str, float], elements: int = 0, rtol: float = RTOL) -> fx.Run:
        """Simulate the experiment at its own times.

        Args:
            values: factors on the files' values, delay [s], by name.
            elements: more (or less) elements of each link than the file's.
            rtol: tolerance.

        Returns:
            The run, with what the sensor feels as `strip/sensed` (bend [rad] or curvature [1/m]).
        """
        times = self._times
        robot = with_stepper_damping(with_parameters(self.robot, values), self.rig, elements)
        if not self.stepper:
            robot = self._with_bearings(robot, values.get(BEARING, 1.0))
        system = fx.assemble(robot)
        q0 = system.start()
        if self.stepper:
            run = self._on_the_stepper(system, q0, values, rtol)
        else:
            run = self._behind_gears(system, q0, values)
        run.uninterrupted()
        kept = slice(len(times) - len(self.t), None)
        channels = run.channels | {"strip/sensed": self._sensed(system, run)}
        return fx.Run(
            self.t,
            {n: v[kept] for n, v in channels.items()},
            run.units | {"strip/sensed": "rad" if self.rig.flex else "1/m"},
            run.meta,
        )

    def _on_the_stepper(
        self, system: fx.System, q0: np.ndarray, values: dict[str, float], rtol: float
    ) -> fx.Run:
        """Joint 1 follows its motor behind the backlash, which its own friction holds in place."""
        assert self.stepper is not None
        times = self._times
        ((axis, shaft),) = self._shaft_positions.items()
        own = self._friction.get(axis.number, Friction()).own * values.get("give", 1.0)
        play = lead_screw.backlash(axis.guide, own)
        play += (values.get("backlash", 1.0) - 1.0) * axis.guide.backlash
        x = lead_screw.backlash_output(shaft, play)
        course = signals.Signal(signals.table(times, x).segments[:-1])
        q0[system.joint_rows] = x[0], self.pulses(times[0])[0]
        torque = self.stepper.holding_torque_N_m * values["holding"]
        stepper = self.stepper.model_copy(update={"holding_torque_N_m": torque})
        return simulate_with_stepper(
            (system, q0),
            times,
            JointDrive(motion=course, prescribed=True),
            self.pulses,
            MagneticSpring(stepper),
            rtol,
            state=self._guess,
            torque_step_s=TORQUE_STEP_S,
            method=METHOD,
            tolerance=TORQUE_TOLERANCE,
        )

    def _behind_gears(self, system: fx.System, q0: np.ndarray, values: dict[str, float]) -> fx.Run:
        """Joints on their gears' teeth: stiffness and damping of the contact beyond the backlash.

        A link that a motor turns bends its gear back and forth, whatever way the motor goes.
        """
        contacts: list[Contact | None] = [None] * len(self.robot.links)
        for axis, shaft in self._shafts.items():
            contacts[axis.number - 1] = Contact(
                shaft,
                values.get("backlash", 1.0) * axis.guide.backlash,
                values.get("contact", 1.0) * axis.guide.contact_stiffness,
                axis.guide.contact_damping,
            )
        q0[system.joint_rows] = [x[0] for x in self._shaft_positions.values()]
        teeth = Backlash(tuple(contacts))
        return fx.simulate(system, self._times, teeth, q0=q0, rtol=GEAR_RTOL, method=GEAR_METHOD)

    def _with_bearings(self, robot: fx.Robot, friction: float) -> fx.Robot:
        """The robot with its bearings' friction in the joints, times a factor."""
        changes = {}
        for axis in self._shafts:
            joint, at = robot.links[axis.number - 1].joint, f"link.{axis.number}.joint"
            changes[f"{at}.coulomb_friction_N_m"] = (
                joint.coulomb_friction + friction * axis.guide.coulomb
            )
            changes[f"{at}.viscous_friction_N_m_s_rad"] = (
                joint.viscous_friction + friction * axis.guide.viscous
            )
        return robot.replace(changes)

    def _sensed(self, system: fx.System, run: fx.Run) -> np.ndarray:
        """What the sensor feels (T,) in a run with states: bend [rad] or curvature [1/m]."""
        assert run.states is not None
        if isinstance(self.sensor, Flex):
            ends, size = [self.sensor.from_m, self.sensor.from_m + self.sensor.length_m], 1.0
        else:
            step = CURVATURE_STEP * self.robot.links[-1].length_m
            ends, size = [max(self.sensor.at_m - step, 0.0), self.sensor.at_m + step], 0.0
            size = ends[1] - ends[0]
        low, high = system.angles(self.link, np.array(ends)) @ run.states[:, : system.n].T
        return np.asarray((high - low) / size)

    def voltage(self, run: fx.Run, values: dict[str, float]) -> np.ndarray:
        """The sensor's voltage (T,) [V] without offset and noise.

        Args:
            run: a run of `simulate`.
            values: parameters by name.
        """
        from scipy.interpolate import CubicSpline

        quiet = StripSensor(self.sensor, None, np.random.default_rng(0), 1.0, values["sensor_gain"])
        volts = np.array([quiet.voltage(felt) for felt in run["strip/sensed"].tolist()])
        return np.asarray(CubicSpline(self.t, volts)(self.t - values["delay_s"]))


def with_parameters(robot: fx.Robot, values: dict[str, float]) -> fx.Robot:
    """The robot with changed parameters.

    Args:
        robot: the nominal robot.
        values: factors `stiffness`, `damping`, `payload` and, if given, `mass` of the flexible
            links; `gyration_m`, radius of gyration of the payload [m].
    """
    mass = values["payload"] * robot.payload.mass_kg
    changes: dict[str, Any] = {
        "payload.mass_kg": mass,
        "payload.inertia_kg_m2": values["payload"] * robot.payload.inertia_kg_m2
        + mass * values.get("gyration_m", 0.0) ** 2,
    }
    tables = robot.to_dict()["link"]
    for number, link in enumerate(robot.links, 1):
        if not link.flexible:
            continue
        heavy = "density_kg_m3" if link.density_kg_m3 is not None else "mass_per_length_kg_m"
        given = (
            "young_modulus_Pa" if link.young_modulus_Pa is not None else "bending_stiffness_N_m2"
        )
        own, at = tables[number - 1], f"link.{number}"
        changes[f"{at}.{given}"] = _times(own[given], values["stiffness"])
        changes[f"{at}.{heavy}"] = _times(own[heavy], values.get("mass", 1.0))
        changes[f"{at}.damping.beta_s"] = values["damping"] * link.damping.beta_s
    return robot.replace(changes)


def _times(value: Any, factor: float) -> Any:
    """A number of a robot file, or its list along the link, times a factor."""
    return (
        [entry | {"value": factor * entry["value"]} for entry in value]
        if isinstance(value, list)
        else factor * value
    )


def with_stepper_damping(robot: fx.Robot, rig: Rig, elements: int = 0) -> fx.Robot:
    """The robot with its links' lowest modes, and a stepper's damping in joint 2."""
    changes: dict[str, Any] = {}
    for number, link in enumerate(robot.links, 1):
        if link.flexible:
            last = number == len(robot.links)
            changes[f"link.{number}.modes"] = MODES if last else MODES_BEFORE
            changes[f"link.{number}.elements"] = link.elements + elements
    if rig.stepper:
        damping = robot.links[1].joint.viscous_friction + rig.stepper.damping_N_m_s
        changes["link.2.joint.viscous_friction_N_m_s_rad"] = damping
    return robot.replace(changes)


def _without_drift(t: np.ndarray, y: np.ndarray, degree: int) -> np.ndarray:
    """y (T,) less the polynomial of a degree that fits it best; 0 for a missing sample."""
    there = np.isfinite(y)
    A = np.polynomial.legendre.legvander(2 * (t - t[0]) / (t[-1] - t[0]) - 1, degree)
    Q, _ = np.linalg.qr(A[there])
    out = np.zeros(len(y))
    out[there] = y[there] - Q @ (Q.T @ y[there])
    return out
