"""Forces within a robot in a state, from the balance of what lies beyond a cut: (121) to (125)."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..link.section import material
from . import masses, sleeve
from .assembly import Assembly
from .kinematics import Line, base, translate
from .masses import Masses, Part
from .structure import LinkState

SAME = 1e-9  # of a link's length: what is closer to a cut is at it


class Load(NamedTuple):
    """A load from outside on link `link` (from 0): x + iy [N] at the abscissa `at` [m], moment
    [N m]."""

    link: int
    at: float
    force: complex = 0j
    moment: float = 0.0


class Wrench(NamedTuple):
    """A force x + iy [N] in the base's axes, and a moment [N m] about a point."""

    force: complex = 0j
    moment: float = 0.0

    def plus(self, other: Wrench) -> Wrench:
        """The sum of two about one point."""
        return Wrench(self.force + other.force, self.moment + other.moment)

    def about(self, place: complex) -> Wrench:
        """The same one about a place, if this is about the origin."""
        return Wrench(self.force, self.moment - _cross(place, self.force))


class Reaction(NamedTuple):
    """What link i-1 exerts on link i: force x + iy [N], moment about the joint [N m], place of the
    joint [m], angle of the axis on which a joint slides [rad]."""

    force: complex
    moment: float
    place: complex
    axis: float


class SectionForces(NamedTuple):
    """Bending moment [N m], shear force and axial force [N] in a section of a link (123)."""

    bending_moment: float
    shear_force: float
    axial_force: float


NO_SECTION = SectionForces(np.nan, np.nan, np.nan)


