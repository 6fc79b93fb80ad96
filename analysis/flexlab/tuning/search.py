"""The search: pymoo's algorithms by ask and tell, one call of the executor a generation.

Every generation is stored. The algorithms are deterministic for a seed, so that their state need
not be stored: a search that continues asks again for the stored generations and gets their goals
instead of running them.

A run is stopped once it is certainly useless to the search. In the genetic algorithm, a candidate
worse than every parent does not survive. In the swarm, one worse than its particle's own best
changes nothing. The search is the same as without this.
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

from .executor import Evaluator
from .history import History
from .objective import FAILURE_COST

ALGORITHMS = {
    "ga": (
        "genetic algorithm, real-coded: tournaments of 3, crossover (SBX) 0.8, mutation 0.1; "
        "best of parents and young stay"
    ),
    "pso": "particle swarm with adaptive inertia",
    "cma-es": "covariance matrix adaptation",
    "nsga2": "Pareto front: two goals",
}
# individuals of a polish, and their initial distance from the best point
POLISH_POPULATION, POLISH_SIGMA = 16, 0.2
MIN_IMPROVEMENT = 1e-3  # an improvement by less than this fraction is none


@dataclass(frozen=True)
class Search:
    """How to search.

    `patience`: generations without an improvement after which the search ends. `polish`:
    generations of a local CMA-ES that starts from the best point after that.
    """

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
        """What determines the generations, the solver included; the ends do not."""
        own = {
            "algorithm": self.algorithm,
            "population": self.population,
            "seed": self.seed,
            "program": program(),
        }
        return own | (
            {"generations": self.generations, "patience": self.patience} if self.polish else {}
        )


class SearchProblem(Protocol):
    """What a search needs of a task: free settings, start, and the goals from metrics."""

    @property
    def free(self) -> Sized:
        """The free settings, d of them."""
        ...

    @property
    def pareto(self) -> bool:
        """Whether there are two goals."""
        ...

    @property
    def objectives(self) -> tuple[str, ...]:
        """Names of the goals."""
        ...

    def start(self) -> np.ndarray:
        """The point (d,) to start from."""
        ...

    def score(self, metrics: np.ndarray, reached: np.ndarray) -> np.ndarray:
        """The goals (B, 1 or 2) from metrics (B, R, k) and fractions reached (B, R)."""
        ...


def search(
    task: SearchProblem,
    how: Search,
    evaluate: Evaluator,
    history: History,
    progress: Callable[[History], None],
) -> bool:
    """Continue the search in `history` to its end; every generation is stored when done.

    Args:
        task: what is optimised.
        how: the search.
        evaluate: evaluates points.
        history: stored generations.
        progress: called after each generation.

    Returns:
        True: to its end; False: interrupted.

    Raises:
        InputError: options do not fit, or the stored generations are another search's.
    """

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
            _algorithm(how, task.start()),
            how.generations,
            how,
            task,
            evaluate,
            history,
            progress,
            0,
        )
        if how.polish:
            best = history.all("points")[
                int(history.all("goals")[: history.ends[done - 1], 0].argmin())
            ]
            local = load("pymoo.algorithms.soo.nonconvex.cmaes").CMAES(
                x0=best, sigma=POLISH_SIGMA, popsize=POLISH_POPULATION, tolfun=1e-6, tolx=1e-5
            )
            _stage(
                local,
                how.polish,
                replace(how, patience=how.polish),
                task,
                evaluate,
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
    task: SearchProblem,
    evaluate: Evaluator,
    history: History,
    progress: Callable[[History], None],
    first: int,
) -> int:
    """Run one algorithm to its end; its generations are the history's from `first` on.

    Returns:
        The number of generations after it.
    """
    d, generation = len(task.free), first
    core, static = load("pymoo.core.evaluator"), load("pymoo.problems.static")
    Problem = load("pymoo.core.problem").Problem
    problem = Problem(n_var=d, n_obj=len(task.objectives), xl=np.zeros(d), xu=np.ones(d))
    algorithm.setup(problem, termination=("n_gen", generations), seed=how.seed, verbose=False)
    while algorithm.has_next() and not (
        generation - first > how.patience and _stagnant(history, generation, how.patience)
    ):
        asked = algorithm.ask()
        if asked is None or len(asked) == 0:
            break
        points = np.asarray(asked.get("X"), dtype=float)
        if generation < len(history):
            objectives = history.objectives_for_algorithm(generation, points)
        else:
            begun = time.perf_counter()
            metrics, reached = evaluate(points, limits(algorithm, len(points)))
            objectives = task.score(metrics, reached)
            history.append(points, objectives, metrics, reached, time.perf_counter() - begun)
            progress(history)
        core.Evaluator().eval(static.StaticProblem(problem, F=objectives), asked)
        algorithm.tell(infills=asked)
        generation += 1
    return generation


def _algorithm(how: Search, start: np.ndarray) -> Any:
    """pymoo's algorithm. Its first generation is a Latin hypercube with `start` in it.

    CMA-ES begins at `start`.
    """
    from scipy.stats import qmc

    CMAES = load("pymoo.algorithms.soo.nonconvex.cmaes").CMAES
    GA = load("pymoo.algorithms.soo.nonconvex.ga").GA
    NSGA2 = load("pymoo.algorithms.moo.nsga2").NSGA2
    PM = load("pymoo.operators.mutation.pm").PM
    PSO = load("pymoo.algorithms.soo.nonconvex.pso").PSO
    SBX = load("pymoo.operators.crossover.sbx").SBX
    TournamentSelection = load("pymoo.operators.selection.tournament").TournamentSelection
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
    """The best (k, 1) of each tournament (k, 3); pymoo's comparison looks at two only."""
    J = population.get("F")[:, 0]
    return drawn[np.arange(len(drawn)), J[drawn].argmin(axis=1)][:, None]


def limits(algorithm: Any, count: int) -> np.ndarray:
    """The J above which each of the points just asked for is useless.

    Args:
        algorithm: pymoo's algorithm.
        count: number of points.

    Returns:
        (count,), inf if every J matters: CMA-ES ranks all.
    """
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
    return np.where(out < FAILURE_COST, out, np.inf)  # what a failure costs is not known before


def _stagnant(history: History, generation: int, patience: int) -> bool:
    """Whether the last `patience` generations brought no improvement."""
    now, before = (
        history.convergence_measure(generation),
        history.convergence_measure(generation - patience),
    )
    return bool(before - now <= MIN_IMPROVEMENT * abs(before))
