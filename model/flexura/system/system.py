"""A robot assembled: numbering, matrices and forces in any state."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ..core import Mechanics
from ..errors import InputError, guarded
from ..io import STATIONS, array, number, summary
from ..link.line import Piece, whole_piece
from ..link.shapes import coefficients_of_legendre_sums, legendre_shapes
from ..robot import Robot, robot_of
from .assembly import Assembly
from .constants import equations
from .nodes import Nodes, nodes_at
from .numbering import Numbering
from .structure import Structure

# A System, a Robot, or the path or name of a robot file.
RobotLike: TypeAlias = "System | Robot | str | os.PathLike[str]"


@dataclass(frozen=True)
class System(Numbering):
    """A robot's equations M(q) qdd + bias(q, qd) + damping qd + elastic(q) + gravity(q) = F (25).

    It checks arguments and answers from an `Assembly` or from the compiled core.

    `Numbering` says what q (n,) is. F has entries in the joints' rows. A System is constant;
    solvers keep their memory apart from it.
    """

    def __repr__(self) -> str:
        return summary.text(*self._summary())

    def _repr_html_(self) -> str:
        return summary.html(*self._summary())

    def _summary(self) -> tuple[str, list[tuple[str, str]]]:
        joints = len(self.joint_rows)
        model = "exact line" if self.exact else "the dissertation's linear line"
        rows = [
            ("unknowns", f"{self.n}: {joints} of joints, {self.n - joints} elastic"),
            ("labels", summary.listed(self.labels)),
            ("model", model),
        ]
        rows += [] if self.nodes is None else [("nodes", summary.listed(self.nodes))]
        return f"System of {self.robot.name or 'a robot'}, {self.robot.structure}", rows

    def fixed(self, q: ArrayLike) -> System:
        """The robot of fixed structure at a configuration.

        Args:
            q: configuration (n,).

        Returns:
            This System; for one that slides from node to node, that with the nodes it has at q.
        """
        if not self.robot.nodal:
            return self
        at = self._array(q, "q")
        return replace(self, nodes=nodes_at(self.robot, at[self.joint_rows]))

    def __getstate__(self) -> dict[str, Any]:
        return {"robot": self.robot, "nodes": self.nodes}  # the rest is computed again

    @cached_property
    def assembly(self) -> Assembly:
        """The same equations as dense sums, to be read; with the shapes that the core uses."""
        made = self._structure
        if self.nodes is not None:
            return Assembly(Nodes(made.robot, made.links, made.linear, self.nodes))
        if not self.exact:
            return Assembly(made)
        links = tuple(self._shapes(i, pieces) for i, pieces in enumerate(made.links))
        return Assembly(Structure(self.robot, links))

    @cached_property
    def equations(self) -> Mechanics:
        """The compiled equations, `core.Mechanics`. Raises InputError where the core refuses the
        robot."""
        return equations(self.robot)

    def mass(self, q: ArrayLike) -> np.ndarray:
        """The mass matrix M(q) (40).

        Args:
            q: configuration (n,).

        Returns:
            (n, n), symmetric and positive definite.
        """
        return self.assembly.mass(self.check(q))

    def stiffness(self, q: ArrayLike | None = None) -> np.ndarray:
        """The stiffness matrix: the slope of elastic and gravity forces (43), (51).

        Args:
            q: configuration (n,); None: K at the start, without loads.

        Returns:
            (n, n).
        """
        if q is None:
            return self.assembly.stiffness_blocks(self.check(self.start()))
        return self.tangent(q)

    @cached_property
    def damping(self) -> np.ndarray:
        """D (n, n) at the start: Rayleigh damping of the elastic unknowns and viscous friction of
        the joints (26)."""
        return self.damping_at(self.start())

    def damping_at(self, q: ArrayLike) -> np.ndarray:
        """The damping matrix D; it depends on the free length of a sleeved link, on nothing else
        (26).

        Args:
            q: configuration (n,).

        Returns:
            (n, n).
        """
        return self.assembly.damping(self.check(q))

    def elastic(self, q: ArrayLike) -> np.ndarray:
        """Elastic forces, on the left-hand side (43).

        Args:
            q: configuration (n,).

        Returns:
            Generalised forces (n,).
        """
        return self.assembly.elastic(self.check(q))

    def gravity(self, q: ArrayLike) -> np.ndarray:
        """Forces of gravity, on the left-hand side (42).

        Args:
            q: configuration (n,).

        Returns:
            Generalised forces (n,).
        """
        return self.assembly.gravity(self.check(q))

    def bias(self, q: ArrayLike, qd: ArrayLike) -> np.ndarray:
        """Coriolis and centrifugal forces, on the left-hand side (41).

        Args:
            q: configuration (n,).
            qd: its rates (n,).

        Returns:
            Generalised forces (n,).
        """
        return self.assembly.bias(self.check(q), self.check(qd, "qd"))

    def forces(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> np.ndarray:
        """The forces that a motion needs: the whole left-hand side without Coulomb friction (59).

        Args:
            q: configuration (n,).
            qd: its rates (n,).
            qdd: its accelerations (n,).

        Returns:
            Generalised forces (n,).
        """
        return self.assembly.forces(self.check(q), self.check(qd, "qd"), self.check(qdd, "qdd"))

    def accelerations(self, q: ArrayLike, qd: ArrayLike, force: ArrayLike) -> np.ndarray:
        """Accelerations under forces, with locked joints at rest and without Coulomb friction (44)
        to (47).

        Args:
            q: configuration (n,).
            qd: its rates (n,).
            force: generalised forces (n,).

        Returns:
            qdd (n,).
        """
        at, rates, acting = self.check(q), self.check(qd, "qd"), self.check(force, "force")
        if self.exact:
            return np.asarray(self.equations.accelerations(at, rates, acting))
        terms, out, free = self.assembly.terms(at, rates), np.zeros(self.n), self.free_rows
        left = acting - terms.forces - terms.elastic - terms.damping @ rates
        out[free] = np.linalg.solve(terms.mass[np.ix_(free, free)], left[free])
        return out

    def line(
        self, q: ArrayLike, link: int, s: ArrayLike | None = None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The shape of a link in the base's axes (3).

        Args:
            q: configuration (n,).
            link: number of the link, from 1.
            s: places along it from its proximal end (S,) [m]; None: 101 places from end to end.

        Returns:
            x, y [m] and the tangent's angle theta [rad], each (S,). Of a sleeved link what is
            inside or behind the sleeve lies on its axis.

        Raises:
            InputError: there is no such link, or a place is not on it.
        """
        places = self.abscissas(link, s)
        if self.exact:
            x, y, angle = np.array(self.equations.line(self.check(q), link - 1, places)).T.copy()
            return x, y, angle
        return self.assembly.line(self.check(q), link, places)

    def abscissas(self, link: int, s: ArrayLike | None = None) -> np.ndarray:
        """Checked places on a link.

        Args:
            link: number of the link, from 1.
            s: places along it from its proximal end (S,) [m]; None: 101 places from end to end.

        Returns:
            (S,) [m].

        Raises:
            InputError: there is no such link, or a place is not on it.
        """
        expected = f"expected a link from 1 to {len(self.robot.links)}"
        if number(link, "link", expected) not in range(1, len(self.robot.links) + 1):
            raise InputError(expected, key="link", value=link)
        length = self.robot.links[link - 1].length_m
        places = (
            np.linspace(0.0, length, 101)
            if s is None
            else np.atleast_1d(array(s, "s", "expected places in metres"))
        )
        if places.ndim != 1 or not np.all((places >= 0) & (places <= length * (1 + 1e-12))):
            raise InputError(
                f"expected places from 0 to the link's length, {length:g} m", key="s", value=s
            )
        return places

    def angles(self, link: int, s: ArrayLike) -> np.ndarray:
        """What each unknown turns the tangent by, against the hub: B of (2).

        Args:
            link: number of the link, from 1; one of constant length.
            s: abscissas along it (S,) [m].

        Returns:
            (S, n).
        """
        places = np.atleast_1d(np.asarray(s, dtype=float))
        out, start = np.zeros((len(places), self.n)), 0.0
        for piece, own in zip(
            *(x[link - 1] for x in (self.assembly.structure.links, self.assembly.structure.own)),
            strict=True,
        ):
            out[:, own] = piece.shapes(np.clip((places - start) / piece.length, 0.0, 1.0))
            start += piece.length
        return out

    def observe(self, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
        """What a Run shows of states (4), (6).

        Args:
            q: configurations (T, n).
            qd: their rates (T, n).

        Returns:
            Rows of poses, deflections, tip and energies, in the order of `recorder.channel_units`
            from `link/1/x` to `energy/potential`.
        """
        if self.exact:
            return np.asarray(self.equations.observe(q, qd, STATIONS))
        return np.array([self.assembly.observe(a, b, STATIONS) for a, b in zip(q, qd, strict=True)])

    def places(self, q: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """What a Run shows of deflections and the tip.

        Args:
            q: configuration (n,).

        Returns:
            Tip deflections of the flexible links (k,) [m], and x, y of the last tip (2,) [m].
        """
        at = self.check(q)
        if self.exact:
            row = self.equations.observe(at[None], np.zeros((1, self.n)), 2)[0]
            first = np.cumsum([0] + [3 + 4 * link.flexible for link in self.robot.links])
            return row[
                [first[i] + 3 for i, link in enumerate(self.robot.links) if link.flexible]
            ], row[first[-1] : first[-1] + 2]
        return self.assembly.tip_deflections(at), np.array(
            [(tip := self.assembly.tip(at)).place.real, tip.place.imag]
        )

    def tangent(self, q: ArrayLike, qd: ArrayLike | None = None) -> np.ndarray:
        """The derivative of bias, elastic and gravity forces by q (52).

        Args:
            q: configuration (n,).
            qd: its rates (n,); None: at rest.

        Returns:
            (n, n).
        """
        at, rates = self.check(q), None if qd is None else self.check(qd, "qd")
        if self.exact:
            return np.asarray(self.equations.stiffness(at, np.zeros(0) if rates is None else rates))
        forces = lambda z: self.assembly.elastic(z) + self.assembly.gravity(z)
        if rates is not None:
            still = forces
            forces = lambda z: still(z) + self.assembly.bias(z, rates)
        return jacobian(forces, at, np.full(self.n, 1e-6))

    def rate(self, q: ArrayLike, qd: ArrayLike) -> np.ndarray:
        """The derivative of all forces by the rates: damping, friction, and gyroscopic terms (52).

        Args:
            q: configuration (n,).
            qd: its rates (n,).

        Returns:
            (n, n).
        """
        at, rates = self.check(q), self.check(qd, "qd")
        if self.exact:
            return np.asarray(self.equations.rates(at, rates))
        gyroscopic = (
            jacobian(lambda v: self.assembly.bias(at, v), rates, np.full(self.n, 1e-3))
            if rates.any()
            else 0.0
        )
        return self.assembly.damping(at) + gyroscopic

    def _shapes(self, link: int, pieces: tuple[Piece, ...]) -> tuple[Piece, ...]:
        """The pieces of a link; one in modes gets the core's modes in place of its own (all else is
        equal to the last digits)."""
        if (
            len(pieces) != 1
            or not hasattr(pieces[0].shapes, "coefficients")
            or not pieces[0].K.size
        ):
            return pieces
        B, K, _, sums = self.equations.whole_link(link)
        count = len(pieces[0].shapes.coefficients)
        if len(sums):
            coefficients = coefficients_of_legendre_sums(np.asarray(sums)[: count + 1])
        else:
            coefficients = np.linalg.lstsq(legendre_shapes(count, pieces[0].xi), B.T, rcond=None)[0]
        material = self._structure.materials[link]
        assert material is not None
        return (whole_piece(material, pieces[0].points, coefficients, K),)


@guarded("the equations of motion")
def assemble(robot: RobotLike) -> System:
    """The System of a robot.

    Args:
        robot: a Robot, the path or name of a robot file, or a System, which is returned as it is.

    Returns:
        The System.

    Raises:
        InputError: an argument is not what is expected; a joint moves no mass.
    """
    if isinstance(robot, System):
        return robot
    system = System(robot_of(robot))
    if system.exact:
        try:
            _ = system.equations
        except InputError as error:
            if isinstance(robot, Robot) or error.file:
                raise
            raise error.in_file(os.fspath(robot)) from None
    return system


def jacobian(function: Any, x: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """The derivative of a function of x (n,) by x, (m, n), by central differences with the given
    steps (n,)."""
    shifts = np.diag(steps)
    return np.column_stack(
        [(function(x + e) - function(x - e)) / (2 * h) for e, h in zip(shifts, steps, strict=True)]
    )
