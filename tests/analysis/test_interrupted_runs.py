"""Ctrl-C within a computation: a simulation then returns the part that it has, and nothing may be
made of that part as if it were the whole."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import flexlab
import flexura

# Who calls a simulation without `uninterrupted()`, and why.
TO_THE_CALLER = "gives the run, with its event, to its caller"
REASONS = {
    "simulation/approximate_inverse.py rigid_feedforward": TO_THE_CALLER,
    "simulation/dynamics.py inverse": TO_THE_CALLER,
    "simulation/trajectory/tip_inversion.py recorded": TO_THE_CALLER,
    "cli/demonstration.py _native": TO_THE_CALLER,
    "cli/output.py simulate_asked": TO_THE_CALLER,
    "comparison/replay/gear_loss.py with_losses": "the first round is the caller's",
    "comparison/replay/simulate_experiment.py simulate_experiment": TO_THE_CALLER,
    "comparison/replay/stepper_relaxation.py _simulate_with_function": TO_THE_CALLER,
    "crosscheck/crosscheck.py crosscheck": "compares the part that both have, and says so",
    "crosscheck/crosscheck.py simulated": "compares the part that both have, and says so",
    "cli/simulate.py _simulate_many": "a population, which keeps what is finished",
    "population/worker.py _alone": "in a thread, which gets no Ctrl-C: a population has a watch",
    "identification/strip.py _behind_gears": "`simulate` there asks, of both ways",
    "identification/fit/identify_robot.py _unknowns": "one row",
    "identification/fit/identify_robot.py _channels": "one row",
}


def calls(folder: Path) -> Iterator[str]:
    """The functions below a folder that call a simulation without `uninterrupted()`."""
    for file in sorted(folder.rglob("*.py")):
        if "benchmarks" in file.parts:  # ended by Ctrl-C as any program
            continue
        yield from _within(ast.parse(file.read_text()), f"{file.relative_to(folder)}", "")


def _within(node: ast.AST, file: str, function: str) -> Iterator[str]:
    for child in ast.iter_child_nodes(node):
        own = child.name if isinstance(child, ast.FunctionDef) else function
        if _simulates(child) and not (
            isinstance(node, ast.Attribute) and node.attr == "uninterrupted"
        ):
            yield f"{file} {own}"
        yield from _within(child, file, own)


def _simulates(node: ast.AST) -> bool:
    """`simulate(...)`, `inverse(...)`, or the same of `fx` or `twin`."""
    if not isinstance(node, ast.Call):
        return False
    called = node.func
    if isinstance(called, ast.Attribute) and isinstance(called.value, ast.Name):
        return called.value.id in ("fx", "twin") and called.attr in ("simulate", "inverse")
    return isinstance(called, ast.Name) and called.id in ("simulate", "inverse")


def test_every_run_within_a_computation_ends_with_it():
    found = [call for each in (flexura, flexlab) for call in calls(Path(each.__path__[0]))]
    assert set(found) == set(REASONS)
