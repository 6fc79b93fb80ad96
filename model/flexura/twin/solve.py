"""Simulation of a robot in Exudyn: settings, the run, and its failures."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from ..errors import FlexuraError, InputError, guarded
from ..io import Run, array, check_progress, choice, flag, interruption, judged, number, whole
from ..optional import Optional
from ..robot import MAX_ELEMENTS, Robot, robot_of
from ..signals import LoadsLike, PayloadsLike, as_loads, as_payloads
from .build import TwinModel, build
from .channels import channels
from .extrapolation import LENGTH_FACTOR, extrapolate
from .joints.mesh import check_supported, mesh, slide_range, sliding_kinds
from .links import ancf, geometrically_exact
from .loads import Actuation, Loads, actuation
from .payload_changes import End, in_parts, later
from .payload_changes import put as put_state
from .start import at_positions, equilibrium, put, resolve_start, start_speeds
from .steps import Steps, plan_steps, suggest_step

exu = Optional("exudyn")

PROGRAMS = {"ancf": ancf.PROGRAM, "ge": geometrically_exact.PROGRAM}
ATTEMPTS = 4  # steps tried, each half the one before, unless the user gives one
# coordinates beyond which sparse matrices are faster (0.25 ms a step against 0.8 at 420)
SPARSE_FROM = 60
COARSE_ELEMENTS = 4  # elements a link for the frequencies that suggest a step
SLACK = 1e-4  # how far a hub or sleeve may go beyond the end of its link, relative to the link
PROGRESS = 0.01  # the fraction of a run between two calls of progress

# times, coordinates, velocities, accelerations, forces of the constraints on prescribed joints
Record = tuple[list[float], list[np.ndarray], list[np.ndarray], list[np.ndarray], list[np.ndarray]]


class DidNotConverge(FlexuraError):
    """Exudyn's solver gave up on a step; a shorter one may help."""


