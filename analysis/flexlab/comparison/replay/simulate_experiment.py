"""Simulation of an experiment by the native model.

The joints are driven in one of three ways:

- `commanded`: the motor's voltage moves the nut, and the nut the carriage behind its backlash
  (`lead_screw`). The stepper's pulses act through its magnetic spring (`stepper_relaxation`).
  All is predicted from the rig file, so that every error of the drives' data adds up. Joint 1's
  position is that of the nut, as its encoder sees it.
- `reference`: the joints follow their set-points exactly, as in the dissertation's inverse
  comparison. The deviation contains the controllers' errors.
- `measured`: the joints follow their smoothed encoders. The deviation is that of the elastic model
  alone.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

import flexura as fx
from flexura import signals
from flexura.errors import InputError
from flexura.io import called
from flexura.signals import JointDrive

from ...rig.description import Rig, rig_of_recording
from ...rig.emulation import Emulated
from ...rig.plant.motor import JointLine, joint_line_of, resistance
from ...rig.plant.stepper import MagneticSpring
from . import lead_screw
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
REQUIRED_CHANNELS = {
    "commanded": ("joint/1/voltage", "joint/2/pulses"),
    "reference": ("joint/1/reference", "joint/2/reference"),
    "measured": ("joint/1/position", "joint/2/position"),
}


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
    missing = [name for name in REQUIRED_CHANNELS[by] if name not in experiment]
    if missing:
        raise InputError(
            f"expected a run with {missing[0]}; it has: {', '.join(experiment)}", key="by", value=by
        )
    if by == "reference" and experiment.meta.get("experiment") == "step":
        raise InputError(
            "expected commanded or measured: no joint can follow the set-points of a step",
            key="by",
            value=by,
        )
    robot = robot or _robot(experiment)
    if len(robot.links) != 2:
        raise InputError(
            "expected a robot of two links, as the rig's", key="robot", value=robot.name
        )
    t = experiment.t
    if by == "commanded":
        rig, more = _rig(experiment)
        carriage = joint_line_of(rig, more)
        robot = _with_drives(robot, carriage, more.stepper.damping_N_m_s)
        pulses, jumps = joint_2_pulse_angle(experiment)
        times, volts = recorded_samples(t, experiment["joint/1/voltage"], "joint/1/voltage")
        volts = np.sign(volts) * np.maximum(np.abs(volts) - more.driver.dead_zone_V, 0.0)
        force = hold_midpoints(
            times + VOLTAGE_DELAY_S + more.motor.inductance_H / resistance(rig),
            carriage.force_N_V * volts,
        )
        at_start = (
            recorded_samples(t, experiment["joint/1/position"], "joint/1/position")[1][0],
            pulses(t[0])[0],
        )
        spring = MagneticSpring(rig.stepper, more.stepper)
        method = "implicit" if jumps else "auto"  # one every millisecond
        start = _start_at(robot, at_start)
        mass_kg = float(start[0].mass(start[1])[0, 0])
        fine_t = np.arange(t[0], t[-1] + lead_screw.STEP_S, lead_screw.STEP_S)
        nut, speed, x = lead_screw.nut_and_carriage(
            fine_t, force, carriage, mass_kg, lead_screw.backlash(more.carriage), at_start[0]
        )
        carriage_drive = JointDrive(
            force=force, motion=continue_past_end(t, np.interp(t, fine_t, x)), prescribed=True
        )
        run = simulate_with_stepper(
            start, t, carriage_drive, pulses, spring, rtol, progress, method=method
        )
        if run.meta["relaxation_rounds"] is not None:
            nut_channels = {
                "joint/1/position": np.interp(run.t, fine_t, nut),
                "joint/1/velocity": np.interp(run.t, fine_t, speed),
            }
            run = dataclasses.replace(run, channels=run.channels | nut_channels)
    else:
        motions = [_motion(experiment, name, by) for name in REQUIRED_CHANNELS[by]]
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


def _with_drives(robot: fx.Robot, carriage: JointLine, damping_N_m_s: float) -> fx.Robot:
    """The robot with motor friction and inertia in joint 1, stepper damping in joint 2."""
    data = robot.to_dict()
    first, second = (link["joint"] for link in data["link"])
    more = (
        (first, "viscous_friction_N_s_m", carriage.viscous_N_s_m),
        (first, "coulomb_friction_N", carriage.coulomb_N),
        (first, "rotor_mass_kg", carriage.reflected_mass_kg),
        (second, "viscous_friction_N_m_s_rad", damping_N_m_s),
    )
    for joint, key, value in more:
        joint[key] = joint.get(key, 0.0) + value
    return fx.Robot.from_dict(data)


def _rig(experiment: fx.Run) -> tuple[Rig, Emulated]:
    tables = experiment.meta.get("rig")
    if not isinstance(tables, dict):
        raise InputError(
            "missing: the run has no rig file in its metadata, which `commanded` needs", key="rig"
        )
    rig = rig_of_recording(tables)
    if rig.emulated is None:
        raise InputError(
            "missing: `commanded` needs the rotor's inertia and the rig's friction from there",
            key="rig.emulated",
        )
    return rig, rig.emulated
