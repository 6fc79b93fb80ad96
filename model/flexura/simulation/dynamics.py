"""Forward and inverse dynamics: drives in, motion out, to a tolerance."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from ..control import Controller, Sampled
from ..errors import InputError
from ..io import Run
from ..signals import Drive, Signal
from ..system import System, system_of
from . import dense, integrator, nodewise_run
from .problem import Problem, Progress, Solution, initial_value_problem
from .recorder import record

DriveLike = Drive | Controller | Sampled | Callable[..., Any]


def simulate(
    robot: Any,
    t_eval: Any,
    drive: DriveLike | None = None,
    q0: Any = None,
    qd0: Any = None,
    rtol: float = 1e-6,
    *,
    method: str = "auto",
    numerical_damping: bool = True,
    progress: Progress = None,
) -> Run:
    """Integrate the equations of motion from t_eval[0] on; the Run has its channels at t_eval (T,).

    A joint that reaches a limit of the robot file or the end of its link ends the run. So does a
    tolerance that cannot be kept, a state that is not a number, and Ctrl-C. The Run then has what
    was computed until there, an event says what happened and where, and `meta["complete"]` is
    false. `meta["energy_error"]` is how far the energies are from balancing, relative to the
    largest; beyond 1e-3 an event says so, beyond 0.1 the run is not complete.

    Args:
        robot: a System, a Robot, or a robot file. t_eval (T,): ascending times [s]. drive: a Drive,
        a sampled Controller, `Sampled(f, rate_Hz)`, or a function of (t) or of (t, position,
        velocity,
            tip_deflection) that gives (links,) forces and torques [N or N m]. Such a function may
            be called again for times within a step, never before its start, and must have no
            memory.
        q0, qd0 (n,): the state at the start, by default `system.start()` at rest. rtol: the error
        that is asked for, of deflections and of a thousandth of the tip's path. method: "auto",
        "explicit" (order 8), "implicit", or "exponential". numerical_damping: exponential steps
        damp fast modes that change no output by more than the tolerance
            (94); False: they do not.
        progress: called with the finished fraction.

    Raises:
        InputError: an argument is not what is expected.
    """
    problem = initial_value_problem(robot, t_eval, drive, q0, qd0, rtol, method, numerical_damping)
    run = record(problem.system, solution := _solver(problem.system)(problem, progress))
    return (
        problem.drive.recorded(run, solution.sampler)
        if isinstance(problem.drive, Controller)
        else run
    )


def inverse(
    robot: Any,
    t_eval: Any,
    motion: Signal | Sequence[Signal],
    q0: Any = None,
    qd0: Any = None,
    rtol: float = 1e-6,
    *,
    method: str = "auto",
    progress: Progress = None,
) -> Run:
    """Inverse dynamics (59): joints follow `motion` exactly; the Run has `joint/i/drive`, the
    forces that this takes.

    The elastic unknowns are integrated from q0, qd0 (n,), whose joint entries are replaced by the
    motion's. Nothing is approximated by a rigid robot and nothing is iterated. Replaying the drives
    through `simulate` returns the motion.

    Args:
        motion: one Signal a joint; the others as in `simulate`.

    Raises:
        InputError: an argument is not what is expected; a motion whose position or velocity jumps.
    """
    system = system_of(robot)
    motions = [motion] if isinstance(motion, Signal) else list(motion)
    if len(motions) != len(system.robot.links) or not all(isinstance(m, Signal) for m in motions):
        raise InputError(
            f"expected {len(system.robot.links)} Signals, one a joint",
            key="motion",
            value=len(motions),
        )
    return simulate(
        system, t_eval, Drive.prescribed(*motions), q0, qd0, rtol, method=method, progress=progress
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
