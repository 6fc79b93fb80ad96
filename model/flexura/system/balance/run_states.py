"""The states of a run, with what follows from them: accelerations, and the balance of forces."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np

from ...signals import Loads
from ..loads import load_forces
from ..system import System
from .cuts import Balance
from .internal_forces import check_continuous, point_loads

ROWS = 500  # times in one block, which bounds the memory that a balance takes


class RunStates:
    """Some states of a run under drives and loads.

    Args:
        system: the robot.
        t: times (T,) [s].
        q: configurations (T, n).
        qd: their rates (T, n).
        drive: forces of the drives (T, links) [N or N m].
        loads: forces and moments on links.
    """

    def __init__(
        self,
        system: System,
        t: np.ndarray,
        q: np.ndarray,
        qd: np.ndarray,
        drive: np.ndarray,
        loads: Loads,
    ) -> None:
        self.system, self.t, self.q, self.qd = system, t, q, qd
        self.drive, self.loads = drive, loads

    def blocks(self) -> Iterator[RunStates]:
        """The same states, of at most 500 times each; one block of no time, if there is none."""
        for first in range(0, max(len(self.t), 1), ROWS):
            part = slice(first, first + ROWS)
            t, q, qd, drive = (x[part] for x in (self.t, self.q, self.qd, self.drive))
            yield RunStates(self.system, t, q, qd, drive, self.loads)

    @cached_property
    def accelerations(self) -> np.ndarray:
        """The accelerations of the unknowns (T, n) (44), with Coulomb friction (57)."""
        system = self.system
        force = load_forces(system, self.q, self.loads, self.t).copy()
        force[:, system.joint_rows] += self.drive
        coulomb = [system.assembly.coulomb(rates) for rates in self.qd]
        force -= np.array(coulomb).reshape(self.q.shape)
        rows = zip(self.q, self.qd, force, strict=True)
        return np.array([system.accelerations(*row) for row in rows]).reshape(self.q.shape)

    @cached_property
    def balance(self) -> Balance:
        """The balance of forces beyond any cut. Raises InputError for a robot that slides from node
        to node."""
        check_continuous(self.system)
        acting = point_loads(self.loads, self.t)
        structure = self.system.assembly.structure
        return Balance(structure, self.q, self.qd, self.accelerations, acting)
