"""The task of `flexura/Reach-v0`: what a two-link robot sees, and what its motion is worth."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..errors import InputError
from ..io import array
from ..robot import robot_of
from .motion import Motion

EPISODE_STEPS = 150  # 3 s at 50 Hz
TORQUES = (0.5, 0.05)  # N m, for the shipped type I
EFFORT = 0.01  # m: what full torque of all joints costs a step
NEAR, FAR = 0.4, 0.9  # of the arm's length: where targets are
DEFAULT = "type-1-rr"


class Task:
    """The tip of a robot with two revolute joints should be at a target, drawn for each episode.

    Args:
        robot: a Robot, or the path or name of a robot file; None: the shipped type I with two modes
            a link.
        count: number of robots, B.
        torque_N_m: the largest torque of each joint (2,).
        modes: of each flexible link; None: as the robot says.
        options: of `Motion`.

    Raises:
        InputError: the robot is another one, or a number is not what is expected.
    """

    def __init__(
        self,
        robot: Any = None,
        count: int = 1,
        torque_N_m: Any = TORQUES,
        modes: int | None = None,
        **options: Any,
    ) -> None:
        modes = 2 if robot is None and modes is None else modes
        self.motion = Motion(
            _with_modes(DEFAULT if robot is None else robot, modes), count, **options
        )
        links = self.motion.robot.links
        kinds = "".join(link.joint.type for link in links)
        if kinds != "RR" or any(k.joint.locked or k.joint.transmission for k in links):
            expected = "expected two free revolute joints without transmission (RR)"
            raise InputError(expected, key="robot", value=kinds)
        expected = "expected two torques above 0 in newton metres"
        self.torque = array(torque_N_m, "torque_N_m", expected)
        if self.torque.shape != (2,) or not (self.torque > 0).all():
            raise InputError(expected, key="torque_N_m", value=torque_N_m)
        self.reach = float(sum(link.length_m for link in links))
        self.target = np.zeros((self.motion.count, 2))

    @property
    def size(self) -> int:
        """Numbers in an observation of one robot."""
        return 6 + self.motion.bent.shape[1]

    def start(self, which: np.ndarray, random: np.random.Generator) -> None:
        """Begin episodes: joints anywhere within their limits, at rest, links straight.

        Args:
            which: numbers of the robots from 0 (K,).
            random: what draws joints and targets.
        """
        low, high = np.clip(self.motion.limits.T, -math.pi, math.pi)
        self.motion.start(which, random.uniform(low, high, (len(which), 2)))
        r = self.reach * np.sqrt(random.uniform(NEAR**2, FAR**2, len(which)))
        angle = random.uniform(-math.pi, math.pi, len(which))
        self.target[which] = np.stack([r * np.cos(angle), r * np.sin(angle)], axis=1)

    def step(self, action: np.ndarray, which: np.ndarray) -> tuple[np.ndarray, ...]:
        """Apply torques until the next action.

        Args:
            action: torques (K, 2) [N m]; larger ones are cut to the largest.
            which: numbers of the robots from 0 (K,).

        Returns:
            Rewards (K,) [m]: minus the tip's distance from the target, minus the effort. Whether
            each robot failed (K,): it met a limit, or its state is not a number any more. That
            costs as much as the largest distance for a whole episode. Distances (K,) [m].

        Raises:
            InputError: a torque is not a finite number.
        """
        given = np.asarray(action, dtype=float)
        if not np.isfinite(given).all():
            raise InputError("expected finite torques in N m", key="action", value=action)
        torque = np.clip(given, -self.torque, self.torque)
        failed = ~self.motion.step(torque, which)
        distance = np.linalg.norm(self.motion.tip[which] - self.target[which], axis=1)
        reward = -distance - EFFORT * ((torque / self.torque) ** 2).mean(axis=1)
        reward[failed] = -2.0 * self.reach * EPISODE_STEPS
        return reward, failed, distance

    def observation(self) -> np.ndarray:
        """Joints [rad], rates [rad/s], tip deflections [m] and target [m] of all (B, size)."""
        moving = self.motion
        parts = (moving.position, moving.velocity, moving.bent, self.target)
        return np.concatenate(parts, axis=1).astype(np.float32)


def _with_modes(robot: Any, modes: int | None) -> Any:
    """The robot with so many modes in each flexible link."""
    from_file = robot_of(robot)
    if modes is None:
        return from_file
    flexible = [i for i, link in enumerate(from_file.links, 1) if link.flexible]
    return from_file.replace({f"link.{i}.modes": modes for i in flexible})
