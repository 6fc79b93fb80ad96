"""A manoeuvre under a controller from a gains file: the motions become its references."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import flexura as fx
from flexura.control import Gains, load_gains
from flexura.signals import constant


def controlled(system: fx.System, asked: fx.Manoeuvre, file: Path) -> fx.Controller:
    """`under` the gains of a file."""
    return under(system, asked, load_gains(file))


def under(system: fx.System, asked: fx.Manoeuvre, settings: Gains) -> fx.Controller:
    """The controller along the manoeuvre's motions, whose own gains are unused; a joint without a
    motion is held at its start.

    The manoeuvre's forces are fed forward where the controller's output is a force or torque.
    Raises InputError for a joint that the manoeuvre prescribes, and for gains of another number of
    joints.
    """
    motions = []
    for i, (joint, start) in enumerate(zip(asked.drive.joints, system.robot.start, strict=True), 1):
        if joint.prescribed:
            expected = "expected no prescribed joint under a controller"
            raise fx.InputError(expected, key=f"joint[{i}].prescribed", value=True)
        motions.append(joint.motion or constant(float(start)))
    made = settings.controller(motions)
    pids = []
    for joint, pid in zip(asked.drive.joints, made.joints, strict=True):
        assert isinstance(pid, fx.PID)
        pids.append(
            replace(pid, feedforward=joint.force) if isinstance(pid.output, fx.Force) else pid
        )
    return replace(made, joints=tuple(pids))
