"""Tip inversion: joint motions and drives with which the tip follows a path, before and after which
it rests."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...errors import FlexuraError
from ...io import Run, check_progress, flag
from ...robot import Robot
from ...signals import Signal, SignalLike
from ...system import RobotLike, System, assemble, static
from ..dynamics import inverse
from ..problem import check_times
from .collocation import Mesh
from .inverse_motion import Rest, TipMotion, TipProblem, mesh_between
from .nearest_motion import nearest_motion
from .posture import exact_system
from .tip_output import TipPath, tip_path

FADED = 18.0  # e-folds: the joints' motion before and after the path is shorter than this leaves it
# durations of the path: of what comes before it, and after it
LONGEST, SHORTEST, NEAREST = 5.0, 0.05, 1.0
INTERVALS = (30, 20)  # of the mesh in the path's duration, one after another where one fails
CORRECTIONS = 6  # with the finer robot, at most
GOOD = 1e-9  # of the tip's reach: a deviation that small is good enough
RTOL = 1e-9  # of the runs that judge
SMOOTH = 2e-9  # m or rad: what a cubic spline through the rows of a Run may be off by
MOST_ROWS = 20_001
ROWS = 20  # at least, before the path and after it
EXACT = 1e-6  # of the reach: a nearest motion that is off by less follows the path
SINGULAR = 0.02  # smallest over largest singular value of the tip by the joints: a singular posture


def invert(
    robot: RobotLike,
    t: ArrayLike,
    tip: SignalLike | Sequence[SignalLike],
    *,
    least_squares: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Run:
    """Joint motions and drives for which the tip follows a path, by stable inversion (116).

    The joints move before the tip does and go on after it has stopped; for that the Run begins
    before t[0] and ends after t[-1]. The nonlinear equations are solved as a boundary value problem
    by Newton's method. The joints' motions are then corrected by what a robot with twice the
    elements does under them, and the Run is that robot's.

    Args:
        robot: a System, a Robot, or the path or name of a robot file, with one or two joints that
            move.
        t: (T,), ascending times [s]; the tip rests where the path begins before t[0], and where it
            ends after t[-1].
        tip: of a robot with two joints (x, y) [m]; with one, the polar angle of the tip seen from
            its axis [rad], or the place along its rail [m]. Signals, functions of time, or values
            (T,), for example of `signals.paths`.
        least_squares: where there is no exact answer, give the nearest one.
        progress: called with the finished fraction.

    Returns:
        A Run with `joint/i/position`, `joint/i/drive`, `tip/x`, `tip/y` and all other channels.
        `meta` has `iterations`, `tip_error_m` (the largest distance from the path), `path_s`
        (start and end of the path), and `zeros_1_s`, the slowest transmission zeros at the start.

    Raises:
        InputError: an argument is not what is expected, or the tip cannot be there.
        FlexuraError: a transmission zero forbids it, or the path begins in a singular posture. The
            message says which.
    """
    system, times = exact_system(robot), check_times(t)
    flag(least_squares, "least_squares")
    check_progress(progress)
    path = tip_path(system, times, tip)
    problem = TipProblem(system, path)
    report = progress or (lambda fraction: None)
    ends = rests(problem)
    why = _forbidden(ends)
    if why and not least_squares:
        raise FlexuraError(f"{why}; least_squares=True (--least-squares) gives the nearest motion")
    motion = None if why else _solved(problem, ends)
    report(0.5)
    if motion is not None:
        motion, judge = _corrected(problem, motion, ends)
        mesh, signals, count = motion.mesh, joint_signals(system, motion), motion.iterations
    else:
        judge, mesh = assemble(finer(system.robot)), _mesh(path, ends, NEAREST, INTERVALS[0])
        nearest = nearest_motion(judge, path, mesh, static(judge, ends[0].q[system.joint_rows]))
        signals, count = nearest.signals, nearest.iterations
    report(0.9)
    rows = output_times(times, mesh.nodes[[0, -1]], signals)
    run = recorded(system.robot, judge, signals, path, rows)
    if motion is None and run.meta["tip_error_m"] > EXACT * sum(
        link.length_m for link in system.robot.links
    ):
        why = why or _no_exact(problem, ends[0])
        text = f"{why}; this is the nearest motion, off by {run.meta['tip_error_m']:.3g} m"
        event = {"t": path.start, "level": "WARN", "name": "nearest", "text": text}
        run.meta["events"] = [*run.meta["events"], event]
    run.meta["exact"] = not any(event["name"] == "nearest" for event in run.meta["events"])
    run.meta["iterations"] = count
    zeros = ends[0].zeros.zeros[:6]
    run.meta["zeros_1_s"] = [[float(z.real), float(z.imag)] for z in zeros]
    report(1.0)
    return run


def rests(problem: TipProblem) -> tuple[Rest, Rest]:
    """The robot at rest where the path begins and where it ends."""
    path = problem.path
    start = problem.rest(path.start, static(problem.system))
    return start, problem.rest(path.end, problem.along(_coarse(path), start.q)[-1])


def _coarse(path: TipPath) -> np.ndarray:
    return np.linspace(path.start, path.end, 61)


def _forbidden(ends: tuple[Rest, Rest]) -> str:
    """Why no bounded motion of the joints may exist; "" where nothing forbids it."""
    for rest, where in zip(ends, ("start", "end"), strict=True):
        if len(zeros := rest.zeros.on_axis):
            return (
                f"a transmission zero on the imaginary axis forbids exact tracking: "
                f"{abs(zeros[0].imag):.4g} rad/s about the {where} of the path. With the tip at "
                f"rest the robot oscillates at this frequency for ever. Damping (damping.beta_s) "
                f"moves it from the axis"
            )
    return ""


def _no_exact(problem: TipProblem, start: Rest) -> str:
    """Why Newton's method may have found no motion: a singular posture on the way, or the speed."""
    times = _coarse(problem.path)
    q = problem.along(times, start.q)
    zero = np.zeros_like(q)
    _, _, _, _, tip, slope = problem.system.equations.force_derivatives(q, zero, zero)
    by_q = problem.path.deviation(tip, slope, problem.path.at(times))[1]
    sizes = np.linalg.svd(by_q[:, :, problem.free], compute_uv=False)
    share = sizes[:, -1] / sizes[:, 0]
    if share.min() > SINGULAR:
        return "no exact inverse was found: the path is too quick"
    return (
        f"no exact inverse was found: about t = {times[share.argmin()]:.3f} s the path passes a "
        f"singular posture, in which the joints cannot move the tip in every direction. Links that "
        f"are bent there do not reach as far as straight ones"
    )