class Balance:
    """The forces that move all masses of a robot as q, qd, qdd (n,) say, under loads from outside.

    The base gets three unknowns more, its place and angle at rest. Lagrange's equations (40) to
    (42) of some parts have force and moment about the origin in the rows of these: so they hold
    for every part that the equations of motion know.
    """

    def __init__(
        self,
        assembly: Assembly,
        q: np.ndarray,
        qd: np.ndarray,
        qdd: np.ndarray,
        loads: Sequence[Load] = (),
    ) -> None:
        self.structure, self.robot = assembly.structure, assembly.robot
        self.assembly, self.n, self.loads = assembly, assembly.n, loads
        self.q, self.qd, self.qdd = (np.concatenate([x, np.zeros(3)]) for x in (q, qd, qdd))
        self.gravity = complex(*self.robot.gravity_m_s2)
        root = base(self.n + 3)
        root.velocity[self.n :] = 1.0, 1j, 0.0
        root.turning[self.n + 2] = 1.0
        self.states = self.structure.states(self.q, self.qd, root)

    def reaction(self, i: int) -> Reaction:
        """The force that link i-1 exerts on link i (both from 0, the base is -1) at joint i (121),
        (122)."""
        joint, hub = self.robot.links[i].joint, self.states[i].hub
        place = hub.place - joint.hub_radius_m * hub.tangent
        axis = hub.angle - (joint.angle_rad if joint.type == "Pa" else 0.0)
        needed = self._beyond[i + 1].plus(self._own[i])
        if joint.type != "Pb":  # whose hub is the sleeve, a part of the link before
            needed = needed.plus(self._hubs[i])
        return Reaction(*needed.about(place), place, axis)

    def section(self, i: int, s: float) -> SectionForces:
        """The forces in the section of link i (from 0) at the abscissa s [m], from its proximal
        end (123).

        What is fixed at s is beyond the cut, but for the hub of the link. In and behind a sleeve
        they are not known: nan.
        """
        state, near = self.states[i], SAME * self.robot.links[i].length_m
        ahead = self.structure._along(i, s, self.q)[0]
        if ahead < -near:
            return NO_SECTION
        cut = self.structure.at(state, s)
        needed = self._fixed_beyond(i, s - near).plus(self._material_beyond(i, s))
        force, moment = needed.about(cut.place)
        damping = self._damping_beyond(i, max(ahead, 0.0), s - near)
        force, moment = force - damping.force, moment - damping.moment
        across = force * cut.tangent.conjugate()
        return SectionForces(-moment, -across.imag, -across.real)

    @cached_property
    def _own(self) -> list[Wrench]:
        """What the masses and loads of each link without its hub take, about the origin."""
        out = []
        for state in self.states:
            parts = self.structure.own_masses(state)
            inertia = self._inertia(parts).plus(self._flow(state, parts[0]))
            out.append(inertia.plus(self._outside(state, -np.inf)))
        return out

    @cached_property
    def _hubs(self) -> list[Wrench]:
        """What the hub of each link takes, about the origin."""
        return [self._inertia(self.structure.hub_masses(state)) for state in self.states]

    @cached_property
    def _beyond(self) -> list[Wrench]:
        """What link i and all after it take with their hubs, about the origin; of no link the
        last."""
        out = [Wrench()]
        for own, hub in zip(reversed(self._own), reversed(self._hubs), strict=True):
            out.append(out[-1].plus(own).plus(hub))
        return out[::-1]

    def _inertia(self, parts: list[Part]) -> Wrench:
        """What parts take against inertia and gravity, about the origin (121), (122)."""
        out = Wrench()
        for part in parts:
            acceleration = part.columns @ self.qdd + part.rest
            if isinstance(part, Masses):
                force = part.mass * (acceleration - self.gravity)
                out = out.plus(Wrench(complex(force.sum()), _cross(part.place, force)))
            else:
                out = out.plus(Wrench(0j, part.inertia * float(acceleration)))
        return out

    def _flow(self, state: LinkState, free: Part) -> Wrench:
        """What the flow terms of (37) add for a flexible link in a sleeve, about the origin."""
        own = self.assembly.sleeved.get(state.number)
        if own is None or not isinstance(free, Masses):
            return Wrench()
        x, y, moment = sleeve.flow_forces(state.lines[0], own, free)[self.n :]
        return Wrench(complex(x, y), float(moment))

    def _outside(self, state: LinkState, s: float) -> Wrench:
        """What loads from outside take away, from the abscissa s of a link on, about the origin."""
        out = Wrench()
        for load in self.loads:
            if load.link == state.number and load.at >= s:
                place = self.structure.at(state, load.at).place
                moment = _cross(place, load.force) + load.moment
                out = out.plus(Wrench(-load.force, -moment))
        return out

    def _fixed_beyond(self, i: int, s: float) -> Wrench:
        """What is fixed to link i from the abscissa s on takes, about the origin: masses, loads,
        payload, and the links after it unless they slide on it before s."""
        state, out = self.states[i], self._outside(self.states[i], s)
        after = i + 1 < len(self.states) and self.robot.links[i + 1].joint
        parts = self.structure.lumps(state, s)
        if not after or after.type != "Pa" or self.q[self.structure.rows[i + 1]] >= s:
            out = out.plus(self._beyond[i + 1])
            parts += self.structure.load_masses(state)
        return out.plus(self._inertia(parts))

    def _material_beyond(self, i: int, s: float) -> Wrench:
        """What the material of link i beyond s takes, about the origin."""
        state, link = self.states[i], self.robot.links[i]
        if not state.lines:
            return self._rigid_beyond(state, s)
        own, out = self.structure.materials[i], Wrench()
        assert own is not None
        start = link.length_m - sum(line.free for line in state.lines)
        for line in state.lines:
            low = max(s, start)
            if low < start + line.free:
                X, dX = own.quadrature(low, start + line.free, line.piece.points + 2)
                place, acceleration = self._motion(line, (X - start) / line.free)
                force = own.mass_per_length(X) * dX * (acceleration - self.gravity)
                out = out.plus(Wrench(complex(force.sum()), _cross(place, force)))
            start += line.free
        return out

    def _rigid_beyond(self, state: LinkState, s: float) -> Wrench:
        """What a rigid link beyond s takes: its mass per length, or at its ends its whole mass."""
        i, link = state.number, self.robot.links[state.number]
        if link.mass_kg is not None:
            if link.mass_kg and s > SAME * link.length_m:
                return Wrench() if s >= (1 - SAME) * link.length_m else Wrench(np.nan, np.nan)
            return self._inertia(self.structure.body(state))
        X, dX = material(link).quadrature(s, link.length_m, 3)
        mass, out = link.mass_per_length(X) * dX, Wrench()
        for x, dm in zip(X, mass, strict=True):
            frame = translate(state.hub, *self.structure._along(i, x, self.q), self.qd)
            out = out.plus(self._inertia([masses.point_mass(float(dm), frame)]))
        return out

    def _motion(self, line: Line, xi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places and accelerations (S,) of the material at xi (S,) of a line (4), (5), (31)."""
        d, piece, start = line.free, line.piece, line.start
        w, bent = piece.integrals(xi), line.E @ self.qdd + line.N
        place = start.place + d * (w @ line.e)
        out = start.rest + start.velocity @ self.qdd + d * (w @ bent)
        if line.row is not None:  # it runs through the mesh
            l, dl = piece.lagrange(xi), piece.lagrange(xi, 1)
            left, rate, more = 1 - xi, line.rate, float(self.qdd[line.row])
            run = left * rate / d
            out += (w @ line.e + left * (l @ line.e)) * more + 2 * rate * (w @ line.rates)
            out += d * run * (2 * (l @ line.rates) + run * (dl @ line.e))
        return place, out

    def _damping_beyond(self, i: int, ahead: float, s: float) -> Wrench:
        """What damping in proportion to the mass exerts on link i beyond a cut, about the cut
        (125): the forces alpha M_c qd of (26) on the straight link, their reaction is at the hub.
        """
        alpha = self.robot.rayleigh(i)[0] if self.robot.links[i].flexible else 0.0
        if not alpha:
            return Wrench()
        state, own = self.states[i], self.structure.materials[i]
        assert own is not None
        hub, length = float(state.hub.turning @ self.qd), self.robot.links[i].length_m
        start, across, moved, moment = length - sum(x.free for x in state.lines), 0.0, 0.0, 0.0
        begin = start
        for line in state.lines:
            rates = float(line.start.turning @ self.qd) - hub + line.piece.B @ self.qd[line.own]
            low = max(begin + ahead, start)
            if low < start + line.free:
                X, dX = own.quadrature(low, start + line.free, line.piece.points + 2)
                dm = own.mass_per_length(X) * dX
                dm *= across + line.free * (line.piece.integrals((X - start) / line.free) @ rates)
                moved, moment = moved + dm.sum(), moment + dm @ (X - begin - ahead)
            across += line.free * float(line.piece.weights @ rates)
            start += line.free
        bodies = [(m.at_m, m.mass_kg, m.inertia_kg_m2, 0j) for m in self.robot.links[i].mass]
        if i + 1 == len(self.states):
            load = self.robot.payload
            centre = complex(*load.centre_of_mass_m)
            bodies.append((length, load.mass_kg, load.inertia_kg_m2, centre))
        along = 0.0
        for at, mass, inertia, centre in bodies:
            if at >= s:
                rise, turn = self._straight_rates(state, at - begin, hub)
                velocity = 1j * rise + 1j * centre * turn
                lever = at - begin - ahead + centre
                moved, along = moved + mass * velocity.imag, along + mass * velocity.real
                moment += mass * _cross(lever, velocity) + inertia * turn
        force = -alpha * complex(along, moved) * state.hub.tangent
        return Wrench(force, -alpha * float(moment))

    def _straight_rates(self, state: LinkState, x: float, hub: float) -> tuple[float, float]:
        """Rates of the deflection [m/s] and of the angle [rad/s] of a straight link, x [m] ahead of
        its hub."""
        across = 0.0
        for k, line in enumerate(state.lines):
            xi = min(x / line.free, 1.0)
            start = float(line.start.turning @ self.qd) - hub
            rates = start + line.piece.B @ self.qd[line.own]
            across += line.free * float(line.piece.integrals(np.array([xi]))[0] @ rates)
            if x <= line.free * (1 + SAME) or k + 1 == len(state.lines):
                turn = start + float(line.piece.shapes(np.array([xi]))[0] @ self.qd[line.own])
                return across, turn
            x -= line.free
        raise AssertionError("a flexible link has a line")


def _cross(place: complex | np.ndarray, force: complex | np.ndarray) -> float:
    """The moment of forces at places about the origin [N m]."""
    return float(np.sum((np.conj(place) * force).imag))
