"""The LQR with observer (`flexura.lqr`) that results are compared with, tuned for case 2's J.

It is designed on two modes of the strip, linear about a place on the way, and measures what the rig
measures (joints and tip deflection). It has the same step, sampling and drive limits. It is tried
on the whole mesh, because it must not excite a mode that it does not know.

It needs a force in every joint. Instead of a stepper's rate it has the torque that the stepper can
hold, without limits of rate and acceleration. Free are the place, the filters of the set-points,
and the weights of each output, of the strip's deflection and rate, and of the measurements' noise.
A joint's weight is its step.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx
from flexura.control import Gains, StepResponse, lqr
from flexura.errors import InputError
from flexura.simulation import prepare_gain_sweep

from .cases import Structure
from .closed_loop import closed_loop_controller
from .history import History
from .result import RTOL, metrics
from .search import Search, search
from .search_space import FreeGain, settings

SEARCH = Search("ga", population=30, generations=30, seed=1, polish=40)


@dataclass(frozen=True)
class LqrBaseline:
    """The best design: its J, weights by name, Run and step response."""

    J: float
    weights: dict[str, float]
    run: fx.Run
    response: StepResponse
    evaluations: int


class LqrDesigns:
    """Designs of one structure as a search sees them: points of the unit cube in, metrics out."""

    def __init__(self, structure: Structure) -> None:
        self.structure, self.task = structure, structure.task(2)
        numbers = range(1, len(structure.ends) + 1)
        self.free = (
            *[FreeGain(f"effort_{i}", 0.01, 100.0, "log") for i in numbers],
            *[FreeGain(f"setpoint_{i}_Hz", 0.2, 50.0, "log") for i in numbers],
            FreeGain("place", 0.0, 1.0, "linear"),
            FreeGain("deflection_m", 1e-4, 1.0, "log"),
            FreeGain("damping_s", 1e-3, 1.0, "log"),
            FreeGain("noise", 1e-6, 1e-2, "log"),
        )
        self.pareto, self.objectives, self.score = False, self.task.objectives, self.task.score

    def start(self) -> np.ndarray:
        """The middle of the unit cube (d,)."""
        return np.full(len(self.free), 0.5)

    @cached_property
    def plant(self) -> fx.System:
        """The robot as it is judged: a design may excite modes that it does not know."""
        return fx.assemble(self.structure.robot)

    def controller(self, values: np.ndarray) -> fx.Controller:
        """The design for settings (d,), on two modes.

        Raises:
            InputError: there is none.
        """
        system = self.task.systems[0]
        named = {f.name: float(v) for f, v in zip(self.free, values, strict=True)}
        given, count = self.structure.lqr_limits, len(self.structure.ends)
        own = {name: named[name] for name in named if name.startswith("setpoint")}
        plain = closed_loop_controller(
            system, self.structure.manoeuvre, Gains(given.settings | own, given.outputs)
        )
        limits = np.array([pid.limit for pid in plain.joints if isinstance(pid, fx.PID)])
        start, rows = system.start(), system.joint_rows
        way = np.zeros(system.n)
        way[rows] = self.structure.ends - start[rows]
        return lqr(
            system,
            plain,
            limits * [named[f"effort_{i + 1}"] for i in range(count)],
            position=np.abs(way[rows]),
            deflection=named["deflection_m"],
            damping=named["damping_s"],
            disturbance=limits,
            noise=named["noise"],
            q=start + named["place"] * way,
        )[0]

    def __call__(self, points: np.ndarray, limits: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Evaluate points (B, d); as `executor.Evaluator`. Weights without a design reach nothing.

        Returns:
            Metrics (B, 1, k) and fractions reached (B, 1).
        """
        m, cost_weights = self.structure.manoeuvre, self.task.cost_weights
        out, reached = (
            np.full((len(points), 1, cost_weights.shape[1]), np.nan),
            np.zeros((len(points), 1)),
        )
        for k, values in enumerate(settings(self.free, points)):
            try:
                drive = self.controller(values)
            except InputError:
                continue
            case = prepare_gain_sweep(
                self.plant, drive, m.duration_s, m.output_step_s, self.task.rtol
            )
            out[k], reached[k] = case.run(drive.gains()[None], cost_weights, limits[k : k + 1])
        return out, reached

    def digest(self) -> str:
        """Digest of the structure and the search."""
        free = [(f.name, f.low, f.high) for f in self.free]
        about = [self.task.spec(), self.structure.lqr_limits.settings, free, SEARCH.identity()]
        return hashlib.sha256(json.dumps(about, sort_keys=True, default=str).encode()).hexdigest()


def tune_lqr_baseline(
    structure: Structure, folder: Path, report: Any = lambda history: None
) -> LqrBaseline | None:
    """Tune the LQR, stored in a folder generation by generation.

    Args:
        structure: of the cases.
        folder: where it is stored.
        report: called after each generation.

    Returns:
        The best design; None: interrupted.
    """
    designs = LqrDesigns(structure)
    history = History.open(folder, designs.digest())
    if not search(designs, SEARCH, designs, history, report):
        return None
    values = settings(designs.free, history.all("points")[history.best][None])[0]
    controller = designs.controller(values)
    system, t = fx.assemble(structure.robot), structure.manoeuvre.t
    run = fx.simulate(system, t, controller, rtol=RTOL).uninterrupted()
    run.meta["manoeuvre"] = structure.manoeuvre.name
    run.save(folder / "best", overwrite=True)
    weights = {f.name: float(v) for f, v in zip(designs.free, values, strict=True)}
    return LqrBaseline(
        float(history.all("goals").min()),
        weights,
        run,
        metrics(run, controller),
        history.evaluations,
    )
