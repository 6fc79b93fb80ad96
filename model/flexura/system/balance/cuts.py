"""Forces within a robot, from the balance of what lies beyond a cut: chapter 15 of the theory."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ...link.section import Material
from ...link.section import material as material_of
from ..structure import Structure, rigid_body
from . import inertia
from .damping import damping_beyond
from .inertia import Wrench, cross, total
from .motion import LinkMotion, link_motions

SAME = 1e-9  # of a link's length: what is closer to a cut is at it


class PointLoad(NamedTuple):
    """A load from outside on link `link` (from 0), at the abscissa `at` [m]: force x + iy [N] and
    moment [N m], constant or (T,). `turns`: the force is along and across the line there (134)."""

    link: int
    at: float
    force: Any = 0j
    moment: Any = 0.0
    turns: bool = False


class Reaction(NamedTuple):
    """What link i-1 exerts on link i: force x + iy [N], moment about the joint [N m], place of the
    joint [m], angle of the axis on which a joint slides [rad]; each (T,). What of it drive and
    friction give says (144)."""

    force: np.ndarray
    moment: np.ndarray
    place: np.ndarray
    axis: np.ndarray


class SectionForces(NamedTuple):
    """Bending moment [N m], shear force and axial force [N] in a section of a link, each (T,)
    (141). The shear force is minus the slope of the moment (142); a fine mesh has the same moment
    by its curvature (145)."""

    bending_moment: np.ndarray
    shear_force: np.ndarray
    axial_force: np.ndarray


class Balance:
    """The forces that all masses of a robot take at T times, less `loads` from outside; q, qd and
    qdd (T, n)."""

    def __init__(
        self,
        structure: Structure,
        q: np.ndarray,
        qd: np.ndarray,
        qdd: np.ndarray,
        loads: Sequence[PointLoad] = (),
    ) -> None:
        self.structure, self.robot, self.loads = structure, structure.robot, loads
        self.q, self.gravity = q, complex(*structure.robot.gravity_m_s2)
        self.motions = link_motions(structure, q, qd, qdd)

    def reaction(self, i: int) -> Reaction:
        """What link i-1 exerts on link i at joint i (139), (140); link -1 is the base.

        Args:
            i: number of the joint, from 0.

        Returns:
            Force, moment about the joint, place and axis, (T,) each.
        """
        joint, hub = self.robot.links[i].joint, self.motions[i].hub
        place = hub.place - joint.hub_radius_m * hub.tangent
        axis = hub.angle - (joint.angle_rad if joint.type == "Pa" else 0.0)
        needed = self._beyond[i + 1].plus(self._own[i])
        if joint.type != "Pb":  # whose hub is the sleeve, a part of the link before
            needed = needed.plus(self._hubs[i])
        return Reaction(*needed.about(place), place, axis)

    def section(self, i: int, s: Any) -> SectionForces:
        """The forces in a section of a link (141).

        What is fixed at s is beyond the cut, but for the hub of the link.

        Args:
            i: number of the link, from 0.
            s: abscissa from its proximal end [m]; of a link in a sleeve also (T,).

        Returns:
            The forces, (T,) each. In and behind a sleeve they are not known: nan.
        """
        motion, near = self.motions[i], SAME * self.robot.links[i].length_m
        x = motion.ahead.value + s
        cut = motion.at(s)
        needed = self._fixed_beyond(i, s - near).plus(self._material_beyond(i, s))
        needed = needed.about(cut.place).less(
            damping_beyond(self.robot, motion, self.structure.materials[i], s, near)
        )
        across = needed.force * cut.tangent.conj()
        known = np.where(x < -near, np.nan, 1.0)
        return SectionForces(-needed.moment * known, -across.imag * known, -across.real * known)

    @cached_property
    def _pieces(self) -> list[list[Wrench]]:
        """What the material of each piece of each flexible link takes, about the origin."""
        out = []
        for motion in self.motions:
            if motion.lines and self.structure.sleeved(motion.number):
                material = self._material(motion.number)
                out.append([inertia.sleeved(motion, material, self.gravity)])
            else:
                out.append([inertia.line(line, self.gravity) for line in motion.lines])
        return out

    @cached_property
    def _own(self) -> list[Wrench]:
        """What the masses and loads of each link without its hub take, about the origin."""
        out = []
        for motion, pieces in zip(self.motions, self._pieces, strict=True):
            parts = [*pieces, self._lumps(motion, -np.inf), self._payload(motion)]
            parts += [] if motion.lines else [self._body(motion)]
            out.append(total([*parts, self._outside(motion, -np.inf)], len(self.q)))
        return out

    @cached_property
    def _hubs(self) -> list[Wrench]:
        """What the hub of each link takes, about the origin; its mass is at the axis (21)."""
        out = []
        for motion in self.motions:
            joint, hub = self.robot.links[motion.number].joint, motion.hub
            axis = hub.moved(-joint.hub_radius_m) if joint.hub_radius_m else hub
            out.append(inertia.body(joint.hub_mass_kg, joint.hub_inertia_kg_m2, axis, self.gravity))
        return out

    @cached_property
    def _beyond(self) -> list[Wrench]:
        """What link i and all after it take with their hubs, about the origin; of no link the
        last."""
        out = [total([], len(self.q))]
        for own, hub in zip(reversed(self._own), reversed(self._hubs), strict=True):
            out.append(out[-1].plus(own).plus(hub))
        return out[::-1]

    def _material(self, i: int) -> Material:
        found = self.structure.materials[i]
        assert found is not None
        return found

    def _body(self, motion: LinkMotion) -> Wrench:
        """What a rigid link takes, about the origin (15), (111)."""
        mass, centre, own = rigid_body(self.robot, motion.number)
        return inertia.body(mass, own, motion.at(centre.real).moved(1j * centre.imag), self.gravity)

    def _lumps(self, motion: LinkMotion, s: Any) -> Wrench:
        """What the lumped masses on a link from the abscissa s on take, about the origin (110)."""
        parts = [
            inertia.body(
                each.mass_kg, each.inertia_kg_m2, motion.at(each.at_m), self.gravity
            ).where(each.at_m >= s)
            for each in self.robot.links[motion.number].mass
        ]
        return total(parts, len(self.q))

    def _payload(self, motion: LinkMotion) -> Wrench:
        """What the payload of the last link takes, about the origin (22), (111)."""
        load = self.robot.payload
        if motion.number + 1 < len(self.motions):
            return total([], len(self.q))
        centre = motion.tip.moved(complex(*load.centre_of_mass_m))
        return inertia.body(load.mass_kg, load.inertia_kg_m2, centre, self.gravity)

    def _outside(self, motion: LinkMotion, s: Any) -> Wrench:
        """What loads from outside take off, from the abscissa s of a link on, about the origin."""
        out = total([], len(self.q))
        for load in self.loads:
            if load.link == motion.number:
                place = motion.at(load.at)
                force = load.force * (place.tangent if load.turns else 1.0)
                moment = cross(place.place, force) + load.moment
                out = out.less(Wrench(force, moment).where(load.at >= s))
        return out

    def _fixed_beyond(self, i: int, s: Any) -> Wrench:
        """What is fixed to link i from the abscissa s on takes, about the origin: masses, loads,
        payload, and the links after it unless they slide on it before s."""
        motion, after = self.motions[i], self._beyond[i + 1]
        if i + 1 < len(self.motions) and self.robot.links[i + 1].joint.type == "Pa":
            after = after.where(self.q[:, self.structure.rows[i + 1]] >= s)
        parts = [self._lumps(motion, s), self._outside(motion, s), self._payload(motion), after]
        return total(parts, len(self.q))

    def _material_beyond(self, i: int, s: Any) -> Wrench:
        """What the material of link i beyond s takes, about the origin."""
        motion = self.motions[i]
        if not motion.lines:
            return self._rigid_beyond(motion, s)
        if self.structure.sleeved(i):
            return inertia.line_beyond(
                motion.lines[0], self._material(i), s, -motion.ahead.value, self.gravity
            )
        parts, start = [], 0.0
        for line, whole in zip(motion.lines, self._pieces[i], strict=True):
            end = start + line.free.value
            if s <= start:
                parts.append(whole)
            elif s < end:
                parts.append(inertia.line_beyond(line, self._material(i), s, start, self.gravity))
            start = end
        return total(parts, len(self.q))

    def _rigid_beyond(self, motion: LinkMotion, s: Any) -> Wrench:
        """What a rigid link beyond s takes: its mass per length, or at its ends its whole mass."""
        link = self.robot.links[motion.number]
        if link.mass_kg is None:
            return inertia.straight(motion, material_of(link), s, link.length_m, self.gravity)
        near, own = SAME * link.length_m, self._body(motion)
        unknown = (s > near) & (s < link.length_m - near) & (link.mass_kg > 0)
        known = np.where(unknown, np.nan, 1.0)
        return Wrench(*(known * x for x in own.where(s <= near)))
