"""The search: pymoo's algorithms by ask and tell, one call of the engine a generation, every
generation stored.

The algorithms are deterministic for a seed, so that what is stored is not their state but what they
were told: a search that goes on asks again for the stored generations and tells their goals instead
of running them. That holds for all four alike.

A run is abandoned where it is certain that the search has no use for it: one worse than every
parent does not survive in the genetic algorithm, one worse than its particle's own best changes
nothing in the swarm. The search goes the same way as without.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sized
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from flexura.errors import FlexuraError, InputError
from flexura.optional import load
from flexura.population import program

from .executor import Runs
from .history import History
from .objective import FAILED

ALGORITHMS = {
    "ga": (
        "genetic algorithm, real-coded: tournaments of 3, crossover (SBX) 0.8, mutation 0.1; "
        "best of parents and young stay"
    ),
    "pso": "particle swarm with adaptive inertia",
    "cma-es": "covariance matrix adaptation",
    "nsga2": "Pareto front: two goals",
}
POLISHERS, NEAR = 16, 0.2  # individuals of a polish, and how far they begin from the best
SAME = 1e-3  # an improvement by less than this fraction is none


@dataclass(frozen=True)
class Search:
    """How to search; `patience`: generations without an improvement after which it ends; `polish`:
    generations of a local CMA-ES from the best point after that."""

    algorithm: str = "ga"
    population: int = 50
    generations: int = 100
    seed: int = 1
    patience: int = 30
    polish: int = 0

    def __post_init__(self) -> None:
        if self.algorithm not in ALGORITHMS:
            raise InputError(
                f"expected one of {', '.join(ALGORITHMS)}", key="--algorithm", value=self.algorithm
            )
        for name, least in (
            ("population", 4),
            ("generations", 1),
            ("seed", 0),
            ("patience", 1),
            ("polish", 0),
        ):
            if getattr(self, name) < least:
                raise InputError(
                    f"expected {least} or more", key=f"--{name}", value=getattr(self, name)
                )

    def identity(self) -> dict[str, Any]:
        """What makes its generations what they are, the solver too; its ends do not."""
        own = {
            "algorithm": self.algorithm,
            "population": self.population,
            "seed": self.seed,
            "program": program(),
        }
        return own | (
            {"generations": self.generations, "patience": self.patience} if self.polish else {}
        )


class Sought(Protocol):
    """What a search asks of a task: how many settings are free, where to start, and the goals of an
    engine's figures."""

    @property
    def free(self) -> Sized: ...
    @property
    def pareto(self) -> bool: ...
    @property
    def goals(self) -> tuple[str, ...]: ...
    def start(self) -> np.ndarray: ...
    def score(self, figures: np.ndarray, reached: np.ndarray) -> np.ndarray: ...


def search(
    task: Sought, how: Search, engine: Runs, history: History, progress: Callable[[History], None]
) -> bool:
    """Go on from what `history` holds to the end of the search; every generation is stored as it is
    done. True: to its end, not interrupted. Raises InputError where the stored generations are not
    this search's."""
    CMAES = load("pymoo.algorithms.soo.nonconvex.cmaes").CMAES

    if task.pareto != (how.algorithm == "nsga2"):
        raise InputError(
            "expected nsga2 for two goals, and only for them",
            key="--algorithm",
            value=how.algorithm,
        )
    if task.pareto and how.polish:
        raise InputError(
            "expected none where there are two goals", key="--polish", value=how.polish
        )
    try:
        done = _stage(
            _algorithm(how, task.start()), how.generations, how, task, engine, history, progress, 0
        )
        if how.polish:
            best = history.all("points")[
                int(history.all("goals")[: history.ends[done - 1], 0].argmin())
            ]
            local = CMAES(x0=best, sigma=NEAR, popsize=POLISHERS, tolfun=1e-6, tolx=1e-5)
            _stage(
                local,
                how.polish,
                replace(how, patience=how.polish),
                task,
                engine,
                history,
                progress,
                done,
            )
    except KeyboardInterrupt:
        return False
    if not len(history):
        raise FlexuraError("the search made no generation")
    return True


