"""A part of the twin: one link in Exudyn, and its motion from recorded coordinates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from ...optional import Optional

eii = Optional("exudyn.itemInterface")


class Frame(NamedTuple):
    """A link's straight start: position x, y [m], angle [rad], and their velocities."""

    x: float
    y: float
    angle: float
    vx: float = 0.0
    vy: float = 0.0
    omega: float = 0.0

    @property
    def axis(self) -> tuple[float, float]:
        """Direction of the x axis: cosine and sine of the angle."""
        return float(np.cos(self.angle)), float(np.sin(self.angle))

    def along(self, s: float, slide: float = 0.0, turn: float = 0.0, spin: float = 0.0) -> Frame:
        """The frame a distance s along this one.

        Args:
            s: distance [m].
            slide: velocity along this frame [m/s].
            turn: rotation [rad].
            spin: additional angular velocity [rad/s].

        Returns:
            The frame.
        """
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
    """Where a joint attaches: a body, a position in it, a marker there, whether it is rigid."""

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
    """One link in Exudyn's system, and its motion.

    q, v: total coordinates and velocities of the part's own nodes over time, (T, coordinates).
    Angles are known up to whole turns until they are unwrapped.
    """

    width: int  # coordinates of a node
    nodes: list[Any]
    origin: Attachment
    tip: Attachment

    def motion_at_origin(self, q: np.ndarray, v: np.ndarray) -> Motion:
        """Motion of the link's origin.

        Args:
            q: coordinates of the part's nodes (T, k).
            v: their velocities (T, k).

        Returns:
            The motion.
        """
        ...

    def motion_at_tip(self, q: np.ndarray, v: np.ndarray) -> Motion:
        """Motion of the link's tip.

        Args:
            q: coordinates of the part's nodes (T, k).
            v: their velocities (T, k).

        Returns:
            The motion.
        """
        ...

    def point(self, q: np.ndarray, x: float) -> np.ndarray:
        """A material point of the link.

        Args:
            q: coordinates of the part's nodes (T, k).
            x: distance from the origin [m].

        Returns:
            Its place (T, 2) [m].
        """
        ...

    def marker_at(self, mbs: Any, x: float) -> Any:
        """A marker of the place and the section at a point of the link, for a load.

        Args:
            mbs: Exudyn's system.
            x: distance from the origin [m].

        Returns:
            The marker.
        """
        ...

    def kinetic(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Kinetic energy.

        Args:
            q: coordinates of the part's nodes (T, k).
            v: their velocities (T, k).

        Returns:
            (T,) [J].
        """
        ...

    def strain(self, q: np.ndarray) -> np.ndarray:
        """Strain energy of bending, axial and shear strains.

        Args:
            q: coordinates of the part's nodes (T, k).

        Returns:
            (T,) [J].
        """
        ...

    def moment(self, q: np.ndarray) -> np.ndarray:
        """The integral of position over mass.

        Args:
            q: coordinates of the part's nodes (T, k).

        Returns:
            (T, 2) [kg m].
        """
        ...


@dataclass
class PointMass:
    """A body on a beam's node or line: mass [kg], inertia about its centre [kg m^2], and the centre
    `along` and `across` [m] the line's tangent there."""

    mass: float = 0.0
    inertia: float = 0.0
    along: float = 0.0
    across: float = 0.0

    @property
    def offset(self) -> np.ndarray:
        """(2, 2): what of the tangent (cos, sin) is the way to the centre."""
        return np.array([[self.along, -self.across], [self.across, self.along]])

    def centre(self, motion: Motion) -> Motion:
        """The motion of the body's centre.

        Args:
            motion: of the place where it is fixed.

        Returns:
            The centre's motion.
        """
        if not (self.along or self.across):
            return motion
        way = _tangent(motion.angle) @ self.offset.T
        left = np.stack([-way[:, 1], way[:, 0]], axis=-1)
        return motion._replace(r=motion.r + way, v=motion.v + motion.omega[:, None] * left)

    def kinetic(self, motion: Motion) -> np.ndarray:
        """Kinetic energy of the mass.

        Args:
            motion: of its node over time.

        Returns:
            (T,) [J].
        """
        speed = (self.centre(motion).v ** 2).sum(axis=-1)
        return 0.5 * self.mass * speed + 0.5 * self.inertia * motion.omega**2

    def moment(self, motion: Motion) -> np.ndarray:
        """Mass times the centre's place.

        Args:
            motion: of its node over time.

        Returns:
            (T, 2) [kg m].
        """
        return self.mass * self.centre(motion).r


class Lump(NamedTuple):
    """A body on the line of a link, at the distance `at` [m] from its origin."""

    at: float
    body: PointMass


def _tangent(angle: np.ndarray) -> np.ndarray:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


@dataclass
class Ground:
    """The base, to which the first joint attaches."""

    tip: Attachment
    origin: Attachment

    @staticmethod
    def add(mbs: Any) -> Ground:
        """Add the base to Exudyn's system.

        Args:
            mbs: Exudyn's system.

        Returns:
            The base.
        """

        body = mbs.AddObject(eii.ObjectGround())
        here = Attachment(
            body, [0.0, 0.0, 0.0], mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=body))
        )
        return Ground(here, here)

    @staticmethod
    def motion(times: int) -> Motion:
        """The base's motion: none.

        Args:
            times: number of times T.

        Returns:
            Zeros.
        """
        return Motion(np.zeros((times, 2)), np.zeros(times), np.zeros((times, 2)), np.zeros(times))


def add_gravity(mbs: Any, body: Any, gravity: tuple[float, float]) -> None:
    """Put a body under gravity [m/s^2]."""

    if any(gravity):
        marker = mbs.AddMarker(eii.MarkerBodyMass(bodyNumber=body))
        mbs.AddLoad(eii.LoadMassProportional(markerNumber=marker, loadVector=[*gravity, 0.0]))
