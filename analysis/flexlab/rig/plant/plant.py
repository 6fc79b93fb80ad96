"""The emulated rig: Exudyn's mechanics behind motors, screw, stepper, encoders and sensor.

    board = EmulatedBoard(elf, rig_plant(load("rig"), seed=3))

The plant runs one step (h = 0.5 ms) behind the board. Each step uses the mean voltages and the mean
pulse count of its own interval, so that volt-seconds are exact and each pulse acts from when it
came. An implicit step's end value acts as if spread evenly about the end, a mean stands for the
step's middle; the stepper's command therefore leads by half of its last change.

Encoder positions for the interval that the board has already started are extrapolated linearly. A
motor's error is 0.01 counts, the stepper's joint's 0.06 on the mean and 0.3 at most, in the ripple
of the microsteps. Between steps encoders move evenly, so that edges come one by one. The same seed
gives the same bytes. What moves the joints is in `drives`.

Error of the rig of type IV against steps of 0.05 ms and 8 elements under the same 520 pulses a
second, relative to the peak: tip deflection (5 mm, with the ripple of the microsteps) 0.9 % rms,
joint 0.03 %.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
from pydantic import ValidationError

import flexura as fx
from flexura.errors import InputError
from flexura.io import explain

from ...board.emulator.emulated import Outputs, Sensors
from ..axes import motor_axes
from ..board_axes import board_axes
from ..configuration import configuration
from ..description import Rig, RigSetup
from ..emulation import FACTORS, TrueParameters
from .drives import MotorDrive, StepperDrive
from .mechanics import ELEMENTS, STEP_S, Mechanics
from .motor import joint_line
from .strip_sensor import StripSensor


def rig_plant(
    setup: RigSetup,
    seed: int = 0,
    *,
    truth: TrueParameters | None = None,
    start: Sequence[float] | None = None,
    step_s: float = STEP_S,
    elements: int = ELEMENTS,
    **what_differs: Any,
) -> RigPlant:
    """The emulated rig of a rig file.

    Args:
        setup: the rig.
        seed: of noise and drift.
        truth: factors by which the rig differs from its files; None: the rig file's own.
        start: the joints [m, rad], at rest; None: at 0.
        step_s: step of the plant [s].
        elements: cables of a flexible link.
        what_differs: values of the rig file by their path, with two underscores for the dot, as
            `emulated__sensor__noise_V=0.0`.

    Raises:
        InputError: a constant that the plant needs is not in the rig file, or a name is unknown.
    """
    changed = dataclasses.replace(setup, rig=_changed(setup, what_differs))
    return RigPlant(
        changed,
        seed,
        truth or setup.emulated.truth,
        [0.0] * setup.rig.joints if start is None else start,
        step_s,
        elements,
    )


def _changed(setup: RigSetup, changes: dict[str, Any]) -> Rig:
    if not changes:
        return setup.rig
    data = setup.rig.model_dump(exclude_none=True)
    for path, value in changes.items():
        *tables, name = path.split("__")
        table: Any = data
        for key in tables:
            table = table.get(key, {})
        if name not in table:
            expected = "expected a value of the rig file, such as emulated__sensor__noise_V"
            raise InputError(expected, key=path.replace("__", "."), value=value, file=setup.file)
        table[name] = value
    try:
        return Rig.model_validate(data)
    except ValidationError as error:
        raise explain(error, Rig, data, setup.file) from None


def true_robot(robot: fx.Robot, truth: TrueParameters) -> fx.Robot:
    """The robot as the emulated rig has it: stiffness, damping and payload by their factors."""
    changes: dict[str, Any] = {
        "payload.mass_kg": truth.payload * robot.payload.mass_kg,
        "payload.inertia_kg_m2": truth.payload * robot.payload.inertia_kg_m2,
    }
    tables = robot.to_dict()["link"]
    for number, link in enumerate(robot.links, 1):
        if not link.flexible:
            continue
        given = (
            "young_modulus_Pa" if link.young_modulus_Pa is not None else "bending_stiffness_N_m2"
        )
        stiffness = tables[number - 1][given]
        if isinstance(stiffness, list):
            stiffness = [entry | {"value": truth.stiffness * entry["value"]} for entry in stiffness]
        else:
            stiffness = truth.stiffness * stiffness
        changes[f"link.{number}.{given}"] = stiffness
        if link.damping.beta_s:
            changes[f"link.{number}.damping.beta_s"] = truth.damping * link.damping.beta_s
    return robot.replace(changes)


class RigPlant:
    """The emulated rig as a plant (`board.emulated.Plant`).

    `truth`: its true parameters, which an identification must not read. `positions`,
    `tip_deflection_m`: where it truly is. `emergency_stop` may be set.
    """

    def __init__(
        self,
        setup: RigSetup,
        seed: int,
        truth: TrueParameters,
        start: Sequence[float],
        step_s: float,
        elements: int,
    ) -> None:
        rig, settings = setup.rig, configuration(setup)
        robot = true_robot(setup.robot, truth)
        flex = rig.flex
        ends = (flex.from_m, flex.from_m + flex.length_m) if flex else (0.0, 0.0)
        self.mechanics = Mechanics(robot, start, step_s, elements, sensor_m=ends)
        self._motors = [
            (
                axis.number - 1,
                MotorDrive(axis, truth, start[axis.number - 1], step_s, rig.driver.dead_zone_V),
            )
            for axis in motor_axes(rig)
        ]
        self.stepper = StepperDrive(rig.stepper, start[1]) if rig.stepper else None
        self.drives: list[MotorDrive | StepperDrive] = [drive for _, drive in self._motors]
        if self.stepper:
            self.drives.append(self.stepper)
        more = setup.rig.emulated
        self.sensor = StripSensor(
            rig.sensor,
            more.sensor if more else None,
            np.random.default_rng([seed, 0]),
            step_s,
            truth.flex_gain,
        )
        self.supply_V, self.emergency_stop = rig.driver.supply_V, False
        self.truth = _truth_for_metadata(setup, truth, robot, seed)
        self._start = list(start)
        self._ends = setup.limits[0]
        self._counts = [axis.counts for axis in board_axes(settings)]
        self._step_s = step_s
        self._unused_s = 0.0  # of the step that was made last [s]
        self._volt_s = [0.0, 0.0]
        self._microstep_s = self._since = 0.0
        self._felt = self.sensor.measure(self.mechanics)
        self._counts_now = self._shafts()
        # what the encoders say at the ends of the step that the board is in
        self._previous = self._extrapolated = self._counts_now
        self._sensors = Sensors(
            flex_V=self.sensor.sample(self._felt),
            supply_V=self.supply_V / rig.driver.supply_divider,
        )

    # ---- what it truly does

    @property
    def window_s(self) -> float:
        """The interval in which a board is best run with this plant [s]."""
        return self._step_s

    @property
    def positions(self) -> list[float]:
        """Positions of the joints [m, rad]."""
        return self.mechanics.positions

    @property
    def motor(self) -> MotorDrive:
        """The motor of joint 1."""
        return self._motors[0][1]

    @property
    def tip_deflection_m(self) -> float:
        """Deflection of the last link's tip [m]."""
        return self.mechanics.tip_deflection_m

    # ---- in lockstep

    def advance(self, seconds: float, outputs: Outputs) -> Sensors:
        """Advance the plant with the board's outputs; returns what its inputs then see.

        Args:
            seconds: time to advance [s].
            outputs: of the board, constant in this time.
        """
        for k, duty in enumerate(outputs.duty):
            self._volt_s[k] += duty * self.supply_V * seconds
        self._microstep_s += outputs.steps * seconds
        self._since += seconds
        if self._unused_s < seconds - 1e-9:
            voltages = [volt_s / self._since for volt_s in self._volt_s]
            steps = self._microstep_s / self._since
            self._volt_s, self._microstep_s, self._since = [0.0, 0.0], 0.0, 0.0
            while self._unused_s < seconds - 1e-9:
                self._step(outputs, voltages, steps)
                self._unused_s += self._step_s
        self._unused_s -= seconds
        part = 1.0 - self._unused_s / self._step_s
        sensors = self._sensors
        now = [
            one + part * (next_one - one)
            for one, next_one in zip(self._previous, self._extrapolated, strict=True)
        ]
        sensors.encoder_1 = now[0]
        if len(now) > 1:
            sensors.encoder_2 = now[1]
        sensors.emergency_stop = self.emergency_stop
        return sensors

    def _step(self, outputs: Outputs, voltages: list[float], steps: float) -> None:
        for k, motor in self._motors:
            motor.advance(voltages[k], outputs.motor_on[k])
        if self.stepper:
            self.stepper.advance(steps, outputs.stepper_on)
        mechanics = self.mechanics
        before = list(mechanics.positions)
        zeros = []
        for k, drive in enumerate(self.drives):
            spring = drive.spring(before[k])
            mechanics.hold(k, spring.stiffness, spring.damping)
            zeros.append(spring.zero)
        mechanics.step(*zeros)
        for k, drive in enumerate(self.drives):
            drive.finish(before[k], mechanics.positions[k])
        sensors = self._sensors
        felt, self._felt = self._felt, self.sensor.measure(mechanics)
        # in the middle of the step that the board is in
        sensors.flex_V = self.sensor.sample(1.5 * self._felt - 0.5 * felt)
        here = mechanics.positions[0]
        sensors.limit_low, sensors.limit_high = here <= self._ends[0], here >= self._ends[1]
        now = self._shafts()
        ahead = [2 * new - old for new, old in zip(now, self._counts_now, strict=True)]
        self._previous, self._extrapolated, self._counts_now = self._extrapolated, ahead, now

    def _shafts(self) -> list[float]:
        """The encoders in counts, from their positions at the start."""
        turned = [
            drive.shaft if isinstance(drive, MotorDrive) else self.positions[k]
            for k, drive in enumerate(self.drives)
        ]
        return [
            count * (at - start)
            for count, at, start in zip(self._counts, turned, self._start, strict=False)
        ]


def _truth_for_metadata(
    setup: RigSetup, truth: TrueParameters, robot: fx.Robot, seed: int
) -> dict[str, Any]:
    strip = robot.links[-1]
    joints = {}
    for axis in motor_axes(setup.rig):
        line = joint_line(axis, truth.friction)
        joints[f"joint_{axis.number}"] = {
            f"coulomb_{axis.force_unit.replace(' ', '_')}": line.coulomb,
            f"viscous_{axis.force_unit.replace(' ', '_')}_s_{axis.unit}": line.viscous,
            f"backlash_{axis.unit}": truth.backlash * axis.guide.backlash,
        }
    return {
        "seed": seed,
        "factors": {name: getattr(truth, name) for name in FACTORS},
        "robot": robot.to_dict(),
        "bending_stiffness_N_m2": float(strip.bending_stiffness(np.zeros(1))[0]),
        "beta_s": strip.damping.beta_s,
        "payload_kg": robot.payload.mass_kg,
        **joints,
    }
