"""Sliding on a flexible link: a rigid carrier guides the elastic line at points.

A beam runs through points of a carrier that lie on a straight line. The abscissa of point k on the
beam is `place[k]` more than one sliding coordinate of all points. The first point is fixed in the
carrier; the others are free along the line, so that the beam may shorten as it bends. Two points
make a hub on link i-1 (Pa), a row of them a sleeve for link i (Pb).

Each point is an ObjectJointALEMoving2D, whose Jacobian contains the sliding coordinate. The force
of a bent beam on that coordinate, M^2/(2 EI), is therefore present and energy is conserved, unlike
with ObjectJointSliding2D. An ALE cable carries one coordinate. For several, each gets a layer of
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
    """A line in a rigid carrier.

    It starts at the carrier's place, which is at `frame`, at `angle` [rad] in the carrier.
    """

    carrier: Attachment
    frame: Frame
    angle: float


def rigid_carrier(
    mbs: Any, held: Attachment, frame: Frame, negligible: tuple[float, float]
) -> Attachment:
    """An attachment as part of a rigid body.

    Args:
        mbs: Exudyn's system.
        held: the attachment.
        frame: its start.
        negligible: mass and inertia of a new body, fixed to `held` if that is not rigid.
    """

    if held.rigid:
        return held
    own = _body(mbs, frame, negligible)
    mbs.AddObject(
        eii.ObjectJointGeneric(
            markerNumbers=[held.marker, own.marker], constrainedAxes=[1, 1, 0, 0, 0, 1]
        )
    )
    return own


def add_sliding_points(
    mbs: Any,
    line: Line,
    beam: Any,
    places: np.ndarray,
    start: float,
    speed: float,
    negligible: tuple[float, float],
) -> Any:
    """Guide a beam at points of a carrier, along which it slides.

    Args:
        mbs: Exudyn's system.
        line: of the points.
        beam: a CableLink.
        places: of the points ahead on the line [m].
        start: abscissa of the beam at the line's start [m].
        speed: its rate [m/s].
        negligible: mass and inertia of the bodies that stand for points free along the line.

    Returns:
        The node of the sliding coordinate, the beam's abscissa at the line's start.
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
            marker = _body(mbs, straight.along(place), negligible).marker
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
    """Add a node of one coordinate without mass.

    Args:
        mbs: Exudyn's system.
        start: value of the coordinate.
        speed: its rate.
    """

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


def complement(mbs: Any, node: Any, total: float, start: float, speed: float) -> Any:
    """Add a node whose coordinate is `total` less that of another.

    Args:
        mbs: Exudyn's system.
        node: the other node.
        total: their sum.
        start: value of the new coordinate.
        speed: its rate.
    """

    own = coordinate(mbs, start, speed)
    markers = [marker_of(mbs, own), marker_of(mbs, node)]
    mbs.AddObject(
        eii.ObjectConnectorCoordinate(markerNumbers=markers, factorValue1=-1.0, offset=-total)
    )
    return own


def _body(mbs: Any, frame: Frame, negligible: tuple[float, float]) -> Attachment:

    node = mbs.AddNode(
        eii.NodeRigidBody2D(referenceCoordinates=list(frame[:3]), initialVelocities=list(frame[3:]))
    )
    body = mbs.AddObject(
        eii.ObjectRigidBody2D(mass=negligible[0], inertia=negligible[1], nodeNumber=node)
    )
    return Attachment(body, [0.0, 0.0, 0.0], mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=body)))
