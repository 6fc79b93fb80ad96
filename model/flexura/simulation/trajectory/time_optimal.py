"""The shortest motion from rest to rest under limits, with nothing that vibrates after it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...errors import FlexuraError, InputError
from ...io import Run, array, number, whole
from ...robot import Robot
from ...signals import Drive, polynomial
from ...system import RobotLike, System, assemble, static
from ..approximate_inverse import rigid_robot
from ..dynamics import inverse, simulate
from .posture import exact_system
from .shortest_motion import METHOD, RTOL, Limits, Plant, ShortestMotion, linear_drive

INTERVALS = 120  # of the drives
REMAINS = 0.02  # of the unshaped residual, at frequencies within the band of `robust`
BAND = (-1.0, -0.5, 0.5, 1.0)  # of `robust`: the plants between which the motion is robust
CAREFUL = 1.15  # of the first guess's time: its drives are below their limits
PERIODS = 3.0  # of the first mode, in which the residual is looked at


def time_optimal(
    robot: RobotLike,
    start: ArrayLike,
    end: ArrayLike,
    limits: Mapping[str, ArrayLike],
    robust: float = 0.0,
    *,
    intervals: int = INTERVALS,
) -> Run:
    """The shortest motion from rest to rest whose drives keep their limits, after which nothing
    vibrates (120).

    A sequence of linear programs on the nonlinear equations, linearised exactly along each motion.
    The first of the robot's modes end at rest. The Run is that of a simulation.

    Args:
        robot: a System, a Robot, or the path or name of a robot file.
        start: positions of the joints (links,) [m or rad]; a number for a robot with one joint.
        end: positions of the joints at the end, as `start`.
        limits: {"drive": largest forces and torques (links,) [N or N m]}, and if there are such
            limits "speed" (links,) [m/s or rad/s] and "deflection_m", of every tip [m].
        robust: by what share the natural frequencies may be other than the model's, for example
            0.1; within it at most 2 % of the unshaped residual remains. 0: only the model.
        intervals: of equal length, in which the drives are linear.

    Returns:
        A Run whose drives are linear between its rows; after its last row they hold the robot.
        `meta` has `duration_s`, `residual_m` and `unshaped_m` (the largest tip deflection after the
        motion, and after that of the rigid robot's fastest drives), `programs`.

    Raises:
        InputError: an argument is not what is expected.
        FlexuraError: no such motion was found.
    """
    system = exact_system(robot)
    joints = len(system.robot.links)
    first, last = (
        _positions(system, value, key) for key, value in (("start", start), ("end", end))
    )
    bounds = _limits(limits, joints)
    share = number(robust, "robust")
    if not 0 <= share < 0.5:
        raise InputError("expected a share of 0 or more, below 0.5", key="robust", value=robust)
    m = whole(intervals, "intervals", 20)
    if not np.any(np.abs(last - first)[~system.locked] > 0):
        raise InputError("expected an end other than the start", key="end", value=end)
    nominal = _plant(system, first, last, 0.0)
    shortest = ShortestMotion([nominal], bounds, m)
    u, T = _first_guess(nominal, bounds, m)
    u, T, count = shortest.solve(u, T)
    unshaped = _unshaped(nominal, bounds, T)
    if share > 0:
        u, T, more = _robust(nominal, bounds, m, share, u, T, unshaped)
        count += more
    return _recorded(nominal, u, T, count, unshaped, share)


def _robust(
    nominal: Plant,
    bounds: Limits,
    m: int,
    share: float,
    u: np.ndarray,
    T: float,
    unshaped: tuple[float, np.ndarray],
) -> tuple[np.ndarray, float, int]:
    """The motion that also brings robots of other frequencies nearly to rest."""
    system = nominal.system
    rows = system.joint_rows
    one = ShortestMotion([nominal], bounds, m)
    joints = len(system.free_rows) - len(system.elastic_rows)
    left = REMAINS * float(unshaped[1][0]) / one.reference(nominal, joints)
    plants = [nominal]
    for part in BAND:
        other = assemble(stiffer(system.robot, (1 + part * share) ** 2))
        plants.append(_plant(other, nominal.start[rows], nominal.end[rows], left))
    return ShortestMotion(plants, bounds, m).solve(u, T)


def stiffer(robot: Robot, factor: float) -> Robot:
    """The same robot with `factor` times the bending stiffness of each link, damped the same."""
    data = robot.to_dict()
    for link, table in zip(robot.links, data["link"], strict=True):
        if link.flexible:
            for key in ("young_modulus_Pa", "bending_stiffness_N_m2"):
                if key in table:
                    table[key] *= factor
            if "damping" in table and "beta_s" in table["damping"]:
                table["damping"]["beta_s"] /= factor**0.5
    return Robot.from_dict(data)


def _plant(system: System, first: np.ndarray, last: np.ndarray, left: float) -> Plant:
    return Plant(system, static(system, first), static(system, last), left)


def _positions(system: System, value: Any, key: str) -> np.ndarray:
    joints = len(system.robot.links)
    found = array(value, key, f"expected {joints} finite positions, one a joint of the robot")
    if found.shape not in ((joints,), (() if joints == 1 else (joints,))):
        raise InputError(
            f"expected {joints} positions, one a joint of the robot", key=key, value=value
        )
    return found.reshape(joints)


def _limits(limits: Any, joints: int) -> Limits:
    known = ("drive", "speed", "deflection_m")
    if not isinstance(limits, Mapping):
        raise InputError(f"expected a table with {', '.join(known)}", key="limits", value=limits)
    for key in limits:
        if key not in known:
            text = f"an unknown key; known: {', '.join(known)}"
            raise InputError(text, key=f"limits.{key}", value=limits[key])
    if "drive" not in limits:
        raise InputError("missing: expected the largest drives, one a joint", key="limits.drive")
    found = {}
    for key in ("drive", "speed"):
        if key not in limits or limits[key] is None:
            found[key] = np.full(joints, np.inf)
            continue
        expected = f"expected {joints} numbers above 0, one a joint"
        given = array(limits[key], f"limits.{key}", expected)
        if given.size not in (1, joints) or not np.all(given > 0):
            raise InputError(expected, key=f"limits.{key}", value=limits[key])
        found[key] = np.broadcast_to(given.ravel(), (joints,)).astype(float)
    bend = limits.get("deflection_m")
    most = np.inf if bend is None else number(bend, "limits.deflection_m")
    if not most > 0:
        raise InputError("expected a length above 0", key="limits.deflection_m", value=bend)
    return Limits(found["drive"], found["speed"], most)


def _first_guess(plant: Plant, limits: Limits, m: int) -> tuple[np.ndarray, float]:
    """Drives of the rigid robot on a smooth way, as quick as the limits let it be."""
    system, rows = plant.system, plant.system.joint_rows
    rigid = assemble(rigid_robot(system.robot))
    T = 1.0
    for _ in range(30):
        motion = [
            None if locked else polynomial(float(b), T, float(a))
            for a, b, locked in zip(plant.start[rows], plant.end[rows], system.locked, strict=True)
        ]
        run = inverse(rigid, np.linspace(0.0, T, m + 1), motion, rtol=1e-6)
        u = np.column_stack([run[f"joint/{i + 1}/drive"] for i in range(len(rows))])
        speeds = [np.abs(run[f"joint/{i + 1}/velocity"]).max() for i in range(len(rows))]
        share = float(max((np.abs(u) / limits.drive).max(), (speeds / limits.speed).max() ** 2))
        if 0.4 < share <= 1.0:
            break
        T *= float(np.clip(CAREFUL * np.sqrt(share), 0.1, 10.0))
    if not share <= 1.0:
        raise FlexuraError("the drives cannot hold the robot on its way: expected higher limits")
    u[0], u[-1] = plant.hold
    return u, T


def _unshaped(plant: Plant, limits: Limits, T: float) -> tuple[float, np.ndarray]:
    """What remains after the rigid robot's fastest drives: the largest tip deflection [m], and the
    first mode's amplitude as a rate (1,). With several joints, what a step of the largest drives
    leaves."""
    system = plant.system
    free = np.flatnonzero(~system.locked)
    shortest = ShortestMotion([plant], limits, INTERVALS)
    joints = len(system.free_rows) - len(system.elastic_rows)
    if not len(system.elastic_rows):
        return 0.0, np.ones(1)
    step = shortest.reference(plant, joints)
    if len(free) > 1 or any(system.robot.gravity_m_s2):
        return np.nan, np.array([step])
    rigid = assemble(rigid_robot(system.robot))
    inertia = float(rigid.mass(rigid.start())[free[0], free[0]])
    way = plant.end[system.joint_rows[free[0]]] - plant.start[system.joint_rows[free[0]]]
    most = limits.drive[free[0]] * np.sign(way)
    span = 2 * np.sqrt(inertia * way / most)
    values = {"u": np.zeros((5, len(system.robot.links)))}
    h = 1e-6 * span
    times = np.array([0.0, span / 2 - h, span / 2 + h, span - h, span + h])
    values["u"][:, free[0]] = [most, most, -most, -most, 0.0]
    drive = Drive.force(*(linear_drive(times, column) for column in values["u"].T))
    omega, into = plant.modes
    later = span + np.linspace(h, PERIODS * 2 * np.pi / omega[joints], 400)
    run = simulate(system, np.append(0.0, later), drive, plant.start, rtol=RTOL, method=METHOD)
    bends = _bends(run, plant)[1:]
    assert run.states is not None
    n = system.n
    away, rate = run.states[1, :n] - plant.end, run.states[1, n:]
    amplitude = float(np.hypot(omega[joints] * into[joints] @ away, into[joints] @ rate))
    return float(np.abs(bends).max()), np.array([amplitude])


def _bends(run: Run, plant: Plant) -> np.ndarray:
    """Tip deflections (T, k) less those at rest."""
    names = [name for name in run if name.endswith("/tip_deflection")]
    rest = plant.system.places(plant.end)[0]
    return np.column_stack([run[name] for name in names]) - rest if names else np.zeros((1, 1))


def _recorded(
    plant: Plant,
    u: np.ndarray,
    T: float,
    count: int,
    unshaped: tuple[float, np.ndarray],
    share: float,
) -> Run:
    """The Run of the motion, and what remains after it."""
    system = plant.system
    nodes = np.linspace(0.0, T, len(u))
    drive = Drive.force(*(linear_drive(nodes, column) for column in u.T))
    run = simulate(system, nodes, drive, plant.start, rtol=RTOL, method=METHOD)
    residual = 0.0
    if len(system.elastic_rows):
        omega, _ = plant.modes
        joints = len(system.free_rows) - len(system.elastic_rows)
        span = PERIODS * 2 * np.pi / omega[joints]
        later = np.concatenate([[0.0], T + np.linspace(0.0, span, 400)])
        after = simulate(system, later, drive, plant.start, rtol=RTOL, method=METHOD)
        residual = float(np.abs(_bends(after, plant)[1:]).max())
    run.meta.update(
        duration_s=T,
        residual_m=residual,
        unshaped_m=None if np.isnan(unshaped[0]) else unshaped[0],
        programs=count,
        robust=share,
    )
    return run
