"""Where a run starts: in static equilibrium, straight, from a given state, or where another run
ended."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..control import PID, Controller
from ..errors import InputError
from ..io import Run, array, choice
from ..io.quantities import note_turns
from ..robot import Robot
from ..signals import STARTS, Drive, Loads, evaluate_many
from ..system import NoEquilibrium, System, static

SLACK = 1e-9  # of a limit, or m or rad: a motion may begin on one, up to round-off
SAME_PLACE = 1e-6  # of the robot's length
NO_START = 'start = "straight" begins with straight links, q0 with a state of your own'


def consistent_start(
    system: System,
    t: float,
    drive: Any,
    q0: ArrayLike | None,
    qd0: ArrayLike | None,
    start: Any = None,
    loads: Loads | None = None,
) -> tuple[np.ndarray, np.ndarray, str]:
    """The state at the start of a run.

    Locked joints are at rest, prescribed ones on their motion. Without q0 the links are straight,
    or under gravity in static equilibrium with the joints held where they start (50), with the
    loads that act at the start (136). Given rates are kept in either case.

    Args:
        system: the robot.
        t: the start [s].
        drive: what acts.
        q0: configuration (n,), or None.
        qd0: its rates (n,), or None.
        start: "static", "straight" or None.
        loads: forces and moments on links, or None.

    Returns:
        q and qd (n,), and which start it is: "given", "static" or "straight".

    Raises:
        InputError: wrong shapes, a drive of another number of joints, a joint outside its limits.
        NoEquilibrium: there is none.
    """
    q, qd = (
        check_state(system, "q0", q0, system.start()),
        check_state(system, "qd0", qd0, np.zeros(system.n)),
    )
    which = resolve_start(system.robot, q0, start)
    qd[system.joint_rows[system.locked]] = 0.0
    apply_prescribed_motions(system.joint_rows, drive, t, q, qd)
    check_limits(system, q, drive)
    if which == "static":
        try:
            q = static(system, q[system.joint_rows], loads=loads, t=t)
        except NoEquilibrium as error:
            raise NoEquilibrium(f"{error}; {NO_START}", error.q, error.share) from None
    return q, qd, which


def resolve_start(robot: Robot, q0: ArrayLike | None, start: Any) -> str:
    """The start of a run, by default as gravity asks.

    Args:
        robot: the robot.
        q0: configuration (n,), or None.
        start: as given, or None.

    Returns:
        "given" by q0, "static" or "straight".

    Raises:
        InputError: start is none of these, or given beside q0.
    """
    if start is not None:
        choice(start, "start", STARTS)
    if q0 is not None:
        if start is not None:
            raise InputError("expected q0 or start, not both", key="start", value=start)
        return "given"
    bends = any(link.flexible for link in robot.links)
    return start or ("static" if bends and any(robot.gravity_m_s2) else "straight")


def state_at_end(
    run: Any, system: System, t: np.ndarray, others: dict[str, Any]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The state at the end of a run that is continued.

    Args:
        run: the run.
        system: the robot.
        t: times (T,) of the new run [s].
        others: arguments that must be None, by name.

    Returns:
        q, qd (n,) and accounts (4,) [J].

    Raises:
        InputError: it is no run of this robot with its states, t does not begin at its end, or one
            of `others` is given besides.
    """
    key, n = "continue_from", system.n
    if not isinstance(run, Run):
        raise InputError("expected a Run", key=key, value=run)
    for name, value in others.items():
        if value is not None:
            raise InputError(f"expected {name} or continue_from, not both", key=name, value=value)
    if run.states is None or not len(run.t):
        text = "expected a run of fx.simulate in this session: archived runs have no states"
        raise InputError(text, key=key, value=f"a run of {run.meta.get('source')}")
    if run.states.shape[1] != 2 * n:
        text = f"expected a run of this robot, which has {n} unknowns"
        raise InputError(text, key=key, value=f"a run with {run.states.shape[1] // 2}")
    _check_payload(run, system)
    _check_places(run, system)
    end = float(run.t[-1])
    if abs(t[0] - end) > 1e-9 * max(1.0, abs(end)):
        text = f"expected times that begin at the end of the run that is continued, {end:g} s"
        raise InputError(text, key="t_eval", value=float(t[0]))
    accounts = [float(run[f"energy/{name}"][-1]) for name in ("work", "loss", "numerical_loss")]
    z = run.states[-1]
    return z[:n].copy(), z[n:].copy(), np.array([*accounts, 0.0])


