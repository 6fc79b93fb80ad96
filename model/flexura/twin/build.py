"""The robot built in Exudyn: parts for the links, coordinates for the joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..optional import Optional
from ..robot import Link, Robot
from .joints import connect
from .joints.mesh import Mesh
from .links.ancf import CableLink
from .links.geometrically_exact import ExactLink
from .links.part import Frame, Ground, Lump, Part
from .links.properties import VANISHING, beam_values, link_inertia, total_mass
from .links.rigid import RigidLink

exu = Optional("exudyn")
eii = Optional("exudyn.itemInterface")

BEAMS = {"ancf": CableLink, "ge": ExactLink}


@dataclass(frozen=True)
class Chain:
    """An assembled robot: `mbs` is Exudyn's system, `parts` and `coordinates` have one entry a link
    and joint.

    `index[i]` are the places of part i's coordinates among the system's, `slides[i]` that of the
    position of a joint that slides on a flexible link (None for others), `reference` the system's
    coordinates before any displacement (Exudyn's own sum of both, GetODE2CoordinatesTotal, corrupts
    memory from about 100 coordinates on in 1.13.6). `container` owns `mbs` and must live as long.
    """

    robot: Robot
    mbs: Any
    parts: list[Part]
    coordinates: list[connect.Coordinate]
    index: list[np.ndarray]
    slides: list[int | None]
    mesh: Mesh
    reference: np.ndarray
    container: Any

    @property
    def reach(self) -> float:
        return reach(self.robot)


def reach(robot: Robot) -> float:
    """The sum of the links' lengths [m], the robot's size; 1 where none has any."""
    return sum(link.length_m for link in robot.links) or 1.0


def build(robot: Robot, beam: str, mesh: Mesh, speeds: np.ndarray, gains: np.ndarray) -> Chain:
    """The robot straight at its start, its joints at `speeds` (n,), with PD controllers of `gains`
    (n, 2)."""

    container = exu.SystemContainer()
    mbs = container.AddSystem()
    fixed = mbs.AddMarker(
        eii.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(eii.NodePointGround()), coordinate=0)
    )
    scale = total_mass(robot.links, robot.payload) or 1.0
    tiny = VANISHING * scale, VANISHING * scale * reach(robot) ** 2
    previous: Any = Ground.add(mbs)
    frame, length = Frame(0.0, 0.0, 0.0), 0.0
    parts: list[Part] = []
    coordinates, nodes = [], []
    for i, link in enumerate(robot.links):
        tip, frame = frame.along(length), connect.start_frame(link, frame, length, speeds[i])
        part = _part(mbs, robot, i, BEAMS[beam], mesh, frame, tiny)
        on = connect.Site(mbs, tip, frame, speeds[i], tiny)
        marker, node = connect.connect(on, link, previous, part, mesh.places[i])
        coordinates.append(
            connect.equip(mbs, link.joint, marker, fixed, speeds[i], tuple(gains[i]))
        )
        parts.append(part)
        nodes.append(node)
        previous, length = part, link.length_m
    mbs.Assemble()
    index = [
        np.concatenate([_places(mbs, node, part.width) for node in part.nodes]) for part in parts
    ]
    slides = [None if node is None else int(mbs.GetNodeODE2Index(node)) for node in nodes]
    reference = np.array(mbs.systemData.GetODE2Coordinates(exu.ConfigurationType.Reference))
    return Chain(robot, mbs, parts, coordinates, index, slides, mesh, reference, container)


def _part(
    mbs: Any, robot: Robot, i: int, beam: Any, mesh: Mesh, frame: Frame, tiny: tuple[float, float]
) -> Part:
    link, last = robot.links[i], i == len(robot.links) - 1
    ending = (
        Lump(robot.payload.mass_kg, robot.payload.inertia_kg_m2)
        if last
        else _hub(robot.links[i + 1], "Pb")
    )
    hub = _hub(link, "R", "Pa")
    if link.flexible:
        stubs = [mesh.stubs[i]] if any(mesh.stubs[i]) else []
        return beam(
            mbs, beam_values(link, mesh.elements[i]), hub, ending, frame, robot.gravity_m_s2, *stubs
        )
    inertia = (
        link_inertia(link)
        .plus(hub.mass, 0.0, hub.inertia)
        .plus(ending.mass, link.length_m, ending.inertia)
    )
    inertia = inertia._replace(
        mass=max(inertia.mass, tiny[0]), inertia=max(inertia.inertia, tiny[1])
    )
    return RigidLink(
        mbs, link.length_m, inertia, frame, robot.gravity_m_s2
    )  # without any its mass matrix would be singular


def _hub(link: Link, *types: str) -> Lump:
    """The hub of a link's joint if that is of these types, else nothing: a Pb's, its sleeve, is on
    the link before."""
    joint = link.joint
    return Lump(joint.hub_mass_kg, joint.hub_inertia_kg_m2) if joint.type in types else Lump()


def _places(mbs: Any, node: Any, width: int) -> np.ndarray:
    first = mbs.GetNodeODE2Index(node)
    return np.arange(first, first + width)
