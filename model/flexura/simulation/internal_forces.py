"""The forces within a robot over a run: of its joints and along its links."""

from __future__ import annotations

import numpy as np

from ..io import STATIONS
from ..robot import Link, Robot
from ..system import Balance, RunStates, SectionForces, sections_known


def force_channels(states: RunStates) -> dict[str, np.ndarray]:
    """The reactions of all joints, and the forces along all links.

    Args:
        states: the states of a run (T,).

    Returns:
        Values (T,) by channel, in the order of `force_units`.

    Raises:
        InputError: a robot that slides from node to node.
    """
    values = _joint_values(states.balance) + _link_values(states.balance)
    return dict(zip(force_units(states.system.robot), values, strict=True))


def force_units(robot: Robot) -> dict[str, str]:
    """The channels of the forces within a robot.

    Args:
        robot: the robot.

    Returns:
        Units by channel, in the order of the channels.
    """
    units: dict[str, str] = {}
    for i, link in enumerate(robot.links, 1):
        own = {"x": "N", "y": "N", "moment": "N m"}
        own |= {"along": "N", "across": "N"} if link.joint.type != "R" else {}
        units |= {f"joint/{i}/reaction_{name}": unit for name, unit in own.items()}
    for i, link in enumerate(robot.links, 1):
        if sections_known(robot, i - 1):
            own = {"bending_moment": "N m", "shear_force": "N", "axial_force": "N"}
            own |= {"stress": "Pa"} if _stressed(link) else {}
            units |= {
                f"link/{i}/{name}/{k}": unit for name, unit in own.items() for k in range(STATIONS)
            }
    return units


def _joint_values(balance: Balance) -> list[np.ndarray]:
    """Of all joints (139), (140); of those that slide also along and across their line."""
    out = []
    for i, link in enumerate(balance.robot.links):
        force, moment, _, axis = balance.reaction(i)
        out += [force.real, force.imag, moment]
        if link.joint.type != "R":
            turned = force * np.exp(-1j * axis)
            out += [turned.real, turned.imag]
    return out


def _link_values(balance: Balance) -> list[np.ndarray]:
    """Of all links whose sections are known (141), (146): at equally spaced places, of a link in a
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


def _stressed(link: Link) -> bool:
    """Whether a link's section has a height, and so an outer fibre."""
    return link.bending_stress(0.0, 0.0) is not None
