"""The environment for learning: how much faster than real time thousands of robots step, and what
their steps leave as an error."""

from __future__ import annotations

import os
import time
from typing import Any

import numpy as np

import flexura as fx
from flexura.optional import Optional

gymnasium = Optional("gymnasium")

ROBOTS, ACTIONS, RATE_HZ = 4096, 10, 50.0
CORES = 2.0  # as many processors as the requirement names
COMPARED, FINE = 64, 64  # robots whose error is found after a second; steps an action for it
CASES = (  # name, modes and elements of each link, required: times real time
    ("2 + 2 modes", 2, 4, 15_000.0),
    ("4 + 4 elements", 0, 4, 2_000.0),
)


def two_links(modes: int, elements: int) -> fx.Robot:
    """The robot of type I with so many elements a link, and modes; 0: all of the mesh."""
    data = fx.load("type-1-rr").to_dict()
    for link in data["link"]:
        link |= {"elements": elements}
        link.pop("modes", None)
        link |= {"modes": modes} if modes else {}
    return fx.Robot.from_dict(data)


def environment(robots: int, **options: Any) -> Any:
    """`flexura/Reach-v0` of so many robots, begun."""
    env = gymnasium.make_vec("flexura.gym:flexura/Reach-v0", num_envs=robots, **options)
    env.action_space.seed(1)
    env.reset(seed=1)
    return env


def tips(robot: fx.Robot, **options: Any) -> np.ndarray:
    """The tips (actions, robots, 2) [m] in a second of random torques."""
    env = environment(COMPARED, robot=robot, **options)
    path = []
    for _ in range(int(RATE_HZ)):
        env.step(env.action_space.sample())
        path.append(env.unwrapped.task.motion.tip.copy())
    return np.array(path)


def measure(rounds: int) -> list[dict[str, Any]]:
    """Time the steps of all robots under random torques.

    Args:
        rounds: times that it is done; the first warms up and is not counted.

    Returns:
        Rows: the robot, times real time on all cores and by processor time of two, what is
            required, the median and the largest error of the tips in a second [mm].
    """
    rows = []
    for name, modes, elements, required in CASES:
        robot = two_links(modes, elements)
        env = environment(ROBOTS, robot=robot)
        actions = [env.action_space.sample() for _ in range(ACTIONS)]
        took = []
        for _ in range(rounds + 1):
            wall, processor = time.perf_counter(), time.process_time()
            for action in actions:
                env.step(action)
            took.append((time.perf_counter() - wall, time.process_time() - processor))
        wall, processor = np.median(took[1:], axis=0)
        seconds = ROBOTS * ACTIONS / RATE_HZ
        off = np.linalg.norm(tips(robot) - tips(robot, steps=FINE), axis=2).max(axis=0)
        rows.append(
            {
                "name": name,
                "robots": ROBOTS,
                "cores": os.cpu_count(),
                "times_real_time": seconds / wall,
                "of_two_processors": seconds / processor * CORES,
                "required": required,
                "median_error_mm": 1e3 * float(np.median(off)),
                "largest_error_mm": 1e3 * float(off.max()),
            }
        )
    return rows
