"""Feedforwards for a controller, from the robot's own equations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..errors import FlexuraError
from ..signals import Signal, table
from ..system import System
from .dynamics import inverse


def gravity(system: System, motions: Sequence[Signal], t_s: ArrayLike) -> list[Signal]:
    """Feedforwards that hold each joint against gravity along its motion, links straight.

    Args:
        system: the robot.
        motions: one Signal a joint [m or rad].
        t_s: times of the tables (T,) [s].

    Returns:
        One Signal a joint [N or N m].
    """
    times = np.asarray(t_s, dtype=float)
    rows, held = system.joint_rows, np.zeros((len(times), len(motions)))
    for k, t in enumerate(times):
        q = np.zeros(system.n)
        q[rows] = [motion(t)[0] for motion in motions]
        held[k] = system.gravity(q)[rows]
    return [table(times, column) for column in held.T]


def inverse_dynamics(
    system: System, motions: Sequence[Signal], t_s: ArrayLike, rtol: float = 1e-7
) -> list[Signal]:
    """Feedforwards that the motions take, the links' bending included.

    Args:
        system: the robot.
        motions: one Signal a joint [m or rad].
        t_s: times of the tables (T,) [s].
        rtol: of `flexura.inverse`.

    Returns:
        One Signal a joint [N or N m].

    Raises:
        FlexuraError: the robot can't follow them to their end.
    """
    run = inverse(system, t_s, motions, rtol=rtol).uninterrupted()
    if not run.complete:
        said = "; ".join(str(event["text"]) for event in run.meta["events"])
        raise FlexuraError(f"the motion was not followed to its end: {said}")
    return [table(run.t, run[f"joint/{i}/drive"]) for i in range(1, len(motions) + 1)]
