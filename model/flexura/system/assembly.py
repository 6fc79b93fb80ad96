"""The extended assembly: Lagrange's equations (24) of any chain, dense.

M(q) qdd + bias(q, qd) + damping(q) qd + elastic(q) + gravity(q) = force                   (25)
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..link.section import Material
from ..robot import Robot
from . import masses, sleeve
from .kinematics import Frame, base
from .structure import LinkState, Structure, structure

COULOMB_RATE = 1e-3  # m/s or rad/s


class Energies(NamedTuple):
    """Kinetic energy, strain energy and the potential of gravity [J]."""

    kinetic: float
    strain: float
    potential: float


class Terms(NamedTuple):
    """The parts of (25) in a state: `forces` (n,) of inertia and gravity, `elastic` (n,); K and D
    (n, n)."""

    mass: np.ndarray
    forces: np.ndarray
    elastic: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray


class Assembly:
    """Lagrange's equations (24) as dense sums over the pieces: the theory written down, which a
    `System` serves with its arguments checked. q and qd (n,) are named by `labels`. The sums have
    the precision of q and qd: with `np.longdouble` they are a reference for others in double.

    A `Structure` in place of a robot brings its own shapes, so that two programs can use one set.
    """

    def __init__(self, robot: Robot | Structure, linear: bool | None = None) -> None:
        self.structure = robot if isinstance(robot, Structure) else structure(robot, linear)
        self.robot, self.rows = self.structure.robot, self.structure.rows
        self.labels, self.n = self.structure.labels, self.structure.n
        self._rotors = np.array([link.joint.rotor_inertia for link in self.robot.links])
        self._coulomb = np.array([link.joint.coulomb_friction for link in self.robot.links])
        # springs beside the drives (108): stiffness of each joint, and where all springs rest
        self._springs = np.array([link.joint.spring_stiffness for link in self.robot.links])
        self._rest = np.zeros(self.n)
        self._rest[self.rows] = [link.joint.spring_rest for link in self.robot.links]
        self._rayleigh = [self.robot.rayleigh(i) for i in range(len(self.robot.links))]
        self._g = complex(*self.robot.gravity_m_s2)
        materials = [
            (i, material)
            for i, material in enumerate(self.structure.materials)
            if material is not None and self.structure.sleeved(i)
        ]
        # flexible links in a sleeve, with their materials
        self._sleeved: dict[int, Material] = dict(materials)

    def mass(self, q: np.ndarray) -> np.ndarray:
        """The mass matrix M(q) (40).

        Args:
            q: configuration (n,).

        Returns:
            (n, n).
        """
        return self._mass(self._inertia(self._at_rest(q))[0])

    def _mass(self, sums: masses.Sum) -> np.ndarray:
        M = sums.mass
        M[self.rows, self.rows] += self._rotors
        return M

    def bias(self, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
        """Coriolis, centrifugal and convective forces, on the left-hand side (41).

        Args:
            q: configuration (n,).
            qd: its rates (n,).

        Returns:
            Generalised forces (n,).
        """
        sums, flow = self._inertia(self.structure.states(q, qd))
        return sums.forces + flow

    def gravity(self, q: np.ndarray) -> np.ndarray:
        """Forces of gravity, on the left-hand side (42).

        Args:
            q: configuration (n,).

        Returns:
            Generalised forces (n,).
        """
        return self._inertia(self._at_rest(q), self._g)[0].forces

    def _inertia(
        self, states: list[LinkState], gravity: complex = 0j
    ) -> tuple[masses.Sum, np.ndarray]:
        """What (40) to (42) sum over, and the flow terms of (37) (n,)."""
        parts, flow = [], np.zeros_like(states[0].q)
        for state in states:
            own = self.structure.masses(state)
            parts += own
            free = own[0]
            if state.number in self._sleeved and isinstance(free, masses.Masses):
                flow += sleeve.flow_forces(state.lines[0], self._sleeved[state.number], free)
        return masses.total(parts, gravity), flow

    def elastic(self, q: np.ndarray) -> np.ndarray:
        """Elastic forces, on the left-hand side (43): K q, of springs beside drives k (q - rest)
        (108), and of a sleeved link also dU/dd.

        -dU/dd is the force that pushes a bent link out of its sleeve (36).

        Args:
            q: configuration (n,).

        Returns:
            Generalised forces (n,).
        """
        return self._elastic(self.stiffness_blocks(q), q)

    def _elastic(self, K: np.ndarray, q: np.ndarray) -> np.ndarray:
        out = K @ (q - self._rest)
        for i in self._sleeved:
            y = q[self.structure.own[i][0]]
            out[self.rows[i]] += 0.5 * y @ self._sleeve(i, q, 1) @ y
        return out

    def stiffness_blocks(self, q: np.ndarray) -> np.ndarray:
        """K, with K(d) of sleeved links (9), (35), and with the springs of joints.

        Twice the strain energy is z^T K z, z = q less where the springs rest.

        Args:
            q: configuration (n,).

        Returns:
            (n, n).
        """
        K = self._diagonal.astype(q.dtype)
        for i in self._sleeved:
            own = self.structure.own[i][0]
            K[own, own] = self._sleeve(i, q)
        return K

    @cached_property
    def _diagonal(self) -> np.ndarray:
        """K (n, n) of the pieces of constant length and of the springs of joints."""
        K = np.zeros((self.n, self.n))
        K[self.rows, self.rows] = self._springs
        for i, row in self.structure.windups.items():
            K[row, row] = self.robot.links[i].joint.windup_stiffness
        for link, owns in zip(self.structure.links, self.structure.own, strict=True):
            for piece, own in zip(link, owns, strict=True):
                if piece.K.size:
                    K[own, own] = np.diag(piece.K)
        return K

    def _sleeve(self, i: int, q: np.ndarray, derivative: int = 0) -> np.ndarray:
        """K(d) of the link i in a sleeve, or its derivatives by d (35)."""
        return sleeve.stiffness(
            self.structure.links[i][0], q[self.rows[i]], self._sleeved[i], derivative
        )

    def stiffness(self, q: np.ndarray) -> np.ndarray:
        """The second derivative of the strain energy, without loads (43).

        Args:
            q: configuration (n,).

        Returns:
            (n, n).
        """
        K = self.stiffness_blocks(q)
        for i in self._sleeved:
            own, row = self.structure.own[i][0], self.rows[i]
            slope = self._sleeve(i, q, 1) @ q[own]
            K[own, row] += slope
            K[row, own] += slope
            K[row, row] += 0.5 * q[own] @ self._sleeve(i, q, 2) @ q[own]
        return K

    def damping(self, q: np.ndarray) -> np.ndarray:
        """D: viscous friction of joints, damping of transmissions (109), alpha M + beta K of links
        (26).

        Args:
            q: configuration (n,).

        Returns:
            (n, n).
        """
        return self._damping(self.stiffness_blocks(q), q)

    def _damping(self, K: np.ndarray, q: np.ndarray) -> np.ndarray:
        D = np.zeros((self.n, self.n), q.dtype)
        for i, (link, row) in enumerate(zip(self.robot.links, self.rows, strict=True)):
            D[row, row] = link.joint.viscous_friction
            if i in self.structure.windups:
                windup = self.structure.windups[i]
                D[windup, windup] = link.joint.windup_damping
            if self.structure.own[i]:
                own = slice(self.structure.own[i][0].start, self.structure.own[i][-1].stop)
                alpha, beta = self._rayleigh[i]
                D[own, own] = beta * K[own, own]
                if alpha:
                    D[own, own] += alpha * self._clamped_mass(i, q)[own, own]
        return D

    def coulomb(self, qd: np.ndarray) -> np.ndarray:
        """Coulomb friction of the joints, on the left-hand side (57).

        Args:
            qd: rates (n,).

        Returns:
            Generalised forces (n,).
        """
        out = np.zeros(self.n)
        out[self.rows] = self._coulomb * np.tanh(qd[self.rows] / COULOMB_RATE)
        return out

    def forces(self, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
        """The forces that a motion needs (59), without Coulomb friction.

        Args:
            q: configuration (n,).
            qd: its rates (n,).
            qdd: its accelerations (n,).

        Returns:
            Generalised forces (n,).
        """
        return (
            self.mass(q) @ qdd
            + self.bias(q, qd)
            + self.damping(q) @ qd
            + self.elastic(q)
            + self.gravity(q)
        )

    def terms(self, q: np.ndarray, qd: np.ndarray) -> Terms:
        """All of (25) but drives and Coulomb friction, in one sweep for a time loop.

        Args:
            q: configuration (n,).
            qd: its rates (n,).

        Returns:
            The terms.
        """
        states = self.structure.states(q, qd)
        sums, flow = self._inertia(states, self._g)
        K, D = (
            self._constant
            if not self._sleeved
            else (K := self.stiffness_blocks(q), self._damping(K, q))
        )
        return Terms(self._mass(sums), sums.forces + flow, self._elastic(K, q), K, D)

    @cached_property
    def _constant(self) -> tuple[np.ndarray, np.ndarray]:
        """K and D (n, n) of a robot without flexible links in sleeves, whose matrices depend on no
        q."""
        return self._diagonal, self.damping(np.zeros(self.n))

    def observe(self, q: np.ndarray, qd: np.ndarray, stations: int) -> np.ndarray:
        """What a Run shows of a state, in the order of `recorder.channel_units` (4), (6).

        Link by link x, y [m] and angle [rad] of its proximal end. If it bends, also its tip's
        distance across the tangent at its hub (sleeve) [m], the tip's angle to it [rad], and that
        distance at equally spaced abscissas [m]. Then x, y of the tip; kinetic, strain and
        potential energy [J].

        Args:
            q: configuration (n,).
            qd: its rates (n,).
            stations: number of abscissas.

        Returns:
            The row.
        """
        states, out = self.structure.states(q, qd), []
        for state, link in zip(states, self.robot.links, strict=True):
            root, hub = self.structure.root(state), state.hub
            out += [root.real, root.imag, hub.angle]
            if state.lines:
                places = self.structure.places(state, np.linspace(0.0, link.length_m, stations))
                across = (
                    (np.append(state.tip.place, places) - hub.place) * hub.tangent.conjugate()
                ).imag
                out += [across[0], state.tip.angle - hub.angle, *across[1:]]
        tip = states[-1].tip.place
        return np.array([*out, tip.real, tip.imag, *self._energies(states, q, qd)])

    def energies(self, q: np.ndarray, qd: np.ndarray) -> Energies:
        """The energies in a state: kinetic (20), strain (9), of gravity (23).

        Args:
            q: configuration (n,).
            qd: its rates (n,).

        Returns:
            Energies [J].
        """
        return self._energies(self.structure.states(q, qd), q, qd)

    def _energies(self, states: list[LinkState], q: np.ndarray, qd: np.ndarray) -> Energies:
        parts = [part for state in states for part in self.structure.masses(state)]
        return Energies(
            float(0.5 * qd @ self._mass(masses.total(parts)) @ qd),
            self.strain(q, self.stiffness_blocks(q)),
            masses.potential(parts, self._g),
        )

    def strain(self, q: np.ndarray, K: np.ndarray) -> float:
        """The strain energy (9), (108), (109).

        Args:
            q: configuration (n,).
            K: its `stiffness_blocks` (n, n).

        Returns:
            Energy [J].
        """
        strained = q - self._rest
        return float(0.5 * strained @ K @ strained)

    def loss(self, q: np.ndarray, qd: np.ndarray) -> float:
        """The power that damping and friction take (28).

        Args:
            q: configuration (n,).
            qd: its rates (n,).

        Returns:
            Power [W].
        """
        return float(qd @ (self.damping(q) @ qd + self.coulomb(qd)))

    def tip(self, q: np.ndarray, qd: np.ndarray | None = None) -> Frame:
        """The frame of the robot's tip, with the columns of its place and angle (39).

        Args:
            q: configuration (n,).
            qd: its rates (n,); None: at rest.

        Returns:
            The frame.
        """
        return (self._at_rest(q) if qd is None else self.structure.states(q, qd))[-1].tip

    def loads(self, q: np.ndarray, rows: np.ndarray, values: np.ndarray) -> np.ndarray:
        """The generalised forces of forces and moments on links (135).

        Args:
            q: configuration (n,).
            rows: where they act (L, 3): link from 0, abscissa [m], 1 if the force is along and
                across the line there (134).
            values: the force's two components [N] and the moment [N m], (L, 3).

        Returns:
            Generalised forces (n,).
        """
        states, out = self._at_rest(q), np.zeros(self.n)
        for (link, at, turns), (x, y, moment) in zip(rows, values, strict=True):
            frame = self.structure.at(states[int(link)], float(at))
            force = complex(x, y) * (frame.tangent if turns else 1.0)
            out += np.real(frame.velocity.conj() * force) + moment * frame.turning
        return out

    def line(
        self, q: np.ndarray, link: int, s: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The shape of a link (3).

        Args:
            q: configuration (n,).
            link: its number, from 1.
            s: abscissas along it (S,) [m].

        Returns:
            x, y [m] and the tangent's angle [rad], each (S,).
        """
        state = self._at_rest(q)[link - 1]
        frames = [self.structure.at(state, float(x)) for x in np.atleast_1d(s)]
        place = np.array([f.place for f in frames])
        return place.real, place.imag, np.array([f.angle for f in frames])

    def tip_deflections(self, q: np.ndarray) -> np.ndarray:
        """The tips of the flexible links across the tangents at their hubs: r_y (6).

        Args:
            q: configuration (n,).

        Returns:
            (k,) [m].
        """
        states = [state for state in self._at_rest(q) if state.lines]
        return np.array(
            [((s.tip.place - s.hub.place) * s.hub.tangent.conjugate()).imag for s in states]
        )

    def _at_rest(self, q: np.ndarray) -> list[LinkState]:
        return self.structure.states(q, np.zeros_like(q))

    def _clamped_mass(self, i: int, q: np.ndarray) -> np.ndarray:
        """M (n, n) of link i alone, straight and clamped, with the payload of the last one (26)."""
        straight, still = np.zeros_like(q), np.zeros_like(q)
        straight[self.rows[i]] = q[self.rows[i]]
        state = self.structure.link(i, base(self.n, q.dtype), straight, still)
        return masses.total(self.structure.own_masses(state)).mass
