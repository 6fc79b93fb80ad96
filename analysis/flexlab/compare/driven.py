"""The simulation of an experiment: the native model, driven by what the experiment commanded, was told to follow, or measured.

`commanded`: the motor's voltage as a force, with the motor's friction and inertia in the joint, and the stepper's pulses through
its magnetic spring (`rig.motor`, `field`), with the nominal figures of the rig file: everything is predicted, and every error of
the drives' data adds up. The nut's play is left out.
`reference`: the joints follow their set-points exactly, as in the dissertation's own inverse comparison: what the controllers
leave is in the deviation.
`measured`: the joints follow their encoders (smoothed): what is left is the deviation of the elastic model alone.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

import flexura as fx
from flexura import signal
from flexura.errors import InputError

from ..experiment.pulses import from_run
from ..naming import called
from ..rig.description import Rig, recorded
from ..rig.emulation import Emulated
from ..rig.motor import JointLine, line, resistance
from ..rig.stepper import MagneticSpring
from .field import Start, held_by_field
from .smoothing import known, onward, rest, smoothed

SET_S = 1e-3  # from the middle between two reports until a voltage acts: it is set in a tick and stays
WAYS = ("commanded", "reference", "measured")
NEEDS = {
    "commanded": ("joint/1/voltage", "joint/2/pulses"),
    "reference": ("joint/1/reference", "joint/2/reference"),
    "measured": ("joint/1/position", "joint/2/position"),
}


def simulate(
    experiment: fx.Run,
    by: str = "commanded",
    robot: fx.Robot | None = None,
    *,
    rtol: float = 1e-6,
    progress: Callable[[float], None] | None = None,
) -> fx.Run:
    """Simulate an experiment natively, at its own times; `robot`: by default that of its metadata.

    Raises InputError for a run that lacks the channels or the metadata that this takes.
    """
    if by not in WAYS:
        raise InputError(f"expected one of {', '.join(WAYS)}", key="by", value=by)
    lacking = [name for name in NEEDS[by] if name not in experiment]
    if lacking:
        raise InputError(f"expected a run with {lacking[0]}; it has: {', '.join(experiment)}", key="by", value=by)
    if by == "reference" and experiment.meta.get("experiment") == "step":
        raise InputError("expected commanded or measured: no joint can follow the set-points of a step", key="by", value=by)
    robot = robot or _robot(experiment)
    if len(robot.links) != 2:
        raise InputError("expected a robot of two links, as the rig's", key="robot", value=robot.name)
    t = experiment.t
    if by == "commanded":
        rig, more = _rig(experiment)
        carriage = line(rig, more)
        robot = _with_drives(robot, carriage, more.stepper.damping_N_m_s)
        exact = from_run(experiment)  # else a line between the reports, which are 2 ms apart
        pulses = signal.piecewise(*exact) if exact else onward(*known(t, experiment["joint/2/pulses"], "joint/2/pulses"))
        times, volts = known(t, experiment["joint/1/voltage"], "joint/1/voltage")
        volts = np.sign(volts) * np.maximum(np.abs(volts) - more.driver.dead_zone_V, 0.0)
        turns = np.abs(volts) > more.motor.starts_at_V  # at rest the motor's static friction holds until then
        volts[: int(np.argmax(turns)) if turns.any() else len(volts)] = 0.0
        force = held(times + SET_S + more.motor.inductance_H / resistance(rig), carriage.force_N_V * volts)
        at_start = known(t, experiment["joint/1/position"], "joint/1/position")[1][0], pulses(t[0])[0]
        spring = MagneticSpring(rig.stepper, more.stepper)
        method = "explicit-5" if exact else "auto"  # a jump every millisecond
        run = held_by_field(_started(robot, at_start), t, force, pulses, spring, rtol, progress, method=method)
    else:
        motions = [_motion(experiment, name, by) for name in NEEDS[by]]
        earlier = rest(t)
        system, q0 = _started(robot, [motion(earlier[0])[0] for motion in motions])
        run = fx.simulate(
            system, np.concatenate([earlier, t]), fx.Drive.prescribed(*motions), q0=q0, rtol=rtol, progress=progress
        )
        kept = slice(len(earlier), None)
        run = dataclasses.replace(run, t=run.t[kept], channels={n: v[kept] for n, v in run.channels.items()}, states=None)
    run.meta.pop("drive", None)  # the experiment's own samples once more
    run.meta["driven_by"] = by
    run.meta["simulates"] = " ".join(filter(None, (experiment.meta.get("experiment"), called(experiment))))
    return run


def _motion(experiment: fx.Run, name: str, by: str) -> signal.Signal:
    """The joint's motion from before the start on, where the robot was at rest: it must not start at speed and unbent."""
    t, y = known(experiment.t, experiment[name], name)
    earlier = rest(t)
    t, y = np.concatenate([earlier, t]), np.concatenate([np.full(len(earlier), y[0]), y])
    return smoothed(t, y) if by == "measured" else onward(t, y)


def _started(robot: fx.Robot, joints: Sequence[float]) -> Start:
    """The system, and its state with the joints where the experiment had them."""
    system = fx.assemble(robot)
    q0 = system.start()
    q0[system.joint_rows] = joints
    return system, q0


def held(t: np.ndarray, y: np.ndarray) -> signal.Signal:
    """Each sample held from half way after the one before to half way before the next: no lag, whatever happens between."""
    at = np.concatenate([t[:1], (t[1:] + t[:-1]) / 2])
    changes = np.concatenate([[True], np.diff(y) != 0.0])
    return signal.piecewise(at[changes], y[changes])


def _robot(experiment: fx.Run) -> fx.Robot:
    tables = experiment.meta.get("robot")
    if not isinstance(tables, dict):
        raise InputError("missing: the run has no robot file in its metadata; give one (--robot)", key="robot")
    return fx.Robot.from_dict(tables)


def _with_drives(robot: fx.Robot, carriage: JointLine, damping_N_m_s: float) -> fx.Robot:
    """The robot with the motor's friction and inertia in joint 1 and the stepper's damping in joint 2."""
    data = robot.to_dict()
    first, second = (link["joint"] for link in data["link"])
    more = (
        (first, "viscous_friction", carriage.viscous_N_s_m), (first, "coulomb_friction", carriage.coulomb_N),
        (first, "rotor_inertia", carriage.reflected_mass_kg), (second, "viscous_friction", damping_N_m_s),
    )  # fmt: skip
    for joint, key, value in more:
        joint[key] = joint.get(key, 0.0) + value
    return fx.Robot.from_dict(data)


def _rig(experiment: fx.Run) -> tuple[Rig, Emulated]:
    tables = experiment.meta.get("rig")
    if not isinstance(tables, dict):
        raise InputError("missing: the run has no rig file in its metadata, which `commanded` needs", key="rig")
    rig = recorded(tables)
    if rig.emulated is None:
        raise InputError("missing: `commanded` needs the rotor's inertia and the rig's friction from there", key="rig.emulated")
    return rig, rig.emulated
