"""The chain of a robot: numbering, and the frames, lines and masses of every link in a state."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..link.line import Piece, is_one_piece, mesh, pieces
from ..link.mesh import joined
from ..link.section import Material, material
from ..link.shapes import WholeShapes
from ..robot import Link, Robot
from . import sleeve
from .kinematics import Frame, Line, base, line, rotate, station, translate
from .masses import Part, line_masses, point_mass, turning


class LinkState(NamedTuple):
    """A link in a state q, qd: frame of its hub (Pb: exit), its lines (none: rigid), its tip."""

    number: int
    q: np.ndarray
    qd: np.ndarray
    hub: Frame
    lines: tuple[Line, ...]
    tip: Frame


@dataclass(frozen=True)
class Structure:
    """A robot's links as pieces, numbered q = [joint 1, elastic unknowns of link 1, joint 2, ...].

    `linear`: the dissertation's line (7).
    """

    robot: Robot
    links: tuple[tuple[Piece, ...], ...]
    linear: bool = False

    @cached_property
    def rows(self) -> list[int]:
        """The unknown of each joint."""
        sizes = [
            1 + elastic_joint(link) + sum(p.count for p in made)
            for link, made in zip(self.robot.links, self.links, strict=True)
        ]
        return [sum(sizes[:i]) for i in range(len(sizes))]

    @cached_property
    def windups(self) -> dict[int, int]:
        """The unknown of each transmission, by the number of its link (from 0) (109)."""
        links = zip(self.robot.links, self.rows, strict=True)
        return {i: row + 1 for i, (link, row) in enumerate(links) if elastic_joint(link)}

    @cached_property
    def own(self) -> list[list[slice]]:
        """The unknowns of each piece of each link."""
        ends = [
            [
                row + 1 + (i in self.windups) + sum(p.count for p in link[:k])
                for k in range(len(link) + 1)
            ]
            for i, (row, link) in enumerate(zip(self.rows, self.links, strict=True))
        ]
        return [[slice(a, b) for a, b in pairwise(e)] for e in ends]

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """The names of the unknowns."""
        out: list[str] = []
        for i, link in enumerate(self.links, 1):
            out += [f"joint/{i}", f"link/{i}/windup"] if i - 1 in self.windups else [f"joint/{i}"]
            if link and isinstance(link[0].shapes, WholeShapes):
                kind = "mode" if link[0].K.size else "shape"
                out += [f"link/{i}/{kind}/{j}" for j in range(1, link[0].count + 1)]
                continue
            for k in range(1, sum(piece.count for piece in link) // 2 + 1):
                out += [f"link/{i}/element/{k}/rotation", f"link/{i}/element/{k}/bubble"]
        return tuple(out)

    @property
    def n(self) -> int:
        """The number of unknowns."""
        return len(self.labels)

    @cached_property
    def materials(self) -> list[Material | None]:
        """The material of each link; None for rigid ones."""
        return [material(link) if link.flexible else None for link in self.robot.links]

    def sleeved(self, i: int) -> bool:
        """Whether link i slides through a sleeve."""
        return self.robot.links[i].joint.type == "Pb"

    def states(self, q: np.ndarray, qd: np.ndarray) -> list[LinkState]:
        """The links in a state, from the base outwards (39)."""
        out: list[LinkState] = []
        for i in range(len(self.links)):
            out.append(self.link(i, self._hub(i, out[-1] if out else None, q, qd), q, qd))
        return out

    def link(self, i: int, hub: Frame, q: np.ndarray, qd: np.ndarray) -> LinkState:
        """Link i in a state, from the frame of its hub to its tip (2), (5)."""
        row = self.rows[i]
        if not self.links[i]:
            return LinkState(
                i,
                q,
                qd,
                hub,
                (),
                translate(hub, *self._along(i, self.robot.links[i].length_m, q), qd),
            )
        lines, frame = [], hub
        for piece, own in zip(self.links[i], self.own[i], strict=True):
            free, free_row = (q[row], row) if self.sleeved(i) else (piece.length, None)
            lines.append(line(piece, frame, hub, own, free, free_row, q, qd, self.linear))
            frame = station(lines[-1], 1.0)
        return LinkState(i, q, qd, hub, tuple(lines), frame)

    def _along(self, i: int, s: float, q: np.ndarray) -> tuple[float, list[int]]:
        """How far s on link i is ahead of its hub or exit [m], and the unknowns in it."""
        return (
            (s - self.robot.links[i].length_m + q[self.rows[i]], [self.rows[i]])
            if self.sleeved(i)
            else (s, [])
        )

    def _hub(self, i: int, before: LinkState | None, q: np.ndarray, qd: np.ndarray) -> Frame:
        """The frame of link i's hub (Pb: of the sleeve's exit) on the link before it (1), (30)."""
        joint, row = self.robot.links[i].joint, self.rows[i]
        tip = before.tip if before else base(self.n, q.dtype)
        if joint.type == "R":
            hub = rotate(tip, q[row], row)
            if i in self.windups:  # (109)
                hub = rotate(hub, q[self.windups[i]], self.windups[i])
            return (
                translate(hub, joint.hub_radius_m, [], qd) if joint.hub_radius_m else hub
            )  # (112)
        if joint.type == "Pb":
            return rotate(tip, joint.angle_rad)
        if before is None:
            return rotate(translate(tip, q[row], [row], qd), joint.angle_rad)
        x, rows = self._along(before.number, q[row], q)
        if before.lines:
            return rotate(station(before.lines[0], x / before.lines[0].free, row), joint.angle_rad)
        return rotate(translate(before.hub, x, [row, *rows], qd), joint.angle_rad)

    def at(self, state: LinkState, s: float) -> Frame:
        """The frame of a link at arc length s [m] from its proximal end (4), (30)."""
        x, rows = self._along(state.number, s, state.q)
        if not state.lines or x < 0:
            return translate(state.hub, x, rows, state.qd)
        k, last = 0, len(state.lines) - 1
        while k < last and x >= state.lines[k].free:
            x, k = x - state.lines[k].free, k + 1
        return station(state.lines[k], x / state.lines[k].free)

    def places(self, state: LinkState, s: np.ndarray) -> np.ndarray:
        """Places of a flexible link at arc lengths s (S,) [m] from its proximal end (4)."""
        if len(state.lines) > 1:
            return np.array([self.at(state, float(x)).place for x in s])
        line, x = state.lines[0], s + self._along(state.number, 0.0, state.q)[0]
        if line.row is None:
            return (
                line.start.place
                + line.free * line.piece.cached_integrals(tuple(x / line.free)) @ line.e
            )
        reach = line.free * line.piece.integrals(np.maximum(x, 0.0) / line.free) @ line.e
        return line.start.place + np.minimum(x, 0.0) * state.hub.tangent + reach

    def root(self, state: LinkState) -> complex:
        """The place of a link's proximal end (3)."""
        if state.lines and not self.sleeved(state.number):
            return state.lines[0].start.place
        return state.hub.place + self._along(state.number, 0.0, state.q)[0] * state.hub.tangent

    def masses(self, state: LinkState) -> list[Part]:
        """What has kinetic energy on a link: its material, its hub (21), and on the last one the
        payload with its rotary inertia (22)."""
        joint, parts = self.robot.links[state.number].joint, self.own_masses(state)
        if joint.hub_mass_kg:
            axis = translate(state.hub, -joint.hub_radius_m, [], state.qd)
            parts.append(point_mass(joint.hub_mass_kg, axis if joint.hub_radius_m else state.hub))
        if joint.hub_inertia_kg_m2:
            parts.append(turning(joint.hub_inertia_kg_m2, state.hub))
        return parts

    def own_masses(self, state: LinkState) -> list[Part]:
        """A link's masses without its hub."""
        i, material = state.number, self.materials[state.number]
        parts: list[Part] = []
        if material is None:
            mass, centre, inertia = rigid_body(self.robot, i)
            x, rows = self._along(i, centre.real, state.q)
            frame = translate(state.hub, complex(x, centre.imag), rows, state.qd)
            parts += [point_mass(mass, frame), turning(inertia, frame)]
        elif self.sleeved(i):
            parts += sleeve.masses(state.lines[0], material)
        else:
            parts += [line_masses(x) for x in state.lines]
        for each in self.robot.links[i].mass:  # (110)
            frame = self.at(state, each.at_m)
            parts += [point_mass(each.mass_kg, frame), turning(each.inertia_kg_m2, frame)]
        if i == len(self.links) - 1:
            load, frame = self.robot.payload, state.tip
            if any(load.centre_of_mass_m):  # (111)
                frame = translate(frame, complex(*load.centre_of_mass_m), [], state.qd)
            parts += [point_mass(load.mass_kg, frame), turning(load.inertia_kg_m2, frame)]
        return parts