def _mesh(path: TipPath, ends: tuple[Rest, Rest], longest: float, count: int) -> Mesh:
    """A mesh of `count` intervals in the path's duration, that begins and ends as much before and
    after it as the joints' motions need, at most `longest` durations."""
    span = path.end - path.start
    before, after = (
        min(FADED / rest.zeros.rate(sign), longest * span)
        for rest, sign in zip(ends, (1, -1), strict=True)
    )
    before, after = (max(time, SHORTEST * span) for time in (before, after))
    return mesh_between(path.start - before, path.end + after, path.breaks, span / count)


def _solved(problem: TipProblem, ends: tuple[Rest, Rest]) -> TipMotion | None:
    """The exact motion, or None where Newton's method finds none."""
    for count in INTERVALS:
        mesh = _mesh(problem.path, ends, LONGEST, count)
        found = problem.solve(mesh, problem.slow(mesh, ends[0].q), *ends)
        if found is not None:
            return found
    return None


def finer(robot: Robot) -> Robot:
    """The same robot with twice the elements of every link that has a mesh, and without limits."""
    data = robot.to_dict()
    for link, table in zip(robot.links, data["link"], strict=True):
        for key in ("limits", "limits_m", "limits_rad"):
            table["joint"].pop(key, None)
        if link.flexible and link.modes is None:
            table["elements"] = 2 * link.elements
    return Robot.from_dict(data)


def _corrected(
    problem: TipProblem, motion: TipMotion, ends: tuple[Rest, Rest]
) -> tuple[TipMotion, System]:
    """The motion with what the finer robot's tip is off taken from it, while that helps; and that
    robot."""
    judge, path = assemble(finer(problem.system.robot)), problem.path
    best, least = motion, np.inf
    for _ in range(CORRECTIONS):
        signals = joint_signals(problem.system, motion)
        off, size, reach = deviation(judge, signals, path, motion.mesh)
        if not size < 0.5 * least:
            return (motion if size < least else best), judge
        best, least = motion, size
        if size < GOOD * reach:
            break
        change = problem.correction(motion, *ends, off)
        motion = TipMotion(motion.mesh, motion.coefficients - change, motion.iterations + 1)
    return best, judge


