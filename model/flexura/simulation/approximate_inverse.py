"""Inverse dynamics in the dissertation's two approximate ways, for comparison with the exact
`inverse`.

Both take the motions of the joints, one Signal a joint, and return a Run of the flexible robot
under the drives they found: how far `joint/i/position` is from the motion is their error.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import core
from ..errors import FlexuraError, InputError
from ..io import Run, interruption
from ..robot import Robot
from ..signals import COLUMNS, Drive, Signal
from ..system import System, assemble
from .dynamics import simulate
from .problem import Solution, check_times
from .recorder import limit_event, record
from .start import consistent_start

ACCOUNTS = 4  # numbers of a state beyond q and qd
MAX_SWEEPS = 300  # joint after joint, in one step


def rigid_robot(robot: Robot) -> Robot:
    """The same robot with rigid links and transmissions: masses, hubs, payload and joints as they
    are.

    Args:
        robot: the robot.

    Returns:
        The rigid Robot.
    """
    data = robot.to_dict()
    for link in data["link"]:
        bending = ("elements", "modes", "young_modulus_Pa", "bending_stiffness_N_m2", "damping")
        for key in (*bending, "sensor"):
            link.pop(key, None)
        link["joint"].pop("transmission", None)
    return Robot.from_dict(data)


def rigid_feedforward(
    system: System,
    t_eval: ArrayLike,
    motion: Sequence[Signal],
    q0: ArrayLike | None = None,
    qd0: ArrayLike | None = None,
    rtol: float = 1e-6,
    *,
    step_s: float = 1e-3,
    progress: Callable[[float], None] | None = None,
) -> Run:
    """Drives of the rigid robot along `motion`, applied open loop to the flexible one (Bien, My and
    Khoi 2017).

    tau = M_rigid(r) r'' + bias + gravity + friction (65), exact, as splines through values about
    `step_s` apart. Neither the elastic displacements nor the joints' errors are compensated. Errors
    otherwise as in `inverse`.

    Args:
        system: the robot.
        t_eval: ascending times (T,) [s].
        motion: one Signal a joint [m or rad].
        q0: configuration at the start (n,).
        qd0: its rates (n,).
        rtol: as in `flexura.simulate`.
        step_s: between two values of the splines [s].
        progress: called with the finished fraction.

    Returns:
        A Run of the flexible robot.
    """
    t = check_times(t_eval)
    Drive.prescribed(*motion).within(t[0], t[-1])  # refuses motions that jump
    rigid = assemble(rigid_robot(system.robot))
    drive = Drive.force(*_splines(lambda s: _forces(rigid, motion, s), motion, t[0], t[-1], step_s))
    q0, qd0 = _start(system, t[0], motion, q0, qd0)
    run = simulate(system, t, drive, q0, qd0, rtol, progress=progress)
    run.meta["drive"] = "those of the rigid robot"
    return run


def shoot_by_bisection(
    system: System,
    t_eval: ArrayLike,
    motion: Sequence[Signal],
    q0: ArrayLike | None = None,
    qd0: ArrayLike | None = None,
    rtol: float = 1e-7,
    *,
    joint_error: float = 1e-10,
    progress: Callable[[float], None] | None = None,
) -> Run:
    """Drives by bisection, step by step; each interval of t_eval is a step.

    After My and Bien (2020, Int. J. Adv. Robot. Syst.), whose abstract names the method; the rest
    is this project's reading. From the rigid robot's drives on, one forward step of the flexible
    model is taken under constant drives. Each joint's drive is bisected in a bracket until |e| <
    `joint_error`, joint after joint until all are; then comes the next step.

        e = (eta - r) + h (eta' - r')       at the end of the step, h long     (66)

    The second term is needed: position errors alone make the drives alternate, u_k = -u_(k-1) +
    ..., for a mass under held forces has its sampled zero at -1. `joint/i/drive` at t_k is the
    value held until t_(k+1). Errors fall as h^3.

    Args:
        system: the robot.
        t_eval: ascending times (T,) [s].
        motion: one Signal a joint [m or rad].
        q0: configuration at the start (n,).
        qd0: its rates (n,).
        rtol: as in `flexura.simulate`.
        joint_error: largest |e| [m or rad].
        progress: called with the finished fraction.

    Returns:
        A Run with the drives.

    Raises:
        InputError: as in `inverse`.
        FlexuraError: the drives diverge: a step is long against the period of a mode.
    """
    t, n, rows = check_times(t_eval), system.n, system.joint_rows
    Drive.prescribed(*motion).within(t[0], t[-1])
    state = np.concatenate([*_start(system, t[0], motion, q0, qd0), np.zeros(ACCOUNTS)])
    trial = _Trial(system, rtol)
    rigid = assemble(rigid_robot(system.robot))
    inertia = np.diag(rigid.mass(rigid.start()))
    moving = np.flatnonzero(~system.locked)
    if not len(moving):
        raise InputError(
            "expected a joint that is free to move", key="link.joint.locked", value=True
        )
    states, forces = [state], []
    events: list[dict[str, Any]] = []
    begun = time.perf_counter()
    try:
        for a, b in pairwise(t):
            r, rd = np.array([m(b)[:2] for m in motion]).T
            error = lambda z: (z[rows] - r) + (b - a) * (z[n + rows] - rd)  # noqa: B023
            drives = _forces(rigid, motion, (a + b) / 2)
            after = _settled(error, trial, (a, b, states[-1]), drives, moving, inertia, joint_error)
            low, high = system.limits.T
            if np.any(beyond := (after[rows] < low) | (after[rows] > high)):
                events.append(
                    limit_event(
                        system, int(np.argmax(beyond)), float(a), np.clip(after[rows], low, high)
                    )
                )
                break
            states.append(after)
            forces.append(drives)
            if progress is not None:
                progress((b - t[0]) / (t[-1] - t[0]))
    except KeyboardInterrupt:
        events.append(interruption(float(t[len(states) - 1])))
    z, rows_done = np.array(states), len(states)
    forces.append(forces[-1] if forces else np.zeros(len(rows)))
    meta = {
        "steps": rows_done - 1,
        "evaluations": trial.count,
        "wall_s": time.perf_counter() - begun,
        "events": events,
        "complete": rows_done == len(t),
        "drive": "by bisection",
        "rtol": rtol,
        "method": "bisection",
    }
    return record(
        system,
        Solution(t[:rows_done], z[:, : 2 * n], z[:, 2 * n :], np.array(forces[:rows_done]), meta),
    )


def _settled(
    error: Callable[[np.ndarray], np.ndarray],
    trial: _Trial,
    step: tuple[float, float, np.ndarray],
    drives: np.ndarray,
    moving: np.ndarray,
    inertia: np.ndarray,
    least: float,
) -> np.ndarray:
    """The state after a step, with the drives (joints,), which are changed, at which all errors of
    the moving joints are below `least` (66). Raises FlexuraError if there are none."""
    width = 0.2 * np.abs(drives) + 1e-3 * inertia
    for _ in range(MAX_SWEEPS):
        for i in map(int, moving):
            before = drives[i]
            of_joint = lambda z: error(z)[i]  # noqa: B023
            after = _bisect(of_joint, trial, step, drives, i, width[i], least)
            width[i] = 2 * abs(drives[i] - before) + 1e-9 * inertia[i]
        if np.abs(error(after)[moving]).max() < least:
            return after
    raise FlexuraError(
        f"the bisection of the joints in turn did not settle at t = {step[0]:.6g} s: "
        f"expected shorter steps"
    )


STEPS_A_TRIAL = 200  # of the integrator between two instants of a bisection, at most


class _Trial:
    """Forward steps from one state under drives that are tried, without limits."""

    def __init__(self, system: System, rtol: float) -> None:
        joints = len(system.robot.links)
        self.system, self.rtol, self.count = system, rtol, 0
        self.rows = np.zeros((joints, COLUMNS))  # a constant force a joint
        ranges = [(i, i + 1, 0, 0) for i in range(joints)]
        self.ranges = np.array(ranges, dtype=np.int64)
        self.gains, self.none = np.zeros((joints, 2)), np.zeros(joints, dtype=np.uint8)
        self.free = np.tile([-np.inf, np.inf], (joints, 1))

    def __call__(self, a: float, b: float, state: np.ndarray, drives: np.ndarray) -> np.ndarray:
        """The state at b (2n + 4,), accounts included, under constant drives from `state` at a."""
        n = self.system.n
        self.rows[:, 0], self.rows[:, 1] = a, drives
        run = core.Simulation(
            robot=self.system.equations,
            t=np.array([a, b]),
            q=state[:n].copy(),
            v=state[n : 2 * n].copy(),
            rtol=self.rtol,
            method="implicit",
            segments=self.rows,
            ranges=self.ranges,
            gains=self.gains,
            prescribed=self.none,
            sampled=self.none,
            limits=self.free,
            function=None,
            sampler=None,
            rate_Hz=0.0,
            first_step=b - a,
            numerical_damping=True,
            most_steps=STEPS_A_TRIAL,
        )
        while run.advance(10_000):
            pass
        self.count += 1
        if run.progress()["status"] != "done":
            raise FlexuraError(
                f"the bisection diverged at t = {a:.6g} s: expected shorter steps, well below the "
                f"periods of the modes"
            )
        after = np.array(run.state())
        after[2 * n :] += state[2 * n :]
        return after


def _bisect(
    error: Callable[[np.ndarray], float],
    trial: _Trial,
    step: tuple[float, float, np.ndarray],
    drives: np.ndarray,
    i: int,
    width: float,
    small: float,
) -> np.ndarray:
    """Put drives[i] where the error is below `small`, or as near as numbers come; returns the state
    there."""
    centre = drives[i]

    def at(value: float) -> tuple[float, np.ndarray]:
        drives[i] = value
        state = trial(*step, drives)
        return error(state), state

    while True:
        low, high = centre - width, centre + width
        below, _ = at(low)
        above, state = at(high)
        if below * above <= 0:
            break
        width *= 2
        if not width < 1e9 * (1 + abs(centre)):
            raise FlexuraError(
                f"the bisection found no drive of joint {i + 1} at t = {step[0]:.6g} s: expected "
                f"shorter steps"
            )
    while True:
        middle = (low + high) / 2
        value, state = at(middle)
        if abs(value) < small or not low < middle < high:
            return state
        low, high = (middle, high) if value * below > 0 else (low, middle)


def _forces(rigid: System, motion: Sequence[Signal], t: float) -> np.ndarray:
    """The rigid robot's drives (N,) along the motions."""
    q, qd, qdd = np.array([m(t) for m in motion]).T
    return rigid.forces(q, qd, qdd) + rigid.assembly.coulomb(qd)


