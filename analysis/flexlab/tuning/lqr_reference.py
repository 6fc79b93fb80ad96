"""What is possible on a structure of the cases: an LQR with observer (`flexura.lqr`), its weights
tuned for case 2's J.

It knows two modes of the strip, linear about a place on the way, measures what the rig does (joints
and tip deflection), and has the same step, sampling and drive limits; it is tried on three modes,
as it may not stir up one that it doesn't know, and what comes out runs on the whole mesh. It needs
a force in every joint: where the cases have a stepper's rate, it has the torque up to which the
stepper's field holds, with no limit to rate and acceleration. Free are that place, the filters of
the set-points, and the weights: of each output in parts of its limit, of the strip's deflection and
rate, and of the measurements' noise. A joint's weight is its way.
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
from flexura.control import Gains, Response, lqr
from flexura.errors import InputError
from flexura.simulation import trials

from .cases import Structure
from .closed_loop import under
from .history import History
from .result import RTOL, figures
from .search import Search, search
from .search_space import Free, settings
from .task import reduced

HOW = Search("ga", population=30, generations=30, seed=1, polish=40)


@dataclass(frozen=True)
class Reference:
    """The best design: its J, weights by name, Run and figures."""

    J: float
    weights: dict[str, float]
    run: fx.Run
    response: Response
    evaluations: int


class Designs:
    """Designs of one structure as a search sees them: points of the unit cube in, the figures of
    runs out."""

    def __init__(self, structure: Structure) -> None:
        self.structure, self.task = structure, structure.task(2)
        numbers = range(1, len(structure.ends) + 1)
        self.free = (
            *[Free(f"effort_{i}", 0.01, 100.0, "log") for i in numbers],
            *[Free(f"setpoint_{i}_Hz", 0.2, 50.0, "log") for i in numbers],
            Free("place", 0.0, 1.0, "linear"),
            Free("deflection_m", 1e-4, 1.0, "log"),
            Free("damping_s", 1e-3, 1.0, "log"),
            Free("noise", 1e-6, 1e-2, "log"),
        )
        self.pareto, self.goals, self.score = False, self.task.goals, self.task.score

    def start(self) -> np.ndarray:
        return np.full(len(self.free), 0.5)

    @cached_property
    def plant(self) -> fx.System:
        """With a mode that the design doesn't know."""
        return fx.assemble(reduced(self.structure.robot, self.task.modes + 1))

    def controller(self, values: np.ndarray) -> fx.Controller:
        """The design (d,), on two modes. Raises InputError where there is none."""
        system = self.task.systems[0]
        named = {f.name: float(v) for f, v in zip(self.free, values, strict=True)}
        given, count = self.structure.reference, len(self.structure.ends)
        own = {name: named[name] for name in named if name.startswith("setpoint")}
        plain = under(system, self.structure.manoeuvre, Gains(given.settings | own, given.outputs))
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
        """As `engine.Runs`: figures (B, 1, k) and fractions reached (B, 1); weights without a
        design have reached nothing."""
        m, prices = self.structure.manoeuvre, self.task.prices
        out, reached = (
            np.full((len(points), 1, prices.shape[1]), np.nan),
            np.zeros((len(points), 1)),
        )
        for k, values in enumerate(settings(self.free, points)):
            try:
                drive = self.controller(values)
            except InputError:
                continue
            one = trials(self.plant, drive, m.duration_s, m.output_step_s, self.task.rtol)
            out[k], reached[k] = one.run(drive.gains()[None], prices, limits[k : k + 1])
        return out, reached

    def digest(self) -> str:
        free = [(f.name, f.low, f.high) for f in self.free]
        about = [self.task.spec(), self.structure.reference.settings, free, HOW.identity()]
        return hashlib.sha256(json.dumps(about, sort_keys=True, default=str).encode()).hexdigest()


def reference(
    structure: Structure, folder: Path, report: Any = lambda history: None
) -> Reference | None:
    """The best design, found and stored in `folder` generation by generation; None: interrupted."""
    designs = Designs(structure)
    history = History.open(folder, designs.digest())
    if not search(designs, HOW, designs, history, report):
        return None
    values = settings(designs.free, history.all("points")[history.best][None])[0]
    controller = designs.controller(values)
    run = fx.simulate(fx.assemble(structure.robot), structure.manoeuvre.t, controller, rtol=RTOL)
    run.meta["manoeuvre"] = structure.manoeuvre.name
    run.save(folder / "best")
    weights = {f.name: float(v) for f, v in zip(designs.free, values, strict=True)}
    return Reference(
        float(history.all("goals").min()),
        weights,
        run,
        figures(run, controller),
        history.evaluations,
    )
