"""The simulation of an experiment: the native model, driven by what the experiment commanded, was
told to follow, or measured.

`commanded`: the motor's voltage moves the nut and this the carriage behind its play (`screw`), the
stepper's pulses act through its magnetic spring (`rig.motor`, `field`), with the figures of the rig
file: everything is predicted, and every error of the drives' data adds up. Joint 1 is then what its
encoder would say, the nut. `reference`: the joints follow their set-points exactly, as in the
dissertation's own inverse comparison: what the controllers leave is in the deviation. `measured`:
the joints follow their encoders (smoothed): what is left is the deviation of the elastic model
alone.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

import flexura as fx
from flexura import signals
from flexura.errors import InputError
from flexura.signals import JointDrive

from ...rig.description import Rig, recorded
from ...rig.emulation import Emulated
from ...rig.plant.motor import JointLine, line, resistance
from ...rig.plant.stepper import MagneticSpring
from ...runs.labels import called
from . import lead_screw
from .pulses import from_run
from .smoothing import from_rest, known, onward, rest, smoothed
from .stepper_relaxation import Start, held_by_field

# a voltage holds for the tick after its report, in mid-course; the one of the tick between is not
# reported
SET_S = 5e-4
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
        raise InputError(
            f"expected a run with {lacking[0]}; it has: {', '.join(experiment)}", key="by", value=by
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
        carriage = line(rig, more)
        robot = _with_drives(robot, carriage, more.stepper.damping_N_m_s)
        pulses, jumps = given(experiment)
        times, volts = known(t, experiment["joint/1/voltage"], "joint/1/voltage")
        volts = np.sign(volts) * np.maximum(np.abs(volts) - more.driver.dead_zone_V, 0.0)
        force = held(
            times + SET_S + more.motor.inductance_H / resistance(rig), carriage.force_N_V * volts
        )
        at_start = (
            known(t, experiment["joint/1/position"], "joint/1/position")[1][0],
            pulses(t[0])[0],
        )
        spring = MagneticSpring(rig.stepper, more.stepper)
        method = "implicit" if jumps else "auto"  # one every millisecond
        start = _started(robot, at_start)
        mass_kg = float(start[0].mass(start[1])[0, 0])
        fine = np.arange(t[0], t[-1] + lead_screw.STEP_S, lead_screw.STEP_S)
        nut, speed, x = lead_screw.driven(
            fine, force, carriage, mass_kg, lead_screw.play(more.carriage), at_start[0]
        )
        moved = JointDrive(force=force, motion=onward(t, np.interp(t, fine, x)), prescribed=True)
        run = held_by_field(start, t, moved, pulses, spring, rtol, progress, method=method)
        if run.meta["relaxation_rounds"] is not None:
            seen = {
                "joint/1/position": np.interp(run.t, fine, nut),
                "joint/1/velocity": np.interp(run.t, fine, speed),
            }
            run = dataclasses.replace(run, channels=run.channels | seen)
    else:
        motions = [_motion(experiment, name, by) for name in NEEDS[by]]
        earlier = rest(t)
        system, q0 = _started(robot, [motion(earlier[0])[0] for motion in motions])
        run = fx.simulate(
            system,
            np.concatenate([earlier, t]),
            fx.Drive.prescribed(*motions),
            q0=q0,
            rtol=rtol,
            progress=progress,
        )
        kept = slice(len(earlier), None)
        run = dataclasses.replace(
            run, t=run.t[kept], channels={n: v[kept] for n, v in run.channels.items()}, states=None
        )
    run.meta.pop("drive", None)  # the experiment's own samples once more
    run.meta["driven_by"] = by
    run.meta["simulates"] = " ".join(
        filter(None, (experiment.meta.get("experiment"), called(experiment)))
    )
    return run


def given(experiment: fx.Run) -> tuple[signals.Signal, bool]:
    """Joint 2's angle by its pulses [rad], from before the start on; whether it jumps: each pulse
    when the firmware gave it, where that follows from what the run holds, else a spline through the
    reports."""
    exact = from_run(experiment)
    if exact is None:
        return _motion(experiment, "joint/2/pulses", "commanded"), False
    at, angle = exact
    at[0] = rest(experiment.t)[0]
    return signals.piecewise(at, angle), True


def _motion(experiment: fx.Run, name: str, by: str) -> signals.Signal:
    """The joint's motion from before the start on, where the robot was at rest: it must not start
    at speed and unbent."""
    t, y = from_rest(*known(experiment.t, experiment[name], name))
    return smoothed(t, y) if by == "measured" else onward(t, y)


def _started(robot: fx.Robot, joints: Sequence[float]) -> Start:
    """The system, and its state with the joints where the experiment had them."""
    system = fx.assemble(robot)
    q0 = system.start()
    q0[system.joint_rows] = joints
    return system, q0


def held(t: np.ndarray, y: np.ndarray) -> signals.Signal:
    """Each sample held from half way after the one before to half way before the next: no lag,
    whatever happens between."""
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
    """The robot with the motor's friction and inertia in joint 1 and the stepper's damping in joint
    2."""
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
    rig = recorded(tables)
    if rig.emulated is None:
        raise InputError(
            "missing: `commanded` needs the rotor's inertia and the rig's friction from there",
            key="rig.emulated",
        )
    return rig, rig.emulated