def _splines(
    function: Callable[[float], np.ndarray],
    motion: Sequence[Signal],
    start: float,
    end: float,
    step: float,
) -> list[Signal]:
    """Functions of time, one a joint, as splines; where a motion has a break, accelerations may
    jump and a new spline begins."""
    from scipy.interpolate import CubicSpline

    breaks = np.concatenate([[start, end], *(m.breaks for m in motion)])
    parts: list[list[np.ndarray]] = [[] for _ in motion]
    for a, b in pairwise(np.unique(np.clip(breaks, start, end))):
        count = max(4, int(np.ceil((b - a) / step)) + 1)
        # closer at the ends: friction turns where a joint stops
        x = a + (b - a) * (1 - np.cos(np.linspace(0, np.pi, count))) / 2
        x[-1] = b
        inside = np.append(x[:-1], np.nextafter(b, -np.inf))
        c = CubicSpline(
            x, np.array([function(s) for s in inside])
        ).c  # (4, k, joints), highest power first
        for i, rows in enumerate(parts):
            new = np.zeros((len(x) - 1, COLUMNS))
            new[:, 0], new[:, 1:5] = x[:-1], c[::-1, :, i].T
            rows.append(new)
    return [Signal(np.concatenate(rows), {"kind": "spline"}) for rows in parts]


def _start(
    system: System, t: float, motion: Sequence[Signal], q0: ArrayLike | None, qd0: ArrayLike | None
) -> tuple[np.ndarray, np.ndarray]:
    """The state at the start, its joints on their motions."""
    q, qd, _ = consistent_start(system, t, Drive.prescribed(*motion), q0, qd0)
    return system.check(q), qd
