"""The forces within a robot over a run: of its joints, along its links, and of its sensors."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...io import STATIONS
from ...robot import FORCE_KINDS, Link, Robot
from ...signals import Loads
from ..system import System
from .cuts import Balance, ExternalLoad, SectionForces
from .internal_forces import check_continuous, sections_known

ROWS = 500  # times in one sweep, which bounds the memory it takes


def force_channels(
    system: System,
    t: np.ndarray,
    q: np.ndarray,
    qd: np.ndarray,
    qdd: Callable[[], np.ndarray],
    loads: Loads,
    everything: bool,
) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """The channels of forces within the robot: those of its sensors, and if asked for all.

    Args:
        system: the robot.
        t: times (T,) [s].
        q: configurations (T, n).
        qd: their rates (T, n).
        qdd: gives their accelerations (T, n).
        loads: forces and moments on links.
        everything: also the reactions of all joints, and the forces along all links.

    Returns:
        Values (T,) and units by channel.

    Raises:
        InputError: a robot that slides from node to node.
    """
    units = force_units(system.robot, everything)
    if not units:
        return {}, {}
    check_continuous(system)
    states, parts = (q, qd, qdd()), []
    for first in range(0, max(len(q), 1), ROWS):
        here, rates, more = (x[first : first + ROWS] for x in states)
        acting = _external_loads(loads, t[first : first + ROWS])
        balance = Balance(system.assembly.structure, here, rates, more, acting)
        found = (_joint_values(balance) + _link_values(balance)) if everything else []
        parts.append(np.array(found + _sensor_values(balance)))
    columns = np.concatenate(parts, axis=1)
    return dict(zip(units, columns, strict=True)), units


def force_units(robot: Robot, everything: bool) -> dict[str, str]:
    """Units by channel of the forces within a robot, in the order of the channels.

    Args:
        robot: the robot.
        everything: also of all joints and along all links, not of its sensors alone.

    Returns:
        Units by channel.
    """
    units: dict[str, str] = {}
    for i, link in enumerate(robot.links if everything else (), 1):
        own = {"x": "N", "y": "N", "moment": "N m"}
        own |= {"along": "N", "across": "N"} if link.joint.type != "R" else {}
        units |= {f"joint/{i}/reaction_{name}": unit for name, unit in own.items()}
    for i, link in enumerate(robot.links if everything else (), 1):
        if sections_known(robot, i - 1):
            own = {"bending_moment": "N m", "shear_force": "N", "axial_force": "N"}
            own |= {"stress": "Pa"} if _stressed(link) else {}
            units |= {
                f"link/{i}/{name}/{k}": unit for name, unit in own.items() for k in range(STATIONS)
            }
    sensors = [s for link in robot.links for s in link.sensor if s.kind in FORCE_KINDS]
    return units | {f"sensor/{s.name}": s.unit for s in sensors}


def _external_loads(loads: Loads, t: np.ndarray) -> list[ExternalLoad]:
    """The loads at times t (T,)."""
    values = np.array([loads.values(float(at)) for at in t]).reshape(len(t), -1, 3)
    return [
        ExternalLoad(int(link), at, own[:, 0] + 1j * own[:, 1], own[:, 2], bool(turns))
        for (link, at, turns), own in zip(loads.rows, values.transpose(1, 0, 2), strict=True)
    ]


def _joint_values(balance: Balance) -> list[np.ndarray]:
    """Of all joints (121), (122); of those that slide also along and across their line."""
    out = []
    for i, link in enumerate(balance.robot.links):
        force, moment, _, axis = balance.reaction(i)
        out += [force.real, force.imag, moment]
        if link.joint.type != "R":
            turned = force * np.exp(-1j * axis)
            out += [turned.real, turned.imag]
    return out


def _link_values(balance: Balance) -> list[np.ndarray]:
    """Of all links whose sections are known (123), (128): at equally spaced places, of a link in a
    sleeve on its free length."""
    out = []
    for i, link in enumerate(balance.robot.links):
        if not sections_known(balance.robot, i):
            continue
        ahead, length = balance.motions[i].ahead.value, link.length_m
        places = [
            np.minimum(share * (length + ahead) - ahead, length)
            for share in np.linspace(0.0, 1.0, STATIONS)
        ]
        found = [balance.section(i, s) for s in places]
        out += [getattr(each, name) for name in SectionForces._fields for each in found]
        if _stressed(link):
            out += [link.bending_stress(f[0], s) for f, s in zip(found, places, strict=True)]
    return out


def _sensor_values(balance: Balance) -> list[np.ndarray]:
    """Of the sensors of forces (123), (128)."""
    out = []
    for i, link in enumerate(balance.robot.links):
        for sensor in link.sensor:
            if sensor.kind in FORCE_KINDS:
                found = balance.section(i, sensor.at_m)
                if sensor.kind == "stress":
                    out.append(
                        link.bending_stress(found.bending_moment, sensor.at_m, sensor.distance_m)
                    )
                else:
                    out.append(getattr(found, sensor.kind))
    return out


def _stressed(link: Link) -> bool:
    """Whether a link's section has a height, and so an outer fibre."""
    return link.bending_stress(0.0, 0.0) is not None
