"""Forward and inverse dynamics: drives in, motion out, to a tolerance."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ..control import Controller, Sampled
from ..errors import InputError, guarded
from ..io import Run, check_progress, flag
from ..signals import Drive, LoadsLike, Manoeuvre, PayloadsLike, SignalLike, as_payloads, as_signals
from ..system import RobotLike, System, assemble, check_continuous
from . import dense, integrator, nodewise_run, payload_changes
from .problem import Budget, Problem, Progress, Solution, check_times, initial_value_problem
from .recorder import fast, off_motion, record, still
from .stop_condition import StopCondition

DriveLike = (
    Drive
    | Controller
    | Sampled
    | Callable[..., ArrayLike]
    | Sequence[SignalLike]
    | np.ndarray
    | float
    | None
)


@guarded("the motion")
def simulate(
    robot: RobotLike,
    t_eval: ArrayLike,
    drive: DriveLike = None,
    q0: ArrayLike | None = None,
    qd0: ArrayLike | None = None,
    rtol: float = 1e-6,
    *,
    method: str = "auto",
    start: str | None = None,
    continue_from: Run | None = None,
    until: Callable[..., bool | float] | None = None,
    numerical_damping: bool = True,
    loads: LoadsLike = None,
    payloads: PayloadsLike = None,
    internal_forces: bool = False,
    max_steps: int | None = None,
    wall_time: float | None = None,
    progress: Progress = None,
) -> Run:
    """Integrate the equations of motion of one robot (25); errors as in `flexura.simulate`.

    Args:
        robot: a System, a Robot, or the path or name of a robot file.
        t_eval: ascending times (T,) [s].
        drive: as in `flexura.simulate`.
        q0: configuration at the start (n,).
        qd0: its rates (n,).
        rtol: as in `flexura.simulate`.
        method: as in `flexura.simulate`.
        start: as in `flexura.simulate`.
        continue_from: as in `flexura.simulate`.
        until: as in `flexura.simulate`.
        numerical_damping: as in `flexura.simulate`.
        loads: as in `flexura.simulate`.
        payloads: as in `flexura.simulate`.
        internal_forces: as in `flexura.simulate`.
        max_steps: as in `flexura.simulate`.
        wall_time: as in `flexura.simulate`.
        progress: called with the finished fraction.

    Returns:
        The Run.
    """
    problem = initial_value_problem(
        robot,
        t_eval,
        drive,
        q0,
        qd0,
        rtol,
        method,
        numerical_damping=numerical_damping,
        start=start,
        before=continue_from,
        budget=Budget.checked(max_steps, wall_time),
        loads=loads,
    )
    check_progress(progress)
    within = flag(internal_forces, "internal_forces")
    if within:
        check_continuous(problem.system)
    solver = _solver(problem.system)
    changes = as_payloads(payloads, float(problem.t[0]), float(problem.t[-1]))
    if changes:
        payload_changes.check(problem, changes, until)
        solution = payload_changes.solve(problem, changes, solver, progress)
    elif until is None:
        solution = solver(problem, progress)
    else:
        solution = StopCondition(until, problem).run(solver, progress)
    solution = replace(
        solution,
        accounts=solution.accounts + problem.accounts,
        meta=solution.meta | {"start": problem.start},
    )
    run = record(problem.system, solution, problem.loads, within)
    remarks = off_motion(problem) + still(run, problem.loads) + fast(run, problem.system.robot)
    run.meta["events"] = run.meta["events"] + remarks
    if isinstance(problem.drive, Controller):
        return problem.drive.recorded(run, solution.sampler)
    return run


@guarded("the inverse dynamics")
def inverse(
    robot: RobotLike,
    t_eval: ArrayLike,
    motion: Sequence[SignalLike] | np.ndarray,
    q0: ArrayLike | None = None,
    qd0: ArrayLike | None = None,
    rtol: float = 1e-6,
    *,
    method: str = "auto",
    start: str | None = None,
    loads: LoadsLike = None,
    payloads: PayloadsLike = None,
    internal_forces: bool = False,
    max_steps: int | None = None,
    wall_time: float | None = None,
    progress: Progress = None,
) -> Run:
    """Inverse dynamics (59): joints follow `motion` exactly; the Run has `joint/i/drive`, the
    forces that this takes.

    The elastic unknowns are integrated from q0, qd0 (n,), whose joint entries are replaced by the
    motions. Nothing is approximated by a rigid robot and nothing is iterated. Replaying the drives
    through `simulate` returns the motion.

    Args:
        robot: a System, a Robot, or the path or name of a robot file.
        t_eval: ascending times (T,) [s].
        motion: motions, never forces, one entry a joint: a Signal, a function of t, an array of
            len(t_eval) values, or a number; or an array (T, joints). Arrays become cubic splines,
            functions splines of fifth order. None is good for a locked joint. A motion may begin
            and end with any velocity, but not jump inside the run.
        q0: configuration at the start (n,), as in `flexura.simulate`.
        qd0: its rates (n,).
        rtol: as in `flexura.simulate`.
        method: as in `flexura.simulate`.
        start: as in `flexura.simulate`. Under gravity the run starts in static equilibrium with the
            joints on their motions.
        loads: as in `flexura.simulate`; the drives bear them too.
        payloads: as in `flexura.simulate`; joints keep to their motions at the impact.
        internal_forces: as in `flexura.simulate`.
        max_steps: as in `flexura.simulate`.
        wall_time: as in `flexura.simulate`.
        progress: called with the finished fraction.

    Returns:
        A Run with the drives.

    Raises:
        InputError: an argument is not what is expected; a motion whose position or velocity jumps.
        NoEquilibrium: there is no static equilibrium to start in.
    """
    system, t = assemble(robot), check_times(t_eval)
    if isinstance(motion, Drive | Controller | Sampled | Manoeuvre):
        expected = "expected motions, one entry a joint; flexura.simulate takes drives"
        raise InputError(expected, key="motion", value=type(motion).__name__)
    motions = as_signals(motion, len(system.robot.links), "motion", t)
    for i, (signal, link) in enumerate(zip(motions, system.robot.links, strict=True), 1):
        if signal is None and not link.joint.locked:
            raise InputError(
                "missing: expected a motion of every joint", key=f"motion[{i}]", value="None"
            )
    drive = Drive.prescribed(*motions)
    return simulate(
        system,
        t,
        drive,
        q0,
        qd0,
        rtol,
        method=method,
        start=start,
        loads=loads,
        payloads=payloads,
        internal_forces=internal_forces,
        max_steps=max_steps,
        wall_time=wall_time,
        progress=progress,
    )


def _solver(system: System) -> Callable[[Problem, Progress], Solution]:
    """What integrates the equations of such a robot: the core, or the dissertation's two models in
    NumPy."""
    return (
        integrator.solve
        if system.exact
        else nodewise_run.solve
        if system.robot.nodal
        else dense.solve
    )
