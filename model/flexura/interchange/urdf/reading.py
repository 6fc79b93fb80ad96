"""A robot of a URDF file: links from joint to joint, as a robot file has them."""

from __future__ import annotations

import cmath
import math
import os
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from ...errors import InputError
from ...robot import Robot
from .chain import chain_of
from .description import read_description
from .plane import Mass, PlanarBody, Plane, planar
from .sections import bends, check_names, read_sections

SHORT = 1e-9  # m: two places are one
LEAST_FREE = 0.02  # of its length that a flexible link keeps out of its sleeve


class JointMap(NamedTuple):
    """What a joint of the URDF is in the robot: position = sense * (its position) + offset."""

    name: str
    type: str
    sense: int
    offset: float


@dataclass(frozen=True)
class Imported:
    """A robot of a URDF file.

    Attributes:
        robot: the robot.
        joints: what each joint of the file is in it, in its order.
        axes: x, y and the normal of its plane in the axes of the URDF's base (3, 3), as rows.
        left_out: what the file says and a robot file has no key for.
        notes: what was chosen.
    """

    robot: Robot
    joints: list[JointMap]
    axes: list[list[float]]
    left_out: list[str]
    notes: list[str]


def read_urdf(
    path: str | os.PathLike[str], sections: str | os.PathLike[str] | None = None
) -> Imported:
    """Read a robot from a URDF file.

    Joints that turn become R. A prismatic joint becomes Pa if it is the first, on the axis of the
    base; else Pb, a sleeve on the link before. Links that are fixed are merged. A link runs from
    its joint to the next one. The last ends at a link that is fixed to it, or as far beyond its
    centre of mass as its joint is before.

    Args:
        path: of the URDF file.
        sections: of a TOML file with a table for each link that bends; None: all are rigid.

    Returns:
        The robot, and how its joints are those of the file.

    Raises:
        InputError: the file is no URDF, or its robot is no serial planar chain; the message names
            the file, the joint and the reason.
    """
    urdf = read_description(path)
    plane, bodies = planar(chain_of(urdf), urdf.file)
    tables = read_sections(sections)
    table_file = "" if sections is None else os.fspath(sections)
    check_names(tables, [b.body.name for b in bodies], table_file)
    builder = _Builder(urdf.file, plane, bodies, tables)
    links, payload = builder.links()
    data: dict[str, Any] = {"name": urdf.name, "gravity_m_s2": list(plane.gravity), "link": links}
    if payload:
        data["payload"] = payload
    robot = Robot.from_dict(data, file=urdf.file)
    axes = [[float(x) for x in axis] for axis in (plane.x, plane.y, plane.normal)]
    return Imported(robot, builder.joints, axes, urdf.left_out, builder.notes)


