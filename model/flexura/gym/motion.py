"""Many copies of one robot that the compiled core moves from one action to the next."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import core
from ..errors import InputError
from ..io import STATIONS, tick_rate, whole
from ..population import cores
from ..population.rows import one
from ..robot import robot_of
from ..signals import COLUMNS
from ..simulation.recorder import recorded_channels
from ..system import assemble

MOST_STEPS = 100_000  # of one robot between two actions


class Motion:
    """B copies of a robot and their states; a step holds the forces of the joints for 1/rate.

    Each robot moves as `flexura.simulate` moves it from its state under these forces.

    Args:
        robot: a Robot, or the path or name of a robot file.
        count: number of copies, B.
        rate_Hz: of the actions.
        rtol: relative tolerance, as in `flexura.simulate`.
        method: as in `flexura.simulate`; "auto" looks for one with each action.
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
        rtol: float = 1e-3,
        method: str = "implicit",
        threads: int | None = None,
    ) -> None:
        self.robot = robot_of(robot)
        self.count = whole(count, "count", 1)
        rate = tick_rate(rate_Hz)
        if not self.robot.stiffening or self.robot.nodal:
            expected = 'expected a robot with stiffening = true and sliding = "continuous"'
            raise InputError(expected, key="robot", value=self.robot.name)
        self.system = assemble(self.robot)
        self.rtol, self.method = float(rtol), method
        self.threads = cores() if threads is None else whole(threads, "threads", 1)
        self.t = np.array([0.0, 1.0 / rate])
        self._rows = one(self.robot).of([0] * self.count)
        self._limits = self._rows.limits
        n, links = self.system.n, len(self.robot.links)
        seen = recorded_channels(self.robot)
        deflections = [name for name in seen if name.endswith("/tip_deflection")]
        self._columns = [("state", k) for k in range(2 * n)]
        self._columns += [("seen", seen.index(k)) for k in (*deflections, "tip/x", "tip/y")]
        self._drive = core.Drive(
            np.zeros((0, COLUMNS)),
            np.zeros((links, 4), dtype=np.int64),
            np.zeros((links, 2)),
            np.zeros(links, dtype=np.uint8),
            np.zeros(links, dtype=np.uint8),
            np.tile([-np.inf, np.inf], (links, 1)),
        )
        self.q, self.v = np.zeros((self.count, n)), np.zeros((self.count, n))
        self.bent = np.zeros((self.count, len(deflections)))
        self.tip = np.zeros((self.count, 2))

    @property
    def position(self) -> np.ndarray:
        """Positions of the joints (B, N) [m or rad]."""
        return self.system.hub_positions(self.q)

    @property
    def velocity(self) -> np.ndarray:
        """Velocities of the joints (B, N) [m/s or rad/s]."""
        return self.system.hub_positions(self.v)

    @property
    def limits(self) -> np.ndarray:
        """Limits of the joints (N, 2) [m or rad]."""
        return self._limits[0]

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
        some = np.arange(self.count) if which is None else which
        rows = self._rows if len(some) == self.count else self._rows.of(some.tolist())
        if not len(some):
            return np.zeros(0, dtype=bool)
        values, words, *_ = core.population(
            rows.counts,
            rows.numbers,
            rows.material,
            rows.lumps,
            rows.gravity,
            rows.payload,
            self._limits[: len(some)],
            [self._drive],
            np.zeros(len(some), dtype=np.int64),
            self.t,
            np.ascontiguousarray(self.q[some]).ravel(),
            np.ascontiguousarray(self.v[some]).ravel(),
            self.rtol,
            self.method,
            True,
            MOST_STEPS,
            self._columns,
            STATIONS,
            self.threads,
            core.Watch(),
            np.ascontiguousarray(force, dtype=float).ravel(),
            self.system.equations,
        )
        n, k = self.system.n, self.bent.shape[1]
        last = np.asarray(values)[:, :, -1].T
        good = np.array([word == "done" for word in words]) & np.isfinite(last).all(axis=1)
        there = some[good]
        ends = np.split(last[good], [n, 2 * n, 2 * n + k], axis=1)
        self.q[there], self.v[there], self.bent[there], self.tip[there] = ends
        return good
