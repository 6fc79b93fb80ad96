"""Exudyn's cheapest settings for an error: python -m flexlab.benchmarks search [PROBLEM ...].

The converged model: steps are halved, with Newton's method converged, until a third of what the
last halving changed is less than a tenth of the target; Richardson's extrapolation of the last two
counts. The search takes the longest step that holds the target on each mesh, then tries one setting
after another on the best of them, with the longest step that holds the target there, and keeps what
is cheaper. What it finds is in `settings.json`: the choice, its error, its processor time, the
error of the converged model, and how far the converged models of the two programs are apart.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import flexura as fx

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
NEWTON: tuple[dict[str, Any], ...] = (
    {},
    {"increments": True, "tolerance": 1e-8},
)  # the second where the first never holds
Log = Callable[[str], None]


def attempt(problem: Problem, choice: Choice) -> tuple[float, Channels] | None:
    """A run, or None if Exudyn gives up."""
    try:
        return run(problem, choice)
    except (RuntimeError, ValueError, fx.FlexuraError):
        return None


def doubled(problem: Problem, choice: Choice) -> Iterator[tuple[int, float, Channels]]:
    """Runs with twice the steps each: steps in an output step, processor seconds, channels."""
    substeps, seconds = problem.ticks, 0.0
    while substeps <= FINEST and 2.2 * seconds < LONGEST_S:
        got = attempt(problem, replace(choice, substeps=substeps))
        if got is not None:
            seconds = got[0]
            yield substeps, *got
        substeps *= 2


def converged(problem: Problem, log: Log) -> tuple[Channels, float, int]:
    """Exudyn's converged channels on the problem's fine mesh, an estimate of their own error, and
    the most steps in an output step that did not hold the target. Raises RuntimeError."""
    start = Choice(problem.finer_elements or problem.elements, 1)
    before: Channels | None = None
    best: Channels | None = None
    estimate, runs = float("inf"), []
    for substeps, seconds, found in doubled(
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
    """The longest of these steps that holds the target."""
    for count in substeps:
        tried = replace(choice, substeps=count * problem.ticks)
        got = attempt(problem, tried)
        if got is None:
            continue
        if (off := error(got[1], exact)) <= TARGET:
            return tried, got[0], off
        if got[0] > LONGEST_S:
            return None
    return None


def meshes(problem: Problem) -> list[int]:
    """Elements a link to be tried: the problem's, and a few more where a finer mesh counts."""
    return [problem.elements + k for k in ((0, 1, 2, 4) if problem.finer_elements else (0,))]


def cheapest(problem: Problem, exact: Channels, coarse: int, log: Log) -> Found:
    """The cheapest choice that holds the target, with more steps than `coarse`. Raises RuntimeError
    if there is none."""
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
    """The entry of `settings.json`."""
    exact, own, coarse = converged(problem, log)
    choice, seconds, off = cheapest(problem, exact, coarse, log)
    apart = error(native.converged(problem, problem.finer), exact)
    log(f"  the converged models of the two programs are {apart:.1e} apart")
    numbers = {"error": off, "seconds": seconds, "converged_within": own, "apart": apart}
    return {"choice": choice.to_dict()} | {
        key: float(f"{value:.3g}") for key, value in numbers.items()
    }


def stored() -> dict[str, dict[str, Any]]:
    """The choices found so far, by problem."""
    return json.loads(FILE.read_text()) if FILE.exists() else {}


def choice(name: str) -> Choice:
    """The cheapest choice that was found for a problem."""
    return Choice(**stored()[name]["choice"])


def store(name: str, entry: dict[str, Any]) -> None:
    """Write one problem's entry."""
    FILE.write_text(json.dumps(dict(sorted((stored() | {name: entry}).items())), indent=1) + "\n")


def main(problems: list[Problem], log: Log = print) -> None:
    """Search for each problem in turn; what fails is said, and the others are still done."""
    for problem in problems:
        log(problem.name)
        try:
            store(problem.name, search(problem, log))
        except (RuntimeError, fx.FlexuraError) as failed:
            log(f"  {failed}")
