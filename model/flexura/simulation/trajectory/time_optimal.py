"""The shortest motion from rest to rest under limits, with nothing that vibrates after it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...errors import FlexuraError, InputError
from ...io import Run, array, number, whole
from ...io.quantities import note_turns
from ...robot import Robot
from ...signals import Drive, polynomial
from ...system import RobotLike, System, assemble, static
from ..approximate_inverse import rigid_robot
from ..dynamics import inverse, simulate
from .limits import KEPT, LIMITED, Limits, read_limits
from .plant_motion import METHOD, PERIODS, RTOL, Plant, deflection_slope, linear_drive
from .posture import exact_system
from .shortest_motion import SETTLED, ShortestMotion

INTERVALS = 160  # of the drives
COARSE = 40  # so many at least in a first, coarse motion
ROUGHLY = 5e-3  # of the time: what a coarse motion may leave to finer ones
FEWEST = 20
ROUNDS = 8  # in which a motion that exceeds a limit between its nodes is mended
FINER = 4  # times the steps in an interval, at most
FAR = 0.02  # of a limit: a motion that exceeds it by more is looked at in finer steps
STRETCHED = (1.0, 1.01, 1.03, 1.1)  # times in which a mended motion is sought
ROWS = 20  # of the Run in each interval: a spline through them hardly leaves the drives
FIRST = 120  # in which the first motion's drives are looked at
LONGER = 12  # times by which the first motion may be too short
REMAINS = 0.0192  # of the unshaped residual, at frequencies within the band of `robust`
NOTHING = 0.001  # of it, at the model's own
BAND = (
    -1.0,
    -0.6,
    -0.25,
    0.25,
    0.6,
    1.0,
)  # of `robust`: the plants between which the motion is robust
CAREFUL = 1.15  # of the first guess's time: its drives are below their limits
MOST_PERIODS = 200  # of the first mode, which a motion may last: its drives have fewer intervals


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
    vibrates (122).

    A sequence of linear programs on the nonlinear equations, linearised exactly along each motion.
    The first of the robot's modes end at rest. The Run is that of a simulation. Limits hold at all
    its rows, to 0.1 %: a motion that exceeds one is mended. Speeds and deflections of the other
    robots of `robust` are not limited.

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
        motion, and after that of the rigid robot's fastest drives), `programs`. An event
        "limit_exceeded" names what exceeds its limit by more than 0.1 %, if a motion could not be
        mended.

    Raises:
        InputError: an argument is not what is expected, or no motion of some 200 periods of the
            first mode keeps the limits.
        FlexuraError: no such motion was found.
    """
    system = exact_system(robot)
    joints = len(system.robot.links)
    first, last = (
        _positions(system, value, key) for key, value in (("start", start), ("end", end))
    )
    bounds = read_limits(limits, joints)
    share = number(robust, "robust")
    if not 0 <= share < 0.5:
        raise InputError("expected a share of 0 or more, below 0.5", key="robust", value=robust)
    m = whole(intervals, "intervals", FEWEST)
    if not np.any(np.abs(last - first)[~system.locked] > 0):
        raise InputError("expected an end other than the start", key="end", value=end)
    ends = static(system, first), static(system, last)
    T, count = _first_time(Plant(system, *ends, np.ones(1), 1.0), bounds), 0
    nominal = Plant(system, *ends, _unshaped(system, *ends, bounds), NOTHING)
    robots = share > 0 and len(nominal.unshaped) > 0
    plants = _band(nominal, share, bounds) if robots else [nominal]
    levels = [k for k in (m // 4, m // 2) if k >= COARSE] + [m]
    for level in levels:  # coarse ones first
        shortest = ShortestMotion(plants, bounds, level)
        if level == levels[0]:
            u, T = _solved(shortest, nominal, T, ROUGHLY if len(levels) > 1 else SETTLED)
        else:
            at, nodes = np.linspace(0, 1, level + 1), np.linspace(0, 1, len(u))
            found = shortest.solve(np.column_stack([np.interp(at, nodes, x) for x in u.T]), T)
            u, T = found or _solved(shortest, nominal, T, SETTLED)
        count += shortest.programs
    if bounds.of_states:
        u, T, programs = _mended(plants, bounds, u, T)
        count += programs
    run = _recorded(plants, u, T, count, share)
    run.meta["events"] = run.meta["events"] + bounds.exceeded(run)
    return run


def _mended(
    plants: list[Plant], limits: Limits, u: np.ndarray, T: float
) -> tuple[np.ndarray, float, int]:
    """A motion that keeps the limits between its nodes too, nearly; and how many programs it took.

    A simulation says what a motion exceeds. Then its steps are made finer or its limits tighter.
    """
    inner, finer, count = limits, 1, 0
    for _ in range(ROUNDS):
        run = _simulated(plants[0], u, T)
        excess = limits.excess(run)
        if excess <= KEPT:
            break
        if excess > FAR and finer < FINER:
            finer *= 2
        else:
            inner = inner.tightened(run, limits)
        shortest = ShortestMotion(plants, inner, len(u) - 1, finer)
        for longer in STRETCHED:
            found = shortest.solve(u, T * longer)
            if found:
                break
        u, T = found or _solved(shortest, plants[0], T, SETTLED)
        count += shortest.programs
    return u, T, count


def _band(nominal: Plant, share: float, limits: Limits) -> list[Plant]:
    """The robot, and robots of other frequencies; 2 % of the largest unshaped residual remains."""
    rows, robots = nominal.system.joint_rows, [(nominal.system, nominal.start, nominal.end)]
    for part in BAND:
        other = assemble(stiffer(nominal.system.robot, (1 + part * share) ** 2))
        start, end = (static(other, q[rows]) for q in (nominal.start, nominal.end))
        robots.append((other, start, end))
    unshaped = np.max([_unshaped(*robot, limits) for robot in robots], axis=0)
    return [Plant(*robot, unshaped, REMAINS) for robot in robots]


def stiffer(robot: Robot, factor: float) -> Robot:
    """The same robot with `factor` times the bending stiffness of each link."""
    data = robot.to_dict()
    for link, table in zip(robot.links, data["link"], strict=True):
        if link.flexible:
            for key in ("young_modulus_Pa", "bending_stiffness_N_m2"):
                if key in table:
                    table[key] *= factor
    return Robot.from_dict(data)


def _positions(system: System, value: Any, key: str) -> np.ndarray:
    joints = len(system.robot.links)
    found = array(value, key, f"expected {joints} finite positions, one a joint of the robot")
    if found.shape not in ((joints,), (() if joints == 1 else (joints,))):
        raise InputError(
            f"expected {joints} positions, one a joint of the robot", key=key, value=value
        )
    found = found.reshape(joints)
    for i, link in enumerate(system.robot.links):
        if link.joint.type == "R":
            note_turns(f"{key} of joint {i + 1}", found[i])
    return found


def _solved(
    shortest: ShortestMotion, plant: Plant, T: float, settled: float
) -> tuple[np.ndarray, float]:
    """The shortest motion from a smooth one on, which may be longer than T."""
    for _ in range(LONGER):
        found = shortest.solve(_smooth_drives(plant, T, shortest.m), T, settled)
        if found:
            return found
        T *= CAREFUL
    raise FlexuraError(
        "no motion was found that keeps the limits and ends at rest: expected higher limits"
    )


def _first_time(plant: Plant, limits: Limits) -> float:
    """A time in which the joints can go a smooth way within the limits."""
    T, most = 1.0, np.inf
    if len(plant.system.elastic_rows):
        most = MOST_PERIODS * 2 * np.pi / plant.modes[0][plant.joints]
    for _ in range(30):
        name, share = limits.nearest(_smooth(plant, T, FIRST))
        share = share**2 if name.endswith("velocity") else share
        if 0.4 < share <= 1.0:
            break
        T *= float(np.clip(CAREFUL * np.sqrt(share), 0.1, 10.0))
        if share > 1.0 and most < T:
            break
    if not share <= 1.0:
        within = f" in {MOST_PERIODS} periods of the first mode" if most < T else ""
        raise InputError(
            f"expected more: {name} stays within this, and the joints cannot go their way{within}",
            key=f"limits.{LIMITED[name.rpartition('/')[2]]}",
        )
    return T


def _smooth(plant: Plant, T: float, m: int) -> Run:
    """The robot whose joints go a smooth way, at m + 1 times."""
    system, rows = plant.system, plant.system.joint_rows
    motion = [
        None if locked else polynomial(float(b), T, float(a))
        for a, b, locked in zip(plant.start[rows], plant.end[rows], system.locked, strict=True)
    ]
    return inverse(system, np.linspace(0.0, T, m + 1), motion, rtol=1e-6).uninterrupted()


def _smooth_drives(plant: Plant, T: float, m: int) -> np.ndarray:
    """Drives (m + 1, links) of the robot whose joints go a smooth way."""
    run = _smooth(plant, T, m)
    u = np.column_stack([run[f"joint/{i + 1}/drive"] for i in range(len(plant.system.joint_rows))])
    u[0], u[-1] = plant.hold
    return u


def _unshaped(system: System, start: np.ndarray, end: np.ndarray, limits: Limits) -> np.ndarray:
    """The largest tip deflections (tips,) [m] after the rigid robot's fastest drives.

    With several joints, or where there is gravity, those of the first mode after a step of the
    largest drives.
    """
    free = np.flatnonzero(~system.locked)
    if not len(system.elastic_rows):
        return np.zeros(0)
    plant = Plant(system, start, end, np.ones(1), 1.0)
    k = plant.joints
    omega = plant.modes[0][k]
    if len(free) > 1 or any(system.robot.gravity_m_s2):
        mode = plant.shape(k)
        rate = limits.drive[free] @ np.abs(mode[system.joint_rows[free]]) / omega
        return np.abs(deflection_slope(system, end) @ mode) * rate / omega
    rigid = assemble(rigid_robot(system.robot))
    inertia = float(rigid.mass(rigid.start())[free[0], free[0]])
    way = plant.end[system.joint_rows[free[0]]] - plant.start[system.joint_rows[free[0]]]
    most = limits.drive[free[0]] * np.sign(way)
    span = 2 * np.sqrt(inertia * way / most)
    h = 1e-6 * span
    times = np.array([0.0, span / 2 - h, span / 2 + h, span - h, span + h])
    values = np.zeros((5, len(system.robot.links)))
    values[:, free[0]] = [most, most, -most, -most, 0.0]
    drive = Drive.force(*(linear_drive(times, column) for column in values.T))
    later = span + np.linspace(h, PERIODS * 2 * np.pi / omega, 400)
    times = np.append(0.0, later)
    run = simulate(system, times, drive, plant.start, rtol=RTOL, method=METHOD).uninterrupted()
    return np.asarray(np.abs(_bends(run, plant)[1:]).max(axis=0))


def _bends(run: Run, plant: Plant) -> np.ndarray:
    """Tip deflections (T, k) less those at rest."""
    names = [name for name in run if name.endswith("/tip_deflection")]
    rest = plant.system.places(plant.end)[0]
    return np.column_stack([run[name] for name in names]) - rest if names else np.zeros((1, 1))


def _drive(u: np.ndarray, T: float) -> Drive:
    nodes = np.linspace(0.0, T, len(u))
    return Drive.force(*(linear_drive(nodes, column) for column in u.T))


def _simulated(plant: Plant, u: np.ndarray, T: float) -> Run:
    """The motion under drives (m + 1, links), with `ROWS` rows in each interval."""
    rows = np.linspace(0.0, T, ROWS * (len(u) - 1) + 1)
    drive = _drive(u, T)
    return simulate(
        plant.system, rows, drive, plant.start, rtol=RTOL, method=METHOD
    ).uninterrupted()


def _recorded(plants: list[Plant], u: np.ndarray, T: float, count: int, share: float) -> Run:
    """The Run of the motion, and what remains after it."""
    run, unshaped, drive = _simulated(plants[0], u, T), plants[0].unshaped, _drive(u, T)
    left = [_residual(plant, drive, T) for plant in plants]
    run.meta.update(
        duration_s=T,
        residual_m=left[0],
        unshaped_m=float(unshaped.max(initial=0.0)),
        programs=count,
        robust=share,
        **({"residual_in_band_m": max(left)} if len(plants) > 1 else {}),
    )
    return run


def _residual(plant: Plant, drive: Drive, T: float) -> float:
    """The largest tip deflection after the motion [m]."""
    if not len(plant.system.elastic_rows):
        return 0.0
    span = PERIODS * 2 * np.pi / plant.modes[0][plant.joints]
    later = np.concatenate([[0.0], T + np.linspace(0.0, span, 400)])
    after = simulate(
        plant.system, later, drive, plant.start, rtol=RTOL, method=METHOD
    ).uninterrupted()
    return float(np.abs(_bends(after, plant)[1:]).max())
