"""Where a run starts: in static equilibrium, straight, from a given state, or where another run
ended."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..control import PID, Controller
from ..errors import InputError
from ..io import Run, array, choice
from ..robot import Robot
from ..signals import STARTS, Drive, Loads
from ..system import NoEquilibrium, System, static

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
    check_limits(system, q)
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
        text = f"expected a run of a robot with {n} unknowns"
        raise InputError(text, key=key, value=run.states.shape[1] // 2)
    _check_payload(run, system)
    end = float(run.t[-1])
    if abs(t[0] - end) > 1e-9 * max(1.0, abs(end)):
        text = f"expected times that begin at the end of the run that is continued, {end:g} s"
        raise InputError(text, key="t_eval", value=float(t[0]))
    accounts = [float(run[f"energy/{name}"][-1]) for name in ("work", "loss", "numerical_loss")]
    z = run.states[-1]
    return z[:n].copy(), z[n:].copy(), np.array([*accounts, 0.0])


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


def check_limits(system: System, q: np.ndarray) -> None:
    """Refuse a joint that starts outside its limits.

    Args:
        system: the robot.
        q: configuration (n,).

    Raises:
        InputError: a joint is outside.
    """
    for i, (link, row) in enumerate(zip(system.robot.links, system.joint_rows, strict=True), 1):
        if (
            link.joint.limits is not None
            and not link.joint.limits[0] <= q[row] <= link.joint.limits[1]
        ):
            raise limit_error(i - 1, link.joint.limits, float(q[row]))


def limit_error(joint: int, limits: tuple[float, float], position: float) -> InputError:
    """Why a joint cannot start at a position.

    Args:
        joint: its number, from 0.
        limits: the lowest and the highest position [m or rad].
        position: the position [m or rad].

    Returns:
        The error to raise.
    """
    return InputError(
        f"expected a start inside the limits of joint {joint + 1}, {list(limits)}",
        key="q0",
        value=position,
    )
