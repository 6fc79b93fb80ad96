"""Simulation of one robot or of many, by the same call."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, overload

from numpy.typing import ArrayLike

from .errors import InputError, within_memory
from .io import Run
from .population import Batch, Population
from .population import simulate as simulate_population
from .signals import Drive, LoadsLike, PayloadsLike
from .simulation.dynamics import DriveLike
from .simulation.dynamics import simulate as simulate_robot
from .simulation.problem import Progress
from .system import RobotLike

OF_ONE, OF_MANY = (
    {p.name for p in inspect.signature(f).parameters.values() if p.kind is p.KEYWORD_ONLY}
    for f in (simulate_robot, simulate_population)
)
WHY = {
    "until": "robots would end at times of their own, and it would run in Python",
    "continue_from": "a Run has the state of one robot",
}


@overload
def simulate(
    robot: Batch,
    t_eval: ArrayLike,
    drive: Drive | None = None,
    q0: ArrayLike | None = None,
    qd0: ArrayLike | None = None,
    rtol: float = 1e-6,
    **options: object,
) -> Population: ...
@overload
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
) -> Run: ...
@within_memory
def simulate(
    robot: RobotLike | Batch,
    t_eval: ArrayLike,
    drive: DriveLike = None,
    q0: ArrayLike | None = None,
    qd0: ArrayLike | None = None,
    rtol: float = 1e-6,
    **options: object,
) -> Run | Population:
    """Integrate the equations of motion from t_eval[0] on; the Run has its channels at t_eval (T,).

    Under gravity a run starts in static equilibrium, with the joints held where they start and the
    links bent by their weight; `meta["start"]` says which start was used. A joint that reaches a
    limit of the robot file or the end of its link ends the run. So does a tolerance that cannot be
    kept, a state that is not a number, and Ctrl-C. The Run then has what was computed until there,
    an event says what happened and where, and `meta["complete"]` is false. `meta["energy_error"]`
    is how far the energies are from balancing, relative to the largest; beyond 1e-3 an event says
    so, beyond 0.1 the run is not complete. Each event has a name: "limit", "end_of_link", "sleeve",
    "interrupted", "stuck", "diverged", "exhausted", "wall_time", "balance", "not_finite", "node",
    "until", "still", "off_motion", "fast", "payload".

    Args:
        robot: a System, a Robot, the path or name of a robot file, or a Batch of robots, which
            gives a Population; `flexura.population.simulate` says what else that takes.
        t_eval: ascending times (T,) [s].
        drive: a Drive, a sampled Controller, `Sampled(f, rate_Hz)`, or a function of (t) or of (t,
            position, velocity, tip_deflection) that gives (links,) forces and torques [N or N m].
            Such a function may be called again for times within a step, never before its start,
            and must have no memory. Or forces, never motions, one entry a joint: a number, a
            Signal, a function of t, an array of len(t_eval) values, or None; or an array
            (T, joints). Motions are in `Drive.pd`, `Drive.prescribed` and `inverse`.
        q0: configuration at the start (n,); None: see `start`.
        qd0: its rates (n,); None: at rest.
        rtol: the error that is asked for, of deflections and of a thousandth of the tip's path.
        **options: the arguments below, by name.
        method: "auto", "explicit" (order 8), "implicit", or "exponential".
        start: where q0 is not given, "static", which is the default under gravity, or "straight".
        continue_from: a Run of `simulate`, at whose end this one starts, with its state and its
            work and losses; t_eval begins there, so that signals go on. Controllers begin anew.
        until: a function of (t, position, velocity, tip_deflection) that gives a bool, or a number
            of which a change of sign counts. It is evaluated at the times t_eval. The instant
            between two of them is found by integrating again from the first of the two. The run
            ends there, complete, with the event "until". Under a Sampled or a Controller it ends at
            the time of t_eval: both may have a memory, so that no tick is computed twice.
        numerical_damping: exponential steps damp fast modes that change no output by more than the
            tolerance (95); False: they do not.
        loads: forces and moments on links (133): a list of `Load`, or of tables with its keys. In
            a static start the loads of t_eval[0] act too. Their work is part of `energy/work`.
        payloads: changes of the payload (137): a list of `PayloadChange`, or of tables with its
            keys. Each is an event "payload"; the energy jumps by what the event says.
        internal_forces: the Run also has the reactions of the joints, and bending moment, shear
            force, axial force and stress along the links. They take about a millisecond a link
            and time.
        max_steps: a budget of steps, rejected ones included, by default 20 million. It ends the run
            with the event "exhausted", at the same step on every machine.
        wall_time: seconds after which the run is stopped where it is, with the event "wall_time".
        progress: called with the finished fraction.

    Returns:
        A Run, of a Batch a Population.

    Raises:
        InputError: an argument is not what is expected, or a motion has nothing that follows it.
        NoEquilibrium: there is no static equilibrium to start in.
        NumericalError: the equations are singular or not finite, or there is too little memory.
    """
    given: dict[str, Any] = dict(options)
    if isinstance(robot, Batch):
        if not (drive is None or isinstance(drive, Drive)):
            raise InputError(
                "expected a Drive: a population runs in the core alone", key="drive", value=drive
            )
        for key in options:
            if key in OF_ONE and key not in OF_MANY:
                text = f"expected this of one robot only, not of a Batch: {WHY[key]}"
                raise InputError(text, key=key)
        return simulate_population(robot, t_eval, drive, q0, qd0, rtol, **given)
    for key in options:
        if key in OF_MANY and key not in OF_ONE:
            raise InputError("expected this of a Batch only, not of one robot", key=key)
    return simulate_robot(robot, t_eval, drive, q0, qd0, rtol, **given)
