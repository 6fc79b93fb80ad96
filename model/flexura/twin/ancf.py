"""A flexible link as ObjectANCFCable2D: an Euler-Bernoulli beam in absolute nodal coordinates.

Coordinates of a node: place x, y and slope vector r' = (x', y'); Hermite cubics between. Hub and payload are
ObjectGenericODE2 on the end nodes with diag(m, m, J, J): exact for rotation where |r'| = 1, and no joint is needed.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .part import Attachment, Frame, Lump, Motion, hang
from .properties import BeamValues

PROGRAM = "ObjectANCFCable2D"

# Exudyn's own integration points: more of them would see the axial strain between its points
_AXIAL = np.polynomial.legendre.leggauss(5)
_BENDING = np.polynomial.legendre.leggauss(3)


class CableLink:
    """A flexible link of equal ANCF cable elements between `hub` and `payload`."""

    width = 4

    def __init__(
        self, mbs: Any, values: BeamValues, hub: Lump, payload: Lump, frame: Frame, gravity: tuple[float, float]
    ) -> None:
        from exudyn import itemInterface as eii

        self.values, self.hub, self.payload = values, hub, payload
        self.nodes, elements = [], []
        for k in range(len(values) + 1):
            here = frame.along(k * values.length)
            (c, s), w = here.axis, here.omega
            self.nodes.append(
                mbs.AddNode(
                    eii.NodePoint2DSlope1(
                        referenceCoordinates=[here.x, here.y, c, s], initialVelocities=[here.vx, here.vy, -w * s, w * c]
                    )
                )
            )
        for k in range(len(values)):
            element = mbs.AddObject(
                eii.ObjectANCFCable2D(
                    length=values.length, massPerLength=values.mass[k], bendingStiffness=values.bending[k],
                    axialStiffness=values.axial[k], bendingDamping=values.beta * values.bending[k],
                    nodeNumbers=[self.nodes[k], self.nodes[k + 1]],
                )
            )  # fmt: skip
            hang(mbs, element, gravity)
            elements.append(element)
        for node, lump in ((self.nodes[0], hub), (self.nodes[-1], payload)):
            _add_lump(mbs, node, lump, gravity)
        self.origin = _end(mbs, elements[0], 0.0, self.nodes[0])
        self.tip = _end(mbs, elements[-1], values.length, self.nodes[-1])

    def motion_at_origin(self, q: np.ndarray, v: np.ndarray) -> Motion:
        return _node_motion(q[:, :4], v[:, :4])

    def motion_at_tip(self, q: np.ndarray, v: np.ndarray) -> Motion:
        return _node_motion(q[:, -4:], v[:, -4:])

    def point(self, q: np.ndarray, x: float) -> np.ndarray:
        length = self.values.length
        k = min(int(x / length), len(self.values) - 1)
        return np.einsum("k,tkd->td", _shapes(x / length - k, length)[0], _elements(q)[:, k])

    def kinetic(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        length = self.values.length
        ends = _elements(v)
        products = np.einsum("tekd,kl,teld->te", ends, _mass_matrix(length), ends)
        lumps = self.hub.kinetic(self.motion_at_origin(q, v)) + self.payload.kinetic(self.motion_at_tip(q, v))
        return 0.5 * products @ self.values.mass + lumps

    def strain(self, q: np.ndarray) -> np.ndarray:
        length, ends = self.values.length, _elements(q)
        out = np.zeros(len(q))
        for u, w in zip(*_AXIAL, strict=True):
            slope = np.einsum("k,tekd->ted", _shapes((u + 1) / 2, length)[1], ends)
            stretch = np.hypot(slope[..., 0], slope[..., 1]) - 1
            out += 0.25 * length * w * (stretch**2 @ self.values.axial)
        for u, w in zip(*_BENDING, strict=True):
            _, first, second = _shapes((u + 1) / 2, length)
            slope, bend = np.einsum("k,tekd->ted", first, ends), np.einsum("k,tekd->ted", second, ends)
            curvature = (slope[..., 0] * bend[..., 1] - slope[..., 1] * bend[..., 0]) / (slope**2).sum(axis=-1)
            out += 0.25 * length * w * (curvature**2 @ self.values.bending)
        return out

    def moment(self, q: np.ndarray) -> np.ndarray:
        length = self.values.length
        mean = np.array([1 / 2, length / 12, 1 / 2, -length / 12])  # means of the Hermite cubics
        beam = np.einsum("e,k,tekd->td", self.values.mass * length, mean, _elements(q))
        return beam + self.hub.mass * q[:, :2] + self.payload.mass * q[:, -4:-2]


def _add_lump(mbs: Any, node: Any, lump: Lump, gravity: tuple[float, float]) -> None:
    from exudyn import itemInterface as eii

    if lump.mass == 0 and lump.inertia == 0:
        return
    m, j = lump.mass, lump.inertia
    mbs.AddObject(eii.ObjectGenericODE2(nodeNumbers=[node], massMatrix=np.diag([m, m, j, j])))
    if any(gravity):
        marker = mbs.AddMarker(eii.MarkerNodePosition(nodeNumber=node))
        mbs.AddLoad(eii.LoadForceVector(markerNumber=marker, loadVector=[m * gravity[0], m * gravity[1], 0.0]))


def _end(mbs: Any, element: Any, x: float, node: Any) -> Attachment:
    from exudyn import itemInterface as eii

    return Attachment(element, [x, 0.0, 0.0], mbs.AddMarker(eii.MarkerNodeRigid(nodeNumber=node)))


def _node_motion(q: np.ndarray, v: np.ndarray) -> Motion:
    slope, rate = q[:, 2:], v[:, 2:]
    omega = (slope[:, 0] * rate[:, 1] - slope[:, 1] * rate[:, 0]) / (slope**2).sum(axis=-1)
    return Motion(q[:, :2], np.arctan2(slope[:, 1], slope[:, 0]), v[:, :2], omega)


def _elements(q: np.ndarray) -> np.ndarray:
    """Nodal coordinates (T, 4 nodes) as (T, elements, 4, 2): r, r' of the element's start, r, r' of its end."""
    nodes = q.reshape(len(q), -1, 2, 2)
    return np.concatenate([nodes[:, :-1], nodes[:, 1:]], axis=2)


def _shapes(s: float, length: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Hermite cubics of r, r', r, r' at s = x/length, and their first and second derivatives by x."""
    value = np.array([1 - 3 * s**2 + 2 * s**3, length * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, length * (s**3 - s**2)])
    first = np.array([6 * (s**2 - s) / length, 1 - 4 * s + 3 * s**2, 6 * (s - s**2) / length, 3 * s**2 - 2 * s])
    second = np.array([(12 * s - 6) / length, 6 * s - 4, (6 - 12 * s) / length, 6 * s - 2]) / length
    return value, first, second


def _mass_matrix(h: float) -> np.ndarray:
    """Integrals of products of the cubics over an element of length h."""
    return (h / 420) * np.array([
        [156, 22 * h, 54, -13 * h],
        [22 * h, 4 * h**2, 13 * h, -3 * h**2],
        [54, 13 * h, 156, -22 * h],
        [-13 * h, -3 * h**2, -22 * h, 4 * h**2],
    ])  # fmt: skip
