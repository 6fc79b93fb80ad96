"""Simulation of an experiment by the native model.

The joints are driven in one of three ways:

- `commanded`: a motor's voltage moves the nut, and the nut the carriage behind its backlash
  (`lead_screw`), or it turns the joint. A stepper's pulses act through its magnetic spring
  (`stepper_relaxation`). All is predicted from the rig file, so that every error of the drives'
  data adds up. A carriage's position is that of the nut, as its encoder sees it.
- `reference`: the joints follow their set-points exactly, as in the dissertation's inverse
  comparison. The deviation contains the controllers' errors.
- `measured`: the joints follow their smoothed encoders. The deviation is that of the elastic model
  alone.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Sequence

import numpy as np

import flexura as fx
from flexura import signals
from flexura.errors import InputError
from flexura.io import called
from flexura.signals import JointDrive

from ...rig.axes import MotorAxis, motor_axes
from ...rig.description import Rig, rig_of_recording
from ...rig.nominal_robot import with_drives
from ...rig.plant.motor import JointLine, joint_line, resistance
from ...rig.plant.stepper import MagneticSpring
from . import lead_screw
from .gear_loss import with_losses
from .pulses import pulses_of_run
from .smoothing import (
    continue_past_end,
    initial_rest,
    recorded_samples,
    smoothing_spline,
    with_initial_rest,
)
from .stepper_relaxation import StartState, simulate_with_stepper

# a voltage holds in the tick after its report, half a tick late on the mean; every second tick is
# reported
VOLTAGE_DELAY_S = 5e-4
DRIVEN_BY = ("commanded", "reference", "measured")


def required_channels(experiment: fx.Run, by: str) -> list[str]:
    """The channels that drive the joints of a simulation.

    Args:
        experiment: the run.
        by: one of `DRIVEN_BY`.
    """
    joints = sum(name.endswith("/position") for name in experiment if name.startswith("joint/"))
    if by != "commanded":
        end = "reference" if by == "reference" else "position"
        return [f"joint/{n}/{end}" for n in range(1, joints + 1)]
    stepper = joints == 2 and "joint/2/pulses" in experiment
    kinds = ["voltage", "pulses" if stepper else "voltage"]
    return [f"joint/{n}/{kind}" for n, kind in zip(range(1, joints + 1), kinds, strict=False)]


def simulate_experiment(
    experiment: fx.Run,
    by: str = "commanded",
    robot: fx.Robot | None = None,
    *,
    rtol: float = 1e-6,
    progress: Callable[[float], None] | None = None,
) -> fx.Run:
    """Simulate an experiment natively, at its own times.

    Args:
        experiment: the run; its metadata have the robot and, for "commanded", the rig.
        by: one of `DRIVEN_BY`.
        robot: by default that of the metadata.
        rtol: tolerance of the simulation.
        progress: called with the finished fraction.

    Returns:
        The simulated run; `meta["driven_by"]` is `by`.

    Raises:
        InputError: the run lacks a channel or metadata that this needs.
    """
    if by not in DRIVEN_BY:
        raise InputError(f"expected one of {', '.join(DRIVEN_BY)}", key="by", value=by)
    required = required_channels(experiment, by)
    missing = [name for name in required if name not in experiment]
    if missing or not required:
        there = dict.fromkeys(re.sub(r"/\d+$", "/*", name) for name in experiment)
        raise InputError(
            f"expected an experiment with {missing[0] if missing else 'joint/1/position'}, or a "
            f"second run; it has: {', '.join(there)}",
            key="by",
            value=by,
        )
    if by == "reference" and experiment.meta.get("experiment") == "step":
        raise InputError(
            "expected commanded or measured: no joint can follow the set-points of a step",
            key="by",
            value=by,
        )
    robot = robot or _robot(experiment)
    if len(robot.links) != len(required):
        raise InputError(
            f"expected a robot of {len(required)} links, as the rig's",
            key="robot",
            value=robot.name,
        )
    if by == "commanded":
        rig = _rig(experiment)
        drive = _by_screw_and_stepper if rig.screw and rig.stepper else _by_motors
        run = drive(experiment, rig, robot, rtol, progress)
    else:
        t = experiment.t
        motions = [_motion(experiment, name, by) for name in required]
        rest_t = initial_rest(t)
        system, q0 = _start_at(robot, [motion(rest_t[0])[0] for motion in motions])
        run = fx.simulate(
            system,
            np.concatenate([rest_t, t]),
            fx.Drive.prescribed(*motions),
            q0=q0,
            rtol=rtol,
            progress=progress,
        )
        recorded = slice(len(rest_t), None)
        run = dataclasses.replace(
            run,
            t=run.t[recorded],
            channels={n: v[recorded] for n, v in run.channels.items()},
            states=None,
        )
    run.meta.pop("drive", None)  # the experiment's own samples once more
    run.meta["driven_by"] = by
    run.meta["simulates"] = " ".join(
        filter(None, (experiment.meta.get("experiment"), called(experiment)))
    )
    return run


def _by_screw_and_stepper(
    experiment: fx.Run,
    rig: Rig,
    robot: fx.Robot,
    rtol: float,
    progress: Callable[[float], None] | None,
) -> fx.Run:
    """Joint 1 behind a lead screw from its voltage, joint 2 on its stepper from the pulses."""
    assert rig.stepper is not None
    t = experiment.t
    (axis,) = motor_axes(rig)
    line = joint_line(axis, delayed=True)
    robot = with_drives(robot, rig, [(axis, line)])
    pulses, jumps = joint_2_pulse_angle(experiment)
    force = motor_force(experiment, rig, axis, line)
    at_start = (_first_position(experiment, 1), pulses(t[0])[0])
    method = "implicit" if jumps else "auto"  # one every millisecond
    start = _start_at(robot, at_start)
    mass_kg = line.moved(float(start[0].mass(start[1])[0, 0]) - line.inertia)
    fine_t = np.arange(t[0], t[-1] + lead_screw.STEP_S, lead_screw.STEP_S)
    nut, speed, x = lead_screw.nut_and_carriage(
        fine_t, force, line, mass_kg, lead_screw.backlash(axis.guide), at_start[0]
    )
    carriage_drive = JointDrive(
        force=force, motion=continue_past_end(t, np.interp(t, fine_t, x)), prescribed=True
    )
    run = simulate_with_stepper(
        start, t, carriage_drive, pulses, MagneticSpring(rig.stepper), rtol, progress, method=method
    )
    if run.meta["relaxation_rounds"] is not None:
        nut_channels = {
            "joint/1/position": np.interp(run.t, fine_t, nut),
            "joint/1/velocity": np.interp(run.t, fine_t, speed),
        }
        run = dataclasses.replace(run, channels=run.channels | nut_channels)
    return run


def _by_motors(
    experiment: fx.Run,
    rig: Rig,
    robot: fx.Robot,
    rtol: float,
    progress: Callable[[float], None] | None,
) -> fx.Run:
    """Joints that motors turn, from their voltages; a stepper's joint from its pulses.

    Rotor, friction and back-EMF are the joints' own, so that the links act back on the motors.
    What gears lose of the links' load is found in rounds (`gear_loss`), beside a stepper it is left
    out. The gears' backlash is left out.
    """
    t = experiment.t
    lines = [(axis, joint_line(axis, delayed=True)) for axis in motor_axes(rig)]
    robot = with_drives(robot, rig, lines)
    forces = [motor_force(experiment, rig, axis, line) for axis, line in lines]
    at_start = [_first_position(experiment, n) for n in range(1, rig.joints + 1)]
    if not rig.stepper:
        system, q0 = _start_at(robot, at_start)
        return with_losses(system, q0, t, forces, lines, rtol, progress)
    pulses, jumps = joint_2_pulse_angle(experiment)
    start = _start_at(robot, [at_start[0], pulses(t[0])[0]])
    spring = MagneticSpring(rig.stepper)
    method = "implicit" if jumps else "auto"
    return simulate_with_stepper(start, t, forces[0], pulses, spring, rtol, progress, method=method)


def motor_force(experiment: fx.Run, rig: Rig, axis: MotorAxis, line: JointLine) -> signals.Signal:
    """The force or torque of a motor's recorded voltage at its joint [N or N m].

    Args:
        experiment: the run.
        rig: its rig.
        axis: the joint.
        line: the joint as a linear motor.
    """
    name = f"joint/{axis.number}/voltage"
    times, volts = recorded_samples(experiment.t, experiment[name], name)
    volts = np.sign(volts) * np.maximum(np.abs(volts) - rig.driver.dead_zone_V, 0.0)
    late = VOLTAGE_DELAY_S + (axis.motor.inductance_H or 0.0) / resistance(axis.motor)
    return hold_midpoints(times + late, line.force_per_V * volts)


def _first_position(experiment: fx.Run, number: int) -> float:
    name = f"joint/{number}/position"
    return float(recorded_samples(experiment.t, experiment[name], name)[1][0])


def joint_2_pulse_angle(experiment: fx.Run) -> tuple[signals.Signal, bool]:
    """Joint 2's angle by its pulses, from before the start on.

    Each pulse acts when the firmware gave it, if the run's data determine that. Otherwise a spline
    through the reports is used.

    Returns:
        The angle [rad] as a signal, and whether it jumps.
    """
    exact = pulses_of_run(experiment)
    if exact is None:
        return _motion(experiment, "joint/2/pulses", "commanded"), False
    at, angle = exact
    at[0] = initial_rest(experiment.t)[0]
    return signals.piecewise(at, angle), True


def _motion(experiment: fx.Run, name: str, by: str) -> signals.Signal:
    """A joint's motion with a rest before its start, so that the strip starts unbent at rest."""
    t, y = with_initial_rest(*recorded_samples(experiment.t, experiment[name], name))
    return smoothing_spline(t, y) if by == "measured" else continue_past_end(t, y)


def _start_at(robot: fx.Robot, joints: Sequence[float]) -> StartState:
    """The system, and its state with the joints where the experiment had them."""
    system = fx.assemble(robot)
    q0 = system.start()
    q0[system.joint_rows] = joints
    return system, q0


def hold_midpoints(t: np.ndarray, y: np.ndarray) -> signals.Signal:
    """Hold each sample from half way after the one before to half way before the next: no lag.

    Args:
        t: times (T,) [s].
        y: values (T,).
    """
    at = np.concatenate([t[:1], (t[1:] + t[:-1]) / 2])
    changes = np.concatenate([[True], np.diff(y) != 0.0])
    return signals.piecewise(at[changes], y[changes])


def _robot(experiment: fx.Run) -> fx.Robot:
    tables = experiment.meta.get("robot")
    if not isinstance(tables, dict):
        raise InputError(
            "missing: the run has no robot file in its metadata; give one (--robot)", key="robot"
        )
    return fx.Robot.from_dict(tables)


def _rig(experiment: fx.Run) -> Rig:
    tables = experiment.meta.get("rig")
    if not isinstance(tables, dict):
        raise InputError(
            "missing: the run has no rig file in its metadata, which `commanded` needs", key="rig"
        )
    return rig_of_recording(tables)
