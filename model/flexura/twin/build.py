"""A robot built in Exudyn: parts for the links, coordinates for the joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..optional import Optional
from ..robot import Link, Robot
from ..signals import Loads
from .joints import connect
from .joints.mesh import Mesh
from .link_loads import LinkLoads
from .links.ancf import CableLink
from .links.geometrically_exact import GeometricallyExactLink
from .links.part import Frame, Ground, Lump, Part, PointMass
from .links.properties import NEGLIGIBLE, beam_values, link_inertia, total_mass, without_ringing
from .links.rigid import RigidLink

exu = Optional("exudyn")
eii = Optional("exudyn.itemInterface")
NO_LOADS = Loads()
BEAMS = {"ancf": CableLink, "ge": GeometricallyExactLink}


@dataclass(frozen=True)
class TwinModel:
    """An assembled robot in Exudyn.

    `mbs`: Exudyn's system. `parts`, `coordinates`: one entry a link and a joint. `index[i]`:
    indices of part i's coordinates in the system. `slides[i]`: index of the position of a joint
    that slides on a flexible link, `rotors[i]`: of the rotor behind a transmission, else None.
    `reference`: the system's coordinates before any displacement. `container` owns `mbs` and must
    live as long. `loads`: on its links.

    Exudyn's own sum of reference and displacement, GetODE2CoordinatesTotal, corrupts memory from
    about 100 coordinates on (1.13.6).
    """

    robot: Robot
    mbs: Any
    parts: list[Part]
    coordinates: list[connect.Coordinate]
    index: list[np.ndarray]
    slides: list[int | None]
    rotors: list[int | None]
    mesh: Mesh
    reference: np.ndarray
    container: Any
    loads: LinkLoads

    @property
    def reach(self) -> float:
        """The sum of the links' lengths [m]."""
        return reach(self.robot)


def reach(robot: Robot) -> float:
    """The sum of the links' lengths [m], the robot's size; 1 if it is 0."""
    return sum(link.length_m for link in robot.links) or 1.0


def build(
    robot: Robot,
    beam: str,
    mesh: Mesh,
    speeds: np.ndarray,
    gains: np.ndarray,
    guided: np.ndarray | None = None,
    held: bool = False,
    loads: Loads = NO_LOADS,
    since: float = 0.0,
) -> TwinModel:
    """Build a robot, straight at its start.

    Args:
        robot: the robot.
        beam: "ancf" or "ge".
        mesh: elements, hubs and sleeves.
        speeds: joint velocities at the start (n,) [m/s or rad/s].
        gains: of the joints' PD controllers (n, 2).
        guided: which joints follow a prescribed motion (n,); None: none does.
        held: all joints stay at their start.
        loads: forces and moments on links.
        since: the loads' time at Exudyn's time 0 [s].
    """

    container = exu.SystemContainer()
    mbs = container.AddSystem()
    fixed = mbs.AddMarker(
        eii.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(eii.NodePointGround()), coordinate=0)
    )
    scale = total_mass(robot.links, robot.payload) or 1.0
    negligible = NEGLIGIBLE * scale, NEGLIGIBLE * scale * reach(robot) ** 2
    previous: Any = Ground.add(mbs)
    frame, length = Frame(0.0, 0.0, 0.0), 0.0
    parts: list[Part] = []
    coordinates, nodes = [], []
    for i, link in enumerate(robot.links):
        tip, frame = frame.along(length), connect.start_frame(link, frame, length, speeds[i])
        part = _add_link(mbs, robot, i, BEAMS[beam], mesh, frame, negligible)
        on = connect.JointSite(mbs, tip, frame, speeds[i], negligible)
        marker, node = connect.connect(on, link, previous, part, mesh.places[i])
        coordinates.append(
            connect.add_drive_and_friction(
                mbs,
                link.joint,
                marker,
                fixed,
                speeds[i],
                tuple(gains[i]),
                guided is not None and bool(guided[i]),
                held,
            )
        )
        parts.append(part)
        nodes.append(node)
        previous, length = part, link.length_m
    on_links = LinkLoads(mbs, parts, loads, since)
    mbs.Assemble()
    index = [
        np.concatenate([_coordinate_rows(mbs, node, part.width) for node in part.nodes])
        for part in parts
    ]
    slides = [None if node is None else int(mbs.GetNodeODE2Index(node)) for node in nodes]
    rotors = [
        None if joint.rotor is None else int(mbs.GetNodeODE2Index(joint.rotor))
        for joint in coordinates
    ]
    reference = np.array(mbs.systemData.GetODE2Coordinates(exu.ConfigurationType.Reference))
    return TwinModel(
        robot, mbs, parts, coordinates, index, slides, rotors, mesh, reference, container, on_links
    )


def _add_link(
    mbs: Any,
    robot: Robot,
    i: int,
    beam: Any,
    mesh: Mesh,
    frame: Frame,
    negligible: tuple[float, float],
) -> Part:
    """Add link i with its hub, and with what is at its end.

    A rigid link gets at least a `negligible` mass and inertia; its mass matrix would else be
    singular.
    """
    link, last = robot.links[i], i == len(robot.links) - 1
    load = robot.payload
    ending = (
        PointMass(load.mass_kg, load.inertia_kg_m2, *load.centre_of_mass_m)
        if last
        else _hub_on(robot.links[i + 1], "Pb")
    )
    hub = _hub_on(link, "R", "Pa")
    lumps = [Lump(each.at_m, PointMass(each.mass_kg, each.inertia_kg_m2)) for each in link.mass]
    if link.flexible:
        stubs = [mesh.stubs[i]] if any(mesh.stubs[i]) else []
        return beam(
            mbs,
            without_ringing(beam_values(link, mesh.elements[i], robot.rayleigh(i)[1])),
            hub,
            ending,
            frame,
            robot.gravity_m_s2,
            *stubs,
            lumps=lumps,
        )
    inertia = link_inertia(link)
    for at, body in (Lump(0.0, hub), Lump(link.length_m, ending), *lumps):
        inertia = inertia.plus(body.mass, complex(at + body.along, body.across), body.inertia)
    inertia = inertia._replace(
        mass=max(inertia.mass, negligible[0]), inertia=max(inertia.inertia, negligible[1])
    )
    return RigidLink(mbs, link.length_m, inertia, frame, robot.gravity_m_s2)


def _hub_on(link: Link, *types: str) -> PointMass:
    """The hub of a link's joint if that has one of these types, else nothing.

    A Pb's hub, its sleeve, is on the link before.
    """
    joint = link.joint
    return (
        PointMass(joint.hub_mass_kg, joint.hub_inertia_kg_m2, -joint.hub_radius_m)
        if joint.type in types
        else PointMass()
    )


def _coordinate_rows(mbs: Any, node: Any, width: int) -> np.ndarray:
    """Indices of a node's coordinates in the system."""
    first = mbs.GetNodeODE2Index(node)
    return np.arange(first, first + width)
