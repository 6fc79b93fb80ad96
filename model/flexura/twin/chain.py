"""The robot built in Exudyn: parts for the links, coordinates for the joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..robot import Link, Robot
from . import joints
from .ancf import CableLink
from .exact import ExactLink
from .part import Frame, Ground, Lump, Part
from .properties import VANISHING, beam_values, rigid_inertia, total_mass, uniform
from .rigid import RigidLink

MIN_ELEMENTS = 8
MIN_ELEMENTS_TAPERED = 24  # each is uniform: 3e-3 of the deflection at 8, 4e-4 at 24 for EI falling to a quarter
BEAMS = {"ancf": CableLink, "ge": ExactLink}


@dataclass(frozen=True)
class Chain:
    """An assembled robot: `mbs` is Exudyn's system, `parts` and `coordinates` have one entry a link and joint.

    `index[i]` are the places of part i's coordinates among the system's, `reference` the system's coordinates before any
    displacement (Exudyn's own sum of both, GetODE2CoordinatesTotal, corrupts memory from about 100 coordinates on in
    1.13.6), `elements` the beam elements of each link,
    `container` owns `mbs` and must live as long.
    """

    robot: Robot
    mbs: Any
    parts: list[Part]
    coordinates: list[joints.Coordinate]
    index: list[np.ndarray]
    reference: np.ndarray
    elements: list[int]
    container: Any

    @property
    def reach(self) -> float:
        return reach(self.robot)


def reach(robot: Robot) -> float:
    """The sum of the links' lengths [m], the robot's size; 1 where none has any."""
    return sum(link.length_m for link in robot.links) or 1.0


def refuse(robot: Robot) -> None:
    """Raise InputError for what the twin doesn't contain."""
    if not robot.stiffening:
        expected = "the twin always contains geometric stiffening; compare with stiffening = true"
        raise InputError(expected, key="stiffening", value=False)
    for i, link in enumerate(robot.links, 1):
        if link.damping.alpha_1_s:
            raise InputError(
                "expected 0: damping in proportion to mass has no counterpart in the twin; use beta_s",
                key=f"link[{i}].damping.alpha_1_s", value=link.damping.alpha_1_s,
            )  # fmt: skip
        if link.joint.type == "Pb":
            raise InputError(
                "the twin does not contain joints Pb yet; it has R anywhere, and Pa on the base or on a rigid link",
                key=f"link[{i}].joint.type", value="Pb",
            )  # fmt: skip
        if link.joint.type == "Pa" and i > 1 and robot.links[i - 2].flexible:
            raise InputError(
                "the twin does not contain Pa on a flexible link yet; it has R anywhere, and Pa on the base or on a rigid link",
                key=f"link[{i}].joint.type", value="Pa",
            )  # fmt: skip


def element_count(link: Link, elements: int | None) -> int:
    """Elements of a link in the twin: `elements` if given, else twice the robot file's and at least 8, or 24 if it tapers."""
    if not link.flexible:
        return 0
    least = MIN_ELEMENTS if uniform(link) else MIN_ELEMENTS_TAPERED
    return max(least, 2 * link.elements) if elements is None else elements


def build(
    robot: Robot, beam: str, elements: int | None, speeds: np.ndarray, gains: np.ndarray
) -> Chain:
    """The robot straight at its start, its joints at `speeds` (n,), with PD controllers of `gains` (n, 2)."""
    import exudyn as exu
    from exudyn import itemInterface as eii

    refuse(robot)
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    ground = Ground.add(mbs)
    fixed = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(eii.NodePointGround()), coordinate=0))
    previous: Any = ground
    frame, length = Frame(0.0, 0.0, 0.0), 0.0
    parts: list[Part] = []
    coordinates = []
    counts = [element_count(link, elements) for link in robot.links]
    for i, link in enumerate(robot.links):
        frame = joints.start_frame(link.joint, frame, length, speeds[i])
        part = _part(mbs, robot, i, BEAMS[beam], counts[i], frame)
        marker = joints.connect(mbs, link.joint, previous, part)
        coordinates.append(joints.equip(mbs, link.joint, marker, fixed, speeds[i], tuple(gains[i])))
        parts.append(part)
        previous, length = part, link.length_m
    mbs.Assemble()
    index = [np.concatenate([_places(mbs, node, part) for node in part.nodes]) for part in parts]
    reference = np.array(mbs.systemData.GetODE2Coordinates(exu.ConfigurationType.Reference))
    return Chain(robot, mbs, parts, coordinates, index, reference, counts, container)


def _part(mbs: Any, robot: Robot, i: int, beam: Any, count: int, frame: Frame) -> Part:
    link, last = robot.links[i], i == len(robot.links) - 1
    if link.flexible:
        hub = Lump(link.joint.hub_mass_kg, link.joint.hub_inertia_kg_m2)
        payload = Lump(robot.payload.mass_kg, robot.payload.inertia_kg_m2) if last else Lump()
        return beam(mbs, beam_values(link, count), hub, payload, frame, robot.gravity_m_s2)
    inertia = rigid_inertia(link, robot.payload if last else None)
    scale = total_mass(robot.links, robot.payload) or 1.0
    inertia = inertia._replace(
        mass=max(inertia.mass, VANISHING * scale), inertia=max(inertia.inertia, VANISHING * scale * reach(robot) ** 2)
    )  # a body without mass or inertia would leave Exudyn's mass matrix singular
    return RigidLink(mbs, link.length_m, inertia, frame, robot.gravity_m_s2)


def _places(mbs: Any, node: Any, part: Part) -> np.ndarray:
    first = mbs.GetNodeODE2Index(node)
    return np.arange(first, first + part.width)
