"""The door of `flexura`: one robot or many, by the same call."""

from __future__ import annotations

from typing import Any, overload

from .errors import InputError
from .io import Run
from .population import Batch, Population
from .population import simulate as simulate_population
from .signals import Drive
from .simulation.dynamics import DriveLike
from .simulation.dynamics import simulate as simulate_robot
from .simulation.problem import Progress


@overload
def simulate(
    robot: Batch, t_eval: Any, drive: Drive | None = None, *state: Any, **options: Any
) -> Population: ...
@overload
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
) -> Run: ...
def simulate(
    robot: Any,
    t_eval: Any,
    drive: Any = None,
    q0: Any = None,
    qd0: Any = None,
    rtol: float = 1e-6,
    **options: Any,
) -> Any:
    """Integrate the equations of motion from t_eval[0] on; the Run has its channels at t_eval (T,).

    A joint that reaches a limit of the robot file or the end of its link ends the run. So does a
    tolerance that cannot be kept, a state that is not a number, and Ctrl-C. The Run then has what
    was computed until there, an event says what happened and where, and `meta["complete"]` is
    false. `meta["energy_error"]` is how far the energies are from balancing, relative to the
    largest; beyond 1e-3 an event says so, beyond 0.1 the run is not complete.

    Args:
        robot: a System, a Robot, a robot file, or a Batch of robots, which gives a Population;
        `flexura.population.simulate`
            says what else that takes.
        t_eval (T,): ascending times [s]. drive: a Drive, a sampled Controller, `Sampled(f,
        rate_Hz)`, or a function of (t) or of (t, position, velocity,
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
    if isinstance(robot, Batch):
        if not (drive is None or isinstance(drive, Drive)):
            raise InputError(
                "expected a Drive: a population runs in the core alone", key="drive", value=drive
            )
        return simulate_population(robot, t_eval, drive, q0, qd0, rtol, **options)
    known = ("method", "numerical_damping", "progress")
    for key in options:
        if key not in known:
            raise InputError("expected this of a Batch only, not of one robot", key=key)
    return simulate_robot(robot, t_eval, drive, q0, qd0, rtol, **options)