def deviation(
    judge: System, signals: list[Signal], path: TipPath, mesh: Mesh
) -> tuple[np.ndarray, float, float]:
    """How far the tip of a robot is from the path if its joints follow `signals`.

    Returns: deviations at the points of Gauss and at the end (T + 1, m), the largest distance [m],
    and the tip's reach [m].
    """
    times = np.concatenate([mesh.nodes[:1], mesh.t, mesh.nodes[-1:]])
    run = inverse(judge, times, _motions(judge, signals), rtol=RTOL).uninterrupted()
    if len(run) < len(times):
        raise FlexuraError(f"the run under the inverse motion ended early: {run.meta['events']}")
    tips = np.column_stack([run["tip/x"], run["tip/y"]])
    off, _ = path.deviation(tips, np.zeros((len(tips), 2, 1)), path.at(times))
    return off[1:], float(path.metres(off, tips).max()), float(np.hypot(*tips.T).max())


def _motions(system: System, signals: list[Signal]) -> list[Signal | None]:
    return [
        None if locked else signal for signal, locked in zip(signals, system.locked, strict=True)
    ]


def joint_signals(system: System, motion: TipMotion) -> list[Signal]:
    """The joints' motions, one Signal a joint."""
    return [motion.mesh.signal(motion.coefficients[:, row]) for row in system.joint_rows]


def recorded(
    robot: Robot, judge: System, signals: list[Signal], path: TipPath, t: np.ndarray
) -> Run:
    """The Run at times t (T,) of a robot whose joints follow `signals`, as `judge` does it."""
    run = inverse(judge, t, _motions(judge, signals), rtol=RTOL)
    tips = np.column_stack([run["tip/x"], run["tip/y"]])
    off, _ = path.deviation(tips, np.zeros((len(tips), 2, 1)), path.at(run.t))
    meta = run.meta | {
        "robot": robot.to_dict(),
        "elements": [link.elements for link in judge.robot.links],
        "tip_error_m": float(path.metres(off, tips).max()),
        "path_s": [path.start, path.end],
    }
    meta["events"] = [*run.meta["events"], *_beyond_limits(assemble(robot), run)]
    return Run(run.t, run.channels, run.units, meta)


def _beyond_limits(system: System, run: Run) -> list[dict[str, Any]]:
    """An event for each joint that the motion takes beyond its limits."""
    events = []
    for i, (low, high) in enumerate(system.limits, 1):
        position = run[f"joint/{i}/position"]
        beyond = np.flatnonzero((position < low) | (position > high))
        if len(beyond):
            text = f"the motion takes joint {i} beyond its limits, {low:g} to {high:g}"
            at = float(run.t[beyond[0]])
            events.append({"t": at, "level": "WARN", "name": "limit", "text": text})
    return events


def output_times(times: np.ndarray, span: np.ndarray, signals: list[Signal]) -> np.ndarray:
    """The times of the Run: those of the path, so many between them that cubic splines through the
    rows give the joints' motions, and as often before and after, within `span` (2,)."""
    from scipy.interpolate import CubicSpline

    step = float(np.median(np.diff(times)))
    first, last = (min(step, way / ROWS) for way in (times[0] - span[0], span[1] - times[-1]))
    before = times[0] - first * np.arange(1, int((times[0] - span[0]) / first + 1e-9) + 1)[::-1]
    after = times[-1] + last * np.arange(1, int((span[1] - times[-1]) / last + 1e-9) + 1)
    rows = np.concatenate([before, times, after])
    position = lambda t: np.column_stack([values(signal, t) for signal in signals])
    while True:
        middles = (rows[:-1] + rows[1:]) / 2
        through = CubicSpline(rows, position(rows), bc_type="natural")
        if np.abs(through(middles) - position(middles)).max() < SMOOTH or 2 * len(rows) > MOST_ROWS:
            return rows
        rows = np.sort(np.concatenate([rows, middles]))


def values(signal: Signal, t: np.ndarray) -> np.ndarray:
    """A signal of polynomials at times t (T,), all at once."""
    segments = signal.segments
    own = segments[np.clip(np.searchsorted(segments[:, 0], t, side="right") - 1, 0, None)]
    s = np.maximum(t - own[:, 0], 0.0)
    return np.asarray((own[:, 1:7] * s[:, None] ** np.arange(6)).sum(axis=1))
