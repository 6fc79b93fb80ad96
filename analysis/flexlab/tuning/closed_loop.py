"""A manoeuvre under a controller from a gains file: its motions become the references."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

import flexura as fx
from flexura.control import Designed, Gains, load_controller
from flexura.signals import constant


def controller_from_file(
    system: fx.System, asked: fx.Manoeuvre, file: Path
) -> fx.Controller | fx.Sampled:
    """The controller of a gains file: `closed_loop_controller`, or what is designed."""
    found = load_controller(file)
    if isinstance(found, Designed):
        return found.sampled(system.robot, references(system, asked))
    return closed_loop_controller(system, asked, found)


def unused_forces(asked: fx.Manoeuvre, drive: object) -> list[int]:
    """The joints, from 1, whose force in the manoeuvre a controller does not take.

    A PID feeds a force forward if its output is one; a controller that is designed takes none.
    """
    joints = drive.joints if isinstance(drive, fx.Controller) else ()
    fed = [isinstance(j, fx.PID) and isinstance(j.output, fx.Force) for j in joints]
    fed = fed or [not isinstance(drive, fx.Sampled)] * len(asked.drive.joints)
    given = [joint.force is not None for joint in asked.drive.joints]
    return [i for i, (has, used) in enumerate(zip(given, fed, strict=True), 1) if has and not used]


def references(system: fx.System, asked: fx.Manoeuvre) -> list[fx.Signal]:
    """A manoeuvre's motions, joints without one at their start.

    Args:
        system: the robot.
        asked: the manoeuvre.

    Raises:
        InputError: the manoeuvre prescribes a joint.
    """
    motions = []
    for i, (joint, start) in enumerate(zip(asked.drive.joints, system.robot.start, strict=True), 1):
        if joint.prescribed:
            expected = "expected no prescribed joint under a controller"
            raise fx.InputError(expected, key=f"joint[{i}].prescribed", value=True)
        motions.append(joint.motion or constant(float(start)))
    return motions


def with_references(run: fx.Run, motions: list[fx.Signal]) -> fx.Run:
    """The Run with joint/i/reference besides, as one under a PID has it."""
    channels, units = dict(run.channels), dict(run.units)
    for i, signal in enumerate(motions, 1):
        channels[f"joint/{i}/reference"] = np.array([signal(float(t))[0] for t in run.t])
        units[f"joint/{i}/reference"] = run.units[f"joint/{i}/position"]
    return replace(run, channels=channels, units=units)


def closed_loop_controller(
    system: fx.System, asked: fx.Manoeuvre, settings: Gains
) -> fx.Controller:
    """The controller that tracks a manoeuvre's motions.

    The manoeuvre's own gains are unused. A joint without a motion is held at its start. The
    manoeuvre's forces are fed forward if the output is a force or torque.

    Args:
        system: the robot.
        asked: the manoeuvre.
        settings: the gains.

    Raises:
        InputError: the manoeuvre prescribes a joint, the numbers of joints differ, or a unit does
            not fit its joint.
    """
    settings.check_joints([link.joint.type == "R" for link in system.robot.links])
    made = settings.controller(references(system, asked))
    pids = []
    for joint, pid in zip(asked.drive.joints, made.joints, strict=True):
        assert isinstance(pid, fx.PID)
        pids.append(
            replace(pid, feedforward=joint.force) if isinstance(pid.output, fx.Force) else pid
        )
    return replace(made, joints=tuple(pids))
