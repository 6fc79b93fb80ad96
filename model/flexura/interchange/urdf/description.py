"""A URDF file as bodies and joints: what it says, with numbers checked and nothing computed."""

from __future__ import annotations

import math
import os
import xml.etree.ElementTree as ET
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from .xml_file import read_xml

ENDLESS = 1e9  # m, rad, N or N m: what stands for no limit
TYPES = ("revolute", "continuous", "prismatic", "fixed")


@dataclass(frozen=True)
class Inertial:
    """A body's mass [kg], centre (3,) [m] and inertia about it (3, 3) [kg m^2] in some axes."""

    mass: float
    centre: np.ndarray
    inertia: np.ndarray


@dataclass(frozen=True)
class UrdfJoint:
    """A joint: `place` (3,) and `axes` (3, 3) of its frame in the parent's, its unit `axis` (3,) in
    its own frame, its limits [rad or m] and its friction."""

    name: str
    type: str
    parent: str
    child: str
    place: np.ndarray
    axes: np.ndarray
    axis: np.ndarray
    limits: tuple[float, float] | None
    damping: float
    friction: float


@dataclass(frozen=True)
class Urdf:
    """A file: its inertials by link, and its joints in the order of the file.

    `left_out` are what it says and a robot file has no key for.
    """

    file: str
    name: str
    links: dict[str, Inertial]
    joints: list[UrdfJoint]
    left_out: list[str]


def read_description(path: str | os.PathLike[str]) -> Urdf:
    """What a URDF file says.

    Args:
        path: of the file.

    Returns:
        Its bodies and joints.

    Raises:
        InputError: no URDF, a number that is none, a joint of a type that is not read; the message
            names the file and the link or joint.
    """
    return _Reader(os.fspath(path), read_xml(path)).read()