@guarded("the twin's motion")
def simulate(
    robot: Any,
    t_eval: Any,
    drive: Any = None,
    qd0: Any = None,
    *,
    start: str | None = None,
    loads: LoadsLike = None,
    payloads: PayloadsLike = None,
    beam: str = "ancf",
    elements: int | None = None,
    step_s: float | None = None,
    hub_length_m: float | None = None,
    internal_forces: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Run:
    """Simulate a robot in Exudyn, as a check of the native solver.

    Nothing is shared with the native solver but the robot file and the drives. The robot is at
    `robot.start` at time 0. Links take all unknowns of their mesh (`modes` is ignored); joint
    limits do not act.

    Args:
        robot: a Robot, a System, or the path or name of a robot file.
        t_eval: ascending times of the result (T,) [s], from 0 on.
        drive: a Drive, whose prescribed joints are held to their motions; a function of (t) or of
            (t, position, velocity, tip_deflection) that returns n forces [N] or torques [N m];
            tip_deflection is the last link's. A function of the state is called in every
            iteration, so that it must depend on its arguments only. Or forces, one entry a joint,
            as in `flexura.simulate`.
        qd0: joint velocities at the start (n,) [m/s or rad/s]; None: at rest.
        start: "static", links in equilibrium with the joints held, which is the default under
            gravity, or "straight". Joints keep the velocities qd0, but a robot with a joint that
            slides on a flexible link must be at rest. `meta["start"]` says which was used.
        loads: forces and moments on links, as in `flexura.simulate`; on a "ge" beam at its nodes.
        payloads: changes of the payload, as in `flexura.simulate`.
        beam: "ancf" (ObjectANCFCable2D, Euler-Bernoulli) or "ge" (ObjectBeamGeometricallyExact2D of
            three nodes, with shear).
        elements: beam elements a flexible link; None: twice the robot file's and at least 8, or 32
            if a joint slides on it.
        step_s: Exudyn's longest step [s]; None: from the robot's frequencies, for a time error
            below 1e-3 of the tip deflection or so, and shorter if needed. Steps divide a uniform
            output step; else cubics interpolate.
        hub_length_m: length of the hub of a Pa on a flexible link, and of the spans of a flexible
            Pb's sleeve [m], see `mesh`. None: short ones, extrapolated to none by one more run for
            each of the two types (`extrapolation`).
        internal_forces: the Run also has the reactions of the joints, and the forces along the
            flexible links, by the accelerations that Exudyn finds; of an "ancf" beam only.
        progress: called with the finished fraction.

    Returns:
        A Run with the channels of a native run except energy/work and energy/loss.
            `meta["extrapolation"]` has the size of the extrapolation. Ctrl-C ends it early, with
            `meta["complete"]` false.

    Raises:
        InputError: an argument is wrong, or the twin does not contain something: stiffening =
            false, damping alpha, sliding on a "ge" beam.
        FlexuraError: Exudyn's solver fails, or finds no equilibrium to start in, or a joint slides
            off the end of a flexible link; the message has the time.
    """
    robot = robot_of(robot)
    within = flag(internal_forces, "internal_forces")
    _check_beam(robot, beam, within)
    t, speeds = _times(t_eval), start_speeds(robot, qd0)
    _check_mesh(elements, step_s, hub_length_m)
    check_progress(progress)
    act = actuation(drive, robot.start, speeds, t)
    if act.guided is not None and act.guided.any():
        assert act.plan is not None
        on = act.plan(0.0)
        robot = at_positions(robot, np.where(act.guided, on[:, 1], robot.start))
        speeds = np.where(act.guided, on[:, 2], speeds)
    lengths = [link.length_m for link in robot.links]
    on_links = as_loads(loads, lengths, 0.0, float(t[-1]))
    changes = as_payloads(payloads, 0.0, float(t[-1])) if payloads else ()
    if changes and beam == "ge" and any(link.flexible for link in robot.links):
        expected = 'expected "ancf" where the payload of a flexible link changes'
        raise InputError(expected, key="beam", value=beam)
    begins = resolve_start(robot, start, speeds)
    kinds = sliding_kinds(robot) if hub_length_m is None else []
    share, report = 1 / (1 + len(kinds)), progress or (lambda fraction: None)

    def run(number: int, times: dict[str, float], longest: float) -> Run:
        shape = mesh(robot, elements, hub_length_m, times)
        bent = equilibrium(robot, beam, shape, on_links) if begins == "static" else None

        def model_of(carrier: Robot, begin: float) -> TwinModel:
            return build(
                carrier, beam, shape, speeds, act.gains, act.guided, loads=on_links, since=begin
            )

        def part(carrier: Robot, begin: float, state: End | None, at: np.ndarray) -> Any:
            def new() -> TwinModel:
                model = model_of(carrier, begin)
                if state is not None:
                    put_state(model, state)
                elif bent is not None:
                    put(model, bent, speeds)
                return model

            def told(fraction: float) -> None:
                reached = 1.0 if t[-1] == 0 else (begin + fraction * at[-1]) / t[-1]
                report((number + reached) * share)

            tries = 1 if step_s else ATTEMPTS
            acting, program = later(act, begin), PROGRAMS[beam]
            return _run(new, acting, at, longest, tries, told, program, within)

        return in_parts(robot, changes, t, model_of, part, _settings(1.0, 1))

    with _quiet():
        coarse = mesh(robot, COARSE_ELEMENTS, hub_length_m)
        first = run(
            0,
            {},
            step_s
            or suggest_step(
                build(robot, beam, coarse, speeds, act.gains, act.guided), _settings(1.0, 1), t[-1]
            ),
        )
        first.meta["start"] = begins
        if not kinds or not first.complete:
            return first
        longer: dict[str, Run] = {}
        for k, kind in enumerate(kinds, 1):
            longer[kind] = run(k, {kind: LENGTH_FACTOR}, first.meta["step_s"])
            if longer[kind].interrupted:
                first.meta.update(complete=False, events=longer[kind].meta["events"])
                return first
        return extrapolate(first, longer)


def _run(
    new: Callable[[], TwinModel],
    act: Actuation,
    t: np.ndarray,
    longest: float,
    tries: int,
    progress: Callable[[float], None],
    program: str,
    internal_forces: bool = False,
) -> tuple[Run, End]:
    """Simulate with steps of at most `longest` [s]; they are halved if Exudyn fails.

    With one try, the step is the user's and stays. The run, and where it ended.
    """

    for attempt in range(tries):
        model, steps = new(), plan_steps(t, longest / 2**attempt, forced=tries == 1)
        try:
            record, done, wall, interrupted = _solve(model, act, steps, progress)
            break
        except DidNotConverge:
            if attempt == tries - 1:
                raise
    data = np.array(model.mbs.systemData.GetDataCoordinates())
    end = End(record[1][-1], record[2][-1], data)
    at, *columns = (np.array(column) for column in record[:4])
    t, q, v, more = steps.at_times(t, at, *columns)
    q += model.reference
    reaction = np.column_stack([np.interp(t, at, column) for column in np.array(record[4]).T])
    values, units = channels(model, act, t, q, v, more, reaction, internal_forces)
    meta = {
        "source": "twin",
        "program": f"Exudyn {exu.__version__} ({program})",
        "robot": model.robot.to_dict(),
        "complete": done == steps.count and not interrupted,
        "events": [interruption(done * steps.length)] if interrupted else [],
        "wall_s": wall,
        "steps": done,
        "step_s": steps.length,
        "elements": model.mesh.elements,
        "labels": [f"joint/{i}" for i in range(1, len(model.parts) + 1)],
        "hub_length_m": model.mesh.hubs,
    }
    return judged(Run(t, values, units, meta)), end


def _check_beam(robot: Robot, beam: Any, internal_forces: bool) -> None:
    """Raises InputError for a beam that there is not, or that lacks what is asked for."""
    choice(beam, "beam", tuple(PROGRAMS))
    check_supported(robot, beam)
    if internal_forces and beam == "ge" and any(link.flexible for link in robot.links):
        expected = 'expected "ancf" for internal forces: a "ge" beam has no cubics to cut'
        raise InputError(expected, key="beam", value=beam)


def _check_mesh(elements: Any, step_s: Any, hub_length_m: Any) -> None:
    """Raises InputError for numbers of a mesh, or a step, that are none."""
    if elements is not None:
        most = 2 * MAX_ELEMENTS
        expected = f"expected a whole number from 1 to {most}"
        if whole(elements, "elements", 1, expected) > most:
            raise InputError(expected, key="elements", value=elements)
    for key, given, unit in (
        ("step_s", step_s, "time in seconds"),
        ("hub_length_m", hub_length_m, "length in metres"),
    ):
        expected = f"expected a {unit}, above 0"
        if given is not None and not number(given, key, expected) > 0:
            raise InputError(expected, key=key, value=given)


def _times(t_eval: Any) -> np.ndarray:
    """The output times (T,), checked."""
    expected = "expected ascending times in seconds, from 0 on"
    t = array(t_eval, "t_eval", expected, (None,))
    if len(t) == 0 or t[0] < 0 or np.any(np.diff(t) <= 0):
        raise InputError(expected, key="t_eval", value=t)
    return t


def _settings(
    end: float, steps: int, reach: float = 1.0, flexible: bool = True, coordinates: int = 0
) -> Any:
    """Exudyn's settings, sound for thin metal strips, without files.

    Exudyn's default tolerances on residuals are below round-off for strips (EA/EI ~ 1e7 1/m^2); it
    would then halve its step a thousand times without a message. With flexible links, convergence
    is judged by increments (residualMode 1) instead, and a step that fails, fails. An increment of
    position of 1e-12 is 1e-12/h^2 in acceleration: with a fixed tolerance errors grow again as the
    step falls, with one proportional to h^2 they do not.

    Args:
        end: duration [s].
        steps: number of steps.
        reach: sum of the links' lengths [m].
        flexible: whether a link is flexible.
        coordinates: of the system.
    """

    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.endTime, integration.numberOfSteps = end, steps
    newton = integration.newton
    newton.useModifiedNewton = True
    if flexible:
        newton.residualMode = 1
        newton.relativeTolerance = 1e-10
        newton.absoluteTolerance = reach * min(2e-12, 2e-4 * (end / steps) ** 2)
    integration.generalizedAlpha.spectralRadius = 0.9
    integration.adaptiveStep = False
    kinds = exu.LinearSolverType
    settings.linearSolver.solverType = (
        kinds.EigenSparse if coordinates > SPARSE_FROM else kinds.EigenDense
    )
    settings.solution.file.write = False
    settings.solution.solverInformationFileName = ""
    settings.solution.sensors.active = False
    return settings


def _solve(
    model: TwinModel, act: Actuation, steps: Steps, progress: Callable[[float], None] | None
) -> tuple[Record, int, float, bool]:
    """Run Exudyn; the record, the steps done, seconds taken, and whether Ctrl-C ended it."""
    record: Record = ([], [], [], [], [])
    force = exu.OutputVariableType.Force
    errors: list[BaseException] = []
    data, done = model.mbs.systemData, 0
    loads = Loads(model, act, steps.length, steps.count, errors.append)
    announce = max(1, round(PROGRESS * steps.count))

    def keep() -> None:
        record[0].append(done * steps.length)
        record[1].append(np.array(data.GetODE2Coordinates()))
        record[2].append(np.array(data.GetODE2Coordinates_t()))
        record[3].append(np.array(data.GetODE2Coordinates_tt()))
        guides = [joint.guide for joint in model.coordinates]
        forces = [0.0 if g is None else -model.mbs.GetObjectOutput(g, force) for g in guides]
        record[4].append(np.array(forces, dtype=float))

    def before(mbs: Any, t: float) -> bool:
        try:
            loads.before_step(t)
        except BaseException as error:
            # Exudyn would turn it into another exception: stop first, raise after
            errors.append(error)
        return not errors

    def after(mbs: Any, t: float) -> bool:
        nonlocal done
        try:
            done = round(t / steps.length)
            _check_on_links(model, data.GetODE2Coordinates(), t)
            if steps.keep[done]:
                keep()
            if progress is not None and done % announce == 0:
                progress(done / max(1, steps.count))
        except BaseException as error:
            errors.append(error)
        return not (errors or interrupted.is_set())

    began = time.perf_counter()
    with _interruptible() as interrupted:
        if steps.count == 0:
            after(model.mbs, 0.0)
        else:
            model.mbs.SetPreStepUserFunction(before)
            model.mbs.SetPostStepUserFunction(after)
            end, size = steps.count * steps.length, len(model.reference)
            settings = _settings(end, steps.count, model.reach, any(model.mesh.elements), size)
            failed = _run_solver(model.mbs, settings)
            if failed and not errors:
                raise _failure(model.mbs, done, steps, failed)
    if errors:
        raise errors[0]
    return record, done, time.perf_counter() - began, interrupted.is_set()


def _check_on_links(model: TwinModel, q: Any, t: float) -> None:
    """Raise FlexuraError if a hub or sleeve has reached the end of its link.

    Exudyn would let it stick there.
    """
    for i, place in enumerate(model.slides):
        if place is not None:
            low, high = slide_range(model.robot, i)
            if not low - SLACK * high <= q[place] <= high + SLACK * high:
                where = f"at {q[place]:.6g} m, it can be from {low:g} to {high:g} m"
                raise FlexuraError(
                    f"joint {i + 1} slid off the end of its link at t = {t:.6g} s: {where}"
                )


def _run_solver(mbs: Any, settings: Any) -> str:
    """Run Exudyn's solver; its error message, or "" if it ended or was stopped."""
    try:
        return "" if mbs.SolveDynamic(settings) else "SolveDynamic returned False"
    except Exception as error:
        return str(error) or type(error).__name__


def _failure(mbs: Any, done: int, steps: Steps, failed: str) -> FlexuraError:
    """The error for a run that failed."""
    where = (
        f"Exudyn's solver stopped at t = {done * steps.length:.6g} s of "
        f"{steps.count * steps.length:.6g} s"
    )
    solver = mbs.sys.get("dynamicSolver")
    if solver is not None and solver.conv.linearSolverFailed:
        return FlexuraError(
            f"{where}: its equations are singular; a link without mass that nothing holds?"
        )
    if solver is not None and not solver.conv.newtonConverged:
        cause = (
            f"a step of {steps.length:.3g} s did not converge; the motion or the drive is too "
            f"fast for it"
        )
        return DidNotConverge(f"{where}: {cause}, give a smaller step_s")
    return FlexuraError(f"{where}: {failed.splitlines()[0]}")


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep Exudyn's messages off the terminal."""

    before = exu.config.printToConsole, exu.config.suppressWarnings
    exu.config.printToConsole, exu.config.suppressWarnings = False, True
    try:
        yield
    finally:
        exu.config.printToConsole, exu.config.suppressWarnings = before


@contextmanager
def _interruptible() -> Iterator[threading.Event]:
    """An event that Ctrl-C sets, instead of an exception inside Exudyn.

    Only the main thread can receive it.
    """
    interrupted = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield interrupted
        return
    before = signal.signal(signal.SIGINT, lambda *_: interrupted.set())
    try:
        yield interrupted
    finally:
        signal.signal(signal.SIGINT, before)
