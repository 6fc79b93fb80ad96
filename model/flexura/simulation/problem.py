"""What is to be integrated, checked once; and what came of it."""

from __future__ import annotations

from collections.abc import Callable, Sized
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..control import Backlash, Controller, DriveFunction, Sampled
from ..errors import InputError
from ..io import Run, Tables, array, check_memory, choice, flag, number, whole
from ..signals import Drive, Loads, LoadsLike, Manoeuvre, Signal, as_loads, as_signals
from ..system import RobotLike, System, assemble
from .start import (
    apply_prescribed_motions,
    check_limits,
    consistent_start,
    note_motions,
    state_at_end,
)

METHODS = ("auto", "explicit", "implicit", "exponential")
SHORT = ("explicit-3", "explicit-5")  # what "auto" takes under a Controller whose ticks are short
MOST_STEPS = 20_000_000  # of a run, attempts included, unless it is asked for others

Progress = Callable[[float], None] | None


@dataclass(frozen=True)
class Problem:
    """An initial value problem.

    Attributes:
        system: the robot.
        t: output times (T,) [s].
        drive: a Drive, a Controller, a Sampled, or a DriveFunction.
        q: configuration at t[0] (n,).
        qd: its rates (n,).
        rtol: relative tolerance.
        method: as in `simulate`.
        numerical_damping: whether exponential steps damp fast modes.
        start: "static", "straight", "given" or "continued".
        accounts: of the run that this one continues (4,) [J].
        loads: forces and moments on links.
        ends: called with the times and states so far; says whether the rest is of no use.
    """

    system: System
    t: np.ndarray
    drive: Any
    q: np.ndarray
    qd: np.ndarray
    rtol: float
    method: str
    numerical_damping: bool = True
    start: str = "given"
    accounts: np.ndarray = field(default_factory=lambda: np.zeros(4))
    loads: Loads = field(default_factory=Loads)
    ends: Callable[[np.ndarray, np.ndarray], bool] | None = None
    budget: Budget = field(default_factory=lambda: Budget())


@dataclass(frozen=True)
class Budget:
    """What a run may take: `steps`, rejected ones included, which are the same on every machine,
    and seconds of time, `wall_s`, which only stop it."""

    steps: int = MOST_STEPS
    wall_s: float = float("inf")

    @staticmethod
    def checked(max_steps: Any, wall_time: Any) -> Budget:
        """The budget of these arguments, None for the default. Raises InputError."""
        steps = MOST_STEPS if max_steps is None else whole(max_steps, "max_steps", 1)
        expected = "expected a time above 0 in seconds"
        wall = float("inf") if wall_time is None else number(wall_time, "wall_time", expected)
        if not wall > 0:
            raise InputError(expected, key="wall_time", value=wall_time)
        return Budget(steps, wall)

    def event(self, name: str, t: float, method: str, steps: int, since: float) -> Tables:
        """What ended a run: "exhausted" or "wall_time", after `steps` from `since` to t [s]."""
        used = (
            f"{self.steps} steps are used up"
            if name == "exhausted"
            else (f"the {self.wall_s:g} s of wall time are over, after {steps} steps")
        )
        mean = f" of {(t - since) / steps:.2g} s in the mean" if steps else ""
        text = (
            f"the simulation got no further than t = {t:.6g} s: {used}{mean} by the method "
            f'"{method}"; what is fast sets them: try another method, a larger rtol, fewer '
            f"elements or a few modes, damping, or a longer {BUDGETS[name]}"
        )
        level = "ERROR" if name == "exhausted" else "WARN"
        return {"t": t, "level": level, "name": name, "text": text}


BUDGETS = {"exhausted": "max_steps", "wall_time": "wall_time"}


@dataclass(frozen=True)
class Solution:
    """What a solver computed, up to the end or to where it stopped.

    Attributes:
        t: times (T,) [s].
        states: q and qd (T, 2n).
        accounts: work of the drives, losses, what the method took out, and the rise of the strain
            energy, each from its own integral (T, 4) [J].
        forces: of the drives (T, links) [N or N m].
        meta: steps, events and whether it is complete.
        seen: what `system.observe` gives (T, k), where the solver knows it.
        jumps: what the energy has jumped by so far, (T,) or 0 [J].
        systems: where the payload changes, the robots and the row before which each ends.
        sampler: of the core, with what a Controller computed at its ticks.
    """

    t: np.ndarray
    states: np.ndarray
    accounts: np.ndarray
    forces: np.ndarray
    meta: Tables
    seen: np.ndarray | None = None
    jumps: Any = 0.0
    systems: tuple[tuple[System, int], ...] = ()
    sampler: Any = None


