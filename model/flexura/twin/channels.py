"""From recorded coordinates to the channels of a Run."""

from __future__ import annotations

import numpy as np

from ..io import STATIONS
from ..robot import Joint, Sensor
from . import internal_forces as forces
from .build import TwinModel
from .links.ancf import CableLink
from .links.part import Ground, Motion, Part
from .links.rigid import RigidLink
from .loads import Actuation


def channels(
    model: TwinModel,
    act: Actuation,
    t: np.ndarray,
    q: np.ndarray,
    v: np.ndarray,
    more: np.ndarray,
    reaction: np.ndarray,
    internal_forces: bool = False,
) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Channels of a run from the system's coordinates.

    Args:
        model: the assembled robot.
        act: its drives.
        t: times (T,) [s].
        q: total coordinates of the system (T, coordinates).
        v: their velocities (T, coordinates).
        more: their accelerations (T, coordinates).
        reaction: forces of the constraints that hold joints to a motion (T, n).
        internal_forces: whether reactions and forces along the links are channels too.

    Returns:
        Channels (T,) and their units, by name.
    """
    out: dict[str, tuple[np.ndarray, str]] = {}
    gravity = np.array(model.robot.gravity_m_s2)
    kinetic, strain, potential = np.zeros(len(t)), np.zeros(len(t)), np.zeros(len(t))
    position, speed = np.zeros((len(t), len(model.parts))), np.zeros((len(t), len(model.parts)))
    motor = np.zeros_like(position), np.zeros_like(position)
    origin = tip = Ground.motion(len(t))
    deflection = np.zeros(len(t))
    places: list[tuple[np.ndarray, np.ndarray]] = []  # of the joints, and their axes
    for i, (link, part, index) in enumerate(
        zip(model.robot.links, model.parts, model.index, strict=True)
    ):
        own, rate = q[:, index], v[:, index]
        hub, end = part.motion_at_origin(own, rate), part.motion_at_tip(own, rate)
        joint = link.joint
        place, hub, position[:, i], speed[:, i] = _joint(t, joint, origin, tip, hub, end)
        places.append((place, hub.angle - (joint.angle_rad if joint.type == "Pa" else 0.0)))
        slides = model.slides[i]
        if slides is not None:
            position[:, i], speed[:, i] = q[:, slides], v[:, slides]
            if joint.type == "Pb":  # what is behind the sleeve's exit is on its axis
                behind = (position[:, i] - link.length_m)[:, None] * _axis(hub.angle)
                hub = hub._replace(r=tip.r + behind)
        slope = _wrap(end.angle - hub.angle)
        end = end._replace(angle=hub.angle + slope)
        out |= {f"link/{i + 1}/x": (hub.r[:, 0], "m"), f"link/{i + 1}/y": (hub.r[:, 1], "m")}
        out[f"link/{i + 1}/angle"] = hub.angle, "rad"
        deflection = _transverse(hub, end.r)
        if link.flexible:
            out |= {
                f"link/{i + 1}/tip_deflection": (deflection, "m"),
                f"link/{i + 1}/tip_slope": (slope, "rad"),
            }
            for k in range(STATIONS):
                place = part.point(own, k * link.length_m / (STATIONS - 1))
                out[f"link/{i + 1}/deflection/{k}"] = _transverse(hub, place), "m"
            out |= _bending_sensors(link.sensor, part, own, hub)
        kinetic += part.kinetic(own, rate)
        motor[0][:, i], motor[1][:, i] = position[:, i], speed[:, i]
        rotor = model.rotors[i]
        if rotor is not None:
            motor[0][:, i], motor[1][:, i] = q[:, rotor], v[:, rotor]
            strain += 0.5 * joint.windup_stiffness * (position[:, i] - q[:, rotor]) ** 2
        strain += 0.5 * joint.spring_stiffness * (motor[0][:, i] - joint.spring_rest) ** 2
        if not joint.locked:
            kinetic += 0.5 * joint.rotor_inertia * motor[1][:, i] ** 2
        strain += part.strain(own)
        potential -= part.moment(own) @ gravity
        origin, tip = hub, end
    whole = all(isinstance(part, CableLink | RigidLink) for part in model.parts)
    if whole and (internal_forces or any(link.sensor for link in model.robot.links)):
        cuts = forces.Cuts(model, t, (q, v, more), position)
        out |= forces.sensor_channels(cuts)
        if internal_forces:
            out |= forces.reaction_channels(cuts, places) | forces.link_channels(cuts)
    bent = deflection * bool(model.mesh.elements[-1])
    hubs = position, speed
    out = _joints(model, act, t, hubs, motor, bent, reaction) | out
    out |= {"tip/x": (tip.r[:, 0], "m"), "tip/y": (tip.r[:, 1], "m")}
    out |= {
        "energy/kinetic": (kinetic, "J"),
        "energy/strain": (strain, "J"),
        "energy/potential": (potential, "J"),
    }
    return {name: values for name, (values, _) in out.items()}, {
        name: unit for name, (_, unit) in out.items()
    }


def _joint(
    t: np.ndarray, joint: Joint, origin: Motion, tip: Motion, hub: Motion, end: Motion
) -> tuple[np.ndarray, Motion, np.ndarray, np.ndarray]:
    """A joint's place (T, 2), its hub with an angle that goes on, its position and rate (T,) each.

    Args:
        t: times (T,) [s].
        joint: the joint.
        origin: of the link before.
        tip: of the link before.
        hub: of the joint's own link.
        end: the tip of the joint's own link.
    """
    if joint.type == "R":
        rate = hub.omega - tip.omega
        turned = _unwrap(t, hub.angle - tip.angle, rate, joint.start)
        place = hub.r - joint.hub_radius_m * _axis(hub.angle)
        return place, hub._replace(angle=tip.angle + turned), turned, rate
    if joint.type == "Pa":
        # the tangent of a link turns by less than half a turn from its start
        turned = _wrap(hub.angle - joint.angle_rad - origin.angle)
        turned_hub = hub._replace(angle=origin.angle + turned + joint.angle_rad)
        return hub.r, turned_hub, *_slide(origin, hub)
    sleeve = tip._replace(angle=tip.angle + joint.angle_rad)
    return tip.r, hub._replace(angle=sleeve.angle), *_slide(sleeve, end)


def _bending_sensors(
    sensors: list[Sensor], part: Part, own: np.ndarray, hub: Motion
) -> dict[str, tuple[np.ndarray, str]]:
    """Sensors of deflection, and on a beam of cubics of slope and strain: by its curvature, whose
    error is of second order in the elements' length."""
    out = {}
    for sensor in sensors:
        if sensor.kind == "deflection":
            value = _transverse(hub, part.point(own, sensor.at_m))
        elif sensor.kind in ("slope", "strain") and isinstance(part, CableLink):
            _, slope, bend = part.at(own, np.full(len(own), sensor.at_m))
            value = _wrap(np.arctan2(slope[:, 1], slope[:, 0]) - hub.angle)
            if sensor.kind == "strain":
                assert sensor.distance_m is not None
                turned = slope[:, 0] * bend[:, 1] - slope[:, 1] * bend[:, 0]
                value = -sensor.distance_m * turned / (slope**2).sum(axis=-1)
        else:
            continue
        out[f"sensor/{sensor.name}"] = value, sensor.unit
    return out


