"""The demonstration: the dissertation's rig along its inverse law, in two programs, and as an
experiment on the emulated board beside its simulation. What is not installed is left out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

import flexura as fx
from flexura.optional import Missing, load

from .. import rig
from ..comparison.measures import Comparison, compare
from ..comparison.replay.simulate_experiment import simulate_experiment
from ..crosscheck import crosscheck as cross
from ..experiment import plan, run_experiment
from ..experiment.flash import RIG, build
from ..recordings.strip_sensor import sensor_of
from ..review import picture
from .compare import save as save_comparison

ROBOT, MANOEUVRE = "rig", "rig-inverse-law"
T = TypeVar("T")


@dataclass(frozen=True)
class Demonstration:
    """What was run, and where what is to be looked at lies; None for what is left out.

    Attributes:
        simulation: the native run.
        check: it and Exudyn's.
        comparison: the emulated experiment and its simulation.
        review, picture: files; in place of the picture why this machine cannot draw one.
        left_out: a sentence for each part that something is missing for.
    """

    simulation: fx.Run
    check: cross.Check | None = None
    comparison: Comparison | None = None
    review: Path | None = None
    picture: Path | str | None = None
    left_out: list[str] = field(default_factory=list)

    @property
    def runs(self) -> list[fx.Run]:
        """All runs that were computed here."""
        twin = [self.check.twin] if self.check else []
        return [self.simulation, *twin, *([self.comparison.experiment] if self.comparison else [])]

    @property
    def passed(self) -> bool:
        """Whether what was run came to its end, and the programs agree."""
        agree = self.check is None or self.check.passed
        return agree and all(run.complete for run in self.runs)

    def moved(self, old: Path, new: Path) -> Demonstration:
        """The same with its files in another folder."""
        place = lambda path: new / path.relative_to(old) if isinstance(path, Path) else path
        return replace(self, review=place(self.review), picture=place(self.picture))


def demonstrate(folder: Path, progress: cross.Progress | None = None) -> Demonstration:
    """Cross-check the rig in `folder`/crosscheck, run the inverse experiment on the emulated board
    into `folder`/experiment, and compare it with its simulation in `folder`/comparison."""
    left_out: list[str] = []

    def attempt(part: str, work: Callable[[], T]) -> T | None:
        try:
            return work()
        except Missing as error:
            left_out.append(f"no {part}: {error}")
            return None

    check = attempt("cross-check", lambda: _check(progress))
    if check is None:
        simulation = _native(progress)
        simulation.save(folder / "crosscheck" / "simulation")
    else:
        done, simulation = check, check.simulation
        attempt("review of the cross-check", lambda: cross.save(done, folder / "crosscheck"))
    experiment = attempt("experiment", lambda: _experiment(folder / "experiment", progress))
    if experiment is None:
        return Demonstration(simulation, check, left_out=left_out)
    found = compare(simulate_experiment(experiment), experiment)
    paths = attempt("report", lambda: save_comparison(found, folder / "comparison", simulated=True))
    if paths is None:
        return Demonstration(simulation, check, found, left_out=left_out)
    try:
        drawn: Path | str = picture(paths[-1], folder / "review.png")
    except fx.FlexuraError as error:
        drawn = str(error)
    return Demonstration(simulation, check, found, paths[-1], drawn, left_out)


def _check(progress: cross.Progress | None) -> cross.Check:
    load("exudyn")  # before the native run, which would be done twice
    robot = fx.load(ROBOT)
    asked = fx.load_manoeuvre(MANOEUVRE, len(robot.links))
    return cross.crosscheck(robot, asked, progress=progress)


def _native(progress: cross.Progress | None) -> fx.Run:
    robot = fx.load(ROBOT)
    asked = fx.load_manoeuvre(MANOEUVRE, len(robot.links))
    report = progress or (lambda name, fraction: None)
    run = fx.simulate(robot, asked.t, asked.drive, progress=lambda f: report("native", f))
    run.meta["manoeuvre"] = asked.name
    return run


def _experiment(folder: Path, progress: cross.Progress | None) -> fx.Run:
    """The inverse law, tracked by the firmware on the emulated board, with the rig's plant behind
    its wires."""
    bench = rig.load(RIG)
    asked = plan.inverse(bench, rig.configuration(bench))
    opened = run_experiment.open_board(bench, None, elf=build())  # what misses it says so first
    watch = run_experiment.Hooks(
        observe=lambda reports, part: progress("emulated", part) if progress else None
    )
    try:
        return run_experiment.conduct(bench, asked, opened, folder, sensor_of(bench), watch).run
    finally:
        opened.board.close()


def numbers(done: Demonstration) -> dict[str, Any]:
    """Where the files lie, and what is left out."""
    drawn = done.picture if isinstance(done.picture, Path) else None
    return {
        "review": done.review and str(done.review),
        "picture": drawn and str(drawn),
        "left_out": done.left_out,
    }
