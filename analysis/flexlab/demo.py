"""The demonstration: the dissertation's rig along its inverse law, in two programs and one picture."""

from __future__ import annotations

from pathlib import Path

import flexura as fx
from flexura.drive import load_manoeuvre

from .crosscheck import Check, Progress, crosscheck, save

ROOT = Path(__file__).parents[2]
ROBOT = ROOT / "model" / "robots" / "rig.toml"
MANOEUVRE = ROOT / "model" / "manoeuvres" / "rig-inverse-law.toml"


def demonstrate(folder: Path, progress: Progress | None = None) -> tuple[Check, Path, Path | str]:
    """Simulate the rig natively and in Exudyn, and leave runs, review and picture in `folder`.

    Returns the check, the review's path and the picture's, or in its place why this machine cannot draw one.
    """
    from .review import picture

    if not ROBOT.is_file():
        raise fx.InputError(
            "no such file: the demonstration needs a checkout of the project, with its model/robots folder", file=str(ROBOT)
        )
    robot = fx.load(ROBOT)
    check = crosscheck(robot, load_manoeuvre(MANOEUVRE, len(robot.links)), progress=progress)
    review = save(check, folder)
    try:
        return check, review, picture(review, folder / "review.png")
    except fx.FlexuraError as error:
        return check, review, str(error)
