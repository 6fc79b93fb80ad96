"""The forces within a robot over a run: of its joints, along its links, and of its sensors."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..io import STATIONS
from ..robot import FORCE_KINDS, Robot, Sensor
from ..system import Balance, System, check_continuous, sections_known

SECTION = ("bending_moment", "shear_force", "axial_force")  # as SectionForces has them


class Wanted(NamedTuple):
    """Channels with their units, and their values in a state, in that order."""

    units: dict[str, str]
    values: Callable[[Balance], list[float]]


def force_channels(
    system: System, q: np.ndarray, qd: np.ndarray, qdd: Callable[[], np.ndarray], everything: bool
) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """The channels of forces within the robot: those of its sensors, and if asked for all.

    Args:
        system: the robot.
        q: configurations (T, n).
        qd: their rates (T, n).
        qdd: gives their accelerations (T, n).
        everything: also the reactions of all joints, and the forces along all links.

    Returns:
        Values (T,) and units by channel.

    Raises:
        InputError: a robot that slides from node to node.
    """
    robot = system.robot
    wanted = [*_reactions(robot), *_along(robot)] if everything else []
    wanted += _sensors(robot)
    if not wanted:
        return {}, {}
    check_continuous(system)
    table = np.empty((len(q), sum(len(each.units) for each in wanted)))
    for row, at, rates, more in zip(table, q, qd, qdd(), strict=True):
        balance = Balance(system.assembly, at, rates, more)
        row[:] = [value for each in wanted for value in each.values(balance)]
    units = {name: unit for each in wanted for name, unit in each.units.items()}
    columns = np.ascontiguousarray(table.T)
    return dict(zip(units, columns, strict=True)), units


def _reactions(robot: Robot) -> list[Wanted]:
    """Of all joints (121), (122); of those that slide also along and across their line."""

    def wanted(i: int, slides: bool) -> Wanted:
        def values(balance: Balance) -> list[float]:
            force, moment, _, axis = balance.reaction(i)
            turned = force * np.exp(-1j * axis)
            return [force.real, force.imag, moment, *([turned.real, turned.imag] * slides)]

        units = {"x": "N", "y": "N", "moment": "N m"}
        units |= {"along": "N", "across": "N"} if slides else {}
        return Wanted({f"joint/{i + 1}/reaction_{k}": u for k, u in units.items()}, values)

    return [wanted(i, link.joint.type != "R") for i, link in enumerate(robot.links)]


def _along(robot: Robot) -> list[Wanted]:
    """Of all links whose sections are known, at equally spaced places (123), (128)."""

    def wanted(i: int) -> Wanted:
        link = robot.links[i]
        shares = np.linspace(0.0, 1.0, STATIONS)
        stressed = link.bending_stress(np.zeros(1), np.zeros(1)) is not None

        def values(balance: Balance) -> list[float]:
            length = link.length_m
            free = balance.q[balance.structure.rows[i]] if link.joint.type == "Pb" else length
            places = np.minimum(length - free + shares * free, length)
            found = np.array([balance.section(i, float(s)) for s in places])
            out = [*found.T.ravel()]
            if stressed:
                stress = link.bending_stress(found[:, 0], places)
                assert stress is not None
                out += [*stress]
            return out

        units = {"bending_moment": "N m", "shear_force": "N", "axial_force": "N"}
        units |= {"stress": "Pa"} if stressed else {}
        names = {f"link/{i + 1}/{k}/{j}": u for k, u in units.items() for j in range(STATIONS)}
        return Wanted(names, values)

    return [wanted(i) for i in range(len(robot.links)) if sections_known(robot, i)]


def _sensors(robot: Robot) -> list[Wanted]:
    """Of the sensors of forces (123), (128)."""

    def wanted(i: int, sensor: Sensor) -> Wanted:
        def values(balance: Balance) -> list[float]:
            found = balance.section(i, sensor.at_m)
            if sensor.kind != "stress":
                return [getattr(found, sensor.kind)]
            moment, at = np.array([found.bending_moment]), np.array([sensor.at_m])
            stress = robot.links[i].bending_stress(moment, at, sensor.distance_m)
            assert stress is not None
            return [float(stress[0])]

        return Wanted({f"sensor/{sensor.name}": sensor.unit}, values)

    return [
        wanted(i, sensor)
        for i, link in enumerate(robot.links)
        for sensor in link.sensor
        if sensor.kind in FORCE_KINDS
    ]