@dataclass
class _Builder:
    """The links of a chain, from the tip inwards and then from the base outwards."""

    file: str
    plane: Plane
    bodies: list[PlanarBody]
    tables: dict[str, dict[str, Any]]
    joints: list[JointMap] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def error(self, i: int, expected: str, value: object = None) -> InputError:
        key = f"link {self.bodies[i].body.name}"
        return InputError(expected, key=key, value=value, file=self.file)

    def links(self) -> tuple[list[dict[str, Any]], dict[str, Any]]:
        """The tables [[link]], and that of the payload."""
        ends = self.ends()
        angle, out, payload = 0.0, [], {}
        for i, (body, end) in enumerate(zip(self.bodies, ends, strict=True)):
            table = self.tables.get(body.body.name, {})
            sleeved = not body.turns and i > 0
            if sleeved:
                length, direction = self.sleeve_length(i), body.axis
                root = end - length * direction
            else:
                root = body.place
                length = abs(end - root)
                length = 0.0 if length < SHORT else length
                direction = (end - root) / length if length else cmath.rect(1.0, angle)
            turned = cmath.phase(direction) - angle
            turned = math.remainder(turned, 2 * math.pi)
            turned = 0.0 if abs(turned) < 1e-12 else turned
            link: dict[str, Any] = {"name": body.body.name, "length_m": length}
            joint = self.joint(i, turned, length)
            extra = dict(table.get("joint", {}))
            link["joint"] = joint | extra
            link |= {k: v for k, v in table.items() if k not in ("joint", "length_m")}
            angle += turned
            local = lambda mass, root=root, direction=direction: Mass(
                mass.mass, (mass.centre - root) * direction.conjugate(), mass.inertia
            )
            if bends(table):
                payload = self.flexible(i, link, length, local)
            else:
                whole = local(body.whole)
                link["mass_kg"] = whole.mass
                link["centre_of_mass_m"] = _centre(whole.centre)
                link["inertia_kg_m2"] = whole.inertia
            out.append(link)
        return out, payload

    def ends(self) -> list[complex]:
        """Where each link ends, in the joints' zero: at the next joint, or at its sleeve's exit."""
        out = [self.tip()]
        for i in range(len(self.bodies) - 1, 0, -1):
            body = self.bodies[i]
            if body.turns:
                out.insert(0, body.place)
                continue
            low, _ = self.range_of(i)
            free = self.least_free(i) - low  # in the zero
            out.insert(0, out[0] - free * body.axis)
        return out

    def range_of(self, i: int) -> tuple[float, float]:
        limits = self.bodies[i].body.joint.limits
        if limits is None:
            key = f"joint {self.bodies[i].body.joint.name}: <limit>"
            raise InputError("expected how far the joint slides", key=key, file=self.file)
        return limits

    def sleeve_length(self, i: int) -> float:
        """The length of a link that slides through a sleeve: as far as it goes, and what stays
        out."""
        low, high = self.range_of(i)
        given = self.tables.get(self.bodies[i].body.name, {}).get("length_m")
        if given is None:
            kept = LEAST_FREE / (1 - LEAST_FREE) if self.bent(i) else 0.0
            return (high - low) * (1 + kept)
        if not isinstance(given, int | float) or not given >= high - low:
            expected = f"expected a length_m of {high - low:g} or more: so far the joint slides"
            raise self.error(i, expected, given)
        return float(given)

    def least_free(self, i: int) -> float:
        """The free length at the lower limit: at the upper one all of the link is out."""
        low, high = self.range_of(i)
        return self.sleeve_length(i) - (high - low)

    def bent(self, i: int) -> bool:
        return bends(self.tables.get(self.bodies[i].body.name, {}))

    def tip(self) -> complex:
        """Where the last link ends."""
        body = self.bodies[-1]
        given = self.tables.get(body.body.name, {}).get("length_m")
        if body.ends:
            name, end = max(body.ends.items(), key=lambda each: abs(each[1] - body.place))
            if abs(end - body.place) > SHORT:
                self.notes.append(f"the tip is at link {name}")
                return self._at_length(end, given)
        half = body.whole.centre - body.place
        said = "as far beyond the last link's centre of mass as its joint is before"
        self.notes.append(f"the tip is {said}")
        return self._at_length(body.place + 2.0 * half, given)

    def _at_length(self, end: complex, given: Any) -> complex:
        """The tip, at the length that the table gives the last link."""
        body = self.bodies[-1]
        if given is None or (not body.turns and len(self.bodies) > 1):
            return end
        way = end - body.place
        if not isinstance(given, int | float) or not given > 0 or abs(way) < SHORT:
            expected = "expected a length_m above 0 of a link whose end has a direction"
            raise self.error(len(self.bodies) - 1, expected, given)
        return body.place + given * way / abs(way)

    def joint(self, i: int, turned: float, length: float) -> dict[str, Any]:
        """The table [link.joint], and the joint's map."""
        body, joint = self.bodies[i], self.bodies[i].body.joint
        if body.turns:
            kind, offset, sense = "R", turned, body.sense
            out: dict[str, Any] = {"type": kind}
        elif i == 0:
            kind, offset, sense = "Pa", 0.0, 1
            out = {"type": kind, "angle_rad": turned}
        else:
            kind, sense = "Pb", 1
            offset = self.least_free(i) - self.range_of(i)[0]
            out = {"type": kind, "angle_rad": turned}
        unit, friction = ("rad", "N_m") if body.turns else ("m", "N")
        start = offset
        if joint.limits is not None:
            ends = sorted(sense * x + offset for x in joint.limits)
            if kind == "Pb":  # round-off must not take it out of its link
                ends = [ends[0], min(ends[1], length)]
            out[f"limits_{unit}"] = ends
            start = min(max(start, ends[0]), ends[1])
        out[f"start_{unit}"] = start
        viscous = "viscous_friction_N_m_s_rad" if body.turns else "viscous_friction_N_s_m"
        out |= {viscous: joint.damping} if joint.damping else {}
        out |= {f"coulomb_friction_{friction}": joint.friction} if joint.friction else {}
        self.joints.append(JointMap(joint.name, kind, sense, offset))
        return out

    def flexible(self, i: int, link: dict[str, Any], length: float, local: Any) -> dict[str, Any]:
        """What is fixed to a link that bends: masses on its line, or the payload."""
        body, last = self.bodies[i], i + 1 == len(self.bodies)
        if not length > 0:
            raise self.error(i, "expected a length above 0 of a link that bends", length)
        by_section = any(k in link for k in ("section", "density_kg_m3", "mass_per_length_kg_m"))
        if not by_section:
            link["mass_per_length_kg_m"] = body.own.mass / length
        else:
            self.notes.append(f"link {body.body.name}: its mass is that of the section")
        hung, lumps = [], list(link.get("mass", []))
        for name, part in body.fixed.items():
            mass = local(part)
            if last and mass.centre.real >= length - 1e-6 * length:
                hung.append(mass)
                continue
            if abs(mass.centre.imag) > 1e-6 * length or mass.centre.real < 0:
                expected = (
                    f"expected link {name}, which is fixed to it, on its line or beyond its tip: a "
                    f"link that bends carries no mass {abs(mass.centre.imag):.4g} m beside it"
                )
                raise self.error(i, expected)
            at = min(mass.centre.real, length)
            lumps.append({"at_m": at, "mass_kg": mass.mass, "inertia_kg_m2": mass.inertia})
        if lumps:
            link["mass"] = lumps
        if not hung:
            return {}
        mass = sum(each.mass for each in hung)
        centre = sum(each.mass * each.centre for each in hung) / mass
        inertia = sum(e.inertia + e.mass * abs(e.centre - centre) ** 2 for e in hung)
        off = [centre.real - length, centre.imag]
        off = [0.0 if abs(x) < SHORT else x for x in off]
        return {"mass_kg": mass, "inertia_kg_m2": inertia, "centre_of_mass_m": off}


def _centre(centre: complex) -> float | list[float]:
    """A centre of mass as a robot file has it: along the link, or along and across."""
    along = 0.0 if abs(centre.real) < SHORT * SHORT else centre.real
    return along if abs(centre.imag) < 1e-15 else [along, centre.imag]
