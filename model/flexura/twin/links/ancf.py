"""A flexible link as ObjectANCFCable2D: an Euler-Bernoulli beam in absolute nodal coordinates.

Coordinates of a node: position x, y and slope vector r' = (x', y'), with Hermite cubics between.
Hub and payload are ObjectGenericODE2 on the end nodes with diag(m, m, J, J): exact for rotation if
|r'| = 1, and no joint is needed. A centre off the node is r + offset r', and a lump between nodes
sits at the cubics' r and r': linear in the coordinates too, so that its mass matrix is constant.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from ...optional import Optional
from .part import Attachment, Frame, Lump, Motion, PointMass, add_gravity
from .properties import BeamValues

eii = Optional("exudyn.itemInterface")

PROGRAM = "ObjectANCFCable2D"
# elements of a stub as long as the link's, so that a sleeve's first spans are as stiff there
FINE_STUB_ELEMENTS = 5
STUB_MASS_RATIO = 1e-4  # mass per length of a stub, relative to the link's end

# Exudyn's own integration points: more of them would see the axial strain between its points
_AXIAL = np.polynomial.legendre.leggauss(5)
_BENDING = np.polynomial.legendre.leggauss(3)
_MOMENTS = np.polynomial.legendre.leggauss(4)  # exact for products of two cubics


class CableLink:
    """A flexible link of equal ANCF cable elements between `hub` and `payload`."""

    width = 4

    def __init__(
        self,
        mbs: Any,
        values: BeamValues,
        hub: PointMass,
        payload: PointMass,
        frame: Frame,
        gravity: tuple[float, float],
        stubs: tuple[float, float] = (0.0, 0.0),
        lumps: Sequence[Lump] = (),
    ) -> None:
        """Add the link to Exudyn's system.

        With stubs, a hub or sleeve may stand at the link's very end. The link's own nodes and
        energies leave them out.

        Args:
            mbs: Exudyn's system.
            values: of the elements.
            hub: at the origin.
            payload: at the tip.
            frame: the link's start.
            gravity: [m/s^2].
            stubs: lengths [m] by which the beam continues, straight and almost without mass, before
                its origin and after its tip.
            lumps: bodies on the line.
        """
        self.values, self.hub, self.payload, self.lumps = values, hub, payload, lumps
        count, length = len(values), values.length
        ends = np.concatenate(
            [
                _stub(-stubs[0], length),
                np.arange(count + 1) * length,
                _stub(stubs[1], length) + count * length,
            ]
        )
        nodes = [_add_node(mbs, frame.along(x)) for x in ends]
        first = int(np.searchsorted(ends, -length / 2))
        self.nodes = nodes[first : first + count + 1]
        self.starts, self.lengths = ends[:-1], np.diff(ends)
        self.pairs = list(pairwise(nodes))
        elements = [
            _add_element(mbs, values, k - first, pair, size)
            for k, (pair, size) in enumerate(zip(self.pairs, self.lengths, strict=True))
        ]
        self.own = own = elements[first : first + count]
        for element in own:
            add_gravity(mbs, element, gravity)
        for node, lump in ((self.nodes[0], hub), (self.nodes[-1], payload)):
            _add_lump(mbs, node, lump, gravity)
        for at, body in lumps:
            k, value, first_ = self._place(at)
            shapes = np.kron(value, np.eye(2)), np.kron(first_, np.eye(2))
            _add_body(mbs, self.nodes[k : k + 2], body, *shapes, gravity)
        self.origin = _end(mbs, own[0], 0.0, self.nodes[0])
        self.tip = _end(mbs, own[-1], length, self.nodes[-1])

    def layer(self, mbs: Any, sliding: Any) -> list[Any]:
        """Add cables without mass and stiffness on the beam's nodes, with a sliding coordinate.

        Args:
            mbs: Exudyn's system.
            sliding: node of the sliding coordinate.

        Returns:
            Their markers, along the beam.
        """

        elements = [
            mbs.AddObject(
                eii.ObjectALEANCFCable2D(
                    length=size,
                    massPerLength=0.0,
                    movingMassFactor=0.0,
                    bendingStiffness=0.0,
                    axialStiffness=0.0,
                    nodeNumbers=[*pair, sliding],
                    addALEvariation=False,
                )
            )
            for pair, size in zip(self.pairs, self.lengths, strict=True)
        ]
        return [
            mbs.AddMarker(eii.MarkerBodyCable2DCoordinates(bodyNumber=element))
            for element in elements
        ]

    def _place(self, x: float) -> tuple[int, np.ndarray, np.ndarray]:
        """The element that x [m] is on, and its cubics there and their slopes (4,)."""
        length = self.values.length
        k = min(int(x / length), len(self.values) - 1)
        return k, *_shapes(x / length - k, length)[:2]

    def _motion(self, q: np.ndarray, v: np.ndarray, x: float) -> Motion:
        k, value, first = self._place(x)
        ends, rates = _elements(q)[:, k], _elements(v)[:, k]
        both = (
            np.concatenate([np.einsum("k,tkd->td", s, z) for s in (value, first)], axis=-1)
            for z in (ends, rates)
        )
        return _node_motion(*both)

    def motion_at_origin(self, q: np.ndarray, v: np.ndarray) -> Motion:
        """See `Part`."""
        return _node_motion(q[:, :4], v[:, :4])

    def motion_at_tip(self, q: np.ndarray, v: np.ndarray) -> Motion:
        """See `Part`."""
        return _node_motion(q[:, -4:], v[:, -4:])

    def point(self, q: np.ndarray, x: float) -> np.ndarray:
        """See `Part`."""
        k, value, _ = self._place(x)
        return np.einsum("k,tkd->td", value, _elements(q)[:, k])

    def at(self, q: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The line at x, and its derivatives by x; of rates of coordinates those of the line.

        Args:
            q: coordinates of the part's nodes, or their derivatives by time (T, k).
            x: distances from the origin (T,) [m].

        Returns:
            r, r' and r'', (T, 2) each.
        """
        length = self.values.length
        k = np.clip((x / length).astype(int), 0, len(self.values) - 1)
        own, shapes = _elements(q)[np.arange(len(q)), k], _shapes(x / length - k, length)
        r, slope, bend = (np.einsum("kt,tkd->td", each, own) for each in shapes)
        return r, slope, bend

    def add_line(
        self,
        q: np.ndarray,
        more: np.ndarray,
        x: np.ndarray,
        gravity: np.ndarray,
        add: Callable[[np.ndarray, np.ndarray], None],
    ) -> None:
        """What the beam's mass beyond x takes, rho A (r'' - g) of its points (139), to be added.

        Args:
            q: coordinates of the part's nodes (T, k).
            more: their accelerations (T, k).
            x: distances from the origin (T,) [m].
            gravity: [m/s^2].
            add: takes places and forces, (T, 2) each.
        """
        length = self.values.length
        for k, mass in enumerate(self.values.mass):
            start = np.clip(x, k * length, (k + 1) * length)
            size = (k + 1) * length - start
            for u, w in zip(*_MOMENTS, strict=True):
                at = start + 0.5 * (u + 1) * size
                force = (0.5 * w * mass * size)[:, None] * (self.at(more, at)[0] - gravity)
                add(self.at(q, at)[0], force)

    def axial_rates(self, q: np.ndarray) -> np.ndarray:
        """The rates of stretch that an inextensible line does not have, as rows on the rates.

        Args:
            q: coordinates of the part's nodes (k,).

        Returns:
            Rows (2 elements + 1, k): r' . v' at the nodes, and its mean on the elements.
        """
        count, length = len(self.values), self.values.length
        nodes, rows = q.reshape(-1, 4), np.zeros((2 * count + 1, len(q)))
        for k, node in enumerate(nodes):
            rows[k, 4 * k + 2 : 4 * k + 4] = node[2:]
        for k in range(count):
            own = q[4 * k : 4 * k + 8].reshape(4, 2)
            for u, w in zip(*_BENDING, strict=True):
                first = _shapes((u + 1) / 2, length)[1]
                rows[count + 1 + k, 4 * k : 4 * k + 8] += (
                    0.5 * w * np.outer(first, first @ own).ravel()
                )
        return rows

    def marker_at(self, mbs: Any, x: float) -> Any:
        """See `Part`."""
        k = self._place(x)[0]
        place = [x - k * self.values.length, 0.0, 0.0]
        return mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=self.own[k], localPosition=place))

    def kinetic(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """See `Part`."""
        length = self.values.length
        ends = _elements(v)
        products = np.einsum("tekd,kl,teld->te", ends, _mass_matrix(length), ends)
        lumps = self.hub.kinetic(self.motion_at_origin(q, v)) + self.payload.kinetic(
            self.motion_at_tip(q, v)
        )
        lumps = lumps + sum(body.kinetic(self._motion(q, v, at)) for at, body in self.lumps)
        return 0.5 * products @ self.values.mass + lumps

    def strain(self, q: np.ndarray) -> np.ndarray:
        """See `Part`."""
        length, ends = self.values.length, _elements(q)
        out = np.zeros(len(q))
        for u, w in zip(*_AXIAL, strict=True):
            slope = np.einsum("k,tekd->ted", _shapes((u + 1) / 2, length)[1], ends)
            stretch = np.hypot(slope[..., 0], slope[..., 1]) - 1
            out += 0.25 * length * w * (stretch**2 @ self.values.axial)
        for u, w in zip(*_BENDING, strict=True):
            _, first, second = _shapes((u + 1) / 2, length)
            slope, bend = (
                np.einsum("k,tekd->ted", first, ends),
                np.einsum("k,tekd->ted", second, ends),
            )
            curvature = (slope[..., 0] * bend[..., 1] - slope[..., 1] * bend[..., 0]) / (
                slope**2
            ).sum(axis=-1)
            out += 0.25 * length * w * (curvature**2 @ self.values.bending)
        return out

    def moment(self, q: np.ndarray) -> np.ndarray:
        """See `Part`."""
        length = self.values.length
        mean = np.array([1 / 2, length / 12, 1 / 2, -length / 12])  # means of the Hermite cubics
        beam = np.einsum("e,k,tekd->td", self.values.mass * length, mean, _elements(q))
        beam += sum(body.moment(self._motion(q, q, at)) for at, body in self.lumps)
        ends = self.motion_at_origin(q, q), self.motion_at_tip(q, q)
        return beam + self.hub.moment(ends[0]) + self.payload.moment(ends[1])


def _stub(length: float, size: float) -> np.ndarray:
    """Ends of a stub's elements, away from the link, ascending [m].

    The first FINE_STUB_ELEMENTS are as long as the link's; the others twice.

    Args:
        length: of the stub [m]; negative: before the link.
        size: length of the link's elements [m].
    """
    count = math.ceil(abs(length) / size - 1e-9)
    ends = size * np.concatenate(
        [
            np.arange(1, min(count, FINE_STUB_ELEMENTS) + 1),
            np.arange(FINE_STUB_ELEMENTS + 2, count + 2, 2),
        ]
    )
    return -ends[::-1] if length < 0 else ends


def _add_node(mbs: Any, here: Frame) -> Any:

    (c, s), w = here.axis, here.omega
    place, speed = [here.x, here.y, c, s], [here.vx, here.vy, -w * s, w * c]
    return mbs.AddNode(eii.NodePoint2DSlope1(referenceCoordinates=place, initialVelocities=speed))


def _add_element(mbs: Any, values: BeamValues, k: int, nodes: tuple[Any, Any], size: float) -> Any:
    """Add element k of the link; k outside the mesh: a stub, as stiff as the link's end beside it,
    almost without mass."""
    near = min(max(k, 0), len(values) - 1)
    return mbs.AddObject(
        eii.ObjectANCFCable2D(
            length=size,
            massPerLength=values.mass[near] * (1.0 if near == k else STUB_MASS_RATIO),
            bendingStiffness=values.bending[near],
            axialStiffness=values.axial[near],
            bendingDamping=values.beta * values.bending[near],
            axialDamping=values.stretch * values.axial[near],
            nodeNumbers=list(nodes),
        )
    )


def _add_lump(mbs: Any, node: Any, lump: PointMass, gravity: tuple[float, float]) -> None:

    if lump.mass == 0 and lump.inertia == 0:
        return
    if lump.along or lump.across:
        _add_body(mbs, [node], lump, np.eye(4)[:2], np.eye(4)[2:], gravity)
        return
    m, j = lump.mass, lump.inertia
    mbs.AddObject(eii.ObjectGenericODE2(nodeNumbers=[node], massMatrix=np.diag([m, m, j, j])))
    if any(gravity):
        marker = mbs.AddMarker(eii.MarkerNodePosition(nodeNumber=node))
        mbs.AddLoad(
            eii.LoadForceVector(
                markerNumber=marker, loadVector=[m * gravity[0], m * gravity[1], 0.0]
            )
        )


def _add_body(
    mbs: Any,
    nodes: list[Any],
    body: PointMass,
    place: np.ndarray,
    slope: np.ndarray,
    gravity: tuple[float, float],
) -> None:
    """Add a body to nodes; place, slope (2, coordinates): r and r' where it is fixed, by theirs."""
    centre = place + body.offset @ slope
    mbs.AddObject(
        eii.ObjectGenericODE2(
            nodeNumbers=nodes,
            massMatrix=body.mass * centre.T @ centre + body.inertia * slope.T @ slope,
            forceVector=body.mass * centre.T @ gravity,
        )
    )


def _end(mbs: Any, element: Any, x: float, node: Any) -> Attachment:

    return Attachment(
        element, [x, 0.0, 0.0], mbs.AddMarker(eii.MarkerNodeRigid(nodeNumber=node)), rigid=False
    )


def _node_motion(q: np.ndarray, v: np.ndarray) -> Motion:
    slope, rate = q[:, 2:], v[:, 2:]
    omega = (slope[:, 0] * rate[:, 1] - slope[:, 1] * rate[:, 0]) / (slope**2).sum(axis=-1)
    return Motion(q[:, :2], np.arctan2(slope[:, 1], slope[:, 0]), v[:, :2], omega)


def _elements(q: np.ndarray) -> np.ndarray:
    """Nodal coordinates (T, 4 nodes) as (T, elements, 4, 2): r, r' of both ends."""
    nodes = q.reshape(len(q), -1, 2, 2)
    return np.concatenate([nodes[:, :-1], nodes[:, 1:]], axis=2)


def _shapes(s: float, length: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Hermite cubics of r, r', r, r' at s = x/length, with first and second derivatives by x."""
    value = np.array(
        [
            1 - 3 * s**2 + 2 * s**3,
            length * (s - 2 * s**2 + s**3),
            3 * s**2 - 2 * s**3,
            length * (s**3 - s**2),
        ]
    )
    first = np.array(
        [6 * (s**2 - s) / length, 1 - 4 * s + 3 * s**2, 6 * (s - s**2) / length, 3 * s**2 - 2 * s]
    )
    second = np.array([(12 * s - 6) / length, 6 * s - 4, (6 - 12 * s) / length, 6 * s - 2]) / length
    return value, first, second


def _mass_matrix(h: float) -> np.ndarray:
    """Integrals of products of the cubics over an element of length h [m]."""
    return (h / 420) * np.array(
        [
            [156, 22 * h, 54, -13 * h],
            [22 * h, 4 * h**2, 13 * h, -3 * h**2],
            [54, 13 * h, 156, -22 * h],
            [-13 * h, -3 * h**2, -22 * h, 4 * h**2],
        ]
    )
