"""The unknowns of a robot: their names, rows, limits and start."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..io import array
from ..robot import Robot
from .nodes import Nodes
from .structure import Structure, structure

_UNITS = {
    "rotation": "rad",
    "bubble": "rad",
    "shape": "rad",
    "mode": "kg^(1/2) m",
    "windup": "rad",
}


@dataclass(frozen=True)
class Numbering:
    """The unknowns q (n,) of a robot, which `labels` names.

    They are numbered [joint 1, elastic unknowns of link 1, joint 2, ...]. The elastic unknowns of a
    mesh are the rotation across each element and its bubble [rad] (10); of a link in its own modes
    mass-normalised coordinates [kg^(1/2) m]; of a link in a sleeve its shapes [rad] (12).

    Attributes:
        robot: the robot.
        nodes: that sliders and sleeves keep where they go from node to node, as `nodes.Nodes`.
    """

    robot: Robot
    nodes: tuple[int, ...] | None = None

    @cached_property
    def _structure(self) -> Structure:
        """The numbering and the pieces with shapes of their own: found once, for the modes of links
        cost time."""
        return structure(self.robot)

    @property
    def n(self) -> int:
        """How many unknowns there are."""
        return len(self.labels)

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """Names and units of the unknowns, for example "link/1/element/2/rotation [rad]"."""
        return tuple(f"{name} [{self._unit(name)}]" for name in self._structure.labels)

    @cached_property
    def joint_rows(self) -> np.ndarray:
        """Rows of the joints in q, (links,)."""
        return np.array([row for row, name in enumerate(self.labels) if name.startswith("joint/")])

    @cached_property
    def elastic_rows(self) -> np.ndarray:
        """Rows of the elastic unknowns in q, without those of nodes at rest in a sleeve."""
        return np.setdiff1d(np.arange(self.n), np.append(self.joint_rows, self._resting))

    @cached_property
    def locked(self) -> np.ndarray:
        """Which joints are locked, (links,) bool."""
        return np.array([link.joint.locked for link in self.robot.links])

    @cached_property
    def free_rows(self) -> np.ndarray:
        """Rows of q that can move: all but locked joints and nodes at rest in a sleeve."""
        return np.setdiff1d(
            np.arange(self.n), np.append(self.joint_rows[self.locked], self._resting)
        )

    @property
    def _resting(self) -> np.ndarray:
        made = self._structure
        if self.nodes is None:
            return np.zeros(0, dtype=int)
        return Nodes(made.robot, made.links, made.linear, self.nodes).resting

    @cached_property
    def windup_rows(self) -> dict[int, int]:
        """Rows of the windups of transmissions, by the number of the link (from 0) (109)."""
        return self._structure.windups

    def link_rows(self, link: int) -> np.ndarray:
        """Rows of the elastic unknowns of a link, without the windup of its joint.

        Args:
            link: number of the link, from 0.

        Returns:
            Indices into q (k,).
        """
        ends = np.append(self.joint_rows, self.n)
        return np.arange(ends[link] + 1 + (link in self.windup_rows), ends[link + 1])

    def hub_positions(self, z: np.ndarray) -> np.ndarray:
        """Positions, or rates, of the joints' hubs: behind a transmission the rotor's and the
        windup (109).

        Args:
            z: configurations, or rates (..., n).

        Returns:
            (..., links).
        """
        out = np.array(z[..., self.joint_rows])
        for link, row in self.windup_rows.items():
            out[..., link] += z[..., row]
        return out

    @cached_property
    def limits(self) -> np.ndarray:
        """Lower and upper limits of the joints (links, 2) [m or rad]: those of the file, and the
        ends of the links that slide."""
        own = np.array([link.joint.limits or (-np.inf, np.inf) for link in self.robot.links])
        ends = np.array([self.robot.travel(i) for i in range(len(self.robot.links))])
        return np.column_stack(
            [np.maximum(own[:, 0], ends[:, 0]), np.minimum(own[:, 1], ends[:, 1])]
        )

    def start(self) -> np.ndarray:
        """The configuration at the start (n,): joints at their `start`, links straight."""
        q = np.zeros(self.n)
        q[self.joint_rows] = self.robot.start
        return q

    @property
    def exact(self) -> bool:
        """Whether the robot is on the exact line, which the compiled core has; else the
        dissertation's model is asked for."""
        return self.robot.stiffening and not self.robot.nodal

    def check(self, q: ArrayLike, key: str = "q") -> np.ndarray:
        """A checked vector of the unknowns.

        Args:
            q: what was given.
            key: name of the argument, for the message.

        Returns:
            An array (n,) of floats.

        Raises:
            InputError: another shape, or a robot that slides from node to node.
        """
        if self.robot.nodal and self.nodes is None:
            text = (
                'expected "continuous": sliding from node to node has other matrices between '
                "every two nodes"
            )
            raise InputError(text, key="sliding", value="nodal")
        return self._array(q, key)

    def _array(self, q: ArrayLike, key: str) -> np.ndarray:
        expected = f"expected an array of shape ({self.n},), in the order of system.labels"
        found = array(q, key, expected)
        if found.shape != (self.n,):
            raise InputError(expected, key=key, value=found.shape)
        return found

    def _unit(self, name: str) -> str:
        parts = name.split("/")
        if parts[0] != "joint":
            return _UNITS[parts[-1] if parts[2] == "element" else parts[2]]
        return "rad" if self.robot.links[int(parts[1]) - 1].joint.type == "R" else "m"
