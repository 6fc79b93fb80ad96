"""The demonstration: the dissertation's rig along its inverse law, in two programs, and as an
experiment on the emulated board beside its simulation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import flexura as fx
from flexura.signals import load_manoeuvre

from .. import rig
from ..comparison.measures import compare
from ..comparison.replay.simulate_experiment import simulate_experiment
from ..crosscheck.crosscheck import Check, Progress, crosscheck, save
from ..experiment import plan, run_experiment
from ..experiment.flash import RIG
from ..paths import MANOEUVRES, ROBOTS
from ..review import picture
from .compare import save as save_comparison

ROBOT = ROBOTS / "rig.toml"
MANOEUVRE = MANOEUVRES / "rig-inverse-law.toml"


@dataclass(frozen=True)
class Demonstration:
    """The cross-check of two programs, the emulated experiment compared with its simulation, and
    where what is to be looked at lies; in place of the picture why this machine cannot draw one."""

    check: Check
    comparison: Any
    review: Path
    picture: Path | str

    @property
    def passed(self) -> bool:
        """Whether the check passed and the experiment came to its end."""
        return self.check.passed and self.comparison.experiment.complete

    def moved(self, old: Path, new: Path) -> Demonstration:
        """The same with its files in another folder."""
        place = lambda path: new / path.relative_to(old) if isinstance(path, Path) else path
        return replace(self, review=place(self.review), picture=place(self.picture))


def demonstrate(folder: Path, progress: Progress | None = None) -> Demonstration:
    """Cross-check the rig in `folder`/crosscheck, run the inverse experiment on the emulated board
    into `folder`/experiment, and compare it with its simulation in `folder`/comparison."""
    if not ROBOT.is_file():
        raise fx.InputError(
            "no such file: the demonstration needs a checkout of the project, with its "
            "model/robots folder",
            file=str(ROBOT),
        )
    robot = fx.load(ROBOT)
    check = crosscheck(robot, load_manoeuvre(MANOEUVRE, len(robot.links)), progress=progress)
    save(check, folder / "crosscheck")
    experiment = _experiment(folder / "experiment", progress)
    found = compare(simulate_experiment(experiment), experiment)
    review = save_comparison(found, folder / "comparison", simulated=True)[-1]
    try:
        return Demonstration(check, found, review, picture(review, folder / "review.png"))
    except fx.FlexuraError as error:
        return Demonstration(check, found, review, str(error))


def _experiment(folder: Path, progress: Progress | None) -> fx.Run:
    """The inverse law, tracked by the firmware on the emulated board, with the rig's plant behind
    its wires."""
    bench = rig.load(RIG)
    asked = plan.inverse(bench, rig.configuration(bench))
    opened = run_experiment.open_board(bench, None)
    watch = run_experiment.Watch(
        observe=lambda reports, part: progress("emulated", part) if progress else None
    )
    try:
        return run_experiment.conduct(
            bench, asked, opened, folder, rig.calibration(bench), watch
        ).run
    finally:
        opened.board.close()
