"""What is to be integrated, checked once; and what came of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..control import PID, Controller, DriveFunction, Sampled
from ..errors import InputError
from ..signals import Drive
from ..system import System, system_of

METHODS = ("auto", "explicit", "implicit", "exponential")
SHORT = ("explicit-3", "explicit-5")  # what "auto" takes under a Controller whose ticks are short
MOST_STEPS = 50_000_000  # of a run

Progress = Callable[[float], None] | None


@dataclass(frozen=True)
class Problem:
    """An initial value problem: robot, output times (T,) [s], drive, state q, qd (n,) at t[0],
    tolerance and method.

    `drive` is a Drive, a Controller, a Sampled, or a DriveFunction.
    """

    system: System
    t: np.ndarray
    drive: Any
    q: np.ndarray
    qd: np.ndarray
    rtol: float
    method: str
    numerical_damping: bool = True


@dataclass(frozen=True)
class Solution:
    """What a solver computed, up to the end or to where it stopped.

    Attributes: t (T,) [s]; states (T, 2n): q and qd; accounts (T, 4): work of the drives, losses,
    what the method took out, and
        the rise of the strain energy, each from its own integral [J]; forces (T, links) of the
        drives; meta: steps, events and whether it is complete; seen (T, k): what `system.observe`
        gives, where the solver knows it; jumps (T,) or 0: what the energy has jumped by so far [J];
        sampler: of the core, with what a Controller computed at its ticks.
    """

    t: np.ndarray
    states: np.ndarray
    accounts: np.ndarray
    forces: np.ndarray
    meta: dict[str, Any]
    seen: np.ndarray | None = None
    jumps: Any = 0.0
    sampler: Any = None


def initial_value_problem(
    robot: Any,
    t_eval: Any,
    drive: Any,
    q0: Any,
    qd0: Any,
    rtol: float,
    method: str,
    numerical_damping: bool = True,
) -> Problem:
    """The problem that a simulation solves.

    Args: as those of `simulate`.

    Raises: InputError: an argument is not what is expected.
    """
    system, t = system_of(robot), check_request(t_eval, rtol, method)
    joints = len(system.robot.links)
    acting = Drive.none(joints) if drive is None else drive
    if not isinstance(acting, Drive | Controller | Sampled):
        acting = DriveFunction(acting, joints)
    q, qd = consistent_start(system, t[0], acting, q0, qd0)
    if not system.exact and isinstance(acting, Controller):
        expected = (
            'expected a robot with stiffening = true and sliding = "continuous" under a Controller'
        )
        raise InputError(expected, key="drive", value="Controller")
    return Problem(system, t, acting, q, qd, rtol, method, numerical_damping)


def check_request(t_eval: Any, rtol: float, method: str) -> np.ndarray:
    """The times (T,) of a request whose tolerance and method are good. Raises InputError."""
    t = check_times(t_eval)
    if not 1e-13 <= rtol <= 0.1:
        raise InputError(
            "expected a relative tolerance between 1e-13 and 0.1", key="rtol", value=rtol
        )
    if method not in METHODS + SHORT:
        raise InputError(f"expected one of {', '.join(METHODS)}", key="method", value=method)
    return t


def consistent_start(
    system: System, t: float, drive: Any, q0: Any, qd0: Any
) -> tuple[np.ndarray, np.ndarray]:
    """q and qd (n,) at the start t [s]: as given, locked joints at rest, prescribed ones on their
    motion. Raises InputError for wrong shapes, a drive of another number of joints, and a joint
    outside its limits."""
    q, qd = (
        check_state(system, "q0", q0, system.start()),
        check_state(system, "qd0", qd0, np.zeros(system.n)),
    )
    qd[system.joint_rows[system.locked]] = 0.0
    if isinstance(drive, Drive | Controller):
        if len(drive.joints) != len(system.robot.links):
            raise InputError(
                f"expected {len(system.robot.links)} joint drives, one a joint",
                key="drive",
                value=len(drive.joints),
            )
        put_on_motions(system, drive, t, q, qd)
    inside_limits(system, q)
    return q, qd


def check_times(t_eval: Any) -> np.ndarray:
    """Ascending finite times (T,) [s]. Raises InputError."""
    t = np.array(t_eval, dtype=float)
    if t.ndim != 1 or len(t) < 1 or not np.all(np.isfinite(t)) or not np.all(np.diff(t) > 0):
        raise InputError(
            "expected ascending finite times in seconds, one or more", key="t_eval", value=t_eval
        )
    return t


def check_state(system: System, key: str, value: Any, default: np.ndarray) -> np.ndarray:
    """A state's q or qd (n,), or the default. Raises InputError."""
    if value is None:
        return default
    array = np.array(value, dtype=float)
    if array.shape != (system.n,) or not np.all(np.isfinite(array)):
        raise InputError(
            f"expected {system.n} finite numbers, in the order of system.labels",
            key=key,
            value=value,
        )
    return array


def put_on_motions(
    system: System, drive: Drive | Controller, t: float, q: np.ndarray, qd: np.ndarray
) -> None:
    """Prescribed joints take position and velocity of their motions at t [s], in place."""
    for joint, row in zip(drive.joints, system.joint_rows, strict=True):
        if isinstance(joint, PID):
            qd[row] = 0.0 if joint.prescribed else qd[row]
        elif joint.prescribed and joint.motion is not None:
            q[row], qd[row], _ = joint.motion(t)


def inside_limits(system: System, q: np.ndarray) -> None:
    """Raises InputError for a joint that starts outside its limits."""
    for i, (link, row) in enumerate(zip(system.robot.links, system.joint_rows, strict=True), 1):
        if (
            link.joint.limits is not None
            and not link.joint.limits[0] <= q[row] <= link.joint.limits[1]
        ):
            raise outside(i - 1, link.joint.limits, float(q[row]))


def outside(joint: int, limits: tuple[float, float], position: float) -> InputError:
    """Why a joint (from 0) cannot start at a position."""
    return InputError(
        f"expected a start inside the limits of joint {joint + 1}, {list(limits)}",
        key="q0",
        value=position,
    )
