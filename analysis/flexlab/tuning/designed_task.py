"""Tuning of a controller that is designed from the robot: each point is a design, and a run in
Python."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

import flexura as fx
from flexura.control import JOINT, STRIP, Designed, design_setting, step_response
from flexura.errors import InputError

from . import search_space
from .closed_loop import references
from .search_space import FreeGain, free_gain
from .task import Task

FIXED = ("rate_Hz", "modes", "intervals", "spread")  # what is no weight, limit or time


@dataclass(frozen=True)
class DesignedTask(Task):
    """A `Task` whose `gains` are a `Designed`: LQG or NMPC."""

    gains: Designed  # type: ignore[assignment]

    def __post_init__(self) -> None:
        names = [f.name for f in self.free]
        for f in self.free:
            key, kind = f"free.{f.name}", self.gains.kind
            if not design_setting(f.name, kind) or f.name in FIXED:
                expected = f'expected a weight, a limit or a time of type = "{kind}"'
                raise InputError(expected, key=key, value=f.name)
            if f.low <= 0:
                raise InputError("expected bounds above 0", key=key, value=[f.low, f.high])
            if names.count(f.name) > 1:
                raise InputError("expected each setting once", key=key, value=f.name)
        if not self.free:
            raise InputError("expected at least one free setting", key="free")

    @cached_property
    def controllers(self) -> list[Any]:
        """The controller of each robot with the file's own settings; refuses as `Task`."""
        refs = references(self.systems[0], self.manoeuvre)
        for signal, link in zip(refs, self.robots[0].links, strict=True):
            if signal(self.manoeuvre.duration_s)[0] == link.joint.start:
                raise InputError(
                    "expected a manoeuvre at whose end every joint is elsewhere than at its start",
                    key="MANOEUVRE",
                )
        return [self.gains.sampled(self.robots[0], refs) for _ in self.systems]

    def tuned(self, values: np.ndarray) -> Designed:  # type: ignore[override]
        """The design with the free settings at `values` (d,)."""
        found = self.gains.settings | search_space.named(self.free, values)
        return replace(self.gains, settings=found)

    def gain_sweeps(self) -> list[Any]:
        """The robots: what a thread needs for runs."""
        return list(self.systems)

    def run(
        self, robots: Sequence[Any], points: np.ndarray, limits: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Run points of the unit cube on all robots, each to its end; as `Task.run`.

        The design is always that of the nominal robot. Settings without a design reach nothing.
        """
        width = self.cost_weights.shape[1]
        metrics = np.full((len(points), len(robots), width), np.nan)
        reached = np.zeros((len(points), len(robots)))
        for b, values in enumerate(self.values(points)):
            for k, system in enumerate(robots):
                metrics[b, k], reached[b, k] = self._row(values, system)
        return metrics, reached

    def _row(self, values: np.ndarray, system: fx.System) -> tuple[np.ndarray, float]:
        tuned, asked = self.tuned(values), self.manoeuvre
        joints = len(system.robot.links)
        nothing = np.full(joints * len(JOINT) + len(STRIP), np.nan)
        refs = references(system, asked)
        try:
            law = tuned.sampled(self.robots[0], refs)
            run = fx.simulate(
                system, asked.t, law, rtol=self.rtol, start=asked.start, loads=asked.loads
            ).uninterrupted()
        except (InputError, fx.NumericalError):
            return nothing, 0.0
        if not run.complete:
            return nothing, float((run.t[-1] - asked.t[0]) / asked.duration_s)
        r = [np.array([signal(t)[0] for t in run.t]) for signal in refs]
        found = step_response(run, r, tuned.limits(joints))
        return np.concatenate([found.joints.ravel(), found.strip]), 1.0

    def spec(self) -> dict[str, Any]:
        """All that the result depends on, except the search."""
        return {
            "robots": [robot.to_dict() for robot in self.robots],
            "manoeuvre": self.manoeuvre.spec(),
            "controller": self.gains.table(),
            "free": search_space.spec(self.free),
            "weights": vars(self.weights),
            "goals": list(self.objectives),
            "rtol": self.rtol,
            "modes": self.modes,
        }


def default_bounds(design: Designed) -> list[FreeGain]:
    """Every weight of a design, from a tenth to ten times its value."""
    words = ("effort", "position", "deflection_m", "damping_s")
    return [
        free_gain(name, value / 10, value * 10)
        for name, value in design.settings.items()
        if value > 0 and name.startswith(words) and "max" not in name
    ]
