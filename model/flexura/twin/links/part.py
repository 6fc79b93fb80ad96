"""A part of the twin: one link in Exudyn, and how to read its motion from recorded coordinates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from ...optional import Optional

eii = Optional("exudyn.itemInterface")


class Frame(NamedTuple):
    """A link's straight start: place x, y [m], angle [rad], and their velocities."""

    x: float
    y: float
    angle: float
    vx: float = 0.0
    vy: float = 0.0
    omega: float = 0.0

    @property
    def axis(self) -> tuple[float, float]:
        return float(np.cos(self.angle)), float(np.sin(self.angle))

    def along(self, s: float, slide: float = 0.0, turn: float = 0.0, spin: float = 0.0) -> Frame:
        """The frame a distance s along this one, sliding along it at `slide` [m/s], turned by
        `turn`, turning at `spin` more."""
        c, n = self.axis
        return Frame(
            self.x + s * c,
            self.y + s * n,
            self.angle + turn,
            self.vx - self.omega * s * n + slide * c,
            self.vy + self.omega * s * c + slide * n,
            self.omega + spin,
        )


class Attachment(NamedTuple):
    """Where a joint takes hold: a body, the place in it, a marker with position and orientation
    there, whether it is rigid."""

    body: Any
    place: list[float]
    marker: Any
    rigid: bool = True


class Motion(NamedTuple):
    """Position (T, 2), angle (T,) and their velocities (T, 2), (T,) of a frame over time."""

    r: np.ndarray
    angle: np.ndarray
    v: np.ndarray
    omega: np.ndarray


class Part(Protocol):
    """One link: made when added to Exudyn's system, read afterwards.

    q, v: total coordinates and velocities of the part's own nodes over time, (T, coordinates).
    Angles are known up to whole turns until they are unwrapped.
    """

    width: int  # coordinates of a node
    nodes: list[Any]
    origin: Attachment
    tip: Attachment

    def motion_at_origin(self, q: np.ndarray, v: np.ndarray) -> Motion: ...

    def motion_at_tip(self, q: np.ndarray, v: np.ndarray) -> Motion: ...

    def point(self, q: np.ndarray, x: float) -> np.ndarray:
        """The material point x [m] from the origin, (T, 2)."""
        ...

    def kinetic(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Kinetic energy [J], (T,)."""
        ...

    def strain(self, q: np.ndarray) -> np.ndarray:
        """Strain energy of bending, axial and shear strains [J], (T,)."""
        ...

    def moment(self, q: np.ndarray) -> np.ndarray:
        """The integral of position over mass [kg m], (T, 2)."""
        ...


@dataclass
class Lump:
    """A mass and inertia on a beam's node: hub or payload."""

    mass: float = 0.0
    inertia: float = 0.0

    def kinetic(self, motion: Motion) -> np.ndarray:
        return 0.5 * self.mass * (motion.v**2).sum(axis=-1) + 0.5 * self.inertia * motion.omega**2


@dataclass
class Ground:
    """The base: what the first joint holds on to."""

    tip: Attachment
    origin: Attachment

    @staticmethod
    def add(mbs: Any) -> Ground:

        body = mbs.AddObject(eii.ObjectGround())
        here = Attachment(
            body, [0.0, 0.0, 0.0], mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=body))
        )
        return Ground(here, here)

    @staticmethod
    def motion(times: int) -> Motion:
        return Motion(np.zeros((times, 2)), np.zeros(times), np.zeros((times, 2)), np.zeros(times))


def hang(mbs: Any, body: Any, gravity: tuple[float, float]) -> None:
    """Put a body with mass under gravity [m/s^2]."""

    if any(gravity):
        marker = mbs.AddMarker(eii.MarkerBodyMass(bodyNumber=body))
        mbs.AddLoad(eii.LoadMassProportional(markerNumber=marker, loadVector=[*gravity, 0.0]))
