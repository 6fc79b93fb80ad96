"""`flexura/Reach-v0` for Gymnasium: one environment, and many that step together."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import InputError
from ..optional import load
from .task import EPISODE_STEPS, Task

gymnasium = load("gymnasium")
vector = load("gymnasium.vector")
batch_space = load("gymnasium.vector.utils").batch_space


def _spaces(task: Task) -> tuple[Any, Any]:
    """Of one robot's observations and actions."""
    high = task.torque.astype(np.float32)
    return (
        gymnasium.spaces.Box(-np.inf, np.inf, (task.size,), np.float32),
        gymnasium.spaces.Box(-high, high, dtype=np.float32),
    )


def _torques(action: Any, count: int) -> np.ndarray:
    """An action as torques (count, 2)."""
    try:
        return np.reshape(np.asarray(action, dtype=float), (count, 2))
    except (TypeError, ValueError):
        expected = f"expected torques of shape ({count}, 2) in N m"
        raise InputError(expected, key="action", value=action) from None


class Reach(gymnasium.Env):  # type: ignore[misc, name-defined]
    """One robot.

    Args:
        render_mode: None; there is no other.
        options: of `Task`.
    """

    metadata = {"render_modes": [], "render_fps": 50}  # noqa: RUF012

    def __init__(self, render_mode: str | None = None, **options: Any) -> None:
        self.render_mode = render_mode
        self.task = Task(**options)
        self.observation_space, self.action_space = _spaces(self.task)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: of the joints and the target that are drawn.
            options: none are known.

        Returns:
            The observation (size,), and an empty dictionary.
        """
        super().reset(seed=seed)
        self.task.start(np.arange(1), self.np_random)
        return self.task.observation()[0], {}

    def step(self, action: Any) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Hold torques until the next action.

        Args:
            action: torques (2,) [N m].

        Returns:
            Observation (size,), reward [m], whether the robot failed, False (the registered
            environment ends an episode after its steps), and `distance_m`.
        """
        reward, failed, distance = self.task.step(_torques(action, 1), np.arange(1))
        about = {"distance_m": float(distance[0])}
        return self.task.observation()[0], float(reward[0]), bool(failed[0]), False, about


class ReachVector(vector.VectorEnv):  # type: ignore[misc, name-defined]
    """Many robots that the core moves four at a time, on all cores.

    One whose episode has ended begins the next with the next step, whose action it ignores
    (`AutoresetMode.NEXT_STEP`).

    Args:
        num_envs: number of robots, B.
        max_episode_steps: after which an episode is truncated.
        render_mode: None; there is no other.
        options: of `Task`.
    """

    metadata = {  # noqa: RUF012
        "render_modes": [],
        "render_fps": 50,
        "autoreset_mode": vector.AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        num_envs: int = 1,
        max_episode_steps: int = EPISODE_STEPS,
        render_mode: str | None = None,
        **options: Any,
    ) -> None:
        self.num_envs, self.render_mode = num_envs, render_mode
        self.max_episode_steps = max_episode_steps
        self.task = Task(count=num_envs, **options)
        self.single_observation_space, self.single_action_space = _spaces(self.task)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._steps = np.zeros(num_envs, dtype=np.int64)
        self._ended = np.zeros(num_envs, dtype=bool)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin episodes of all.

        Args:
            seed: of the joints and the targets that are drawn.
            options: none are known.

        Returns:
            Observations (B, size), and an empty dictionary.
        """
        super().reset(seed=seed)
        self._begin(np.arange(self.num_envs))
        return self.task.observation(), {}

    def step(
        self, actions: Any
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Hold torques until the next action.

        Args:
            actions: torques (B, 2) [N m].

        Returns:
            Observations (B, size); rewards (B,) [m]; which robots failed (B,); whose episode is
            over by its number of steps (B,); `distance_m` (B,), NaN where an episode begins.
        """
        going, begun = np.flatnonzero(~self._ended), np.flatnonzero(self._ended)
        reward, distance = np.zeros(self.num_envs), np.full(self.num_envs, np.nan)
        failed = np.zeros(self.num_envs, dtype=bool)
        torque = _torques(actions, self.num_envs)[going]
        reward[going], failed[going], distance[going] = self.task.step(torque, going)
        self._steps[going] += 1
        over = ~failed & (self._steps >= self.max_episode_steps)
        over[begun] = False
        self._begin(begun)
        self._ended = failed | over
        about = {"distance_m": distance, "_distance_m": np.isfinite(distance)}
        return self.task.observation(), reward, failed, over, about

    def _begin(self, which: np.ndarray) -> None:
        self.task.start(which, self.np_random)
        self._steps[which], self._ended[which] = 0, False
