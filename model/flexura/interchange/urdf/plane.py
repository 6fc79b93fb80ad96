"""The plane in which a chain moves: revolute axes are normal to it, prismatic ones lie in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NoReturn

import numpy as np

from ...errors import InputError
from .chain import Body, joined
from .description import Inertial

PARALLEL = 1e-5  # rad: numbers of files have five digits or more
GRAVITY = 9.81  # m/s^2


@dataclass(frozen=True)
class Mass:
    """Mass [kg], centre x + iy [m] and inertia about it [kg m^2] of a body in the plane."""

    mass: float
    centre: complex
    inertia: float


@dataclass(frozen=True)
class PlanarBody:
    """A body in the plane, with the robot in the joints' zero.

    Attributes:
        body: the one in space.
        place: of its joint [m].
        turns: whether the joint turns.
        sense: of a joint that turns: 1 if it turns to the left, else -1.
        axis: of a joint that slides: its direction, of length 1; else 0.
        own: mass of the link itself.
        fixed: masses of what is fixed to it, by link.
        whole: of all together.
        ends: places of what ends there, by link.
    """

    body: Body
    place: complex
    turns: bool
    sense: int
    axis: complex
    own: Mass
    fixed: dict[str, Mass]
    whole: Mass
    ends: dict[str, complex]


@dataclass(frozen=True)
class Plane:
    """Axes of the plane (3,), and gravity in it [m/s^2]."""

    x: np.ndarray
    y: np.ndarray
    normal: np.ndarray
    gravity: tuple[float, float]

    def place(self, vector: np.ndarray) -> complex:
        """A vector (3,) in the plane."""
        return complex(self.x @ vector, self.y @ vector)

    def mass(self, inertial: Inertial) -> Mass:
        """A body in the plane."""
        about = float(self.normal @ inertial.inertia @ self.normal)
        return Mass(inertial.mass, self.place(inertial.centre), about)


def planar(bodies: list[Body], file: str) -> tuple[Plane, list[PlanarBody]]:
    """A chain in its plane.

    The normal is the axis of the first joint that turns. x lies along the first joint, if it
    slides; else y points up, or x is that of the base, if the plane lies level.

    Args:
        bodies: the chain.
        file: name of the file, for messages.

    Returns:
        The plane, and the bodies in it.

    Raises:
        InputError: the chain is not planar; the message names the joint.
    """
    normal = _normal(bodies, file)
    for body in bodies:
        across = float(normal @ body.axis)
        slides = body.joint.type == "prismatic"
        off = np.arcsin(min(1.0, abs(across))) if slides else _between(normal, body.axis)
        if off > PARALLEL:
            how = "lie in the plane of the chain" if slides else "be parallel to the first"
            expected = f"expected a planar chain: the axis must {how}, and is {np.degrees(off):.3g}"
            _refuse(body, f"{expected} degrees off", file)
    up = np.array([0.0, 0.0, 1.0])
    if bodies[0].joint.type == "prismatic":
        x = bodies[0].axis
        y = np.cross(normal, x)
    elif np.linalg.norm(up - (up @ normal) * normal) > PARALLEL:
        y = _unit(up - (up @ normal) * normal)
        x = np.cross(y, normal)
    else:
        x = _unit(np.array([1.0, 0.0, 0.0]) - normal[0] * normal)
        y = np.cross(normal, x)
    x, y = (_round(axis) for axis in (x, y))
    weight = -GRAVITY * up
    gravity = tuple(float(g) if abs(g) > 1e-12 else 0.0 for g in (x @ weight, y @ weight))
    plane = Plane(x, y, normal, (gravity[0], gravity[1]))
    return plane, [_in_plane(plane, body) for body in bodies]


def _in_plane(plane: Plane, body: Body) -> PlanarBody:
    turns = body.joint.type != "prismatic"
    axis = 0j if turns else plane.place(body.axis)
    own, *fixed = body.parts.items()
    return PlanarBody(
        body,
        plane.place(body.place),
        turns,
        1 if float(plane.normal @ body.axis) > 0 else -1,
        axis if turns else axis / abs(axis),
        plane.mass(own[1]),
        {name: plane.mass(part) for name, part in fixed if part.mass > 0},
        plane.mass(joined(list(body.parts.values()))),
        {name: plane.place(end) for name, end in body.ends.items()},
    )


def _normal(bodies: list[Body], file: str) -> np.ndarray:
    """The plane's normal (3,)."""
    for body in bodies:
        if body.joint.type != "prismatic":
            return _round(_unit(body.axis))
    first = bodies[0].axis
    for body in bodies[1:]:
        across = np.cross(first, body.axis)
        if np.linalg.norm(across) > PARALLEL:
            return _round(_unit(across))
    up = np.array([0.0, 0.0, 1.0])  # all slide along one line: a plane that stands upright
    level = np.cross(first, up)
    other = np.array([0.0, -1.0, 0.0])
    return _round(_unit(level) if np.linalg.norm(level) > PARALLEL else other)


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


def _round(axis: np.ndarray) -> np.ndarray:
    """An axis without the round-off of turned frames: quarter turns are exact."""
    near = np.round(axis)
    return near + 0.0 if np.abs(axis - near).max() < 1e-9 else axis


def _between(a: np.ndarray, b: np.ndarray) -> float:
    """The angle between two lines [rad]."""
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), abs(a @ b)))


def _refuse(body: Body, expected: str, file: str) -> NoReturn:
    key = f"joint {body.joint.name}"
    raise InputError(expected, key=key, file=file)
