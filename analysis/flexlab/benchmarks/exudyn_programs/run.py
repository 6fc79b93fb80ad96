"""Runs of Exudyn: settings, processor time, and the channels."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

import flexura as fx
from flexura import twin

from ..problems.problem import Channels, Problem
from .chain import Chain
from .loads import Loads


@dataclass(frozen=True)
class Choice:
    """Settings of a run: elements a link, steps in an output step, and the solver's options."""

    elements: int
    substeps: int
    tolerance: float = 1e-6
    increments: bool = (
        False  # Newton's method judges by increments (residualMode 1), not by residuals
    )
    spectral_radius: float = 0.9
    reduced: int = 0  # order of the cables' quadrature
    sparse: bool = False
    trapezoidal: bool = False  # index 2, in place of generalized alpha

    def to_dict(self) -> dict[str, Any]:
        """The settings that differ from the defaults; elements and substeps always."""
        plain = asdict(Choice(0, 0))
        return {k: v for k, v in asdict(self).items() if v != plain[k]}

    def tight(self) -> Choice:
        """The same with Newton's method converged, for reference runs."""
        return replace(
            self,
            increments=True,
            tolerance=1e-10,
            spectral_radius=0.95,
            trapezoidal=False,
            sparse=False,
            reduced=0,
        )


def settings(exu: Any, choice: Choice, end: float, step: float, period: float) -> Any:
    """Exudyn's settings: fixed steps, modified Newton, no files, sensors at output times.

    Args:
        exu: Exudyn's module.
        choice: what is chosen.
        end: duration [s].
        step: length of a step [s].
        period: time between outputs [s].
    """
    made = exu.SimulationSettings()
    integration = made.timeIntegration
    integration.endTime, integration.numberOfSteps = end, round(end / step)
    integration.verboseMode, integration.adaptiveStep = 0, False
    newton = integration.newton
    newton.useModifiedNewton, newton.residualMode = True, int(choice.increments)
    newton.relativeTolerance = choice.tolerance
    newton.absoluteTolerance = (
        1e-2 * choice.tolerance if choice.tolerance < 1e-9 else choice.tolerance
    )
    integration.generalizedAlpha.spectralRadius = choice.spectral_radius
    kinds = exu.LinearSolverType
    made.linearSolver.solverType = kinds.EigenSparse if choice.sparse else kinds.EigenDense
    made.solution.file.write = False
    made.solution.solverInformationFileName = ""
    made.solution.sensors.writePeriod = period
    return made


def run(problem: Problem, choice: Choice) -> tuple[float, Channels]:
    """Run a problem in Exudyn.

    Returns:
        Processor time of the time loop [s], and the channels at the problem's times.

    Raises:
        RuntimeError: Exudyn fails.
    """
    period = float(problem.t[1] - problem.t[0])
    step = period / choice.substeps
    if problem.hub_length_m:
        return _twin(problem, choice, step)
    chain = Chain(problem.robot, choice.elements, choice.reduced)
    loads = Loads(chain, problem.work)
    chain.mbs.Assemble()
    end = float(problem.t[-1])
    loads.begin(round(end / step), step)
    kinds = chain.exu.DynamicSolverType
    kind = kinds.TrapezoidalIndex2 if choice.trapezoidal else kinds.GeneralizedAlpha
    chosen = settings(chain.exu, choice, end, step, period)
    begun = time.process_time()
    done = chain.mbs.SolveDynamic(chosen, solverType=kind)
    took = time.process_time() - begun
    if done is False:
        raise RuntimeError("Exudyn's solver failed")
    return took, channels(problem, chain, loads)


def channels(problem: Problem, chain: Chain, loads: Loads) -> Channels:
    """Tip deflections, tip position, and drives of prescribed joints.

    Raises:
        RuntimeError: Exudyn stopped early, or a value is not finite.
    """
    read = lambda sensor: np.asarray(chain.mbs.GetSensorStoredData(sensor))
    out: Channels = {}
    first = len(chain.joints) - len(chain.ends) + 1
    for number, (root, tip) in enumerate(chain.sensors, first):
        a, b = read(root), read(tip)
        angle, across = np.arctan2(a[:, 4], a[:, 3]), b[:, 1:3] - a[:, 1:3]
        out[f"link/{number}/tip_deflection"] = (
            np.cos(angle) * across[:, 1] - np.sin(angle) * across[:, 0]
        )
    out["tip/x"], out["tip/y"] = b[:, 1], b[:, 2]
    if problem.inverse:
        out |= {
            f"joint/{k}/drive": -read(sensor)[:, 1] for k, sensor in enumerate(loads.reactions, 1)
        }
    if any(
        len(value) != len(problem.t) or not np.all(np.isfinite(value)) for value in out.values()
    ):
        raise RuntimeError("Exudyn did not reach the end, or what it gives is not finite")
    return out


def _twin(problem: Problem, choice: Choice, step: float) -> tuple[float, Channels]:
    """The same by flexura's twin, which has sliders and sleeves."""
    drive = fx.Drive.force(*problem.work.force)
    begun = time.process_time()
    done = twin.simulate(
        fx.Robot.from_dict(problem.robot),
        problem.t,
        drive,
        elements=choice.elements,
        hub_length_m=problem.hub_length_m,
        step_s=step,
        start="straight",
    )
    took = min(time.process_time() - begun, done.meta["wall_s"])
    if not done.meta["complete"]:
        raise RuntimeError("the twin did not reach the end")
    return took, {name: np.asarray(done[name]) for name in problem.names}
