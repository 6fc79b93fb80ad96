"""What gears and screws lose of the links' load, which a motor must give besides.

A drive of the efficiency eta that carries the load T loses (1 / eta - 1) |T| where it drives the
load, and the same where the load drives it, but never more than |T| then. The loss acts against the
velocity. The load is the joint's force less what the rotor's inertia and the joint's friction take.
It depends on the motion and the motion on the loss: both are found in rounds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

import flexura as fx
from flexura import signals
from flexura.signals import Loads, Signal
from flexura.system import RunStates, System

from ...rig.axes import MotorAxis
from ...rig.plant.motor import JointLine

SLOW = 1e-2  # rad/s: below, a loss fades to zero, as Coulomb friction does (57)
ROUNDS, CLOSE = 20, 1e-3  # of the way of a joint: what the last round may change of its motion


def with_losses(
    system: System,
    q0: np.ndarray,
    t: np.ndarray,
    forces: Sequence[Signal],
    lines: Sequence[tuple[MotorAxis, JointLine]],
    rtol: float,
    progress: Callable[[float], None] | None = None,
) -> fx.Run:
    """Simulate joints under their motors' forces, less what the drives lose of the load.

    Args:
        system: the robot with rotors and friction in its joints.
        q0: configuration at the start (n,).
        t: times (T,) [s].
        forces: of the motors at the joints [N or N m].
        lines: the joints with motors.
        rtol: tolerance of the simulation.
        progress: called with the finished fraction of a round.

    Returns:
        The Run; `meta["gear_loss_rounds"]` says how many rounds it took, None: they did not end.
    """
    solve = lambda acting: fx.simulate(
        system, t, fx.Drive.force(*acting), q0=q0, rtol=rtol, progress=progress
    )
    run = solve(forces)
    if run.interrupted or all(line.efficiency >= 1.0 for _, line in lines):
        return run
    run.meta["gear_loss_rounds"] = None
    for rounds in range(1, ROUNDS + 1):
        acting = [
            signals.sum([force, signals.table(t, -lost)])
            for force, lost in zip(forces, losses(system, run, lines), strict=True)
        ]
        before, run = run, solve(acting).uninterrupted()
        if all(
            np.abs(run[name] - before[name]).max() <= CLOSE * np.ptp(run[name])
            for name in (f"joint/{axis.number}/position" for axis, _ in lines)
        ):
            run.meta["gear_loss_rounds"] = rounds
            break
    return run


def losses(
    system: System, run: fx.Run, lines: Sequence[tuple[MotorAxis, JointLine]]
) -> list[np.ndarray]:
    """What each drive loses of its load in a run, (T,) [N or N m], positive with the velocity."""
    assert run.states is not None
    n, rows = system.n, system.joint_rows
    q, qd = np.split(run.states, [n], axis=1)
    drive = np.column_stack([run[f"joint/{i + 1}/drive"] for i in range(len(rows))])
    qdd = RunStates(system, run.t, q, qd, drive, Loads()).accelerations
    out = []
    for axis, line in lines:
        i = axis.number - 1
        speed = qd[:, rows[i]]
        along = np.tanh(speed / SLOW)
        load = drive[:, i] - line.inertia * qdd[:, rows[i]] - line.viscous * speed
        load = load - line.coulomb * along
        driving, driven = 1 / line.efficiency - 1, 1 - line.back_driven
        out.append(np.where(load * speed > 0, driving, driven) * np.abs(load) * along)
    return out
