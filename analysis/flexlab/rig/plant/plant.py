"""The emulated rig: Exudyn's mechanics behind motor, screw, stepper, encoders and flex sensor.

    board = EmulatedBoard(elf, rig_plant(load("firmware/rig.toml"), seed=3))

The plant runs one step (h = 0.5 ms) behind the board. Each step uses the mean voltage and the mean
pulse count of its own interval, so that volt-seconds are exact and each pulse acts from when it
came. An implicit step's end value acts as if spread evenly about the end, a mean stands for the
step's middle; the command therefore leads by half of its last change.

Encoder positions for the interval that the board has already started are extrapolated linearly. The
motor's error is 0.01 counts, the joint's 0.06 on the mean and 0.3 at most, in the ripple of the
microsteps. Between steps encoders move evenly, so that edges come one by one. The same seed gives
the same bytes. The data stand in `firmware/rig.toml`, [emulated].

The nut touches a flank of the screw (spring and damper), or none while it crosses the backlash b.
The rail holds the carriage by an elastic-plastic spring that gives way by d and then slides:

    F_nut  = -k (x - s -+ b/2) - c (x' - s')     if x - s is beyond +-b/2, s = lead angle / (2 pi)
    F_rail = -(F_c / d) (x - z) - c_r x'         z follows x at no more than d

Error against steps of 0.05 ms and 8 elements under the same 520 pulses a second, relative to the
peak: tip deflection (5 mm, with the ripple of the microsteps) 0.9 % rms, joint 0.03 %.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from pydantic import ValidationError

import flexura as fx
from flexura.errors import InputError
from flexura.io import explain

from ...board.emulator.emulated import Outputs, Sensors
from ..description import RigSetup, configuration
from ..emulation import FACTORS, Emulated, TrueParameters
from .flex_sensor import FlexSensor
from .mechanics import ELEMENTS, STEP_S, Mechanics
from .motor import DCMotor, joint_line, motor_data
from .stepper import MagneticSpring


def rig_plant(
    setup: RigSetup,
    seed: int = 0,
    *,
    truth: TrueParameters | None = None,
    start: tuple[float, float] = (0.0, 0.0),
    step_s: float = STEP_S,
    elements: int = ELEMENTS,
    **what_differs: Any,
) -> RigPlant:
    """The emulated rig of a rig file.

    Args:
        setup: the rig.
        seed: of noise and drift.
        truth: factors by which the rig differs from its files; None: the rig file's own.
        start: carriage [m] and joint 2 [rad], at rest.
        step_s: step of the plant [s].
        elements: cables of the strip.
        what_differs: values of [emulated] by their path, with two underscores for the dot, as
            `flex__noise_V=0.0`.

    Raises:
        InputError: the rig file has no [emulated], or a name is unknown.
    """
    return RigPlant(
        setup,
        _changed(setup, what_differs),
        seed,
        truth or setup.emulated.truth,
        start,
        step_s,
        elements,
    )


def _changed(setup: RigSetup, changes: dict[str, Any]) -> Emulated:
    data = setup.emulated.model_dump()
    for path, value in changes.items():
        table, _, name = path.partition("__")
        if name not in data.get(table, {}):
            expected = "expected a value of [emulated], such as flex__noise_V"
            raise InputError(
                expected, key=f"emulated.{path.replace('__', '.')}", value=value, file=setup.file
            )
        data[table][name] = value
    try:
        return Emulated.model_validate(data)
    except ValidationError as error:
        wrong = explain(error, Emulated, data, setup.file)
        raise InputError(
            wrong.expected, key=f"emulated.{wrong.key}", value=wrong.value, file=setup.file
        ) from None


def true_robot(robot: fx.Robot, truth: TrueParameters) -> fx.Robot:
    """The robot as the emulated rig has it: stiffness, damping and payload by their factors."""
    strip, payload = robot.links[1], robot.payload
    given = "young_modulus_Pa" if strip.young_modulus_Pa is not None else "bending_stiffness_N_m2"
    values = robot.to_dict()["link"][1]
    stiffness = values[given]
    if isinstance(stiffness, list):
        stiffness = [entry | {"value": truth.stiffness * entry["value"]} for entry in stiffness]
    else:
        stiffness = truth.stiffness * stiffness
    changes: dict[str, Any] = {
        f"link.2.{given}": stiffness,
        "payload.mass_kg": truth.payload * payload.mass_kg,
        "payload.inertia_kg_m2": truth.payload * payload.inertia_kg_m2,
    }
    if strip.damping.beta_s:
        changes["link.2.damping.beta_s"] = truth.damping * strip.damping.beta_s
    return robot.replace(changes)


class RigPlant:
    """The emulated rig as a plant (`board.emulated.Plant`).

    `truth`: its true parameters, which an identification must not read. `carriage_m`, `joint_rad`,
    `tip_deflection_m`: its true position. `emergency_stop` may be set.
    """

    def __init__(
        self,
        setup: RigSetup,
        emulated: Emulated,
        seed: int,
        truth: TrueParameters,
        start: tuple[float, float],
        step_s: float,
        elements: int,
    ) -> None:
        rig, settings = setup.rig, configuration(setup)
        robot = true_robot(setup.robot, truth)
        first, strip = emulated.flex.from_m, robot.links[1]
        if first + rig.flex.length_m > strip.length_m:
            expected = (
                f"expected a sensor of {rig.flex.length_m:g} m that ends on the strip of "
                f"{strip.length_m:g} m"
            )
            raise InputError(expected, key="emulated.flex.from_m", value=first, file=setup.file)
        self.mechanics = Mechanics(
            robot, start, step_s, elements, sensor_m=(first, first + rig.flex.length_m)
        )
        screw, carriage = emulated.screw, emulated.carriage
        self.motor = DCMotor(
            motor_data(rig, emulated.motor),
            rig.screw.efficiency,
            screw.coulomb_friction_N_m,
            screw.viscous_friction_N_m_s,
            truth.friction,
        )
        self.spring = MagneticSpring(rig.stepper, emulated.stepper)
        self.flex = FlexSensor(
            rig.flex, emulated.flex, np.random.default_rng([seed, 0]), step_s, truth.flex_gain
        )
        self.supply_V, self.emergency_stop = rig.driver.supply_V, False
        self.truth = _truth_for_metadata(setup, truth, robot, seed)
        self._dead_zone_V = emulated.driver.dead_zone_V
        self._lead, self._start = rig.screw.lead_m / (2 * math.pi), start
        self._half_backlash = 0.5 * truth.backlash * carriage.backlash_m
        self._contact = carriage.contact_stiffness_N_m, carriage.contact_damping_N_s_m
        self._presliding = carriage.presliding_m
        self._rail_stiffness = truth.friction * carriage.coulomb_friction_N / carriage.presliding_m
        self._rail_damping = truth.friction * carriage.viscous_friction_N_s_m
        self._rotor_damping = emulated.stepper.damping_N_m_s
        self._ends = setup.limits[0]
        self._counts = settings["motor_counts_per_m"], settings["stepper_counts_per_rad"]
        self._step_s = step_s
        self._unused_s = 0.0  # of the step that was made last [s]
        self._volt_s = self._microstep_s = self._since = 0.0
        self._anchor = self._x = start[0]
        self._theta = start[1]
        self._load_N_m = self._steps = self._bend = 0.0
        self._counts_now = self._shafts()
        # what the encoders say at the ends of the step that the board is in
        self._previous = self._extrapolated = self._counts_now
        self._sensors = Sensors(
            flex_V=self.flex.sample(0.0), supply_V=self.supply_V / rig.driver.supply_divider
        )

    # ---- what it truly does

    @property
    def window_s(self) -> float:
        """The interval in which a board is best run with this plant [s]."""
        return self._step_s

    @property
    def carriage_m(self) -> float:
        """Position of the carriage [m]."""
        return self.mechanics.x_m

    @property
    def nut_m(self) -> float:
        """The carriage's position by the motor's encoder, without backlash [m]."""
        return self._start[0] + self._lead * self.motor.angle_rad

    @property
    def joint_rad(self) -> float:
        """Angle of joint 2 [rad]."""
        return self.mechanics.angle_rad

    @property
    def tip_deflection_m(self) -> float:
        """Deflection of the strip's tip [m]."""
        return self.mechanics.tip_deflection_m

    # ---- in lockstep

    def advance(self, seconds: float, outputs: Outputs) -> Sensors:
        """Advance the plant with the board's outputs; returns what its inputs then see.

        Args:
            seconds: time to advance [s].
            outputs: of the board, constant in this time.
        """
        self._volt_s += outputs.duty * self.supply_V * seconds
        self._microstep_s += outputs.steps * seconds
        self._since += seconds
        if self._unused_s < seconds - 1e-9:
            voltage, steps = self._volt_s / self._since, self._microstep_s / self._since
            self._volt_s = self._microstep_s = self._since = 0.0
            while self._unused_s < seconds - 1e-9:
                self._step(outputs, voltage, steps)
                self._unused_s += self._step_s
        self._unused_s -= seconds
        part = 1.0 - self._unused_s / self._step_s
        (one, two), (a, b) = self._previous, self._extrapolated
        sensors = self._sensors
        sensors.encoder_1, sensors.encoder_2 = one + part * (a - one), two + part * (b - two)
        sensors.emergency_stop = self.emergency_stop
        return sensors

    def _step(self, outputs: Outputs, voltage: float, steps: float) -> None:
        voltage = math.copysign(max(0.0, abs(voltage) - self._dead_zone_V), voltage)
        self.motor.advance(self._step_s, voltage if outputs.motor_on else None, self._load_N_m)
        mechanics = self.mechanics
        here, turned = mechanics.x_m, mechanics.angle_rad
        on = outputs.stepper_on
        command = self._start[1] + (1.5 * steps - 0.5 * self._steps) * self.spring.rad_per_step
        self._steps = steps
        mechanics.hold_joint(self.spring.stiffness(on), self._rotor_damping)
        centre = self.spring.centre(command, 2 * turned - self._theta, on)
        nut, flank = self._carriage(2 * here - self._x)
        mechanics.step(nut, centre)
        self._x, self._theta = here, turned
        if flank is None:
            self._load_N_m = 0.0
        else:
            stiffness, damping = self._contact
            slip = (mechanics.x_m - here) / self._step_s - self._lead * self.motor.speed_rad_s
            self._load_N_m = -self._lead * (stiffness * (mechanics.x_m - flank) + damping * slip)
        sensors = self._sensors
        before, self._bend = self._bend, mechanics.bend_rad
        # in the middle of the step that the board is in
        sensors.flex_V = self.flex.sample(1.5 * self._bend - 0.5 * before)
        sensors.limit_low, sensors.limit_high = (
            mechanics.x_m <= self._ends[0],
            mechanics.x_m >= self._ends[1],
        )
        now, (one, two) = self._shafts(), self._counts_now
        self._previous, self._extrapolated, self._counts_now = (
            self._extrapolated,
            (2 * now[0] - one, 2 * now[1] - two),
            now,
        )

    def _carriage(self, expected: float) -> tuple[float, float | None]:
        """Set the carriage's spring for a step that is expected to end at `expected` [m].

        One spring stands for nut and rail; its zero makes its force the sum of both: k x_0 + c s' =
        k_1 z + k_2 flank + c s'.

        Returns:
            The zero [m], and the flank that the nut touches [m] or None.
        """
        self._anchor = min(
            max(self._anchor, expected - self._presliding), expected + self._presliding
        )
        stiffness, damping, pull = (
            self._rail_stiffness,
            self._rail_damping,
            self._rail_stiffness * self._anchor,
        )
        nut, flank = self.nut_m, None
        if expected - nut >= self._half_backlash:
            flank = nut + self._half_backlash
        elif nut - expected >= self._half_backlash:
            flank = nut - self._half_backlash
        if flank is not None:
            stiffness, damping = stiffness + self._contact[0], damping + self._contact[1]
            pull += (
                self._contact[0] * flank + self._contact[1] * self._lead * self.motor.speed_rad_s
            )
        self.mechanics.hold_carriage(stiffness, damping)
        return pull / stiffness if stiffness else 0.0, flank

    def _shafts(self) -> tuple[float, float]:
        """Both encoders in counts, from their positions at the start."""
        turned = self.mechanics.angle_rad - self._start[1]
        return self._counts[0] * self._lead * self.motor.angle_rad, self._counts[1] * turned


def _truth_for_metadata(
    setup: RigSetup, truth: TrueParameters, robot: fx.Robot, seed: int
) -> dict[str, Any]:
    line = joint_line(setup, truth.friction)
    strip = robot.links[1]
    return {
        "seed": seed,
        "factors": {name: getattr(truth, name) for name in FACTORS},
        "robot": robot.to_dict(),
        "bending_stiffness_N_m2": float(strip.bending_stiffness(np.zeros(1))[0]),
        "beta_s": strip.damping.beta_s,
        "payload_kg": robot.payload.mass_kg,
        "joint_1_coulomb_N": line.coulomb_N,
        "joint_1_viscous_N_s_m": line.viscous_N_s_m,
        "backlash_m": truth.backlash * setup.emulated.carriage.backlash_m,
        "flex_ohm_per_rad": truth.flex_gain * setup.rig.flex.ohm_per_rad,
    }
