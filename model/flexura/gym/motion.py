"""Many copies of one robot that the compiled core moves from one action to the next."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import core
from ..errors import InputError
from ..io import tick_rate, whole
from ..population import cores
from ..population.rows import one
from ..robot import robot_of
from ..system import assemble

STEPS = 4  # of the integration, between two actions at 50 Hz


class Motion:
    """B copies of a robot and their states; a step holds the forces of the joints for 1/rate.

    Each is moved by equal steps of a method of order 2 (86): their error falls by four where
    `steps` is doubled. `flexura.simulate` has the same equations and controls its error.

    Args:
        robot: a Robot, or the path or name of a robot file.
        count: number of copies, B.
        rate_Hz: of the actions.
        steps: of the integration between two actions; one takes in some 5 ms of motion.
        threads: of the core; None: one a core of the processor.

    Attributes:
        q: configurations (B, n).
        v: their rates (B, n).
        bent: tip deflections of the flexible links (B, k) [m].
        tip: x and y of the tip (B, 2) [m], known after a step.

    Raises:
        InputError: an argument is not what is expected.
    """

    def __init__(
        self,
        robot: Any,
        count: int,
        rate_Hz: float = 50.0,
        steps: int = STEPS,
        threads: int | None = None,
    ) -> None:
        self.robot = robot_of(robot)
        self.count = whole(count, "count", 1)
        rate = tick_rate(rate_Hz)
        if not self.robot.stiffening or self.robot.nodal:
            expected = 'expected a robot with stiffening = true and sliding = "continuous"'
            raise InputError(expected, key="robot", value=self.robot.name)
        self.system = assemble(self.robot)
        self.steps = whole(steps, "steps", 1)
        self.step_s = 1.0 / rate / self.steps
        self.threads = cores() if threads is None else whole(threads, "threads", 1)
        self.limits = one(self.robot).of([0]).limits[0]
        self._bounds = np.ascontiguousarray(self.limits.T)
        self._copies = core.Copies(self.system.equations)
        n = self.system.n
        self.q, self.v = np.zeros((self.count, n)), np.zeros((self.count, n))
        self.bent = np.zeros((self.count, sum(link.flexible for link in self.robot.links)))
        self.tip = np.zeros((self.count, 2))

    @property
    def position(self) -> np.ndarray:
        """Positions of the joints (B, N) [m or rad]."""
        return self.system.hub_positions(self.q)

    @property
    def velocity(self) -> np.ndarray:
        """Velocities of the joints (B, N) [m/s or rad/s]."""
        return self.system.hub_positions(self.v)

    def start(self, which: np.ndarray, position: np.ndarray) -> None:
        """Put robots at rest with straight links.

        Args:
            which: their numbers from 0 (K,).
            position: of their joints (K, N) [m or rad].
        """
        self.q[which], self.v[which], self.bent[which] = 0.0, 0.0, 0.0
        self.q[np.ix_(which, self.system.joint_rows)] = position

    def step(self, force: np.ndarray, which: np.ndarray | None = None) -> np.ndarray:
        """Move robots on to their next action.

        Args:
            force: of the joints (K, N) [N m or N], held until then.
            which: numbers of the robots from 0 (K,); None: all.

        Returns:
            Whether each got there (K,); one that met a limit, or whose state is not a number any
            more, stays where it was.
        """
        moves, forces = np.ones(self.count, dtype=bool), force
        if which is not None:
            moves[:] = False
            moves[which] = True
            forces = np.zeros((self.count, len(self.limits)))
            forces[which] = force
        arrived = np.zeros(self.count, dtype=bool)
        self._copies.advance(
            self.q,
            self.v,
            np.ascontiguousarray(forces, dtype=float),
            self._bounds,
            moves,
            self.bent,
            self.tip,
            arrived,
            self.step_s,
            self.steps,
            self.threads,
        )
        return arrived if which is None else arrived[which]
