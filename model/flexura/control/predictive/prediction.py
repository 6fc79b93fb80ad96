"""The robot ahead of a predictive controller: exact derivatives along a motion, and steps that damp
fast modes."""

from __future__ import annotations

import numpy as np

from ...system import System


class Prediction:
    """Small motions about states along a predicted motion, over intervals of their own lengths
    (151).

    Args:
        system: the robot.
        driven: its free joints, from 0.
    """

    def __init__(self, system: System, driven: list[int]) -> None:
        self.system, self.free = system, system.free_rows
        self.count, self.inputs = len(self.free), len(driven)
        columns = [int(np.flatnonzero(self.free == system.joint_rows[i])[0]) for i in driven]
        self.joint_columns = np.array(columns)
        self.push = np.zeros((self.count, self.inputs))
        self.push[columns, range(self.inputs)] = 1.0
        self.whole = self.count == system.n
        self.pick = np.ix_(self.free, self.free)

    def full(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Unknowns and rates (T, n) of states (T, 2m) of what moves."""
        if self.whole:
            return x[:, : self.count].copy(), x[:, self.count :].copy()
        q = np.tile(self.system.start(), (len(x), 1))
        v = np.zeros_like(q)
        q[:, self.free], v[:, self.free] = x[:, : self.count], x[:, self.count :]
        return q, v

    def rates(
        self, x: np.ndarray, u: np.ndarray, guess: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """x' = f(x, u) and its derivatives by state and forces, by the core's dual numbers.

        From F(q, v, a) = E u with F_q, F_v at accelerations that are nearly those of the motion:
        the derivatives are exact where `guess` is the acceleration itself.

        Args:
            x: states (T, 2m).
            u: forces of the drives (T, inputs).
            guess: accelerations (T, m), nearly.

        Returns:
            f (T, 2m), A (T, 2m, 2m), B (T, 2m, inputs).
        """
        m = self.count
        q, v = self.full(x)
        a = np.ascontiguousarray(guess)
        if not self.whole:
            a = np.zeros_like(q)
            a[:, self.free] = guess
        force, K, G, M, _, _ = self.system.equations.force_derivatives(q, v, a)
        if not self.whole:
            rows, columns = self.pick
            force = force[:, self.free]
            K, G, M = (X[:, rows, columns] for X in (K, G, M))
        push = np.broadcast_to(self.push, (len(x), *self.push.shape))
        missed = (force - u @ self.push.T)[..., None]
        solved = np.linalg.solve(M, np.concatenate([K, G, missed, push], axis=2))
        A = np.zeros((len(x), 2 * m, 2 * m))
        A[:, :m, m:] = np.eye(m)
        A[:, m:] = -solved[:, :, : 2 * m]
        B = np.zeros((len(x), 2 * m, self.inputs))
        B[:, m:] = solved[:, :, 2 * m + 1 :]
        return np.concatenate([x[:, m:], guess - solved[:, :, 2 * m]], axis=1), A, B

    def steps(
        self, f: np.ndarray, A: np.ndarray, B: np.ndarray, h: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Steps of Radau IIA of order 3 on x' = f + A dx + B du, du held (151).

        Args:
            f: rates (T, 2m).
            A: their derivatives by the state (T, 2m, 2m).
            B: by the forces (T, 2m, inputs).
            h: lengths (T,) [s].

        Returns:
            R (T, 2m, 2m), G (T, 2m, inputs), c (T, 2m): x + R dx + G du + c after the step.
        """
        H = h[:, None, None]
        Z = H * A
        one = np.eye(A.shape[1])
        square = Z @ Z
        D = one - (2 / 3) * Z + square / 6
        held = H * np.concatenate([B, f[..., None]], axis=2)
        right = np.concatenate([one + Z / 3, held - Z @ held / 6], axis=2)
        out = np.linalg.solve(D, right)
        n = A.shape[1]
        return out[:, :, :n], out[:, :, n:-1], out[:, :, -1]
