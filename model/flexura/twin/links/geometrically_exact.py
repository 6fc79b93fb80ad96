"""A flexible link as ObjectBeamGeometricallyExact2D: a Reissner beam of three-node elements.

Coordinates of a node: position x, y and the section's angle, with quadratic Lagrange polynomials
between. Hub and payload are ObjectRigidBody2D on the end nodes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...errors import InputError
from ...optional import Optional
from .part import Attachment, Frame, Lump, Motion, PointMass, add_gravity
from .properties import BeamValues

eii = Optional("exudyn.itemInterface")

PROGRAM = "ObjectBeamGeometricallyExact2D"

_STRAIN = np.polynomial.legendre.leggauss(2)  # Exudyn's own points: reduced, against locking
_MASS = np.polynomial.legendre.leggauss(3)


class GeometricallyExactLink:
    """A flexible link of equal geometrically exact elements between `hub` and `payload`."""

    width = 3

    def __init__(
        self,
        mbs: Any,
        values: BeamValues,
        hub: PointMass,
        payload: PointMass,
        frame: Frame,
        gravity: tuple[float, float],
        lumps: Sequence[Lump] = (),
    ) -> None:

        self.values, self.hub, self.payload, self.lumps = values, hub, payload, lumps
        self.nodes = []
        for k in range(2 * len(values) + 1):
            here = frame.along(k * values.length / 2)
            self.nodes.append(
                mbs.AddNode(
                    eii.NodeRigidBody2D(
                        referenceCoordinates=list(here[:3]), initialVelocities=list(here[3:])
                    )
                )
            )
        for k in range(len(values)):
            element = mbs.AddObject(
                eii.ObjectBeamGeometricallyExact2D(
                    length=values.length,
                    massPerLength=values.mass[k],
                    crossSectionInertia=values.rotary[k],
                    bendingStiffness=values.bending[k],
                    axialStiffness=values.axial[k],
                    shearStiffness=values.shear[k],
                    bendingDamping=values.beta * values.bending[k],
                    axialDamping=values.stretch * values.axial[k],
                    nodeNumbers=self.nodes[2 * k : 2 * k + 3],
                )
            )
            add_gravity(mbs, element, gravity)
        self.origin = _end(mbs, self.nodes[0], hub, gravity)
        self.tip = _end(mbs, self.nodes[-1], payload, gravity)
        for at, body in lumps:
            k, value = self._place(at)
            centre = np.kron(value, np.eye(3)[:2])
            turning = np.kron(value, np.eye(3)[2])
            mbs.AddObject(
                eii.ObjectGenericODE2(
                    nodeNumbers=self.nodes[2 * k : 2 * k + 3],
                    massMatrix=body.mass * centre.T @ centre
                    + body.inertia * np.outer(turning, turning),
                    forceVector=body.mass * centre.T @ gravity,
                )
            )

    def _place(self, x: float) -> tuple[int, np.ndarray]:
        """The element that x [m] is on, and its polynomials there (3,)."""
        k = min(int(x / self.values.length), len(self.values) - 1)
        return k, _shapes(2 * (x / self.values.length - k) - 1, self.values.length)[0]

    def _motion(self, q: np.ndarray, v: np.ndarray, x: float) -> Motion:
        k, value = self._place(x)
        place, rate = (np.einsum("k,tkd->td", value, _elements(z)[:, k]) for z in (q, v))
        return Motion(place[:, :2], place[:, 2], rate[:, :2], rate[:, 2])

    def motion_at_origin(self, q: np.ndarray, v: np.ndarray) -> Motion:
        """See `Part`."""
        return Motion(q[:, :2], q[:, 2], v[:, :2], v[:, 2])

    def motion_at_tip(self, q: np.ndarray, v: np.ndarray) -> Motion:
        """See `Part`."""
        return Motion(q[:, -3:-1], q[:, -1], v[:, -3:-1], v[:, -1])

    def point(self, q: np.ndarray, x: float) -> np.ndarray:
        """See `Part`."""
        k, value = self._place(x)
        return np.einsum("k,tkd->td", value, _elements(q)[:, k, :, :2])

    def marker_at(self, mbs: Any, x: float) -> Any:
        """See `Part`. Exudyn's elements of this kind have no markers between their nodes."""
        half = 0.5 * self.values.length
        k = round(x / half)
        if abs(x - k * half) > 1e-9 * half * len(self.nodes):
            text = (
                f'expected a place at a node of the beam, a multiple of {half:g} m, or beam "ancf"'
            )
            raise InputError(text, key="load.at_m", value=x)
        return mbs.AddMarker(eii.MarkerNodeRigid(nodeNumber=self.nodes[k]))

    def kinetic(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """See `Part`."""
        ends, out = _elements(v), np.zeros(len(v))
        for u, w in zip(*_MASS, strict=True):
            rate = np.einsum("k,tekd->ted", _shapes(u, self.values.length)[0], ends)
            density = (rate[..., :2] ** 2).sum(axis=-1) @ self.values.mass + rate[
                ..., 2
            ] ** 2 @ self.values.rotary
            out += 0.25 * self.values.length * w * density
        out += sum(body.kinetic(self._motion(q, v, at)) for at, body in self.lumps)
        return (
            out
            + self.hub.kinetic(self.motion_at_origin(q, v))
            + self.payload.kinetic(self.motion_at_tip(q, v))
        )

    def strain(self, q: np.ndarray) -> np.ndarray:
        """See `Part`."""
        ends, out = _elements(q), np.zeros(len(q))
        for u, w in zip(*_STRAIN, strict=True):
            value, first = _shapes(u, self.values.length)
            angle = np.einsum("k,tek->te", value, ends[..., 2])
            slope = np.einsum("k,tekd->ted", first, ends)
            c, s = np.cos(angle), np.sin(angle)
            axial = c * slope[..., 0] + s * slope[..., 1] - 1
            shear = -s * slope[..., 0] + c * slope[..., 1]
            density = (
                axial**2 @ self.values.axial
                + shear**2 @ self.values.shear
                + slope[..., 2] ** 2 @ self.values.bending
            )
            out += 0.25 * self.values.length * w * density
        return out

    def moment(self, q: np.ndarray) -> np.ndarray:
        """See `Part`."""
        simpson = np.array([1 / 6, 4 / 6, 1 / 6])
        beam = np.einsum(
            "e,k,tekd->td", self.values.mass * self.values.length, simpson, _elements(q)[..., :2]
        )
        beam += sum(body.moment(self._motion(q, q, at)) for at, body in self.lumps)
        ends = self.motion_at_origin(q, q), self.motion_at_tip(q, q)
        return beam + self.hub.moment(ends[0]) + self.payload.moment(ends[1])


def _end(mbs: Any, node: Any, lump: PointMass, gravity: tuple[float, float]) -> Attachment:

    # also without mass: a joint's coordinate needs a body, and the beam's elements don't offer one
    along, across = lump.along, lump.across
    body = mbs.AddObject(  # Exudyn takes the inertia about the node
        eii.ObjectRigidBody2D(
            mass=lump.mass,
            inertia=lump.inertia + lump.mass * (along**2 + across**2),
            centerOfMass=[along, across],
            nodeNumber=node,
        )
    )
    if lump.mass > 0:
        add_gravity(mbs, body, gravity)
    return Attachment(body, [0.0, 0.0, 0.0], mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=body)))


def _elements(q: np.ndarray) -> np.ndarray:
    """Nodal coordinates (T, 3 nodes) as (T, elements, 3, 3): x, y, angle of the three nodes."""
    nodes = q.reshape(len(q), -1, 3)
    return np.stack([nodes[:, :-2:2], nodes[:, 1:-1:2], nodes[:, 2::2]], axis=2)


def _shapes(u: float, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Quadratic Lagrange polynomials at u in [-1, 1], and their derivatives by x."""
    value = np.array([u * (u - 1) / 2, 1 - u**2, u * (u + 1) / 2])
    return value, np.array([u - 0.5, -2 * u, u + 0.5]) * 2 / length
