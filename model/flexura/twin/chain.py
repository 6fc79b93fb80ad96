"""The robot built in Exudyn: parts for the links, coordinates for the joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..robot import Link, Robot
from . import joints, sliding
from .ancf import CableLink
from .exact import ExactLink
from .part import Frame, Ground, Lump, Part
from .properties import VANISHING, beam_values, rigid_inertia, total_mass, uniform
from .rigid import RigidLink

MIN_ELEMENTS = 8
MIN_ELEMENTS_SLIDING = 16
HUB = 1.5  # length of a hub in elements: shorter ones are made stiffer by the mesh, unevenly
MIN_ELEMENTS_TAPERED = 24  # each is uniform: 3e-3 of the deflection at 8, 4e-4 at 24 for EI falling to a quarter
BEAMS = {"ancf": CableLink, "ge": ExactLink}


@dataclass(frozen=True)
class Chain:
    """An assembled robot: `mbs` is Exudyn's system, `parts` and `coordinates` have one entry a link and joint.

    `index[i]` are the places of part i's coordinates among the system's, `slides[i]` that of the position of a joint that
    slides on a flexible link and `hubs[i]` the length of its hub [m] (None for others), `reference` the system's coordinates before any
    displacement (Exudyn's own sum of both, GetODE2CoordinatesTotal, corrupts memory from about 100 coordinates on in
    1.13.6), `elements` the beam elements of each link,
    `container` owns `mbs` and must live as long.
    """

    robot: Robot
    mbs: Any
    parts: list[Part]
    coordinates: list[joints.Coordinate]
    index: list[np.ndarray]
    slides: list[int | None]
    hubs: list[float | None]
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
        _refuse_start(robot, i, link)


def _refuse_start(robot: Robot, i: int, link: Link) -> None:
    joint, key = link.joint, f"link[{i}].joint.start"
    if joint.type == "Pb" and not 0 < joint.start <= link.length_m:
        expected = f"expected the free length at the start, above 0 and at most the link's length, {link.length_m:g} m"
        raise InputError(expected, key=key, value=joint.start)
    if slides_on(robot, i - 1) and joint.type == "Pa" and not 0 <= joint.start <= robot.links[i - 2].length_m:
        expected = f"expected a place on the link that it slides along, from 0 to {robot.links[i - 2].length_m:g} m"
        raise InputError(expected, key=key, value=joint.start)


def slides_on(robot: Robot, i: int) -> Link | None:
    """The flexible link that joint i (from 0) slides on: the one before a Pa, its own for a Pb; None: on none."""
    link = robot.links[i]
    if link.joint.type == "Pb" and link.flexible:
        return link
    before = robot.links[i - 1] if i else None
    return before if link.joint.type == "Pa" and before is not None and before.flexible else None


def element_counts(robot: Robot, elements: int | None) -> list[int]:
    """Elements of each link in the twin: `elements` if given, else twice the robot file's and at least 8, 16 if a joint slides
    on it, 24 if it tapers; 0 for a rigid link."""
    slid = [id(slides_on(robot, i)) for i in range(len(robot.links))]

    def count(link: Link) -> int:
        if not link.flexible or elements is not None:
            return (elements or 0) * link.flexible
        least = MIN_ELEMENTS_SLIDING if id(link) in slid else MIN_ELEMENTS
        return max(least if uniform(link) else MIN_ELEMENTS_TAPERED, 2 * link.elements)

    return [count(link) for link in robot.links]


def hub_lengths(robot: Robot, counts: list[int], given: float | None) -> list[float | None]:
    """Lengths of the hubs and of the sleeves' spans [m], where a joint slides on a flexible link: `given`, or HUB elements."""
    out: list[float | None] = []
    for i in range(len(robot.links)):
        beam = slides_on(robot, i)
        span = None if beam is None else HUB * beam.length_m / counts[i if beam is robot.links[i] else i - 1]
        out.append(span if span is None or given is None else given)
    return out