def initial_value_problem(
    robot: RobotLike,
    t_eval: ArrayLike,
    drive: Any,
    q0: ArrayLike | None,
    qd0: ArrayLike | None,
    rtol: Any,
    method: Any,
    *,
    numerical_damping: Any = True,
    start: Any = None,
    before: Run | None = None,
    budget: Budget | None = None,
    loads: LoadsLike = None,
) -> Problem:
    """The problem that a simulation solves.

    Args:
        robot: as in `simulate`.
        t_eval: as in `simulate`.
        drive: as in `simulate`.
        q0: as in `simulate`.
        qd0: as in `simulate`.
        rtol: as in `simulate`.
        method: as in `simulate`.
        numerical_damping: as in `simulate`.
        start: as in `simulate`.
        before: the run that it continues.
        budget: of passes and seconds; None: the default.
        loads: as in `simulate`.

    Returns:
        The problem.

    Raises:
        InputError: an argument is not what is expected.
        NoEquilibrium: it should start in static equilibrium, and there is none.
    """
    system, t = assemble(robot), check_request(t_eval, rtol, method)
    check_rows(system, len(t))
    acting = acting_drive(drive, len(system.robot.links), t)
    lengths = [link.length_m for link in system.robot.links]
    on_links = as_loads(loads, lengths, float(t[0]), float(t[-1]))
    accounts = np.zeros(4)
    note_motions(system.robot, acting, t)
    if before is None:
        q, qd, start = consistent_start(system, t[0], acting, q0, qd0, start, on_links)
    else:
        q, qd, accounts = state_at_end(before, system, t, {"q0": q0, "qd0": qd0, "start": start})
        start = "continued"
        apply_prescribed_motions(system.joint_rows, acting, t[0], q, qd)
        check_limits(system, q, acting)
    if not system.exact and isinstance(acting, Controller):
        expected = (
            'expected a robot with stiffening = true and sliding = "continuous" under a Controller'
        )
        raise InputError(expected, key="drive", value="Controller")
    return Problem(
        system=system,
        t=t,
        drive=acting,
        q=q,
        qd=qd,
        rtol=float(rtol),
        method=method,
        numerical_damping=flag(numerical_damping, "numerical_damping"),
        start=start,
        accounts=accounts,
        loads=on_links,
        budget=budget or Budget(),
    )


COPIES = 3  # of a run's rows, while it is recorded


def check_rows(system: System, count: int) -> None:
    """Raises InputError for more output times than memory has room for."""
    wide = 2 * system.n + 4 + 20 * len(system.robot.links)
    what = f"{count} output times of a robot with {system.n} unknowns; expected fewer times"
    check_memory(8.0 * COPIES * count * wide, what, "t_eval", count)


def acting_drive(drive: Any, joints: int, t: np.ndarray) -> Drive | Controller | Sampled | Any:
    """What acts in a run, as the solvers take it.

    Args:
        drive: as in `simulate`.
        joints: how many the robot has.
        t: output times (T,) [s].

    Returns:
        A Drive whose motions are Signals, a Controller, a Sampled or a DriveFunction.

    Raises:
        InputError: it is nothing of this, is for another number of joints, or has a motion that
            nothing follows.
    """
    if drive is None:
        return Drive.none(joints)
    if isinstance(drive, Manoeuvre):
        expected = "expected the drive of it, manoeuvre.drive, at times such as manoeuvre.t"
        raise InputError(expected, key="drive", value="Manoeuvre")
    if isinstance(drive, Sampled):
        return drive
    if isinstance(drive, Backlash) and len(drive.contacts) != joints:
        expected = f"expected {joints} contacts or None, one a joint"
        raise InputError(expected, key="drive", value=len(drive.contacts))
    if not isinstance(drive, Drive | Controller):
        if callable(drive) and not isinstance(drive, Signal | type):
            return DriveFunction(drive, joints)
        if isinstance(drive, str):
            file = "; a file is read by load_manoeuvre(path, joints), which has a drive"
            raise InputError(EXPECTED_DRIVE + file, key="drive", value=drive)
        if isinstance(drive, bytes | dict | type):
            raise InputError(EXPECTED_DRIVE, key="drive", value=drive)
        drive = Drive.force(*as_signals(drive, joints, "drive", t))
    if len(drive.joints) != joints:
        raise InputError(
            f"expected {joints} joint drives, one a joint", key="drive", value=len(drive.joints)
        )
    return drive.within(float(t[0]), float(t[-1]))


EXPECTED_DRIVE = (
    "expected a Drive, a Controller, a Sampled, a function of (t) or of (t, position, velocity, "
    "tip_deflection), or one entry a joint: numbers, Signals, functions of t or arrays"
)


def check_request(t_eval: ArrayLike, rtol: Any, method: Any) -> np.ndarray:
    """The times of a request whose tolerance and method are good.

    Args:
        t_eval: as in `simulate`.
        rtol: as in `simulate`.
        method: as in `simulate`.

    Returns:
        Times (T,) [s].

    Raises:
        InputError: an argument is not what is expected.
    """
    t = check_times(t_eval)
    expected = "expected a relative tolerance between 1e-13 and 0.1"
    if not 1e-13 <= number(rtol, "rtol", expected) <= 0.1:
        raise InputError(expected, key="rtol", value=rtol)
    if not (isinstance(method, str) and method in SHORT):
        choice(method, "method", METHODS)
    return t


def check_times(t_eval: ArrayLike) -> np.ndarray:
    """Ascending finite times.

    Args:
        t_eval: what was given.

    Returns:
        Times (T,) [s].

    Raises:
        InputError: they are not.
    """
    expected = "expected ascending finite times in seconds, one or more"
    if isinstance(t_eval, Sized):
        what = f"{len(t_eval)} output times; expected fewer"
        check_memory(16.0 * len(t_eval), what, "t_eval", len(t_eval))
    t = array(t_eval, "t_eval", expected, (None,))
    if len(t) < 1 or not np.all(np.diff(t) > 0):
        raise InputError(expected, key="t_eval", value=t_eval)
    return t
