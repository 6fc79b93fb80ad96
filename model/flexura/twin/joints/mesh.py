"""What the twin can build, and its mesh: beam elements, hubs and sleeves on flexible links.

A joint Pa on a flexible link stands on it with a hub of two points, a distance delta apart. A
flexible link with a joint Pb runs through a sleeve: a row of points, delta apart near its exit.
Both become exact as delta goes to 0.

A pair of forces carries the moment of a hub. A hub is therefore too stiff, by a compliance delta/(6
EI) and terms of delta^2. A beam over a row of points ends as if clamped delta/(2 sqrt 3) behind the
first (three-moment equation). The first point is put that much ahead of the exit, so that the error
is of order delta^2.

On a mesh of elements of length h the shift is less by 0.0108 delta (h/delta)^3 on the mean (static
solutions, at all places of the points among the elements) and varies by +-0.001 delta at delta =
1.5 h. A hub of 0.5 h is too stiff by 0.099 h/EI instead of 0.083, +-0.006; twice as long by 0.168
instead of 0.167.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ...robot import Link, Robot
from ..links.properties import uniform

MIN_ELEMENTS = 8
MIN_ELEMENTS_SLIDING = 32  # where a joint slides on the link
# each element is uniform: 3e-3 of the deflection at 8, 4e-4 at 24 for EI falling to a quarter
MIN_ELEMENTS_TAPERED = 24
DEFAULT_DELTA = {"Pa": 0.5, "Pb": 1.5}  # in elements
ORDER = {"Pa": 1, "Pb": 2}  # of the error in delta
# spans of length delta behind a sleeve's exit; farther back they are longer, up to a part of the
# link's length
SHORT_SPANS = 3
MAX_SPAN_RATIO = 1 / 8


@dataclass(frozen=True)
class Mesh:
    """The mesh of a robot.

    Per link: `elements`, and `stubs`, how far points stand off its ends [m]. Per joint that slides
    on a flexible link: `hubs`, delta [m], and `places` of its points, ahead of the hub's middle or
    the sleeve's exit [m]; None for other joints.
    """

    elements: list[int]
    hubs: list[float | None]
    places: list[np.ndarray | None]
    stubs: list[tuple[float, float]]


def sliding_on(robot: Robot, i: int) -> int | None:
    """The flexible link that joint i slides on: i for a Pb, i - 1 for a Pa, else None; from 0."""
    kind = robot.links[i].joint.type
    on = i - 1 if kind == "Pa" else i
    return on if kind != "R" and on >= 0 and robot.links[on].flexible else None


def sliding_kinds(robot: Robot) -> list[str]:
    """The types of the joints that slide on flexible links, each once: Pa, Pb."""
    return sorted(
        {link.joint.type for i, link in enumerate(robot.links) if sliding_on(robot, i) is not None}
    )


def mesh(
    robot: Robot,
    elements: int | None = None,
    hub_length_m: float | None = None,
    times: Mapping[str, float] | None = None,
) -> Mesh:
    """The mesh of a robot.

    Args:
        robot: the robot.
        elements: a flexible link; None: the twin's own choice.
        hub_length_m: delta of hubs and sleeves [m]; None: the twin's own choice.
        times: factors on delta for the joint types Pa and Pb.
    """
    n = len(robot.links)
    on = [sliding_on(robot, i) for i in range(n)]
    counts = [_count(link, elements, i in on) for i, link in enumerate(robot.links)]
    hubs: list[float | None] = [None] * n
    places: list[np.ndarray | None] = [None] * n
    ends = [np.zeros(1) for _ in range(n)]
    for i, k in enumerate(on):
        if k is not None:
            kind, length = robot.links[i].joint.type, robot.links[k].length_m
            element = length / counts[k]
            delta = hubs[i] = (hub_length_m or DEFAULT_DELTA[kind] * element) * (times or {}).get(
                kind, 1.0
            )
            own = places[i] = (
                hub_places(delta) if kind == "Pa" else sleeve_places(delta, length, element)
            )
            ends[k] = np.concatenate([ends[k], own])
    return Mesh(counts, hubs, places, [(-float(each.min()), float(each.max())) for each in ends])


def _count(link: Link, elements: int | None, sliding_on: bool) -> int:
    """Number of elements of a link; 0 for a rigid one.

    Twice the robot file's, and at least what the link needs, unless `elements` is given.
    """
    if not link.flexible or elements is not None:
        return elements or 0 if link.flexible else 0
    least = MIN_ELEMENTS_SLIDING if sliding_on else MIN_ELEMENTS
    return max(least if uniform(link) else MIN_ELEMENTS_TAPERED, 2 * link.elements)


def hub_places(delta: float) -> np.ndarray:
    """The points of a hub of length delta, ahead of its middle (2,) [m]."""
    return np.array([delta / 2, -delta / 2])


def sleeve_places(delta: float, length: float, element: float) -> np.ndarray:
    """The points of a sleeve, ahead of its exit [m] (106).

    There are enough to guide the whole link, so that its part behind the exit stays straight.

    Args:
        delta: distance of the points near the exit [m].
        length: of the link [m].
        element: length of its elements [m].
    """
    shift = delta / (2 * math.sqrt(3)) - 0.0108 * element**3 / delta**2
    near = shift - delta * np.arange(SHORT_SPANS + 1)
    span = max(delta, MAX_SPAN_RATIO * length)
    far = near[-1] - span * np.arange(1, max(0, math.ceil((length + near[-1]) / span)) + 1)
    return np.concatenate([near, far])


def check_supported(robot: Robot, beam: str) -> None:
    """Check that the twin contains what a robot has, with this kind of beam.

    Args:
        robot: the robot.
        beam: "ancf" or "ge".

    Raises:
        InputError: it does not.
    """
    if not robot.stiffening:
        expected = "the twin always contains geometric stiffening; compare with stiffening = true"
        raise InputError(expected, key="stiffening", value=False)
    for i, link in enumerate(robot.links):
        joint, on = link.joint, sliding_on(robot, i)
        if robot.rayleigh(i)[0]:
            key = "alpha_1_s" if link.damping.ratios is None else "ratios"
            raise InputError(
                "expected 0: damping in proportion to mass has no counterpart in the twin; use "
                "beta_s or ratio",
                key=f"link[{i + 1}].damping.{key}",
                value=getattr(link.damping, key),
            )
        if on is not None and beam != "ancf":
            expected = (
                f'expected "ancf": Exudyn\'s joints that slide on a beam, as joint {i + 1} '
                f"does, know no other"
            )
            raise InputError(expected, key="beam", value=beam)
        low, high = slide_range(robot, i)
        if not low <= joint.start <= high or (joint.type == "Pb" and joint.start == 0):
            what = (
                "a free length above 0, at most"
                if joint.type == "Pb"
                else "a place on the link that it slides along, 0 to"
            )
            raise InputError(
                f"expected {what} {high:g} m", key=f"link[{i + 1}].joint.start", value=joint.start
            )


def slide_range(robot: Robot, i: int) -> tuple[float, float]:
    """Positions between which joint i is on the link that it slides on [m].

    Infinite for R, and for Pa on a rigid link.
    """
    if robot.links[i].joint.type == "Pb":
        return 0.0, robot.links[i].length_m
    on = sliding_on(robot, i)
    return (-math.inf, math.inf) if on is None else (0.0, robot.links[on].length_m)
