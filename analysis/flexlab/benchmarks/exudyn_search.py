"""Exudyn's cheapest settings for an error: python -m flexlab.benchmarks search [PROBLEM ...].

Converged model: steps are halved, with Newton's method converged, until the estimated error is
below a tenth of the target. The estimate is a third of the last change; Richardson's extrapolation
of the last two runs is the result.

Search: on each mesh the longest step that holds the target; then one setting after another on the
best mesh. Cheaper settings are kept. `settings.json` gets the choice, its error and processor time,
the error of the converged model, and the difference of the two programs' converged models.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import flexura as fx
from flexura.io import write_text

from . import native
from .exudyn_programs.run import Choice, run
from .problems.problem import Channels, Problem, error

FILE = Path(__file__).with_name("settings.json")
TARGET = 1e-3  # of `problem.scale`
LADDER = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024)
FINEST = 2048  # steps in an output step at most
LONGEST_S = 60.0  # of processor time: a longer run is not begun
CHEAPER = 0.97  # of the time so far: what counts as cheaper
VARIANTS: tuple[dict[str, Any], ...] = (
    {"tolerance": 1e-5},
    {"tolerance": 1e-4},
    {"increments": True, "tolerance": 1e-6},
    {"increments": True, "tolerance": 1e-8},
    {"spectral_radius": 0.99},
    {"spectral_radius": 0.8},
    {"spectral_radius": 0.6},
    {"reduced": 2},
    {"sparse": True},
    {"trapezoidal": True},
)
# the second is used if the first never holds
NEWTON: tuple[dict[str, Any], ...] = ({}, {"increments": True, "tolerance": 1e-8})
Log = Callable[[str], None]


def attempt(problem: Problem, choice: Choice) -> tuple[float, Channels] | None:
    """One run of Exudyn: processor time [s] and channels, or None if Exudyn fails."""
    try:
        return run(problem, choice)
    except (RuntimeError, ValueError, fx.FlexuraError):
        return None


def runs_with_halved_steps(
    problem: Problem, choice: Choice
) -> Iterator[tuple[int, float, Channels]]:
    """Runs with twice as many steps each, until a run would take too long.

    Yields:
        Steps in an output step, processor time [s], channels.
    """
    substeps, seconds = problem.ticks, 0.0
    while substeps <= FINEST and 2.2 * seconds < LONGEST_S:
        result = attempt(problem, replace(choice, substeps=substeps))
        if result is not None:
            seconds = result[0]
            yield substeps, *result
        substeps *= 2


def converged(problem: Problem, log: Log) -> tuple[Channels, float, int]:
    """Exudyn's converged channels on the problem's fine mesh.

    Args:
        problem: what is run.
        log: called with lines of progress.

    Returns:
        The channels, an estimate of their error, and the largest number of steps in an output step
            that did not hold the target.

    Raises:
        RuntimeError: the converged model was not reached.
    """
    start = Choice(problem.finer_elements or problem.elements, 1)
    before: Channels | None = None
    best: Channels | None = None
    estimate, runs = float("inf"), []
    for substeps, seconds, found in runs_with_halved_steps(
        problem, start if problem.hub_length_m else start.tight()
    ):
        runs.append((substeps, found))
        if before is not None:
            change = error(before, found)
            log(f"  converged: {substeps} steps, {seconds:.2f} s, change {change:.1e}")
            if best is not None and change > 1.2 * 3 * estimate:  # round-off
                break
            best, estimate = (
                {name: v + (v - before[name]) / 3 for name, v in found.items()},
                change / 3,
            )
            if estimate < 0.1 * TARGET:
                break
        before = found
    if best is None:
        raise RuntimeError(f"{problem.name}: Exudyn's converged model was not reached")
    return (
        best,
        estimate,
        max((substeps for substeps, found in runs if error(found, best) > TARGET), default=0),
    )


Found = tuple[Choice, float, float]  # a choice, its processor seconds and its error


def longest_step(
    problem: Problem, choice: Choice, exact: Channels, substeps: list[int]
) -> Found | None:
    """The longest step that holds the target.

    Args:
        problem: what is run.
        choice: the other settings.
        exact: the converged channels.
        substeps: numbers of steps to try, in ticks of the problem.

    Returns:
        The choice, its processor time [s] and error; None if no step holds the target.
    """
    for count in substeps:
        tried = replace(choice, substeps=count * problem.ticks)
        result = attempt(problem, tried)
        if result is None:
            continue
        if (found_error := error(result[1], exact)) <= TARGET:
            return tried, result[0], found_error
        if result[0] > LONGEST_S:
            return None
    return None


def meshes(problem: Problem) -> list[int]:
    """Numbers of elements to try: the problem's, and some more if a finer mesh counts."""
    return [problem.elements + k for k in ((0, 1, 2, 4) if problem.finer_elements else (0,))]


