"""A rigid link: one ObjectRigidBody2D with its node at the link's origin."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...optional import Optional
from .part import Attachment, Frame, Motion, add_gravity
from .properties import Inertia

eii = Optional("exudyn.itemInterface")


class RigidLink:
    """A rigid link with hub, and with the payload if it is the last.

    Coordinates of its one node: x, y, angle of the link's origin.
    """

    width = 3

    def __init__(
        self, mbs: Any, length: float, inertia: Inertia, frame: Frame, gravity: tuple[float, float]
    ) -> None:

        self.length, self.inertia = length, inertia
        m, c, about = inertia
        node = mbs.AddNode(
            eii.NodeRigidBody2D(
                referenceCoordinates=list(frame[:3]), initialVelocities=list(frame[3:])
            )
        )
        # Exudyn takes the inertia about the reference point, here the link's origin
        body = mbs.AddObject(
            eii.ObjectRigidBody2D(
                mass=m,
                inertia=about + m * abs(c) ** 2,
                centerOfMass=[c.real, c.imag],
                nodeNumber=node,
            )
        )
        add_gravity(mbs, body, gravity)
        self.nodes, self.body = [node], body
        self.origin, self.tip = (
            Attachment(
                body,
                [x, 0.0, 0.0],
                mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=body, localPosition=[x, 0.0, 0.0])),
            )
            for x in (0.0, length)
        )

    def motion_at_origin(self, q: np.ndarray, v: np.ndarray) -> Motion:
        """See `Part`."""
        return self._motion(q, v, 0.0)

    def motion_at_tip(self, q: np.ndarray, v: np.ndarray) -> Motion:
        """See `Part`."""
        return self._motion(q, v, self.length)

    def point(self, q: np.ndarray, x: Any) -> np.ndarray:
        """See `Part`; across the link by the imaginary part of x."""
        return q[:, :2] + _turned(q[:, 2], x)

    def acceleration(self, q: np.ndarray, v: np.ndarray, more: np.ndarray, x: Any) -> np.ndarray:
        """The acceleration of a point.

        Args:
            q: coordinates (T, 3).
            v: their rates (T, 3).
            more: the rates of these (T, 3).
            x: distance from the origin, across the link by its imaginary part [m].

        Returns:
            (T, 2) [m/s^2].
        """
        turn, spin = _turned(q[:, 2], 1j * x), _turned(q[:, 2], x)
        return np.asarray(more[:, :2] + more[:, 2:3] * turn - v[:, 2:3] ** 2 * spin)

    def marker_at(self, mbs: Any, x: float) -> Any:
        """See `Part`."""
        return mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=self.body, localPosition=[x, 0.0, 0.0]))

    def kinetic(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """See `Part`."""
        centre = self._motion(q, v, self.inertia.centre)
        return (
            0.5 * self.inertia.mass * (centre.v**2).sum(axis=-1)
            + 0.5 * self.inertia.inertia * centre.omega**2
        )

    def strain(self, q: np.ndarray) -> np.ndarray:
        """See `Part`."""
        return np.zeros(len(q))

    def moment(self, q: np.ndarray) -> np.ndarray:
        """See `Part`."""
        return self.inertia.mass * self.point(q, self.inertia.centre)

    def _motion(self, q: np.ndarray, v: np.ndarray, x: complex) -> Motion:
        speed = v[:, :2] + v[:, 2:3] * _turned(q[:, 2], 1j * x)
        return Motion(self.point(q, x), q[:, 2], speed, v[:, 2])


def _turned(angle: np.ndarray, x: Any) -> np.ndarray:
    """The vector x (real, imaginary) turned by angles (T,): (T, 2)."""
    out = x * np.exp(1j * angle)
    return np.stack([out.real, out.imag], axis=-1)