def _check_places(run: Run, system: System) -> None:
    """Refuse a robot whose tip is elsewhere in the run's last state: its links are others."""
    if run.states is None or "tip/x" not in run:
        return
    before = np.array([run["tip/x"][-1], run["tip/y"][-1]])
    _, after = system.places(run.states[-1][: system.n])
    size = sum(link.length_m for link in system.robot.links)
    if np.hypot(*(after - before)) > SAME_PLACE * max(size, float(np.abs(before).max())):
        shown = [f"({x:.6g}, {y:.6g})" for x, y in (before, after)]
        text = f"expected a run of this robot; its tip would jump from {shown[0]} to {shown[1]} m"
        raise InputError(text, key="continue_from", value="a run of another robot")


def _check_payload(run: Run, system: System) -> None:
    """Refuse a robot whose payload is not the one that the run ended with."""
    changes = run.meta.get("payloads")
    own = system.robot.payload
    if not changes:
        return
    last = changes[-1]
    if (own.mass_kg, own.inertia_kg_m2) != (last["mass_kg"], last["inertia_kg_m2"]):
        text = (
            f"expected the payload at the end of the run that is continued, {last['mass_kg']:g} kg "
            f"and {last['inertia_kg_m2']:g} kg m^2"
        )
        raise InputError(text, key="payload.mass_kg", value=own.mass_kg)


def check_state(system: System, key: str, value: Any, default: np.ndarray) -> np.ndarray:
    """A state's q or qd.

    Args:
        system: the robot.
        key: name of the argument.
        value: what was given, or None.
        default: in place of None (n,).

    Returns:
        (n,).

    Raises:
        InputError: another shape, or a number that is not finite.
    """
    if value is None:
        return default
    expected = f"expected {system.n} finite numbers, in the order of system.labels"
    return array(value, key, expected, (system.n,))


def apply_prescribed_motions(
    joint_rows: Any, drive: Any, t: float, q: np.ndarray, qd: np.ndarray
) -> None:
    """Put prescribed joints on their motions, in place.

    Args:
        joint_rows: their entries of q and qd (links,).
        drive: what acts.
        t: time [s].
        q: configuration (n,).
        qd: its rates (n,).
    """
    if not isinstance(drive, Drive | Controller):
        return
    for joint, row in zip(drive.joints, joint_rows, strict=True):
        if isinstance(joint, PID):
            qd[row] = 0.0 if joint.prescribed else qd[row]
        elif joint.prescribed and joint.motion is not None:
            q[row], qd[row], _ = joint.motion(t)


def check_limits(system: System, q: np.ndarray, drive: Any = None) -> None:
    """Refuse a joint that starts outside its limits, or beyond the end of the link that it is on.

    Args:
        system: the robot.
        q: configuration (n,).
        drive: what acts: a prescribed joint starts on its motion.

    Raises:
        InputError: a joint is outside.
    """
    for i, (row, bounds) in enumerate(zip(system.joint_rows, system.limits, strict=True)):
        slack = SLACK * np.maximum(1.0, np.abs(bounds))
        if not bounds[0] - slack[0] <= q[row] <= bounds[1] + slack[1]:
            raise limit_error(system, i, float(q[row]), _prescribed(drive, i))


def limit_error(
    system: System, joint: int, position: float, prescribed: bool = False
) -> InputError:
    """Why a joint cannot start at a position.

    Args:
        system: the robot.
        joint: its number, from 0.
        position: the position [m or rad].
        prescribed: whether its motion begins there.

    Returns:
        The error to raise.
    """
    low, high = (float(bound) for bound in system.limits[joint])
    ends = "" if system.robot.links[joint].joint.limits else "; it slides between a link's ends"
    return InputError(
        f"expected a start inside the limits of joint {joint + 1}, {low:g} to {high:g}{ends}",
        key=f"motion of joint {joint + 1}" if prescribed else "q0",
        value=position,
    )


def _prescribed(drive: Any, joint: int) -> bool:
    """Whether a joint, from 0, is held to a motion."""
    if not isinstance(drive, Drive | Controller):
        return False
    own = drive.joints[joint]
    return not isinstance(own, PID) and own.prescribed and own.motion is not None


def note_motions(robot: Robot, drive: Any, t: np.ndarray) -> None:
    """Say motions of joints R over more than a turn, which may have been meant in degrees.

    Args:
        robot: the robot.
        drive: a Drive or a Controller; others have no motions.
        t: output times (T,) [s].
    """
    given = drive.joints if isinstance(drive, Drive | Controller) else ()
    for i, (link, joint) in enumerate(zip(robot.links, given, strict=False), 1):
        motion = getattr(joint, "motion", None) or getattr(joint, "reference", None)
        if link.joint.type == "R" and motion is not None and len(motion.segments):
            y, _ = evaluate_many(motion.segments, t)
            note_turns(f"motion of joint {i}", y[np.abs(y).argmax()])