def cheapest(problem: Problem, exact: Channels, coarse: int, log: Log) -> Found:
    """The cheapest choice that holds the target.

    Args:
        problem: what is run.
        exact: the converged channels.
        coarse: number of steps that is known to be too small.
        log: called with lines of progress.

    Returns:
        The choice, its processor time [s] and error.

    Raises:
        RuntimeError: there is none.
    """
    ladder = list(LADDER)
    finer = [count for count in ladder if count * problem.ticks > coarse]
    for newton in NEWTON:
        tried = (
            longest_step(problem, Choice(elements, 1, **newton), exact, finer)
            for elements in meshes(problem)
        )
        found = [each for each in tried if each is not None]
        if found:
            break
    else:
        raise RuntimeError(f"{problem.name}: Exudyn does not hold {TARGET:g}")
    best = min(found, key=lambda each: each[1])
    log(f"  {best[0].to_dict()}: {best[1]:.3f} s, error {best[2]:.1e}")
    improved = not problem.hub_length_m  # the twin has settings of its own
    while improved:
        improved = False
        for change in VARIANTS:
            tried_choice = replace(best[0], **change)
            if tried_choice == best[0]:
                continue
            at = ladder.index(best[0].substeps // problem.ticks)
            new = longest_step(problem, tried_choice, exact, ladder[max(0, at - 2) : at + 1])
            if new is None:
                continue
            again = [attempt(problem, choice) for choice in (new[0], best[0])]
            seconds = [
                min(a, b[0] if b else a) for a, b in zip((new[1], best[1]), again, strict=True)
            ]
            best = (best[0], seconds[1], best[2])
            if seconds[0] < CHEAPER * seconds[1]:
                best, improved = (new[0], seconds[0], new[2]), True
                log(f"  cheaper: {best[0].to_dict()}: {best[1]:.3f} s, error {best[2]:.1e}")
    return best


def search(problem: Problem, log: Log) -> dict[str, Any]:
    """Search one problem's settings.

    Returns:
        The entry of `settings.json`.
    """
    exact, own, coarse = converged(problem, log)
    choice, seconds, found_error = cheapest(problem, exact, coarse, log)
    difference = error(native.converged(problem, problem.finer), exact)
    log(f"  the converged models of the two programs are {difference:.1e} apart")
    numbers = {
        "error": found_error,
        "seconds": seconds,
        "converged_within": own,
        "apart": difference,
    }
    return {"choice": choice.to_dict()} | {
        key: float(f"{value:.3g}") for key, value in numbers.items()
    }


def stored() -> dict[str, dict[str, Any]]:
    """The entries of `settings.json`, by problem."""
    return json.loads(FILE.read_text()) if FILE.exists() else {}


def choice(name: str) -> Choice:
    """The cheapest choice that was found for a problem."""
    return Choice(**stored()[name]["choice"])


def store(name: str, entry: dict[str, Any]) -> None:
    """Write one problem's entry of `settings.json`."""
    entries = dict(sorted((stored() | {name: entry}).items()))
    write_text(FILE, json.dumps(entries, indent=1) + "\n")


def main(problems: list[Problem], log: Log = print) -> None:
    """Search the problems in turn; a failure is reported and the next problem follows."""
    for problem in problems:
        log(problem.name)
        try:
            store(problem.name, search(problem, log))
        except (RuntimeError, fx.FlexuraError) as failed:
            log(f"  {failed}")
