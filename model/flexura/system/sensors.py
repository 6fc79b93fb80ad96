"""What the sensors on the links of a robot show of the states of a run."""

from __future__ import annotations

from functools import cache

import numpy as np

from ..robot import FORCE_KINDS, Sensor
from ..signals import Loads
from .balance import Balance, balances
from .loads import load_forces
from .system import System


def sensor_channels(
    system: System,
    t: np.ndarray,
    q: np.ndarray,
    qd: np.ndarray,
    drive: np.ndarray,
    loads: Loads,
) -> dict[str, np.ndarray]:
    """The channels of a robot's sensors.

    Args:
        system: the robot.
        t: times (T,) [s].
        q: configurations (T, n).
        qd: their rates (T, n).
        drive: forces of the drives (T, links) [N or N m].
        loads: forces and moments on links.

    Returns:
        Values (T,) by channel, in the unit of the sensor.
    """
    qdd = cache(lambda: accelerations(system, t, q, qd, drive, loads))
    out, forces = {}, []
    for i, link in enumerate(system.robot.links):
        for sensor in link.sensor:
            name = f"sensor/{sensor.name}"
            if sensor.kind == "acceleration":
                out[name] = _acceleration(system, i, sensor.at_m, q, qd, qdd())
            elif sensor.kind in FORCE_KINDS:
                forces.append((i, sensor))
            else:
                out[name] = _bending(system, i, sensor, q)
    if forces:
        parts = [
            [_force(balance, i, sensor) for i, sensor in forces]
            for balance in balances(system, t, q, qd, qdd(), loads)
        ]
        columns = np.concatenate(parts, axis=1)
        out |= {f"sensor/{s.name}": each for (_, s), each in zip(forces, columns, strict=True)}
    return out


def _force(balance: Balance, i: int, sensor: Sensor) -> np.ndarray:
    """A force or stress in a section of link i (from 0), (T,) (139), (144)."""
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


def accelerations(
    system: System,
    t: np.ndarray,
    q: np.ndarray,
    qd: np.ndarray,
    drive: np.ndarray,
    loads: Loads,
) -> np.ndarray:
    """The accelerations of the unknowns (44), with Coulomb friction (57), under drives and loads.

    Args:
        system: the robot.
        t: times (T,) [s].
        q: configurations (T, n).
        qd: their rates (T, n).
        drive: forces of the drives (T, links) [N or N m].
        loads: forces and moments on links.

    Returns:
        (T, n).
    """
    force = load_forces(system, q, loads, t).copy()
    force[:, system.joint_rows] += drive
    force -= np.array([system.assembly.coulomb(rates) for rates in qd]).reshape(q.shape)
    rows = zip(q, qd, force, strict=True)
    return np.array([system.accelerations(*row) for row in rows]).reshape(q.shape)


def _acceleration(
    system: System, i: int, at: float, q: np.ndarray, qd: np.ndarray, rates: np.ndarray
) -> np.ndarray:
    """The acceleration of a place of link i across its tangent, to the left (T,) [m/s^2] (39)."""
    structure, out = system.assembly.structure, np.empty(len(q))
    for k, (here, speed, rate) in enumerate(zip(q, qd, rates, strict=True)):
        frame = structure.at(structure.states(here, speed)[i], at)
        full = frame.rest + frame.velocity @ rate
        out[k] = (full * frame.tangent.conjugate()).imag
    return out
