"""Where a run in Exudyn starts: positions, speeds, straight or in static equilibrium, links under
gravity and joints held."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import FlexuraError, InputError
from ..io import array, choice
from ..optional import Optional
from ..robot import Robot
from ..signals import STARTS, Loads
from .build import TwinModel, build
from .joints.mesh import Mesh, sliding_kinds

exu = Optional("exudyn")

LOAD_STEPS = (1, 10, 100)  # tried in turn: in how many steps gravity grows
SPREAD = 1e-10  # of the robot's size: the last correction of a solution


def at_positions(robot: Robot, positions: np.ndarray) -> Robot:
    """The same robot with its joints starting at positions (n,)."""
    links = [
        link.model_copy(update={"joint": link.joint.model_copy(update={"start": float(place)})})
        for link, place in zip(robot.links, positions, strict=True)
    ]
    return robot.model_copy(update={"link": links})


def start_speeds(robot: Robot, qd0: Any) -> np.ndarray:
    """The joint velocities at the start (n,), checked."""
    n = len(robot.links)
    if qd0 is None:
        return np.zeros(n)
    speeds = array(qd0, "qd0", f"expected {n} joint velocities in m/s or rad/s", (n,))
    for i, (link, speed) in enumerate(zip(robot.links, speeds, strict=True), 1):
        if link.joint.locked and speed:
            raise InputError(
                "expected 0: this joint is locked", key=f"qd0[{i}]", value=float(speed)
            )
    return speeds


def resolve_start(robot: Robot, start: Any, speeds: np.ndarray) -> str:
    """The start of a run, "static" or "straight", by default as gravity asks.

    A static start gives the positions. The joints keep their velocities, as in the native solver.

    Args:
        robot: the robot.
        start: as given, or None.
        speeds: joint velocities at the start (n,) [m/s or rad/s].

    Returns:
        "static" or "straight".

    Raises:
        InputError: start is neither, or it is static, joints move and one of the robot's joints
            slides on a flexible link: the twin does not know the velocities of its hub or sleeve.
    """
    if start is not None:
        choice(start, "start", STARTS)
    bends = any(link.flexible for link in robot.links) and any(robot.gravity_m_s2)
    which = start or ("static" if bends else "straight")
    if which == "static" and speeds.any() and sliding_kinds(robot):
        expected = (
            'expected "straight", or a robot at rest: a joint slides on a flexible link, and from '
            "equilibrium the twin starts such a robot at rest"
        )
        raise InputError(expected, key="start", value=which)
    return str(which)


def equilibrium(robot: Robot, beam: str, mesh: Mesh, loads: Loads) -> np.ndarray:
    """The coordinates of a robot in static equilibrium, without the reference.

    Args:
        robot: the robot, with its joints at their start.
        beam: "ancf" or "ge".
        mesh: elements, hubs and sleeves.
        loads: on links, as they are at time 0.

    Returns:
        Displacements of all coordinates.

    Raises:
        FlexuraError: Exudyn finds none.
    """
    n = len(robot.links)
    for steps in LOAD_STEPS:
        model = build(robot, beam, mesh, np.zeros(n), np.zeros((n, 2)), held=True, loads=loads)
        try:
            if model.mbs.SolveStatic(_settings(model, steps)):
                return np.array(model.mbs.systemData.GetODE2Coordinates())
        except Exception:  # Exudyn's own: the next attempt grows the load more slowly
            continue
    raise FlexuraError(
        'Exudyn found no static equilibrium to start in: start = "straight" begins with straight '
        "links"
    )


def put(model: TwinModel, coordinates: np.ndarray, speeds: np.ndarray) -> None:
    """Let a model start in static equilibrium.

    Args:
        model: the model.
        coordinates: displacements of the equilibrium from the reference.
        speeds: joint velocities at the start (n,) [m/s or rad/s].
    """
    data, initial = model.mbs.systemData, exu.ConfigurationType.Initial
    data.SetODE2Coordinates(coordinates, initial)
    if speeds.any():
        rates = np.array(data.GetODE2Coordinates_t(initial))
        data.SetODE2Coordinates_t(_rigid_rates(model, coordinates, speeds, rates), initial)


def _rigid_rates(
    model: TwinModel, coordinates: np.ndarray, speeds: np.ndarray, rates: np.ndarray
) -> np.ndarray:
    """Velocities of all coordinates when the joints move and the links keep their shapes.

    Args:
        model: a model without joints that slide on flexible links.
        coordinates: displacements from the reference.
        speeds: joint velocities (n,) [m/s or rad/s].
        rates: velocities of the coordinates that belong to no link, such as rotors.
    """
    total, rates = model.reference + coordinates, rates.copy()
    across = lambda r: np.stack([-r[..., 1], r[..., 0]], axis=-1)
    # a point of the body before with its velocity; the body's angle and angular velocity
    place, v, angle, omega = np.zeros(2), np.zeros(2), 0.0, 0.0
    for link, part, index, speed in zip(model.robot.links, model.parts, model.index, speeds):
        q = total[index]
        origin = part.motion_at_origin(q[None], np.zeros_like(q[None]))
        at, turned = origin.r[0], float(origin.angle[0])
        v = v + omega * across(at - place)
        if link.joint.type == "R":
            omega += speed
        else:
            along = angle if link.joint.type == "Pa" else turned
            v = v + speed * np.array([np.cos(along), np.sin(along)])
        nodes = q.reshape(-1, part.width)
        rate = np.full_like(nodes, omega)
        rate[:, :2] = v + omega * across(nodes[:, :2] - at)
        if part.width == 4:  # a slope vector in place of an angle
            rate[:, 2:] = omega * across(nodes[:, 2:])
        rates[index] = rate.ravel()
        place, angle = at, turned
    return rates


def _settings(model: TwinModel, steps: int) -> Any:
    settings = exu.SimulationSettings()
    static = settings.staticSolver
    static.numberOfLoadSteps = steps
    static.adaptiveStep = False
    newton = static.newton
    newton.relativeTolerance = 1e-10
    newton.absoluteTolerance = SPREAD * model.reach
    newton.residualMode = 1
    newton.maxIterations = 50
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    settings.solution.file.write = False
    settings.solution.solverInformationFileName = ""
    settings.solution.sensors.active = False
    return settings
