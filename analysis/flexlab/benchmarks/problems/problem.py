"""What a problem of the benchmark is, and how far two answers to it are apart."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import flexura as fx

Tables = dict[str, Any]  # a robot file's tables
Channels = dict[str, np.ndarray]  # values (T,) by channel name
PATH_SHARE = 1e-3  # of the tip's path: what counts as a deflection where the links hardly bend


@dataclass(frozen=True)
class Work:
    """What acts in the joints, one entry a joint, in a form that both programs take.

    `force`: torques or forces over time. `motion`, `kp`, `kd`: PD control along a motion, held
    between ticks if `rate_Hz` > 0. `prescribed`: motions that the joints follow exactly.
    `of_time(t)` and `of_state(t, position, velocity, tip_deflection)` are a user's own Python
    functions, which give one force a joint; `tick` is one that is called once a tick of `rate_Hz`.
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

    `robot` is what flexura runs; `finer`, if given, is the robot whose converged motion counts (a
    mesh beside few modes). `elements` is what Exudyn takes for each flexible link, `finer_elements`
    what its converged model takes. `exact`: method and tolerance of flexura's converged run; `same`
    acts as `work` does, without Python. `hub_length_m`: of the hubs of the twin, which runs what
    slides; 0: the chain of `exudyn_chain.py` runs it. `undamped`: it rings after jumps and nothing
    damps it, so that the accuracy that is asked of the others does not hold.
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
    asked: float | None = None
    needs: str = ""  # a public name of flexura without which it can't be run

    @property
    def available(self) -> bool:
        return not self.needs or hasattr(fx, self.needs)

    @property
    def names(self) -> list[str]:
        """The channels of its motion that are compared."""
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
    """The length by which errors are divided [m]: the largest tip deflection, or 1e-3 of the tip's
    path if that is more."""
    bent = max(np.abs(v).max() for name, v in exact.items() if name.endswith("tip_deflection"))
    path = np.hypot(np.diff(exact["tip/x"]), np.diff(exact["tip/y"])).sum()
    return float(max(bent, PATH_SHARE * path))


def error(found: Channels, exact: Channels) -> float:
    """The largest deviation of the tip's place and of the tip deflections, relative to `scale`; of
    drives, to their largest."""
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
