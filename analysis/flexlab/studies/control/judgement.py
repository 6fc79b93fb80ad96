"""What is measured of each method: on the robot as it is, and with payloads 20 % off."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

import flexura as fx

from .methods import METHODS, Method, Motion
from .tasks import Task

PAYLOADS = (1.0, 0.8, 1.2)  # factors
SETTLED = 0.01  # of the tip's way: the motion is over if the tip stays as near to its end
BEGUN = 0.01  # of the largest drive: the motion has begun
AFTER_S = 1.0  # simulated after the motion
ROW_S = 1e-3


@dataclass(frozen=True)
class Figures:
    """Of one run. `error_m`: the largest distance of the tip from where it should be; NaN: the
    method follows no path. `time_s`: from the first drive until the tip stays within 1 % of its
    way from its end; infinity: never. `residual_m`: the tip's largest distance from its end after
    the motion. `peak` (2,): the largest drives [N or N m]."""

    error_m: float
    time_s: float
    residual_m: float
    peak: tuple[float, float]


@dataclass(frozen=True)
class Judged:
    """A method on a task: figures of each payload, and the nominal run, whose motion begins at
    `begin_s`; `about` is a sentence for the table."""

    method: str
    figures: tuple[Figures, ...]
    run: fx.Run
    begin_s: float
    about: str = ""

    @property
    def nominal(self) -> Figures:
        """With the payload as it is."""
        return self.figures[0]

    def worst(self, name: str) -> float:
        """The largest of a figure over the payloads that are off.

        Args:
            name: of the figure.

        Returns:
            The figure.
        """
        return float(max(getattr(f, name) for f in self.figures[1:]))


def compare(
    task: Task,
    methods: Iterable[Method] = METHODS,
    *,
    rtol: float = 1e-7,
    progress: Callable[[float], None] = lambda fraction: None,
) -> list[Judged]:
    """All methods on a task.

    Args:
        task: the task.
        methods: the methods.
        rtol: of the simulations.
        progress: called with the finished fraction.

    Returns:
        One entry a method.

    Raises:
        FlexuraError: a method has no answer, or a run did not end.
    """
    out, methods = [], list(methods)
    for k, method in enumerate(methods):
        motion = method.motion(task)
        rows = int(np.ceil((motion.end_s + AFTER_S) / ROW_S))
        t = ROW_S * np.arange(rows + 1)
        runs = []
        for factor in PAYLOADS:
            robot = task.robot if factor == 1 else task.with_payload(factor)
            run = fx.simulate(robot, t, motion.drive, rtol=rtol).uninterrupted()
            if not run.complete:
                texts = "; ".join(event["text"] for event in run.meta["events"])
                raise fx.FlexuraError(f"{method.name}, payload x {factor:g}: {texts}")
            runs.append(run)
        figures = tuple(_figures(task, motion, run) for run in runs)
        out.append(Judged(method.name, figures, runs[0], _begin(runs[0]), motion.about))
        progress((k + 1) / len(methods))
    return out


def from_end(task: Task, run: fx.Run) -> np.ndarray:
    """The tip's distance (T,) [m] from its end."""
    x, y = task.tip(task.set_points, task.duration_s)
    return np.asarray(np.hypot(run["tip/x"] - x, run["tip/y"] - y))


def _begin(run: fx.Run) -> float:
    drives = np.abs(np.column_stack([run["joint/1/drive"], run["joint/2/drive"]]))
    return float(run.t[(drives > BEGUN * drives.max(axis=0)).any(axis=1).argmax()])


def _figures(task: Task, motion: Motion, run: fx.Run) -> Figures:
    error = np.nan
    if motion.wanted is not None:
        wanted = np.array([motion.wanted(float(t)) for t in run.t])
        error = float(np.hypot(run["tip/x"] - wanted[:, 0], run["tip/y"] - wanted[:, 1]).max())
    away = from_end(task, run)
    outside = np.flatnonzero(away > SETTLED * away[0])
    ended = outside[-1] < len(run) - 1
    return Figures(
        error,
        float(run.t[outside[-1] + 1]) - _begin(run) if ended else np.inf,
        float(away[run.t >= motion.end_s].max()),
        tuple(float(np.abs(run[f"joint/{i}/drive"]).max()) for i in (1, 2)),  # type: ignore[arg-type]
    )