def _stage(
    algorithm: Any,
    generations: int,
    how: Search,
    task: Sought,
    engine: Runs,
    history: History,
    progress: Callable[[History], None],
    first: int,
) -> int:
    """One algorithm to its end, its generations being the history's from `first` on; how many there
    are after it."""
    Evaluator = load("pymoo.core.evaluator").Evaluator
    Problem = load("pymoo.core.problem").Problem
    StaticProblem = load("pymoo.problems.static").StaticProblem

    d, generation = len(task.free), first
    problem = Problem(n_var=d, n_obj=len(task.goals), xl=np.zeros(d), xu=np.ones(d))
    algorithm.setup(problem, termination=("n_gen", generations), seed=how.seed, verbose=False)
    while algorithm.has_next() and not (
        generation - first > how.patience and _stagnant(history, generation, how.patience)
    ):
        asked = algorithm.ask()
        if asked is None or len(asked) == 0:
            break
        points = np.asarray(asked.get("X"), dtype=float)
        if generation < len(history):
            goals = history.told(generation, points)
        else:
            begun = time.perf_counter()
            figures, reached = engine(points, limits(algorithm, len(points)))
            goals = task.score(figures, reached)
            history.add(points, goals, figures, reached, time.perf_counter() - begun)
            progress(history)
        Evaluator().eval(StaticProblem(problem, F=goals), asked)
        algorithm.tell(infills=asked)
        generation += 1
    return generation


def _algorithm(how: Search, start: np.ndarray) -> Any:
    """pymoo's algorithm; its first generation is a Latin hypercube with `start` in it, CMA-ES
    begins there."""
    NSGA2 = load("pymoo.algorithms.moo.nsga2").NSGA2
    CMAES = load("pymoo.algorithms.soo.nonconvex.cmaes").CMAES
    GA = load("pymoo.algorithms.soo.nonconvex.ga").GA
    PSO = load("pymoo.algorithms.soo.nonconvex.pso").PSO
    SBX = load("pymoo.operators.crossover.sbx").SBX
    PM = load("pymoo.operators.mutation.pm").PM
    TournamentSelection = load("pymoo.operators.selection.tournament").TournamentSelection
    from scipy.stats import qmc

    if how.algorithm == "cma-es":
        return CMAES(x0=start, sigma=0.3, popsize=how.population, tolfun=1e-6, tolx=1e-5)
    first = qmc.LatinHypercube(len(start), seed=how.seed).random(how.population)
    first[0] = start
    cross, change = SBX(prob=0.8, eta=10), PM(prob=1.0, prob_var=max(0.1, 1 / len(start)), eta=5)
    if how.algorithm == "ga":
        select = TournamentSelection(pressure=3, func_comp=_winners)
        return GA(
            pop_size=how.population,
            sampling=first,
            selection=select,
            crossover=cross,
            mutation=change,
        )
    if how.algorithm == "pso":
        return PSO(pop_size=how.population, sampling=first)
    return NSGA2(pop_size=how.population, sampling=first, crossover=cross, mutation=change)


def _winners(population: Any, drawn: np.ndarray, **_: Any) -> np.ndarray:
    """The best (k, 1) of each tournament (k, 3); pymoo's own comparison looks at the first two
    only."""
    J = population.get("F")[:, 0]
    return drawn[np.arange(len(drawn)), J[drawn].argmin(axis=1)][:, None]


def limits(algorithm: Any, count: int) -> np.ndarray:
    """The J (count,) above which each of the points just asked for is of no use, inf where every J
    is: CMA-ES ranks all."""
    GA = load("pymoo.algorithms.soo.nonconvex.ga").GA
    PSO = load("pymoo.algorithms.soo.nonconvex.pso").PSO

    out = np.full(count, np.inf)
    if not algorithm.is_initialized or not isinstance(algorithm, GA | PSO):
        return out
    known = algorithm.pop.get("F")[:, 0]
    if isinstance(algorithm, PSO):
        out[:] = known  # a particle's own best
    elif len(known) == algorithm.pop_size:
        out[:] = known.max()  # of equals the parents survive
    return np.where(out < FAILED, out, np.inf)  # what a failure costs is not known before


def _stagnant(history: History, generation: int, patience: int) -> bool:
    """Was there no improvement in the last `patience` generations before this one? Of two goals: of
    the front's area."""
    now, before = history.merit(generation), history.merit(generation - patience)
    return bool(before - now <= SAME * abs(before))