class _Reader:
    """One file while it is read."""

    def __init__(self, file: str, root: ET.Element) -> None:
        self.file, self.root = file, root

    def error(self, key: str, expected: str, value: object = None) -> InputError:
        return InputError(expected, key=key, value=value, file=self.file)

    def read(self) -> Urdf:
        root = self.root
        if root.tag != "robot":
            raise self.error("", f"expected a URDF file, <robot>, not <{root.tag}>")
        if any(e.tag.startswith("xacro:") for e in root.iter()):
            expected = "a xacro file: expected the URDF that `xacro FILE` makes of it"
            raise self.error("", expected)
        links: dict[str, Inertial] = {}
        for element in root.findall("link"):
            name = self.name_of(element, "link")
            if name in links:
                raise self.error(f"link {name}", "expected another name for each link")
            links[name] = self.inertial(element, f"link {name}")
        joints: list[UrdfJoint] = []
        left_out: list[str] = []
        for element in root.findall("joint"):
            joint = self.joint(element, links)
            if any(joint.name == other.name for other in joints):
                raise self.error(f"joint {joint.name}", "expected another name for each joint")
            joints.append(joint)
            limit = element.find("limit")
            if limit is None or joint.type == "fixed":
                continue
            for word in ("effort", "velocity"):
                given = float(self.numbers(limit, word, f"joint {joint.name}", "0")[0])
                if 0 < given < ENDLESS:
                    left_out.append(f"joint {joint.name}: {word} limit {given:g}")
        if not joints:
            raise self.error("", "expected a robot with one joint or more")
        return Urdf(self.file, root.get("name", ""), links, joints, left_out)

    def name_of(self, element: ET.Element, what: str) -> str:
        name = element.get("name")
        if not name:
            raise self.error(what, f"expected a name of each {what}")
        return name

    def numbers(self, element: ET.Element, key: str, where: str, default: str) -> np.ndarray:
        """An attribute of finite numbers, as many as its default has."""
        text, count = element.get(key, default), len(default.split())
        try:
            values = np.array([float(word) for word in text.split()])
        except ValueError:
            values = np.array([])
        if len(values) != count or not np.isfinite(values).all():
            numbers = f"{count} finite numbers" if count > 1 else "a finite number"
            raise self.error(f"{where}: <{element.tag}> {key}", f"expected {numbers}", text)
        return values

    def frame(self, element: ET.Element, where: str) -> tuple[np.ndarray, np.ndarray]:
        """Place (3,) and axes (3, 3) of an element's <origin>."""
        origin = element.find("origin")
        if origin is None:
            return np.zeros(3), np.eye(3)
        place = self.numbers(origin, "xyz", where, "0 0 0")
        return place, axes_of(self.numbers(origin, "rpy", where, "0 0 0"))

    def inertial(self, link: ET.Element, where: str) -> Inertial:
        element = link.find("inertial")
        if element is None:
            return Inertial(0.0, np.zeros(3), np.zeros((3, 3)))
        place, axes = self.frame(element, where)
        mass, inertia = element.find("mass"), element.find("inertia")
        if mass is None:
            raise self.error(f"{where}: <inertial>", "expected a <mass> in it")
        value = float(self.numbers(mass, "value", where, "nan")[0])
        if value < 0:
            raise self.error(f"{where}: mass", "expected a mass of 0 or more", value)
        own = np.zeros((3, 3))
        if inertia is not None:
            for i, j, key in ((0, 0, "ixx"), (1, 1, "iyy"), (2, 2, "izz")):
                own[i, j] = self.numbers(inertia, key, where, "nan")[0]
            for i, j, key in ((0, 1, "ixy"), (0, 2, "ixz"), (1, 2, "iyz")):
                own[i, j] = own[j, i] = self.numbers(inertia, key, where, "0")[0]
        return Inertial(value, place, axes @ own @ axes.T)

    def joint(self, element: ET.Element, links: dict[str, Inertial]) -> UrdfJoint:
        name, kind = self.name_of(element, "joint"), element.get("type", "")
        where = f"joint {name}"
        if kind not in TYPES:
            why = f"expected one of {', '.join(TYPES)}: the robot is a planar chain"
            raise self.error(f"{where}: type", why, kind)
        if element.find("mimic") is not None:
            raise self.error(f"{where}: <mimic>", "expected a joint that moves by itself")
        parent, child = (self.end(element, tag, where, links) for tag in ("parent", "child"))
        place, axes = self.frame(element, where)
        given = element.find("axis")
        given = ET.Element("axis", xyz="1 0 0") if given is None else given
        axis = self.numbers(given, "xyz", where, "1 0 0")
        length = float(np.linalg.norm(axis))
        if kind != "fixed" and not length > 1e-6:
            raise self.error(f"{where}: <axis> xyz", "expected a direction", given.get("xyz"))
        axis = axis / length if kind != "fixed" else axis
        dynamics = element.find("dynamics")
        damping, friction = 0.0, 0.0
        if dynamics is not None:
            damping = float(self.numbers(dynamics, "damping", where, "0")[0])
            friction = float(self.numbers(dynamics, "friction", where, "0")[0])
        limits = self.limits(element, kind, where)
        return UrdfJoint(name, kind, parent, child, place, axes, axis, limits, damping, friction)

    def end(self, joint: ET.Element, tag: str, where: str, links: dict[str, Inertial]) -> str:
        """The name of a joint's parent or child, which is one of the links."""
        element = joint.find(tag)
        link = None if element is None else element.get("link")
        if link == "world" and link not in links:  # some programs know it without a word
            links[link] = Inertial(0.0, np.zeros(3), np.zeros((3, 3)))
        if link is None or link not in links:
            raise self.error(f"{where}: <{tag}>", "expected the name of a link", link)
        return link

    def limits(self, joint: ET.Element, kind: str, where: str) -> tuple[float, float] | None:
        limit = joint.find("limit")
        if kind in ("continuous", "fixed") or (limit is None and kind == "revolute"):
            return None
        if limit is None:
            raise self.error(f"{where}: <limit>", "missing: expected how far the joint slides")
        low, high = (float(self.numbers(limit, k, where, "0")[0]) for k in ("lower", "upper"))
        if not low < high:
            expected = "expected lower below upper; a joint that does not move is of type fixed"
            raise self.error(f"{where}: <limit>", expected, [low, high])
        return None if low <= -ENDLESS and high >= ENDLESS else (low, high)


def axes_of(rpy: np.ndarray) -> np.ndarray:
    """The axes (3, 3) of a frame that is turned by roll, pitch and yaw [rad] about fixed axes."""
    (a, b, c), (s, t, u) = (np.array([f(x) for x in rpy]) for f in (math.cos, math.sin))
    return np.array(
        [
            [c * b, c * t * s - u * a, c * t * a + u * s],
            [u * b, u * t * s + c * a, u * t * a - c * s],
            [-t, b * s, b * a],
        ]
    )