class _Builder:
    """Builds a robot link by link; only `build` uses it."""

    def __init__(self, robot: Robot, beam: str, counts: list[int], hubs: list[float | None]) -> None:
        import exudyn as exu
        from exudyn import itemInterface as eii

        self.robot, self.beam, self.counts, self.hubs = robot, BEAMS[beam], counts, hubs
        self.container = exu.SystemContainer()
        self.mbs = self.container.AddSystem()
        self.ground = Ground.add(self.mbs)
        self.fixed = self.mbs.AddMarker(
            eii.MarkerNodeCoordinate(nodeNumber=self.mbs.AddNode(eii.NodePointGround()), coordinate=0)
        )
        scale = total_mass(robot.links, robot.payload) or 1.0
        self.tiny = VANISHING * scale, VANISHING * scale * reach(robot) ** 2

    def part(self, i: int, frame: Frame) -> Part:
        robot, link, last = self.robot, self.robot.links[i], i == len(self.robot.links) - 1
        ending = Lump(robot.payload.mass_kg, robot.payload.inertia_kg_m2) if last else _sleeve(robot.links[i + 1])
        if link.flexible:
            hub = Lump() if link.joint.type == "Pb" else Lump(link.joint.hub_mass_kg, link.joint.hub_inertia_kg_m2)
            values = beam_values(link, self.counts[i])
            stubs = self._stubs(i)
            return self.beam(self.mbs, values, hub, ending, frame, robot.gravity_m_s2, *([stubs] if any(stubs) else []))
        inertia = rigid_inertia(link, None).plus(ending.mass, link.length_m, ending.inertia)
        inertia = inertia._replace(mass=max(inertia.mass, self.tiny[0]), inertia=max(inertia.inertia, self.tiny[1]))
        return RigidLink(self.mbs, link.length_m, inertia, frame, robot.gravity_m_s2)  # no mass at all would be singular

    def _stubs(self, i: int) -> tuple[float, float]:
        """How far points of a sleeve and of a hub may stand off link i's ends [m]."""
        own = self._places(i) if slides_on(self.robot, i) is self.robot.links[i] else np.zeros(1)
        follows = i + 1 < len(self.robot.links) and slides_on(self.robot, i + 1) is self.robot.links[i]
        places = np.concatenate([own, self._places(i + 1) if follows else np.zeros(1)])
        return float(-places.min()), float(places.max())

    def _places(self, i: int) -> np.ndarray:
        delta, link = self.hubs[i], self.robot.links[i]
        assert delta is not None
        return sliding.sleeve_places(delta, link.length_m) if link.joint.type == "Pb" else sliding.hub_places(delta)

    def joint(self, i: int, previous: Any, part: Any, frames: tuple[Frame, Frame], speed: float) -> tuple[Any, Any]:
        """Connect link i, at frames[1], to the one before, at frames[0]; returns the coordinate's marker and node, or None."""
        link, (before, mine) = self.robot.links[i], frames
        length = self.robot.links[i - 1].length_m if i else 0.0
        joint, mbs, tip = link.joint, self.mbs, before.along(length)
        if slides_on(self.robot, i) is None:
            if joint.type == "Pb":
                previous = Ground(sliding.rigid(mbs, previous.tip, tip, self.tiny), previous.origin)
            return joints.connect(mbs, link, previous, part), None
        places = self._places(i)
        if joint.type == "Pa":
            hub = sliding.rigid(mbs, part.origin, mine, self.tiny)
            line = mine.along(0.0, turn=-joint.angle_rad)
            node = sliding.hold(
                mbs, hub, -joint.angle_rad, line, previous, places, 0.0, joint.start, speed, self.tiny
            )
            return sliding.marker_of(mbs, node), node
        sleeve = sliding.rigid(mbs, previous.tip, tip, self.tiny)
        line = tip.along(0.0, turn=joint.angle_rad)
        node = sliding.hold(
            mbs, sleeve, joint.angle_rad, line, part, places, link.length_m, -joint.start, -speed, self.tiny
        )
        node = sliding.reversed_coordinate(mbs, node, joint.start, speed)
        return sliding.marker_of(mbs, node), node


def _sleeve(following: Link) -> Lump:
    """The sleeve of the joint after a link's tip, where that is a Pb."""
    joint = following.joint
    return Lump(joint.hub_mass_kg, joint.hub_inertia_kg_m2) if joint.type == "Pb" else Lump()


def build(
    robot: Robot, beam: str, elements: int | None, speeds: np.ndarray, gains: np.ndarray, hub_length_m: float | None = None
) -> Chain:
    """The robot straight at its start, its joints at `speeds` (n,), with PD controllers of `gains` (n, 2).

    `hub_length_m`: of each hub and sleeve on a flexible link; None: HUB of the link's elements.
    """
    import exudyn as exu

    refuse(robot)
    counts = element_counts(robot, elements)
    hubs = hub_lengths(robot, counts, hub_length_m)
    new = _Builder(robot, beam, counts, hubs)
    mbs = new.mbs
    previous: Any = new.ground
    frame, length = Frame(0.0, 0.0, 0.0), 0.0
    parts: list[Part] = []
    coordinates, nodes = [], []
    for i, link in enumerate(robot.links):
        before, frame = frame, joints.start_frame(link, frame, length, speeds[i])
        part = new.part(i, frame)
        marker, node = new.joint(i, previous, part, (before, frame), speeds[i])
        coordinates.append(joints.equip(mbs, link.joint, marker, new.fixed, speeds[i], tuple(gains[i])))
        parts.append(part)
        nodes.append(node)
        previous, length = part, link.length_m
    mbs.Assemble()
    index = [np.concatenate([_places(mbs, node, part.width) for node in part.nodes]) for part in parts]
    slides = [None if node is None else int(mbs.GetNodeODE2Index(node)) for node in nodes]
    reference = np.array(mbs.systemData.GetODE2Coordinates(exu.ConfigurationType.Reference))
    return Chain(robot, mbs, parts, coordinates, index, slides, hubs, reference, counts, new.container)


def _places(mbs: Any, node: Any, width: int) -> np.ndarray:
    first = mbs.GetNodeODE2Index(node)
    return np.arange(first, first + width)
