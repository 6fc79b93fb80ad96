"""What the sensors on the links of a robot show of the states of a run."""

from __future__ import annotations

import numpy as np

from ..robot import FORCE_KINDS, Sensor
from .balance import Balance, RunStates
from .system import System


def sensor_channels(states: RunStates) -> dict[str, np.ndarray]:
    """The channels of a robot's sensors.

    Args:
        states: the states of a run (T,).

    Returns:
        Values (T,) by channel, in the unit of the sensor.

    Raises:
        InputError: a sensor of forces on a robot that slides from node to node.
    """
    out = {}
    for i, link in enumerate(states.system.robot.links):
        for sensor in link.sensor:
            if sensor.kind == "acceleration":
                values = _acceleration(states, i, sensor.at_m)
            elif sensor.kind in FORCE_KINDS:
                values = _force(states.balance, i, sensor)
            else:
                values = _bending(states.system, i, sensor, states.q)
            out[f"sensor/{sensor.name}"] = values
    return out


def _force(balance: Balance, i: int, sensor: Sensor) -> np.ndarray:
    """A force or stress in a section of link i (from 0), (T,) (141), (146)."""
    found = balance.section(i, sensor.at_m)
    if sensor.kind != "stress":
        return np.asarray(getattr(found, sensor.kind))
    link = balance.robot.links[i]
    return np.asarray(link.bending_stress(found.bending_moment, sensor.at_m, sensor.distance_m))


def _bending(system: System, i: int, sensor: Sensor, q: np.ndarray) -> np.ndarray:
    """Deflection [m] (6), slope [rad] or strain [1] of link i (from 0) at a sensor, (T,): the
    curvature is dTheta/ds (2)."""
    structure, left = system.assembly.structure, sensor.at_m
    across, turned = np.zeros(len(q)), np.zeros(len(q))
    pieces = list(zip(structure.links[i], structure.own[i], strict=True))
    for k, (piece, own) in enumerate(pieces):
        last = left <= piece.length or k + 1 == len(pieces)
        xi = np.array([min(left / piece.length, 1.0)])
        angle = turned[:, None] + q[:, own] @ piece.B.T
        rise = angle if structure.linear else np.sin(angle)
        across = across + piece.length * rise @ piece.integrals(xi if last else np.ones(1))[0]
        if last:
            if sensor.kind == "strain":
                assert sensor.distance_m is not None
                curvature = q[:, own] @ piece.shapes(xi, 1)[0] / piece.length
                return np.asarray(-sensor.distance_m * curvature)
            turned = turned + q[:, own] @ piece.shapes(xi)[0]
            break
        turned = turned + q[:, own] @ piece.shapes(np.ones(1))[0]
        left -= piece.length
    return across if sensor.kind == "deflection" else turned


def _acceleration(states: RunStates, i: int, at: float) -> np.ndarray:
    """The acceleration of a place of link i across its tangent, to the left (T,) [m/s^2] (39)."""
    structure, out = states.system.assembly.structure, np.empty(len(states.q))
    rows = zip(states.q, states.qd, states.accelerations, strict=True)
    for k, (here, speed, rate) in enumerate(rows):
        frame = structure.at(structure.states(here, speed)[i], at)
        full = frame.rest + frame.velocity @ rate
        out[k] = (full * frame.tangent.conjugate()).imag
    return out
