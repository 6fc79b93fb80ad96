"""Sliding from node to node: the structure of a robot while its sliders and sleeves keep their
nodes.

Dissertation, table 2.1. Pa: the hub sits at d along the axis of the link that it rides on, and
turns and moves across the axis with node k = ceil(d / l_e). Pb: the mesh is fixed to the link, node
k at X_k = k L / n. Nodes in the sleeve, X_k <= L - d, are at rest on its axis, so that the link is
clamped at the last of them: up to l_e behind the sleeve's exit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..robot import Link, Robot
from .kinematics import Frame, rotate, station, translate
from .structure import LinkState, Structure

SAME = 1e-9  # of an element: on the node


@dataclass(frozen=True)
class Nodes(Structure):
    """The structure with the node of each link (38): of a sleeved one the last at rest, of a slider
    the one that it takes, else 0."""

    nodes: tuple[int, ...] = ()

    @property
    def resting(self) -> np.ndarray:
        """The unknowns of the elements that end at nodes at rest."""
        each = [
            row + 1 + np.arange(2 * k)
            for row, k, link in zip(self.rows, self.nodes, self.robot.links)
            if rests_in_sleeve(link)
        ]
        return np.concatenate([np.zeros(0, dtype=int), *each])

    def sleeved(self, i: int) -> bool:
        """Whether link i is a rigid one in a sleeve: a flexible one moves with its mesh, which
        begins at its proximal end."""
        return super().sleeved(i) and not self.links[i]

    def link(self, i: int, hub: Frame, q: np.ndarray, qd: np.ndarray) -> LinkState:
        """Link i in a state; of a sleeved one `hub` is the exit, and the mesh begins L - d behind
        it."""
        if not rests_in_sleeve(self.robot.links[i]):
            return super().link(i, hub, q, qd)
        root = translate(hub, q[self.rows[i]] - self.robot.links[i].length_m, [self.rows[i]], qd)
        return super().link(i, root, q, qd)._replace(hub=hub)

    def _hub(self, i: int, before: LinkState | None, q: np.ndarray, qd: np.ndarray) -> Frame:
        if before is None or not self.robot.rides(i):
            return super()._hub(i, before, q, qd)
        line, k = before.lines[0], self.nodes[i]
        at = k / self.robot.links[i - 1].elements
        node, root = station(line, at), line.start
        moved = translate(root, q[self.rows[i]] - at * line.free, [self.rows[i]], qd)
        frame = node._replace(
            place=node.place + moved.place - root.place,
            velocity=node.velocity + moved.velocity - root.velocity,
            rest=node.rest + moved.rest - root.rest,
        )
        return rotate(frame, self.robot.links[i].joint.angle_rad)


def rests_in_sleeve(link: Link) -> bool:
    """Whether a sleeve has nodes of this link at rest."""
    return link.joint.type == "Pb" and link.flexible


def nodes_at(robot: Robot, position: np.ndarray) -> tuple[int, ...]:
    """The nodes (N,) of `Nodes` with the joints at `position` (N,) (38); one element at least is
    ahead of a sleeve."""
    out: list[int] = []
    for i, (link, x) in enumerate(zip(robot.links, position)):
        node = 0
        if rests_in_sleeve(link):
            node = int(
                np.clip(
                    np.floor(link.elements * (1 - x / link.length_m) + SAME), 0, link.elements - 1
                )
            )
        elif robot.rides(i):
            under = robot.links[i - 1]
            first = out[i - 1] + 1 if rests_in_sleeve(under) else 1
            node = int(
                np.clip(np.ceil(under.elements * x / under.length_m - SAME), first, under.elements)
            )
        out.append(node)
    return tuple(out)


def place(link: Link, node: int) -> float:
    """Where a node is from the link's proximal end [m]."""
    return link.length_m * node / link.elements


def rest_node(structure: Nodes, i: int, node: int, y: np.ndarray) -> None:
    """Set deflection and angle of a node of link i to 0 in y (n,), unknowns or their rates; what
    other nodes have stays.

    The deflection is the integral of the angle, for the exact line too. All nodes before this one
    are at 0.
    """
    link, h = (
        structure.robot.links[i],
        structure.robot.links[i].length_m / structure.robot.links[i].elements,
    )
    own = structure.own[i][0].start + 2 * (node - 1)
    means = (
        structure.links[i][0].integrals(np.arange(1, link.elements + 1) / link.elements)
        @ structure.links[i][0].B
    )
    # of the angle over each element, by all unknowns
    mean = link.elements * np.diff(means, axis=0, prepend=0.0)
    k = own - structure.own[i][0].start
    angle, deflection = y[own], h * mean[node - 1, k : k + 2] @ y[own : own + 2]
    y[own : own + 2] = 0.0
    if node < link.elements:  # the next element: its end stays, its start goes
        before = y[own + 2 : own + 4].copy()
        level = mean[node, k + 2 : k + 4]
        rise = angle + level @ before + deflection / h
        y[own + 2] = before[0] + angle
        y[own + 3] = (rise - level[0] * y[own + 2]) / level[1]