def structure(robot: Robot, linear: bool | None = None) -> Structure:
    """The structure of a robot, with shapes computed here."""
    links, flat = robot.links, not robot.stiffening if linear is None else linear
    made = tuple(
        _pieces(robot, link, after, flat) if link.flexible else ()
        for link, after in zip(links, [*links[1:], None], strict=True)
    )
    return Structure(robot, made, flat)


def _pieces(robot: Robot, link: Link, after: Link | None, linear: bool) -> tuple[Piece, ...]:
    """The pieces of a link: with nodal sliding a mesh; what the core does not have is one piece."""
    slides = link.joint.type == "Pb" or (after is not None and after.joint.type == "Pa")
    equal = slides if robot.nodal else not is_one_piece(link, after)
    if (linear or robot.nodal) and equal:
        made = mesh(material(link), np.linspace(0, link.length_m, link.elements + 1))
    else:
        made = pieces(link, after, robot.payload if after is None else None)
    return (joined(made),) if linear or robot.nodal else made


def elastic_joint(link: Link) -> bool:
    """Whether a transmission is between the rotor and the hub of a link."""
    return link.joint.transmission is not None


def rigid_body(robot: Robot, i: int) -> tuple[float, complex, float]:
    """Mass [kg], centre along + i across [m] from the proximal end, inertia [kg m^2] about it:
    rigid link i (15), (111)."""
    link = robot.links[i]
    if link.mass_kg is not None:
        given = link.length_m / 2 if link.centre_of_mass_m is None else link.centre_of_mass_m
        centre = complex(*given) if isinstance(given, tuple) else complex(given)
        return link.mass_kg, centre, link.inertia_kg_m2 or 0.0
    s, ds = material(link).quadrature(0.0, link.length_m, 3)
    dm = link.mass_per_length(s) * ds
    mass = float(dm.sum())
    centre = float(dm @ s) / mass
    return mass, complex(centre), float(dm @ (s - centre) ** 2)
