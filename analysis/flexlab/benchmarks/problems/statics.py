"""Statics and frequencies beside Exudyn: processor time of the whole call, on the same mesh."""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import flexura as fx

from .. import native
from ..exudyn_programs.chain import Chain, exudyn
from ..exudyn_programs.run import Choice, settings
from .problem import Tables
from .robots import beam, chain, robot, turning, upright_arm

COUNT = 20  # lowest frequencies
HINGE_N_M = 1e9  # of springs in place of hinges: sparse eigenvalues come without constraints only
STATIC = Choice(0, 1, tolerance=1e-8)
LOAD_STEPS = (1, 2, 3, 5, 10, 20, 50)
Program = Callable[[], tuple[float, np.ndarray]]  # processor seconds and the answer


@dataclass(frozen=True)
class StaticProblem:
    """A problem without motion: both programs, and the difference of their answers."""

    name: str
    what: str
    ours: Program
    theirs: Program
    difference: Callable[[np.ndarray, np.ndarray], float]
    required_ratio: float | None = None


def timed(call: Callable[[], Any]) -> tuple[float, Any]:
    """Call a function; returns processor time [s] and its result."""
    begun = time.process_time()
    given = call()
    return time.process_time() - begun, given


def on_first_run(make: Callable[[], Program]) -> Program:
    """A program that is set up when it is first run."""
    made: list[Program] = []

    def run() -> tuple[float, np.ndarray]:
        made.extend([] if made else [make()])
        return made[0]()

    return run


def tip(tables: Tables, force: tuple[float, float]) -> Program:
    """flexura: equilibrium position of the tip under a force [N] and the weight, joints held."""
    system = native.system(tables)

    def run() -> tuple[float, np.ndarray]:
        took, q = timed(lambda: fx.static(system, tip_force=force))
        return took, np.asarray(fx.tip_pose(system, q))[:2]

    return run


def exudyn_tip(tables: Tables, elements: int, force: tuple[float, float]) -> Program:
    """Exudyn: the same, with the fewest load steps that converge."""

    def once(steps: int) -> tuple[float, np.ndarray]:
        made = Chain(tables, elements)
        item, mbs = made.item, made.mbs
        for joint, link in zip(made.joints, tables["link"], strict=True):
            ends = [made.origin, joint.coordinate]
            mbs.AddObject(
                item.ObjectConnectorCoordinate(
                    markerNumbers=ends, offset=link["joint"].get("start_rad", 0.0)
                )
            )
        end = mbs.AddMarker(item.MarkerNodePosition(nodeNumber=made.ends[-1][1]))
        mbs.AddLoad(item.LoadForceVector(markerNumber=end, loadVector=[*force, 0]))
        mbs.Assemble()
        chosen = settings(made.exu, STATIC, 1.0, 1.0, 1.0)
        chosen.staticSolver.numberOfLoadSteps, chosen.staticSolver.verboseMode = steps, 0
        newton = chosen.staticSolver.newton
        newton.relativeTolerance = newton.absoluteTolerance = STATIC.tolerance
        took, done = timed(lambda: mbs.SolveStatic(chosen))
        if done is False:
            raise RuntimeError("Exudyn found no equilibrium")
        return took, np.array(
            mbs.GetNodeOutput(made.ends[-1][1], made.exu.OutputVariableType.Position)
        )[:2]

    def converges(steps: int) -> bool:
        try:
            once(steps)
        except RuntimeError:
            return False
        return True

    steps = next(count for count in LOAD_STEPS if converges(count))
    return lambda: once(steps)


def spectrum(tables: Tables) -> Program:
    """flexura: the lowest frequencies [Hz] with free joints."""
    system = native.system(tables)
    takes = inspect.signature(fx.frequencies).parameters
    keys = {"count": COUNT} if "count" in takes else {}
    return lambda: timed(lambda: np.asarray(fx.frequencies(system, joints="free", **keys))[:COUNT])


class SprungChain(Chain):
    """A chain whose hinges are stiff springs."""

    def _hinge(
        self, k: int, root: int, carrier: int, bodies: list[int], place: list[float], start: float
    ) -> None:
        at = self._marker("NodePosition", nodeNumber=root)
        on = {"nodeNumber": self.ends[-1][1]} if k else {"bodyNumber": self.ground}
        before = self._marker("NodePosition" if k else "BodyPosition", **on)
        stiffness = [HINGE_N_M, HINGE_N_M, 0.0]
        self.mbs.AddObject(
            self.item.ObjectConnectorCartesianSpringDamper(
                markerNumbers=[before, at], stiffness=stiffness
            )
        )


def exudyn_spectrum(tables: Tables, elements: int, sprung: bool) -> Program:
    """Exudyn: frequencies [Hz] with free joints.

    Args:
        tables: the robot.
        elements: cables a link.
        sprung: False: all frequencies, dense matrices, hinges as constraints. True: the lowest,
            sparse matrices, hinges as stiff springs.
    """
    made = (SprungChain if sprung else Chain)(tables, elements)
    made.mbs.Assemble()
    sparse = exudyn().SimulationSettings()
    sparse.linearSolver.solverType = exudyn().LinearSolverType.EigenSparse
    keys: dict[str, Any] = (
        {"useSparseSolver": True, "numberOfEigenvalues": COUNT + 8} if sprung else {}
    )
    solve = lambda: made.mbs.ComputeODE2Eigenvalues(sparse, convert2Frequencies=True, **keys)[0]

    def run() -> tuple[float, np.ndarray]:
        took, values = timed(solve)
        return took, np.sort(np.asarray(values))

    return run


def nearest(ours: np.ndarray, theirs: np.ndarray) -> float:
    """The largest relative distance of our frequencies from the nearest of theirs.

    Theirs include the frequencies of stretching.
    """
    return max(float(np.abs(theirs / f - 1).min()) for f in ours if f > 0.1)


def all_statics() -> dict[str, StaticProblem]:
    """The problems by their names."""
    hanging, pull = upright_arm(4), (0.5, -0.6)
    soft, push = robot([beam(1.0, 1.0, 0.1, 8, turning())]), (0.0, 10.0)
    many = chain(4, 50)
    shift = lambda size: lambda a, b: float(np.abs(a - b).max() / size)
    found = [
        StaticProblem(
            "static",
            "three links under their weight and a force at the tip",
            on_first_run(lambda: tip(hanging, pull)),
            on_first_run(lambda: exudyn_tip(hanging, 4, pull)),
            shift(1.2),
            10,
        ),
        StaticProblem(
            "elastica",
            "a cantilever, P L^2/EI = 10, 8 elements",
            on_first_run(lambda: tip(soft, push)),
            on_first_run(lambda: exudyn_tip(soft, 8, push)),
            shift(1.0),
            10,
        ),
        StaticProblem(
            "frequencies",
            f"lowest {COUNT} of 404 unknowns; Exudyn: constraints, dense",
            on_first_run(lambda: spectrum(many)),
            on_first_run(lambda: exudyn_spectrum(many, 50, False)),
            nearest,
            10,
        ),
        StaticProblem(
            "frequencies-sparse",
            "the same; Exudyn: springs as hinges, sparse",
            on_first_run(lambda: spectrum(many)),
            on_first_run(lambda: exudyn_spectrum(many, 50, True)),
            nearest,
        ),
    ]
    return {each.name: each for each in found}
