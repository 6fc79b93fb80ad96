"""What a review calls and how it colours the runs that it shows."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from flexura.errors import InputError
from flexura.io import Run

from ..runs import labels
from ..runs.poses import with_poses
from .shapes import has_shapes

Colour = tuple[int, int, int]
COLOURS: dict[str, Colour] = {
    "simulation": (36, 123, 214),
    "twin": (240, 120, 24),
    "experiment": (32, 164, 84),
}
SECOND: Colour = (160, 84, 204)  # the second of two runs from the same kind of source
OTHER: Colour = (110, 110, 110)
DEVIATION: Colour = (214, 64, 140)
NAMES = {
    COLOURS["simulation"]: "blue",
    COLOURS["twin"]: "orange",
    COLOURS["experiment"]: "green",
    SECOND: "violet",
    OTHER: "grey",
}

_HIDDEN = re.compile(
    r"link/\d+/(x|y|angle|deflection/\d+)"
)  # drawn as shapes, not as curves over time


@dataclass(frozen=True)
class Source:
    """One run of a review: its root in the entity tree, what it is called, its colour; `computed`:
    its poses are no channels."""

    root: str
    label: str
    colour: Colour
    run: Run
    computed: bool

    @property
    def signals(self) -> list[str]:
        """The channels that are shown over time."""
        return [name for name in self.run if not _HIDDEN.fullmatch(name)]

    @property
    def shaped(self) -> bool:
        return has_shapes(self.run)


def sources(runs: Sequence[Run]) -> list[Source]:
    """One or two runs with their names. Raises InputError for another number of runs, or one
    without samples."""
    if not 1 <= len(runs) <= 2:
        raise InputError("one run, or two to compare", key="runs", value=len(runs))
    found: list[Source] = []
    for run in runs:
        kind = labels.kind(run)
        if len(run) == 0:
            raise InputError("a run with samples; this one is empty", key="run", value=kind)
        root = re.sub(r"[^a-z0-9_]", "_", kind.lower())
        colour, again = COLOURS.get(kind, OTHER), ""
        if found and found[0].root == root:
            root, colour, again = f"{root}_2", SECOND, " 2"
        placed, computed = with_poses(run)
        found.append(Source(root, labels.called(run, again), colour, placed, computed))
    return found


def against_experiment(shown: Sequence[Source]) -> bool:
    """Whether these are a calculation and an experiment, in this order."""
    return len(shown) == 2 and [labels.kind(s.run) == "experiment" for s in shown] == [False, True]


def order(names: list[str], units: dict[str, str]) -> dict[str, int]:
    """Which tone each channel gets: its place, from 0, among those that share a plot with it."""
    fixed = {
        "energy/strain": 1,
        "energy/potential": 2,
        "energy/loss": 1,
        "tip/y": 1,
        "tip_distance": 2,
    }
    places: dict[str, int] = {}
    seen: dict[tuple[str, str], int] = {}
    for name in names:
        plot = (re.sub(r"\d+", "", name), units.get(name, "m"))
        if re.fullmatch(r"(joint|link)/\d+/\w+", name):
            places[name] = seen[plot] = seen.get(plot, -1) + 1
        else:
            places[name] = fixed.get(name, 0)
    return places


def tone(colour: Colour, k: int) -> Colour:
    """A lighter tone of a colour for the k-th curve (from 0) of one source in one plot."""
    share = (0.0, 0.5, 0.75, 0.25)[k % 4]
    r, g, b = (round(c + share * (255 - c)) for c in colour)
    return r, g, b


def entity(name: str) -> str:
    """A channel's name as an entity path: only what needs no escaping."""
    return re.sub(r"[^A-Za-z0-9_/]", "_", name)


def loaded(run: Run) -> bool:
    """Whether the robot of the run carries a payload."""
    return bool(run.meta.get("robot", {}).get("payload", {}).get("mass_kg", 0.0))


def tip_meaning(run: Run) -> str:
    return "large because it carries the payload" if loaded(run) else "without a payload"
