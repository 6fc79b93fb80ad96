"""What a review calls and how it colours the runs that it shows."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence
from dataclasses import dataclass

from flexura.errors import InputError
from flexura.io import Run, called, kind
from flexura.io.drawing import has_shapes, with_poses

Colour = tuple[int, int, int]
COLOURS: dict[str, Colour] = {
    "simulation": (36, 123, 214),
    "twin": (240, 120, 24),
    "experiment": (32, 164, 84),
}
SECOND: Colour = (160, 84, 204)  # the second of two runs from the same kind of source
FURTHER: tuple[Colour, ...] = (SECOND, (196, 130, 30), (20, 150, 160), (200, 70, 70), (90, 110, 60))
MOST = 6  # runs of one review
OTHER: Colour = (110, 110, 110)
DEVIATION: Colour = (214, 64, 140)
# The curves of one source in one plot: its own colour, then others near it. Each is seen on the
# viewer's light and dark background alike, and differs from its neighbours in lightness too.
FAMILIES: dict[Colour, tuple[Colour, ...]] = {
    COLOURS["simulation"]: ((36, 123, 214), (0, 172, 200), (116, 92, 214), (120, 168, 232)),
    COLOURS["twin"]: ((240, 120, 24), (204, 52, 44), (196, 146, 20), (236, 140, 128)),
    COLOURS["experiment"]: ((32, 164, 84), (134, 150, 24), (16, 116, 104), (112, 184, 128)),
    SECOND: ((160, 84, 204), (210, 92, 178), (112, 72, 168), (184, 148, 216)),
    DEVIATION: ((214, 64, 140), (226, 112, 84), (150, 60, 150), (226, 140, 178)),
    OTHER: ((110, 110, 110), (165, 165, 165), (70, 110, 160), (170, 120, 80)),
}
NAMES = {
    COLOURS["simulation"]: "blue",
    COLOURS["twin"]: "orange",
    COLOURS["experiment"]: "green",
    SECOND: "violet",
    OTHER: "grey",
    FURTHER[1]: "ochre",
    FURTHER[2]: "teal",
    FURTHER[3]: "red",
    FURTHER[4]: "olive",
}

# drawn as shapes, not as curves over time
_HIDDEN = re.compile(r"link/\d+/(x|y|angle|deflection/\d+)")


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
    def has_shape(self) -> bool:
        """Whether the run's channels say where its links are."""
        return has_shapes(self.run)


def sources(runs: Sequence[Run]) -> list[Source]:
    """Up to MOST runs with their names, the first one what others are compared with.

    A run without a robot, as of a log, is drawn as the robot of another that fits its channels.

    Raises:
        InputError: another number of runs, or one without samples.
    """
    if not 1 <= len(runs) <= MOST:
        raise InputError(f"expected one to {MOST} runs", key="runs", value=len(runs))
    lent = next((run.meta["robot"] for run in runs if run.meta.get("robot")), None)
    found: list[Source] = []
    for run in runs:
        source = kind(run)
        if len(run) == 0:
            raise InputError("a run with samples; this one is empty", key="run", value=source)
        root = re.sub(r"[^a-z0-9_]", "_", source.lower())
        colour, again = COLOURS.get(source, OTHER), ""
        if count := sum(kind(s.run) == source for s in found):
            root, again = f"{root}_{count + 1}", f" {count + 1}"
            used = {s.colour for s in found}
            colour = next(c for c in FURTHER if c not in used)
        placed, computed = with_poses(run)
        if lent is not None and not run.meta.get("robot"):
            borrowed = dataclasses.replace(run, meta={**run.meta, "robot": lent})
            placed, computed = with_poses(borrowed)
            placed = placed if has_shapes(placed) else run
        found.append(Source(root, called(run, again), colour, placed, computed))
    return found


def against_experiment(shown: Sequence[Source]) -> bool:
    """Whether these are a calculation and an experiment, in this order."""
    return len(shown) == 2 and [kind(s.run) == "experiment" for s in shown] == [False, True]


def order(names: list[str], units: dict[str, str]) -> dict[str, int]:
    """Which colour of a family each channel gets: its place, from 0, among those that share a plot
    with it."""
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


def curve_colour(colour: Colour, k: int) -> Colour:
    """The colour of the k-th curve (from 0) of one source in one plot."""
    family = FAMILIES.get(colour, (colour, lightened(colour, 0.4)))
    return family[k % len(family)]


def lightened(colour: Colour, share: float) -> Colour:
    """A colour mixed with a share of white, for what is drawn on white."""
    r, g, b = (round(c + share * (255 - c)) for c in colour)
    return r, g, b


def entity(name: str) -> str:
    """A channel's name as an entity path: only what needs no escaping."""
    return re.sub(r"[^A-Za-z0-9_/]", "_", name)


def has_payload(run: Run) -> bool:
    """Whether the robot of the run carries a payload."""
    return bool(run.meta.get("robot", {}).get("payload", {}).get("mass_kg", 0.0))


def tip_meaning(run: Run) -> str:
    """What the size of the tip's mark means.

    Args:
        run: the run.

    Returns:
        The end of a sentence.
    """
    return "large because it carries the payload" if has_payload(run) else "without a payload"
