"""The command: python -m flexlab.benchmarks [PART ...] [PROBLEM ...].

Parts: motions, statics, population, scaling, predictive, learning, board, accuracy, passes, time,
search.
"""

from __future__ import annotations

import argparse
import json
import sys
import warnings
from collections.abc import Callable, Iterable
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from . import (
    accuracy,
    equal_error,
    exudyn_search,
    population,
    report,
    scaling,
    time_parts,
)
from .problems import board_load, learning, predictive
from .problems.motions import all_motions
from .problems.problem import Problem
from .problems.statics import StaticProblem, all_statics

# measured by default
PARTS = ("motions", "statics", "population", "scaling", "predictive", "learning", "board")
OTHERS = ("accuracy", "passes", "time", "search")
ROUNDS = 7


def arguments() -> argparse.Namespace:
    """Parse the command line: parts and problems in any order, rounds, JSON.

    Returns:
        The parsed arguments `names`, `rounds`, `json`.
    """
    parser = argparse.ArgumentParser(
        prog="python -m flexlab.benchmarks",
        description=(
            "Times flexura beside Exudyn at equal error, each at its cheapest settings, "
            "in "
            "processor time."
        ),
        epilog=f"parts: {', '.join(PARTS + OTHERS)}; "
        f"problems: {', '.join([*all_motions(), *all_statics()])}. "
        "example: python -m flexlab.benchmarks type4 pendulum static --rounds 3",
    )
    parser.add_argument("names", nargs="*", help="parts or problems; all parts by default")
    parser.add_argument(
        "--rounds",
        type=int,
        default=ROUNDS,
        help=f"rounds in which the programs take turns, default {ROUNDS}",
    )
    parser.add_argument(
        "--json", action="store_true", help="print the numbers as JSON in place of tables"
    )
    given = parser.parse_args()
    known = {*PARTS, *OTHERS, *all_motions(), *all_statics()}
    for name in given.names:
        if name not in known:
            parser.error(f"{name}: expected a part or a problem: {', '.join(sorted(known))}")
    if given.rounds < 1:
        parser.error("--rounds: expected a whole number, 1 or more")
    return given


def each(what: str, items: Iterable[Any], work: Callable[[Any], Any]) -> list[Any]:
    """Call `work` on each item, with a progress bar on stderr.

    Args:
        what: title of the bar.
        items: what is worked on; the bar shows an item's `name`, if it has one.
        work: called once with each item.

    Returns:
        The results, in the order of the items.
    """
    items = list(items)
    columns = (
        TextColumn("{task.description:>32}"),
        BarColumn(),
        TextColumn("{task.completed}/{task.total}"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        task = bars.add_task(what, total=len(items))
        out = []
        for item in items:
            bars.update(task, description=f"{what}: {getattr(item, 'name', item)}")
            out.append(work(item))
            bars.advance(task)
    return out


def measured(
    parts: list[str], motions: list[Problem], statics: list[StaticProblem], rounds: int
) -> dict[str, Any]:
    """Measure the named parts.

    Args:
        parts: names of `PARTS` or `OTHERS`.
        motions: problems for "motions", "accuracy", "passes" and "time".
        statics: problems for "statics".
        rounds: rounds in which the programs take turns.

    Returns:
        The rows of each part, by its name.
    """
    out: dict[str, Any] = {}
    works: dict[str, Callable[[], Any]] = {
        "motions": lambda: each("motions", motions, lambda p: equal_error.motion_row(p, rounds)),
        "statics": lambda: each("statics", statics, lambda p: equal_error.statics_row(p, rounds)),
        "population": lambda: each("population", [rounds], population.measure)[0],
        "scaling": lambda: each("scaling", [5 * rounds], scaling.measure)[0],
        "predictive": lambda: each("predictive", [rounds], predictive.measure)[0],
        "learning": lambda: each("learning", [rounds], learning.measure)[0],
        "board": lambda: each("board", ["emulated"], lambda _: board_load.measure())[0],
        "accuracy": lambda: each("accuracy", [p for p in motions if p.available], accuracy.errors),
        "passes": lambda: each("passes", [p for p in motions if p.available], accuracy.passes),
        "time": lambda: each("time", [p for p in motions if p.available], time_parts.of_motion),
    }
    for part in parts:
        out[part] = works[part]()
    return out


def tables(found: dict[str, Any]) -> list[Any]:
    """Tables and lines to print for the rows of `measured`."""
    shown: dict[str, Callable[[Any], list[Any]]] = {
        "motions": lambda rows: [report.motions(rows), report.summary(rows)],
        "statics": lambda rows: [
            report.statics(rows),
            "\n".join(f"{r['name']}: {r['failed']}" for r in rows if "failed" in r),
        ],
        "population": lambda rows: [report.populations(rows)],
        "scaling": lambda rows: [report.growths(rows)],
        "predictive": lambda rows: [report.predictions(rows)],
        "learning": lambda rows: [report.environments(rows)],
        "board": lambda rows: [report.boards(rows)],
        "accuracy": lambda rows: [
            report.accuracies(rows),
            "\n".join(accuracy.beyond(rows)) or "all within what is asked",
        ],
        "time": lambda rows: [report.time_parts(rows)],
        "passes": lambda rows: [
            report.passes(rows),
            "\n".join(accuracy.slower(rows)) or "auto: all within what is asked",
        ],
    }
    return [part for name, rows in found.items() for part in shown[name](rows) if part]


def main() -> None:
    """Run the command."""
    warnings.filterwarnings("ignore")
    given = arguments()
    motions, statics = all_motions(), all_statics()
    chosen = [motions[name] for name in given.names if name in motions]
    static_problems = [statics[name] for name in given.names if name in statics]
    parts = [name for name in given.names if name in PARTS + OTHERS]
    if not parts:
        parts = [
            part for part, some in (("motions", chosen), ("statics", static_problems)) if some
        ] or list(PARTS)
    if "search" in parts:
        exudyn_search.main(
            chosen or list(motions.values()), lambda line: print(line, file=sys.stderr, flush=True)
        )
        return
    found = measured(
        parts,
        chosen or list(motions.values()),
        static_problems or list(statics.values()),
        given.rounds,
    )
    if given.json:
        print(json.dumps(found, indent=1, default=float))
        return
    report.show(*tables(found))


if __name__ == "__main__":
    main()
