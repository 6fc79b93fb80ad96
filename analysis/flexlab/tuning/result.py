"""What a search comes to: the best gains, simulated again to a tighter tolerance, their figures,
files, table and drawing."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx
from flexura.control import Designed, Gains, StepResponse, step_response
from flexura.io import write_bytes
from flexura.io.drawing import attempted, saved

from ..runs.formatting import number
from ..runs.table import Table
from . import search_space as freedom
from .closed_loop import closed_loop_controller, references, with_references
from .drawing import figure
from .history import History
from .objective import HELP
from .search import Search
from .task import Task

RTOL = 1e-6


@dataclass(frozen=True)
class TuningResult:
    """The best gains (of a front: the balanced ones), their runs on every robot of the task, and
    the history."""

    task: Task
    how: Search
    history: History
    complete: bool
    gains: Gains | Designed
    runs: tuple[fx.Run, ...]
    responses: tuple[StepResponse, ...]

    @property
    def best(self) -> np.ndarray:
        """Its goals."""
        return np.asarray(self.history.all("goals")[self.history.best])

    @property
    def settings(self) -> dict[str, float]:
        """The free settings that were found, by name."""
        point = self.history.all("points")[self.history.best]
        return freedom.named(self.task.free, self.task.values(point[None])[0])

    @property
    def at_bounds(self) -> list[str]:
        """A sentence for each setting that ended at a bound of its range."""
        return freedom.at_bounds(self.task.free, self.settings)

    def meta(self) -> dict[str, Any]:
        """Everything that the outcome depends on, in the result too."""
        own = (
            {"objective": self.task.weights.text(), "objective_terms": HELP}
            if not self.task.pareto
            else {}
        )
        return own | {"search": vars(self.how), "task": self.task.spec(), "complete": self.complete}


def result(task: Task, how: Search, history: History, complete: bool) -> TuningResult:
    """Simulate the best gains on every robot of the task with its own mesh, to RTOL."""
    values = task.values(history.all("points")[history.best][None])[0]
    tuned = task.tuned(values)
    both = [
        simulate_tuned(fx.assemble(robot), task.manoeuvre, tuned, nominal=task.robots[0])
        for robot in task.robots
    ]
    return TuningResult(
        task, how, history, complete, tuned, tuple(b[0] for b in both), tuple(b[1] for b in both)
    )


def simulate_tuned(
    system: fx.System,
    asked: fx.Manoeuvre,
    gains: Gains | Designed,
    settled: float | None = None,
    nominal: fx.Robot | None = None,
) -> tuple[fx.Run, StepResponse]:
    """A run under gains, or under the design for the nominal robot, and its figures."""
    acts: dict[str, Any] = {"start": asked.start, "loads": asked.loads}
    if isinstance(gains, Designed):
        refs = references(system, asked)
        law = gains.sampled(system.robot if nominal is None else nominal, refs)
        run = fx.simulate(system, asked.t, law, rtol=RTOL, **acts).uninterrupted()
        run = with_references(run, refs)
        run.meta["manoeuvre"] = asked.name
        r = [run[f"joint/{i}/reference"] for i in range(1, len(refs) + 1)]
        return run, step_response(run, r, gains.limits(len(refs)), settled)
    controller = closed_loop_controller(system, asked, gains)
    run = fx.simulate(system, asked.t, controller, rtol=RTOL, **acts).uninterrupted()
    run.meta["manoeuvre"] = asked.name
    return run, metrics(run, controller, settled)


def metrics(run: fx.Run, controller: fx.Controller, settled: float | None = None) -> StepResponse:
    """The figures of a run, simulated or not, under the controller that it had."""
    references = [
        np.array([pid.reference(t)[0] for t in run.t])
        for pid in controller.joints
        if isinstance(pid, fx.PID)
    ]
    return step_response(
        run,
        references,
        [pid.limit for pid in controller.joints if isinstance(pid, fx.PID)],
        settled,
    )


def save(found: TuningResult, folder: Path) -> list[Path]:
    """gains.toml, best/ (the nominal run), history/ (a Run), tuning.png and .svg; of a front also
    front/gains-NN.toml."""
    paths = [folder / "gains.toml", folder / "best", folder / "history"]
    found.gains.write(paths[0])
    found.runs[0].save(paths[1], overwrite=True)
    task, history = found.task, found.history
    values = task.values(history.all("points"))
    whole = history.run([f.name for f in task.free], values, task.objectives, found.meta())
    whole.save(paths[2], overwrite=True)
    if task.pareto:
        for number, k in enumerate(history.pareto_front(), 1):
            task.tuned(values[k]).write(folder / "front" / f"gains-{number:02d}.toml")
        paths.append(folder / "front")
    for kind in ("png", "svg"):
        paths.append(folder / f"tuning.{kind}")
        with attempted(paths[-1].name):
            drawing = figure(task, history, found.runs[0])
            drawn = saved(drawing, kind, Title=f"tuning: {task.manoeuvre.name}")
        write_bytes(paths[-1], drawn)
    return paths


HEADS = (
    "robot",
    "joint",
    "rise [s]",
    "settling [s]",
    "overshoot [%]",
    "error [%]",
    "peak [mm]",
    "residual [mm]",
)


def table(found: TuningResult) -> Table:
    """The figures on every robot, the tuned settings, and what ended at its bound."""
    history, task = found.history, found.task
    title = f"{task.robots[0].name or 'robot'}: {task.manoeuvre.name}, {found.how.algorithm}"
    out = Table(title, HEADS, ("robot",))
    for k, response in enumerate(found.responses):
        for i, row in enumerate(response.joints):
            bent = [number(1e3 * x, 3, missing="") for x in response.strip[:2]]
            out.add(
                _robot(found, k) if i == 0 else "",
                str(i + 1),
                *(number(factor * x, 3, missing="never") for factor, x in zip(_FACTORS, row)),
                *(bent if i == 0 else ["", ""]),
            )
    objectives = ", ".join(
        f"{n} = {v:.5g}" for n, v in zip(task.objectives, found.best, strict=True)
    )
    out.notes.append(
        f"{objectives}; {history.evaluations} evaluations in {len(history)} generations, "
        f"{sum(history.wall_s):.3g} s; seed {found.how.seed}"
    )
    if not found.complete:
        out.notes.append("interrupted")
    if len(task.robots) > 1:
        out.notes.append(f"worst of {len(task.robots)} robots")
    out.notes.append(
        f"{len(history.pareto_front())} gains on the front, these are the balanced ones"
        if task.pareto
        else task.weights.text()
    )
    tuned = found.settings
    out.notes.append(", ".join(f"{name} = {value:.4g}" for name, value in tuned.items()))
    out.notes += found.at_bounds
    return out


_FACTORS = (1.0, 1.0, 100.0, 100.0)  # of rise, settling, overshoot, error


def _robot(found: TuningResult, k: int) -> str:
    if k == 0:
        return "nominal"
    one, nominal = found.task.robots[k], found.task.robots[0]
    parts = []
    if nominal.payload.mass_kg:
        parts.append(f"payload x {one.payload.mass_kg / nominal.payload.mass_kg:.3g}")
    for a, b in zip(one.links, nominal.links, strict=True):
        if a.flexible:
            parts.append(f"EI x {_stiffness(a) / _stiffness(b):.3g}")
            break
    return ", ".join(parts)


def _stiffness(link: Any) -> float:
    data = link.model_dump() if hasattr(link, "model_dump") else vars(link)
    if data.get("young_modulus_Pa"):
        return float(data["young_modulus_Pa"])
    EI = data["bending_stiffness_N_m2"]
    return float(EI if not isinstance(EI, list | tuple) else EI[0]["value"])


def numbers(found: TuningResult) -> dict[str, Any]:
    """For JSON."""
    return {
        "goals": dict(zip(found.task.objectives, map(float, found.best), strict=True)),
        "settings": found.settings,
        "at_bounds": found.at_bounds,
        "evaluations": found.history.evaluations,
        "generations": len(found.history),
        "wall_s": sum(found.history.wall_s),
        "robots": [
            {"robot": _robot(found, k)} | r.numbers() for k, r in enumerate(found.responses)
        ],
        "front": [
            list(map(float, found.history.all("goals")[k])) for k in found.history.pareto_front()
        ]
        if found.task.pareto
        else None,
    } | found.meta()
