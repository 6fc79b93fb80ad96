"""A URDF file of a robot: its rigid bodies, in a plane."""

from __future__ import annotations

import cmath
import math
import xml.etree.ElementTree as ET

import numpy as np

from ...errors import InputError
from ...link.section import material
from ...robot import Robot, robot_of
from ...system import RobotLike
from ...system.structure import rigid_body
from .description import ENDLESS
from .plane import GRAVITY, Mass


def urdf(robot: RobotLike) -> tuple[str, list[str]]:
    """A robot as a URDF file.

    Without gravity the chain lies level, in the plane of x and y. With gravity it stands in that
    of x and z and turns about -y, and gravity points down. Links that bend become rigid ones with
    their straight line's mass. Locked joints are fixed at their start. Positions of joints are
    those of the robot. The link `tip` is at the tip.

    Args:
        robot: a Robot, a System, or the path or name of a robot file.

    Returns:
        The file's text, and what it does not say of the robot.

    Raises:
        InputError: it is no robot; a link has a name of another link.
    """
    described = robot_of(robot)
    return _Writer(described).write()


class _Writer:
    """One file while it is written."""

    def __init__(self, robot: Robot) -> None:
        self.robot, self.left_out = robot, list[str]()
        self.root = ET.Element("robot", name=robot.name or "robot")
        self.level = not any(robot.gravity_m_s2)
        self.names = ["base"]
        for i, link in enumerate(robot.links, 1):
            name = link.name or f"link_{i}"
            if name in (*self.names, "tip", "world"):
                expected = "expected another name for each link, not base, tip or world"
                raise InputError(expected, key=f"link[{i}].name", value=name)
            self.names.append(name)

    def write(self) -> tuple[str, list[str]]:
        robot, bodies = self.robot, self.bodies()
        gravity = complex(*robot.gravity_m_s2)
        down = 0.0 if self.level else cmath.phase(gravity * 1j)  # turned from -y
        if not self.level and not math.isclose(abs(gravity), GRAVITY, rel_tol=1e-9):
            self.left_out.append(f"gravity of {abs(gravity):g} m/s^2: programs take {GRAVITY}")
        if down:
            ET.SubElement(self.root, "link", name="world")
        for name, parts in zip(self.names, bodies, strict=True):
            link = ET.SubElement(self.root, "link", name=name)
            mass = _joined(parts)
            if mass.mass > 0 or mass.inertia > 0:
                self.inertial(link, mass)
        ET.SubElement(self.root, "link", name="tip")
        if down:
            self.frame("world_joint", "fixed", ("world", "base"), 0j, -down)
        for i in range(len(robot.links)):
            self.joint(i)
        end = self.end_of(len(robot.links) - 1)
        self.frame("tip_joint", "fixed", (self.names[-1], "tip"), end, 0.0)
        ET.indent(self.root)
        text = ET.tostring(self.root, encoding="unicode")
        return f'<?xml version="1.0"?>\n{text}\n', self.left_out

    def frame(
        self, name: str, kind: str, ends: tuple[str, str], place: complex, angle: float
    ) -> ET.Element:
        """A joint between a parent and a child, at a place and an angle in the parent's plane."""
        element = ET.SubElement(self.root, "joint", name=name, type=kind)
        ET.SubElement(element, "parent", link=ends[0])
        ET.SubElement(element, "child", link=ends[1])
        turn = f"0 0 {angle + 0.0!r}" if self.level else f"0 {0.0 - angle!r} 0"
        ET.SubElement(element, "origin", xyz=self.xyz(place), rpy=turn)
        return element

    def xyz(self, place: complex) -> str:
        """A place of the plane, x + iy, without -0.0."""
        x, y = place.real + 0.0, place.imag + 0.0
        return f"{x!r} {y!r} 0" if self.level else f"{x!r} 0 {y!r}"

    def bodies(self) -> list[list[Mass]]:
        """The masses of the base and of each link, in the axes of its URDF frame."""
        out: list[list[Mass]] = [[]]
        for i, link in enumerate(self.robot.links):
            joint, root = link.joint, self.root_of(i)
            parts = [_moved(part, root) for part in _own(self.robot, i)]
            hub = Mass(joint.hub_mass_kg, 0j, joint.hub_inertia_kg_m2)
            if joint.type == "Pb":  # the sleeve is the link's before
                out[-1].append(_moved(hub, self.end_of(i - 1)))
            else:
                parts.append(hub)
            out.append(parts)
            if link.flexible:
                self.left_out.append(f"link {self.names[i + 1]} bends: it is written as rigid")
        load = self.robot.payload
        parts = [Mass(load.mass_kg, complex(*load.centre_of_mass_m), load.inertia_kg_m2)]
        out[-1] += [_moved(part, self.end_of(len(self.robot.links) - 1)) for part in parts]
        out[0] = []  # of the base nothing moves
        return out

    def root_of(self, i: int) -> complex:
        """The proximal end of a link's line in its URDF frame: of a link in a sleeve the frame is
        at its tip, of another one on the axis of its joint."""
        link = self.robot.links[i]
        return complex(-link.length_m if link.joint.type == "Pb" else link.joint.hub_radius_m)

    def end_of(self, i: int) -> complex:
        """The tip of a link in its URDF frame."""
        return self.root_of(i) + self.robot.links[i].length_m if i >= 0 else 0j

    def inertial(self, link: ET.Element, mass: Mass) -> None:
        element = ET.SubElement(link, "inertial")
        ET.SubElement(element, "origin", xyz=self.xyz(mass.centre), rpy="0 0 0")
        ET.SubElement(element, "mass", value=repr(mass.mass))
        about = repr(mass.inertia)  # about the normal; half of it is the least of the others
        half = repr(0.5 * mass.inertia)
        zero = {"ixy": "0", "ixz": "0", "iyz": "0"}
        normal = "izz" if self.level else "iyy"
        axes = dict.fromkeys(("ixx", "iyy", "izz"), half) | {normal: about}
        ET.SubElement(element, "inertia", axes | zero)

    def joint(self, i: int) -> None:
        link, before = self.robot.links[i], self.robot.links[i - 1] if i else None
        joint, name = link.joint, f"joint_{i + 1}"
        place, angle, kind = self.end_of(i - 1), joint.angle_rad, "prismatic"
        axis = self.xyz(1 + 0j)
        if joint.type == "R":
            kind, angle = "continuous" if joint.limits is None else "revolute", 0.0
            axis = "0 0 1" if self.level else "0 -1 0"
        elif joint.type == "Pa":
            place = self.root_of(i - 1) if before is not None else 0j
            axis = self.xyz(cmath.rect(1.0, -angle))
        if joint.locked:
            at, kind = joint.start, "fixed"
            if joint.type == "R":
                angle = at
            else:
                place += at * (1.0 if joint.type == "Pa" else cmath.rect(1.0, angle))
        element = self.frame(name, kind, (self.names[i], self.names[i + 1]), place, angle)
        if kind == "fixed":
            return
        ET.SubElement(element, "axis", xyz=axis)
        low, high = joint.limits or self.robot.travel(i)
        if kind != "continuous":
            ends = [repr(float(np.clip(x, -ENDLESS, ENDLESS))) for x in (low, high)]
            none = dict.fromkeys(("effort", "velocity"), repr(ENDLESS))  # URDF asks for them
            limit = {"lower": ends[0], "upper": ends[1]} | none
            ET.SubElement(element, "limit", limit)
        friction = {"damping": joint.viscous_friction, "friction": joint.coulomb_friction}
        if any(friction.values()):
            ET.SubElement(element, "dynamics", {k: repr(v) for k, v in friction.items() if v})
        for what, there in (
            ("the rotor's inertia", joint.rotor_inertia),
            ("the spring beside the drive", joint.spring_stiffness),
            ("the transmission", joint.transmission),
        ):
            if there:
                self.left_out.append(f"joint {name}: {what}")


def _own(robot: Robot, i: int) -> list[Mass]:
    """The masses of a link's own line, straight, from its proximal end."""
    link = robot.links[i]
    parts = [Mass(each.mass_kg, complex(each.at_m), each.inertia_kg_m2) for each in link.mass]
    if not link.flexible:
        return [*parts, Mass(*rigid_body(robot, i))]
    s, ds = material(link).quadrature(0.0, link.length_m, 3)
    dm = link.mass_per_length(s) * ds
    mass = float(dm.sum())
    centre = float(dm @ s) / mass if mass else 0.0
    return [*parts, Mass(mass, complex(centre), float(dm @ (s - centre) ** 2))]


def _moved(part: Mass, by: complex) -> Mass:
    return Mass(part.mass, part.centre + by, part.inertia)


def _joined(parts: list[Mass]) -> Mass:
    mass = sum(part.mass for part in parts)
    centre = sum(part.mass * part.centre for part in parts) / mass if mass else 0j
    inertia = sum(part.inertia + part.mass * abs(part.centre - centre) ** 2 for part in parts)
    return Mass(mass, centre, inertia)
