"""Where a run in Exudyn starts: positions, speeds, straight or in static equilibrium, links under
gravity and joints held."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import FlexuraError, InputError
from ..io import array, choice
from ..optional import Optional
from ..robot import Robot
from ..signals import STARTS
from .build import TwinModel, build
from .joints.mesh import Mesh

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


def which_start(robot: Robot, start: Any, speeds: np.ndarray) -> str:
    """The start of a run, "static" or "straight", by default as gravity asks.

    Args: start: as given, or None; speeds (n,) of the joints at the start.

    Raises: InputError: start is neither, or is static while joints move.
    """
    if start is not None:
        choice(start, "start", STARTS)
    bends = any(link.flexible for link in robot.links) and any(robot.gravity_m_s2)
    which = start or ("static" if bends else "straight")
    if which == "static" and speeds.any():
        expected = (
            'expected "straight" with joints that move: from equilibrium the twin starts at rest'
        )
        raise InputError(expected, key="start", value=which)
    return str(which)


def equilibrium(robot: Robot, beam: str, mesh: Mesh) -> np.ndarray:
    """The coordinates of a robot with this mesh in static equilibrium, without the reference.

    Raises: FlexuraError: Exudyn finds none.
    """
    n = len(robot.links)
    for steps in LOAD_STEPS:
        model = build(robot, beam, mesh, np.zeros(n), np.zeros((n, 2)), held=True)
        try:
            if model.mbs.SolveStatic(_settings(model, steps)):
                return np.array(model.mbs.systemData.GetODE2Coordinates())
        except Exception:  # Exudyn's own: the next attempt grows the load more slowly
            continue
    raise FlexuraError(
        'Exudyn found no static equilibrium to start in: start = "straight" begins with straight '
        "links"
    )


def put(model: TwinModel, coordinates: np.ndarray) -> None:
    """Let a model start with these coordinates, its velocities as they are."""
    model.mbs.systemData.SetODE2Coordinates(coordinates, exu.ConfigurationType.Initial)


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