def _joints(
    model: TwinModel,
    act: Actuation,
    t: np.ndarray,
    hubs: tuple[np.ndarray, np.ndarray],
    motors: tuple[np.ndarray, np.ndarray],
    deflection: np.ndarray,
    reaction: np.ndarray,
) -> dict[str, tuple[np.ndarray, str]]:
    """Position, velocity and drive of the joints, with units; hubs, motors: positions and
    velocities (T, n)."""
    drive = np.array(
        [act.call(*sample) for sample in zip(t, *motors, deflection, strict=True)]
    ).reshape(motors[0].shape)
    drive = drive + reaction
    out = {}
    for i, link in enumerate(model.robot.links):
        length, force = ("rad", "N m") if link.joint.type == "R" else ("m", "N")
        out[f"joint/{i + 1}/position"] = hubs[0][:, i], length
        out[f"joint/{i + 1}/velocity"] = hubs[1][:, i], f"{length}/s"
        out[f"joint/{i + 1}/drive"] = drive[:, i], force
        if link.joint.transmission is not None:
            out[f"joint/{i + 1}/motor_position"] = motors[0][:, i], length
            out[f"joint/{i + 1}/motor_velocity"] = motors[1][:, i], f"{length}/s"
    return out


def _transverse(hub: Motion, place: np.ndarray) -> np.ndarray:
    """Distance of points (T, 2) across the hub's axis (T,) [m]."""
    delta = place - hub.r
    return np.cos(hub.angle) * delta[:, 1] - np.sin(hub.angle) * delta[:, 0]


def _slide(rail: Motion, hub: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Distance of the hub along the rail's axis, and its rate, (T,) each."""
    axis = _axis(rail.angle)
    normal = np.stack([-axis[:, 1], axis[:, 0]], axis=-1)
    delta, rate = hub.r - rail.r, hub.v - rail.v
    return (axis * delta).sum(axis=-1), (axis * rate + rail.omega[:, None] * normal * delta).sum(
        axis=-1
    )


def _axis(angle: np.ndarray) -> np.ndarray:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _wrap(angle: np.ndarray) -> np.ndarray:
    """An angle in (-pi, pi]."""
    return angle - 2 * np.pi * np.ceil(angle / (2 * np.pi) - 0.5)


def _unwrap(t: np.ndarray, angle: np.ndarray, rate: np.ndarray, start: float) -> np.ndarray:
    """An angle known up to whole turns as a continuous one.

    The rate predicts the angle over long output steps.

    Args:
        t: times (T,) [s].
        angle: up to whole turns (T,) [rad].
        rate: its rate (T,) [rad/s].
        start: the angle at the start, at most half a turn off [rad].
    """
    out = np.empty_like(angle)
    guess = start
    for k in range(len(t)):
        if k:
            guess = out[k - 1] + (rate[k - 1] + rate[k]) / 2 * (t[k] - t[k - 1])
        out[k] = angle[k] - 2 * np.pi * np.round((angle[k] - guess) / (2 * np.pi))
    return out
