"""What acts on a robot, and dz/dt of its state z = (q, v, work, loss, rise of the strain
energy)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...signals import Drive, Loads, Signal
from ...system import System
from ...system.assembly import COULOMB_RATE, Terms


class Equations:
    """The dense equations (25) under a drive.

    Args:
        system: the robot.
        drive: a Drive, a function of four arguments, or None where `held` has the forces.
        loads: forces and moments on links.
    """

    def __init__(
        self, system: System, drive: Drive | Callable[..., np.ndarray] | None, loads: Loads
    ) -> None:
        from scipy.linalg.lapack import dposv

        self.system, self.drive, self.loads = system, drive, loads
        # the latest time [s] at which signals are read, just before the next break
        self.until = np.inf
        self.held: np.ndarray | None = None  # forces (N,) of a sampled drive since the last tick
        self.n, self.rows = system.n, system.joint_rows
        self.motions: list[Signal | None] = [None] * len(self.rows)
        if isinstance(drive, Drive):
            self.motions = [
                joint.motion if follows else None
                for joint, follows in zip(drive.joints, drive.follows)
            ]
        self.given = np.array(
            [i for i, motion in enumerate(self.motions) if motion is not None], dtype=int
        )
        # rows whose accelerations are unknown
        self.free = np.setdiff1d(system.free_rows, self.rows[self.given])
        self._pick, self._square = np.ix_(self.free, self.free), len(self.free) == self.n
        self._solve = dposv
        self._coulomb = np.array([link.joint.coulomb_friction for link in system.robot.links])
        self.evaluations = 0
        self.seen: tuple[Terms, np.ndarray, np.ndarray]  # the last terms (25), and q, v (n,) there

    def state(self, t: float, z: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """q, v and the accelerations that are prescribed (n,), with the joints that follow a motion
        on it."""
        q, v, a = z[: self.n].copy(), z[self.n : 2 * self.n].copy(), np.zeros(self.n)
        for i in self.given:
            row, motion = self.rows[i], self.motions[i]
            assert motion is not None
            q[row], v[row], a[row] = motion(min(t, self.until))
        return q, v, a

    def rates(self, t: float, z: np.ndarray) -> np.ndarray:
        """dz/dt; 0 in the rows of joints that follow a motion."""
        return self.acted(t, z)[0]

    def acted(self, t: float, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """dz/dt, and the forces of the drives (N,), those that a motion needs included (25), (28),
        (135)."""
        q, v, a = self.state(t, z)
        self.evaluations += 1
        if self.held is not None:
            force = self.held.copy()
        elif isinstance(self.drive, Drive):
            force = self.drive(min(t, self.until), q[self.rows], v[self.rows])
        else:
            assert self.drive is not None
            force = self.drive(t, q[self.rows], v[self.rows], self.deflection(q)).copy()
        terms, free = self.system.assembly.terms(q, v), self.free
        self.seen = terms, q, v
        lost = terms.damping @ v
        if self._coulomb.any():
            lost += self.system.assembly.coulomb(v)
        left = -terms.forces - terms.elastic - lost
        if len(self.given):
            left -= terms.mass @ a
        left[self.rows] += force
        pushed = np.zeros(self.n)
        if self.loads:
            values = self.loads.values(min(t, self.until))
            pushed = self.system.assembly.loads(q, self.loads.rows, values)
            left += pushed
        if len(free):
            _, a[free], singular = self._solve(
                terms.mass if self._square else terms.mass[self._pick], left[free]
            )
            if singular:
                raise np.linalg.LinAlgError
        rates = np.concatenate([v, a, [0.0, v @ lost, terms.elastic @ v]])
        if len(self.given):
            row = self.rows[self.given]
            force[self.given] = (terms.mass @ a + terms.forces + terms.elastic + lost - pushed)[row]
            rates[row] = rates[self.n + row] = 0.0
        rates[2 * self.n] = force @ v[self.rows] + pushed @ v
        return rates, force

    def energy(self) -> float:
        """The kinetic and strain energy at the last evaluation [J]."""
        terms, q, v = self.seen
        strain = self.system.assembly.strain(q, terms.stiffness)
        return 0.5 * float(v @ terms.mass @ v) + strain

    def strain(self, z: np.ndarray) -> float:
        """The strain energy in the state z [J]."""
        q = z[: self.n]
        return self.system.assembly.strain(q, self.system.assembly.stiffness_blocks(q))

    def deflection(self, q: np.ndarray) -> float:
        """The tip deflection of the last flexible link [m], 0 without one."""
        found = self.system.assembly.tip_deflections(q)
        return float(found[-1]) if len(found) else 0.0

    def linear(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """M, K and D (m, m) in the free rows at the last evaluation, with the drives' gains and the
        slope of friction (87)."""
        terms, _, v = self.seen
        K, D = terms.stiffness.copy(), terms.damping.copy()
        D[self.rows, self.rows] += (
            self._coulomb / COULOMB_RATE * (1 - np.tanh(v[self.rows] / COULOMB_RATE) ** 2)
        )
        if isinstance(self.drive, Drive):
            K[self.rows, self.rows] += self.drive.gains[:, 0]
            D[self.rows, self.rows] += self.drive.gains[:, 1]
        return terms.mass[self._pick], K[self._pick], D[self._pick]

    def slope(self, t: float, z: np.ndarray) -> np.ndarray:
        """The slope of dz/dt by z, of the linear forces alone: Newton's matrix of the implicit
        method."""
        n, free, out = self.n, self.free, np.zeros((len(z), len(z)))
        q, v, _ = self.state(t, z)
        terms = self.system.assembly.terms(q, v)
        self.seen = terms, q, v
        M, K, D = self.linear()
        out[free, n + free] = 1.0
        out[np.ix_(n + free, np.append(free, n + free))] = -np.linalg.solve(M, np.hstack([K, D]))
        out[2 * n + 1, n : 2 * n] = 2 * terms.damping @ v
        out[2 * n + 2, :n], out[2 * n + 2, n : 2 * n] = terms.stiffness @ v, terms.elastic
        return out
