"""A problem of the benchmark, and the error between two answers to it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import flexura as fx

Tables = dict[str, Any]  # a robot file's tables
Channels = dict[str, np.ndarray]  # values (T,) by channel name
PATH_SHARE = 1e-3  # of the tip's path: the least scale of deflections


@dataclass(frozen=True)
class Work:
    """What acts in the joints, one entry a joint, in a form that both programs take.

    `force`: torques or forces over time. `motion`, `kp`, `kd`: PD control along a motion, held
    between ticks if `rate_Hz` > 0. `prescribed`: motions that the joints follow exactly.
    `of_time(t)` and `of_state(t, position, velocity, tip_deflection)`: Python functions that return
    one force a joint. `tick()` makes such a function, with a memory, that is called once a tick of
    `rate_Hz`.
    """

    force: Sequence[fx.Signal | None] = ()
    motion: Sequence[fx.Signal] = ()
    kp: Sequence[float] = ()
    kd: Sequence[float] = ()
    rate_Hz: float = 0.0
    prescribed: Sequence[fx.Signal] = ()
    of_time: Callable[[float], Any] | None = None
    of_state: Callable[[float, Any, Any, Any], Any] | None = None
    tick: Callable[[], Callable[[float, Any, Any, Any], Any]] | None = (
        None  # makes the function, which may have a memory
    )

    @property
    def python(self) -> bool:
        """Whether a Python function acts."""
        return any(f is not None for f in (self.of_time, self.of_state, self.tick))


@dataclass(frozen=True)
class Problem:
    """A robot and what it does at the times t (T,) [s].

    `robot`: tables of the robot that flexura runs. `finer`: a robot with a finer mesh, whose
    converged motion counts. `elements`, `finer_elements`: Exudyn's elements a flexible link, in a
    run and in its converged model. `exact`: method and tolerance of flexura's converged run.
    `same`: equivalent to `work`, without Python functions. `hub_length_m`: length of the twin's
    hubs, for sliding joints; 0: `exudyn_programs.chain` runs the problem. `undamped`: it rings
    after jumps, so that the required accuracy does not apply. `required_ratio`: how much faster
    than Exudyn. `needs`: a public name of flexura that the problem needs.
    """

    name: str
    what: str
    robot: Tables
    t: np.ndarray
    work: Work
    elements: int
    finer: Tables | None = None
    finer_elements: int = 0
    exact: tuple[str, float] = ("implicit", 1e-9)
    same: Work | None = None
    hub_length_m: float = 0.0
    inverse: bool = False
    undamped: bool = False
    required_ratio: float | None = None
    needs: str = ""  # a public name of flexura without which it can't be run

    @property
    def available(self) -> bool:
        """Whether this version of flexura can run the problem."""
        return not self.needs or hasattr(fx, self.needs)

    @property
    def names(self) -> list[str]:
        """The channels that are compared."""
        bent = [
            f"link/{k}/tip_deflection"
            for k, link in enumerate(self.robot["link"], 1)
            if link["elements"]
        ]
        return ["tip/x", "tip/y", *bent]

    @property
    def ticks(self) -> int:
        """Ticks of a sampled controller in an output step; 1 without one."""
        return max(1, round(self.work.rate_Hz * (self.t[1] - self.t[0])))


def scale(exact: Channels) -> float:
    """The length by which errors are divided [m].

    It is the largest tip deflection, or 1e-3 of the tip's path if that is more.
    """
    bent = max(np.abs(v).max() for name, v in exact.items() if name.endswith("tip_deflection"))
    path = np.hypot(np.diff(exact["tip/x"]), np.diff(exact["tip/y"])).sum()
    return float(max(bent, PATH_SHARE * path))


def error(found: Channels, exact: Channels) -> float:
    """The largest deviation of tip position and tip deflections, relative to `scale`.

    Deviations of drives are relative to the largest drive. Infinite if a value is not finite.
    """
    size = scale(exact)
    worst = [
        np.hypot(found["tip/x"] - exact["tip/x"], found["tip/y"] - exact["tip/y"]).max() / size
    ]
    for name, value in exact.items():
        if name.endswith("tip_deflection"):
            worst.append(np.abs(found[name] - value).max() / size)
        elif name.endswith("drive"):
            worst.append(np.abs(found[name] - value).max() / np.abs(value).max())
    return float(np.max(worst)) if np.all(np.isfinite(worst)) else float("inf")
