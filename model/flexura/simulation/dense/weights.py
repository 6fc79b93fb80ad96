"""What an error weighs: metres at the robot's tips over the tolerance (81), (82)."""

from __future__ import annotations

import numpy as np

from ...system import System

WAY, START = 1e-3, 1e-6  # of the tips' way; of the robot's length, before anything has moved
INSIDE = 0.1  # what a shape that leaves the tip where it is still weighs
LEAST = 0.01  # of the robot's length: the lever of a joint that turns nothing long


class Weights:
    """The sizes of a run so far (81), and by how much each number of a state may be wrong (82).

    `tolerance` (2n + 3,) belongs to z = (q, v, work, loss, strain); an error e is good if e /
    tolerance has a norm below 1.
    """

    def __init__(self, system: System, rtol: float, z: np.ndarray) -> None:
        self.n, self.rtol, self.rows = system.n, rtol, system.joint_rows
        self.lever, self.deflect, self.reach = _levers(system)
        slow = np.zeros(self.n)
        slow[system.free_rows] = self.reach * START / self.lever[system.free_rows]
        self._begun, self._sizes = z[self.rows].copy(), np.full(5, -1.0)
        self.grow(z, sum(system.assembly.energies(z[: self.n], slow)[:2]))

    def grow(self, z: np.ndarray, energy: float = 0.0) -> None:
        """Sizes with the state z too, and with the sum of its kinetic and strain energy [J]."""
        n = self.n
        both = z[: 2 * n].reshape(2, n)
        moved = both[:, self.rows]
        moved[0] -= self._begun
        bent, way = np.abs(self.deflect @ both.T).max(axis=0), np.abs(moved) @ self.lever[self.rows]
        sizes = np.maximum(
            self._sizes, [*bent, *(WAY * way), max(energy, *np.abs(z[2 * n : 2 * n + 2]).tolist())]
        )
        if np.any(sizes > self._sizes):
            self._sizes, least = sizes, self.reach * START
            place, rate = max(sizes[0], sizes[2], least), max(sizes[1], sizes[3], least)
            joules = np.full(3, max(sizes[4], 1e-280))
            self.tolerance = self.rtol * np.concatenate(
                [place / self.lever, rate / self.lever, joules]
            )


def _levers(system: System) -> tuple[np.ndarray, np.ndarray, float]:
    """How far a unit of each unknown moves a tip at most (n,); the tip of each link across its
    hub's axis (links, n); the robot's length: of the straight robot [m]."""
    structure, links = system.assembly.structure, system.robot.links
    lever, deflect, beyond = np.ones(system.n), np.zeros((len(links), system.n)), 0.0
    for i in range(len(links) - 1, -1, -1):
        own = 0.0  # length of the link's pieces beyond
        for piece, rows in zip(structure.links[i][::-1], structure.own[i][::-1], strict=True):
            tip, inside = (piece.length * piece.weights @ B for B in (piece.B, np.abs(piece.B)))
            deflect[i, rows] = tip + piece.B_tip * own
            lever[rows] = np.maximum(np.abs(tip), INSIDE * inside) + np.abs(piece.B_tip) * (
                own + beyond
            )
            own += piece.length
        beyond += links[i].length_m
        if i in system.windup_rows:
            lever[system.windup_rows[i]], deflect[i, system.windup_rows[i]] = beyond, own
        if links[i].joint.type == "R":
            lever[system.joint_rows[i]] = beyond
    reach = beyond if beyond > 1e-9 else 1.0
    turns = [row for row, link in zip(system.joint_rows, links) if link.joint.type == "R"]
    turns += system.windup_rows.values()
    lever[turns] = np.maximum(lever[turns], LEAST * reach)
    return lever, deflect, reach
