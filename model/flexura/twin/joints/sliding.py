"""Sliding on a flexible link: a rigid carrier that holds the elastic line at points, among which it
slides.

A beam runs through points of a carrier that lie on a straight line; the abscissa of point k on the
beam is `place[k]` more than one sliding coordinate of all of them. The first point is fixed in the
carrier, the others are free along the line, so that the beam may shorten as it bends. Two points
make a hub on link i-1 (Pa), a row of them a sleeve for link i (Pb).

Each point is an ObjectJointALEMoving2D, whose Jacobian has the sliding coordinate in it: the force
that a bent beam puts on the coordinate, M^2/(2 EI), is there and energy is kept, unlike with
ObjectJointSliding2D. An ALE cable carries one coordinate; to have several, each gets a layer of
cables of its own, without mass and stiffness, on the nodes of the beam.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ...optional import Optional
from ..links.part import Attachment, Frame

eii = Optional("exudyn.itemInterface")


class Line(NamedTuple):
    """A line in a rigid carrier: it starts at the carrier's place, which is at `frame`, at `angle`
    [rad] in the carrier."""

    carrier: Attachment
    frame: Frame
    angle: float


def rigid(mbs: Any, held: Attachment, frame: Frame, tiny: tuple[float, float]) -> Attachment:
    """`held`, at `frame`, as part of a rigid body: itself if it is one, else a body of `tiny` mass
    and inertia fixed to it."""

    if held.rigid:
        return held
    mine = _body(mbs, frame, tiny)
    mbs.AddObject(
        eii.ObjectJointGeneric(
            markerNumbers=[held.marker, mine.marker], constrainedAxes=[1, 1, 0, 0, 0, 1]
        )
    )
    return mine


def hold(
    mbs: Any,
    line: Line,
    beam: Any,
    places: np.ndarray,
    start: float,
    speed: float,
    tiny: tuple[float, float],
) -> Any:
    """Hold `beam` (a CableLink) at points of a carrier, `places` [m] ahead on its line; returns the
    sliding coordinate's node.

    The coordinate is the beam's abscissa at the line's start; it is `start` at first [m], at the
    rate `speed` [m/s]. `tiny`: mass and inertia of the bodies that stand for the points free along
    the line.
    """

    node = coordinate(mbs, start, speed)
    cables = beam.layer(mbs, node)
    carrier, axis = line.carrier, np.array([math.cos(line.angle), math.sin(line.angle), 0.0])
    straight = line.frame.along(0.0, turn=line.angle)
    for k, place in enumerate(places):
        if k == 0:
            there = carrier.place + place * axis
            marker = mbs.AddMarker(
                eii.MarkerBodyRigid(bodyNumber=carrier.body, localPosition=there)
            )
        else:
            marker = _body(mbs, straight.along(place), tiny).marker
            mbs.AddObject(
                eii.ObjectJointPrismatic2D(
                    markerNumbers=[carrier.marker, marker],
                    axisMarker0=axis,
                    normalMarker1=[0, 1, 0],
                )
            )
        on = int(
            np.clip(
                np.searchsorted(beam.starts, place + start, side="right") - 1, 0, len(cables) - 1
            )
        )
        index = mbs.AddNode(eii.NodeGenericData(initialCoordinates=[on], numberOfDataCoordinates=1))
        mbs.AddObject(
            eii.ObjectJointALEMoving2D(
                markerNumbers=[marker, cables[on]],
                slidingMarkerNumbers=cables,
                slidingMarkerOffsets=beam.starts,
                slidingOffset=place,
                nodeNumbers=[index, node],
            )
        )
    return node


def coordinate(mbs: Any, start: float, speed: float) -> Any:
    """A node of one coordinate without mass."""

    return mbs.AddNode(
        eii.NodeGenericODE2(
            numberOfODE2Coordinates=1,
            referenceCoordinates=[0.0],
            initialCoordinates=[start],
            initialCoordinates_t=[speed],
        )
    )


def marker_of(mbs: Any, node: Any) -> Any:
    """The marker of such a node's coordinate."""

    return mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))


def rest(mbs: Any, node: Any, total: float, start: float, speed: float) -> Any:
    """A node whose coordinate and another one's are `total` together."""

    mine = coordinate(mbs, start, speed)
    markers = [marker_of(mbs, mine), marker_of(mbs, node)]
    mbs.AddObject(
        eii.ObjectConnectorCoordinate(markerNumbers=markers, factorValue1=-1.0, offset=-total)
    )
    return mine


def _body(mbs: Any, frame: Frame, tiny: tuple[float, float]) -> Attachment:

    node = mbs.AddNode(
        eii.NodeRigidBody2D(referenceCoordinates=list(frame[:3]), initialVelocities=list(frame[3:]))
    )
    body = mbs.AddObject(eii.ObjectRigidBody2D(mass=tiny[0], inertia=tiny[1], nodeNumber=node))
    return Attachment(body, [0.0, 0.0, 0.0], mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=body)))
