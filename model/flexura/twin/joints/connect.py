"""A joint of the twin: constraints that leave one relative coordinate, and its drive.

The coordinate is a marker of Exudyn whose value is the joint's position [m or rad] and whose
Jacobian is the direction of virtual work. A force on it acts on the hub and back on the previous
link, at the point and along the line where they touch. Drive, friction, lock and rotor attach to
it. The rotor is a mass of its own with one coordinate tied to the joint's, which gives exactly 1/2
I (d eta/dt)^2 between two moving links. A transmission is a spring-damper between the two
coordinates; all else then attaches to the rotor's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...optional import Optional
from ...robot import Joint, Link
from ..links.part import Attachment, Frame
from . import sliding

eii = Optional("exudyn.itemInterface")
exu, advanced = Optional("exudyn"), Optional("exudyn.advancedUtilities")

FRICTION_SPEED = 1e-3  # m/s or rad/s: Coulomb friction is f tanh(velocity / this)


@dataclass(frozen=True)
class Coordinate:
    """A joint's coordinate in Exudyn.

    `marker` measures it, `load` acts on it, `servo` is its PD controller or None, `guide` the
    constraint that puts it on a prescribed motion or None. `references` keeps objects that Exudyn
    only refers to. `rotor`: the node of a rotor behind a transmission, whose coordinate this then
    is, or None.
    """

    marker: Any
    load: Any
    servo: Any = None
    references: Any = None
    guide: Any = None
    rotor: Any = None


def start_frame(link: Link, previous: Frame, length: float, speed: float) -> Frame:
    """The straight start of a link.

    Args:
        link: the link.
        previous: start of the link before it, or the base.
        length: length of the link before it [m]; 0 for the base.
        speed: joint velocity [m/s or rad/s].
    """
    joint = link.joint
    if joint.type == "R":
        axis = previous.along(length, turn=joint.start, spin=speed)
        return axis.along(joint.hub_radius_m) if joint.hub_radius_m else axis
    if joint.type == "Pa":
        return previous.along(joint.start, slide=speed, turn=joint.angle_rad)
    return previous.along(length, turn=joint.angle_rad).along(
        joint.start - link.length_m, slide=speed
    )


@dataclass(frozen=True)
class JointSite:
    """Where a joint is built.

    `tip`, `origin`: starts of the previous link's tip and of the link's origin. `speed`: of the
    joint [m/s or rad/s]. `negligible`: mass and inertia of bodies that only hold others.
    """

    mbs: Any
    tip: Frame
    origin: Frame
    speed: float
    negligible: tuple[float, float]


def connect(
    on: JointSite, link: Link, previous: Any, part: Any, places: np.ndarray | None
) -> tuple[Any, Any]:
    """Constrain a link to the one before it.

    Args:
        on: where the joint is built.
        link: the link.
        previous: the part before it, or the base.
        part: the link's part.
        places: points of the hub or sleeve, if the joint slides on a flexible link [m]; else None.

    Returns:
        The marker of the joint's coordinate, and its node if it has one.
    """
    joint, mbs = link.joint, on.mbs
    if joint.type == "R":
        hub = part.origin
        if joint.hub_radius_m:
            body = sliding.rigid_carrier(mbs, hub, on.origin, on.negligible).body
            place = [-joint.hub_radius_m, 0.0, 0.0]
            marker = mbs.AddMarker(eii.MarkerBodyRigid(bodyNumber=body, localPosition=place))
            hub = Attachment(body, place, marker)
        return _revolute(mbs, joint, previous.tip, hub), None
    if joint.type == "Pa":
        if places is None:
            return _prismatic(
                mbs, previous.origin, part.origin, part.origin, 0.0, joint.angle_rad
            ), None
        hub = sliding.rigid_carrier(mbs, part.origin, on.origin, on.negligible)
        line = sliding.Line(hub, on.origin, -joint.angle_rad)
        node = sliding.add_sliding_points(
            mbs, line, previous, places, joint.start, on.speed, on.negligible
        )
        return sliding.marker_of(mbs, node), node
    sleeve = sliding.rigid_carrier(mbs, previous.tip, on.tip, on.negligible)
    if places is None:  # d is where the tip of link i is
        return _prismatic(mbs, sleeve, part.origin, part.tip, joint.angle_rad, 0.0), None
    line = sliding.Line(sleeve, on.tip, joint.angle_rad)
    behind = sliding.add_sliding_points(
        mbs, line, part, places, link.length_m - joint.start, -on.speed, on.negligible
    )
    node = sliding.complement(mbs, behind, link.length_m, joint.start, on.speed)
    return sliding.marker_of(mbs, node), node


def _revolute(mbs: Any, joint: Joint, tip: Attachment, hub: Attachment) -> Any:

    mbs.AddObject(eii.ObjectJointRevolute2D(markerNumbers=[tip.marker, hub.marker]))
    # counts whole turns
    turns = mbs.AddNode(
        eii.NodeGenericData(initialCoordinates=[joint.start], numberOfDataCoordinates=1)
    )
    return mbs.AddMarker(
        eii.MarkerBodiesRelativeRotationCoordinate(
            bodyNumbers=[tip.body, hub.body],
            localPosition0=tip.place,
            localPosition1=hub.place,
            axis0=[0, 0, 1],
            nodeNumber=turns,
        )
    )


def _prismatic(
    mbs: Any, rail: Attachment, hub: Attachment, end: Attachment, axis: float, turned: float
) -> Any:
    """`hub` slides on a line at the angle `axis` in the frame of `rail`, `turned` to it; the
    coordinate is where `end` is."""

    along = [math.cos(axis), math.sin(axis), 0.0]
    normal = [math.sin(turned), math.cos(turned), 0.0]  # of the line, in the hub's frame
    markers = [rail.marker, hub.marker]
    mbs.AddObject(
        eii.ObjectJointPrismatic2D(markerNumbers=markers, axisMarker0=along, normalMarker1=normal)
    )
    return mbs.AddMarker(
        eii.MarkerBodiesRelativeTranslationCoordinate(
            bodyNumbers=[rail.body, end.body],
            localPosition0=rail.place,
            localPosition1=end.place,
            axis0=along,
        )
    )


def add_drive_and_friction(
    mbs: Any,
    joint: Joint,
    marker: Any,
    fixed: Any,
    speed: float,
    gains: tuple[float, float],
    guided: bool = False,
    held: bool = False,
) -> Coordinate:
    """Put drive, PD gains, friction, rotor or lock on a joint's coordinate.

    Args:
        mbs: Exudyn's system.
        joint: the joint.
        marker: of its coordinate.
        fixed: a marker whose coordinate is always 0.
        speed: velocity at the start [m/s or rad/s].
        gains: stiffness and damping.
        guided: it follows a prescribed motion.
        held: a joint that is not locked stays at its start all the same, with the same unknowns.
    """

    behind = None
    if joint.transmission is not None:
        behind, marker = _rotor(mbs, joint, marker, speed)
    load = mbs.AddLoad(eii.LoadCoordinate(markerNumber=marker, load=0.0))
    guide = None
    if joint.locked or guided or held:
        guide = mbs.AddObject(
            eii.ObjectConnectorCoordinate(markerNumbers=[fixed, marker], offset=joint.start)
        )
    if joint.spring_stiffness:
        mbs.AddObject(
            eii.ObjectConnectorCoordinateSpringDamper(
                markerNumbers=[fixed, marker],
                stiffness=joint.spring_stiffness,
                offset=joint.spring_rest,
            )
        )
    if joint.locked:
        return Coordinate(marker, load, rotor=behind)
    servo = references = None
    if any(gains):
        # Its offsets follow the motion. A load kp r against a spring without offset is equivalent,
        # but if both are large, Newton's method does not see their lines of action turn, and
        # converges badly.
        servo = mbs.AddObject(
            eii.ObjectConnectorCoordinateSpringDamperExt(
                markerNumbers=[fixed, marker],
                stiffness=gains[0],
                damping=gains[1],
                frictionProportionalZone=1.0,
            )
        )
    if joint.viscous_friction or joint.coulomb_friction:
        spring = mbs.AddObject(
            eii.ObjectConnectorCoordinateSpringDamper(
                markerNumbers=[fixed, marker], damping=joint.viscous_friction
            )
        )
        if joint.coulomb_friction:
            references = _friction(mbs, spring, joint.coulomb_friction)
            mbs.SetObjectParameter(spring, "springForceUserFunction", references)
    if joint.rotor_inertia and joint.transmission is None:
        _rotor(mbs, joint, marker, speed)
    return Coordinate(marker, load, servo, references, guide if guided else None, behind)


def _rotor(mbs: Any, joint: Joint, marker: Any, speed: float) -> tuple[Any, Any]:
    """The rotor's node and the marker of its coordinate, tied to the joint's or connected to it by
    the transmission."""
    rotor = mbs.AddNode(
        eii.NodeGenericODE2(
            numberOfODE2Coordinates=1,
            referenceCoordinates=[0.0],
            initialCoordinates=[joint.start],
            initialCoordinates_t=[speed],
        )
    )
    mbs.AddObject(eii.ObjectGenericODE2(nodeNumbers=[rotor], massMatrix=[[joint.rotor_inertia]]))
    own = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=rotor, coordinate=0))
    if joint.transmission is None:
        mbs.AddObject(eii.ObjectConnectorCoordinate(markerNumbers=[own, marker]))
    else:
        mbs.AddObject(
            eii.ObjectConnectorCoordinateSpringDamper(
                markerNumbers=[own, marker],
                stiffness=joint.transmission.stiffness_N_m_rad,
                damping=joint.transmission.damping_N_m_s_rad,
            )
        )
    return rotor, own


def _friction(mbs: Any, spring: Any, coulomb: float) -> Any:
    """c v + f tanh(v / v0) (57) as an expression that Exudyn evaluates without Python."""
    tanh: Any = exu.symbolic.tanh

    def force(mbs, t, itemNumber, displacement, velocity, stiffness, damping, offset):  # type: ignore[no-untyped-def]
        return damping * velocity + coulomb * tanh(velocity / FRICTION_SPEED)

    return advanced.CreateSymbolicUserFunction(mbs, force, "springForceUserFunction", spring)
