"""The serial chain of a URDF file: its moving bodies with all that is fixed to them, in the axes of
the base, while the joints are at 0."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...errors import InputError
from .description import Inertial, Urdf, UrdfJoint


@dataclass
class Body:
    """A link that moves, with the links that are fixed to it.

    Attributes:
        name: the link's.
        joint: that moves it against the body before.
        place: of the joint (3,) [m].
        axis: of the joint, unit (3,).
        parts: masses of the link and of those fixed to it, by link, the link itself first.
        ends: frames of the fixed links to which nothing more is fixed, (3,) [m] by link.
    """

    name: str
    joint: UrdfJoint
    place: np.ndarray
    axis: np.ndarray
    parts: dict[str, Inertial] = field(default_factory=dict)
    ends: dict[str, np.ndarray] = field(default_factory=dict)


def chain_of(urdf: Urdf) -> list[Body]:
    """The moving bodies from the base outwards.

    Args:
        urdf: a file's bodies and joints.

    Returns:
        The bodies.

    Raises:
        InputError: it is no tree, or two joints move links on one body.
    """
    root = _root(urdf)
    bodies: list[Body] = []
    place, axes = np.zeros(3), np.eye(3)
    grounded: dict[str, Inertial] = {}
    moving = _collect(urdf, root, place, axes, grounded, {})
    while moving:
        if len(moving) > 1:
            (first, *_), (second, *_) = moving[:2]
            raise _error(
                urdf,
                f"joint {second.name}",
                f"expected a serial chain: joint {first.name} moves another branch of "
                f"{_on(bodies)}",
            )
        joint, place, axes = moving[0]
        bodies.append(Body(joint.child, joint, place, axes @ joint.axis))
        body = bodies[-1]
        moving = _collect(urdf, joint.child, place, axes, body.parts, body.ends)
    reached = grounded.keys() | {name for body in bodies for name in body.parts}
    for joint in urdf.joints:
        if joint.child not in reached:
            expected = f"expected a tree: no way leads from link {root} to link {joint.child}"
            raise _error(urdf, f"joint {joint.name}", expected)
    if not bodies:
        raise _error(urdf, "", "expected a joint that moves: all joints are fixed")
    return bodies


def _on(bodies: list[Body]) -> str:
    return f"link {bodies[-1].name}" if bodies else "the base"


def _error(urdf: Urdf, key: str, expected: str) -> InputError:
    return InputError(expected, key=key, file=urdf.file)


def _root(urdf: Urdf) -> str:
    """The one link that no joint moves or fixes."""
    parents: dict[str, UrdfJoint] = {}
    for joint in urdf.joints:
        if joint.child in parents:
            other = parents[joint.child].name
            expected = f"expected a tree: link {joint.child} is the child of joint {other} too"
            raise _error(urdf, f"joint {joint.name}", expected)
        parents[joint.child] = joint
    roots = [name for name in urdf.links if name not in parents]
    if len(roots) != 1:
        expected = f"expected one link without a parent, not {len(roots)}"
        said = f": {', '.join(roots[:4])}" if roots else ": the links form a loop"
        raise _error(urdf, "", expected + said)
    return roots[0]


def _collect(
    urdf: Urdf,
    link: str,
    place: np.ndarray,
    axes: np.ndarray,
    parts: dict[str, Inertial],
    ends: dict[str, np.ndarray],
) -> list[tuple[UrdfJoint, np.ndarray, np.ndarray]]:
    """The joints that move links on a body, with their frames; the masses of the link in its frame
    and of all that is fixed to it go into `parts`, the places of fixed ends into `ends`."""
    moving, waiting = [], [(link, place, axes)]
    while waiting:
        name, place, axes = waiting.pop(0)
        own = urdf.links[name]
        parts[name] = Inertial(own.mass, place + axes @ own.centre, axes @ own.inertia @ axes.T)
        after = [joint for joint in urdf.joints if joint.parent == name]
        for joint in after:
            frame = place + axes @ joint.place, axes @ joint.axes
            if joint.type == "fixed":
                waiting.append((joint.child, *frame))
            else:
                moving.append((joint, *frame))
        if not after and name != link:
            ends[name] = place
    return moving


def joined(parts: list[Inertial]) -> Inertial:
    """The masses of a body as one: the parallel axis theorem."""
    mass = sum(part.mass for part in parts)
    if mass == 0:
        centre = parts[0].centre
    else:
        centre = sum((part.mass * part.centre for part in parts), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for part in parts:
        d = part.centre - centre
        inertia += part.inertia + part.mass * (d @ d * np.eye(3) - np.outer(d, d))
    return Inertial(mass, centre, inertia)
