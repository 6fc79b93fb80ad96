"""Reactions of the twin's joints and forces along its links, from the accelerations that Exudyn
finds.

All is in the base's axes: accelerations are those of Exudyn's own coordinates, by its own shapes,
so that no joint has a convective term. What lies beyond a cut takes what comes through it (139),
(140).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..io import STATIONS
from ..robot import FORCE_KINDS
from .links.ancf import CableLink
from .links.part import PointMass
from .links.rigid import RigidLink

if TYPE_CHECKING:
    from .build import TwinModel

NEAR = 1e-9  # of a link's length: what is closer to a cut is at it
Channels = dict[str, tuple[np.ndarray, str]]
States = tuple[np.ndarray, np.ndarray, np.ndarray]


class Sum:
    """Forces (T, 2) [N] and moments (T,) [N m] about the base's origin, added up."""

    def __init__(self, times: int) -> None:
        self.force, self.moment = np.zeros((times, 2)), np.zeros(times)

    def add(self, place: Any, force: np.ndarray, moment: Any = 0.0, where: Any = 1.0) -> None:
        """Add forces (T, 2) at places (T, 2), and moments (T,), where `where` (T,) is not 0."""
        self.force = self.force + force * np.reshape(where, (-1, 1))
        self.moment = self.moment + (_cross(place, force) + moment) * where

    def about(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Forces (T, 2), and moments (T,) about places (T, 2)."""
        return self.force, self.moment - _cross(place, self.force)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _unit(slope: np.ndarray) -> np.ndarray:
    return np.asarray(slope / np.hypot(slope[:, 0], slope[:, 1])[:, None])


class Cuts:
    """A run of a twin, cut.

    Args:
        model: the assembled robot.
        t: times (T,) [s].
        states: coordinates, velocities and accelerations of the system, (T, coordinates) each.
        position: of the joints (T, n) [m or rad].
    """

    def __init__(
        self, model: TwinModel, t: np.ndarray, states: States, position: np.ndarray
    ) -> None:
        self.model, self.t, self.position = model, t, position
        self.gravity = np.array(model.robot.gravity_m_s2)
        self.loads = model.loads.loads.each
        self.values = np.array([model.loads.values(at) for at in t]).reshape(len(t), -1, 3)
        self.own = [[x[:, index] for x in states] for index in model.index]
        self.beyond = [Sum(len(t))]  # what part i and all after it take; of no part the last
        for i in reversed(range(len(model.parts))):
            found = self._whole(i)
            found.add(0 * found.force, self.beyond[0].force, self.beyond[0].moment)
            self.beyond.insert(0, found)

    def point(self, i: int, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Place, tangent and acceleration of part i at x (T,) [m], (T, 2) each."""
        part, (q, v, more) = self.model.parts[i], self.own[i]
        if isinstance(part, CableLink):
            place, slope, _ = part.at(q, x)
            return place, _unit(slope), part.at(more, x)[0]
        assert isinstance(part, RigidLink)
        tangent = np.stack([np.cos(q[:, 2]), np.sin(q[:, 2])], axis=-1)
        return part.point(q, x), tangent, part.acceleration(q, v, more, x)

    def section(self, i: int, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Bending moment, shear force and axial force of a flexible link at x (T,) (141)."""
        part, (q, _, more) = self.model.parts[i], self.own[i]
        assert isinstance(part, CableLink)
        before = x - NEAR * self.model.robot.links[i].length_m
        needed = self._fixed(i, before)
        part.add_line(q, more, x, self.gravity, needed.add)
        on: Any = 1.0
        if i + 1 < len(self.own) and self.model.robot.links[i + 1].joint.type == "Pa":
            on = self.position[:, i + 1] >= before
        after = self.beyond[i + 1]
        needed.add(0 * after.force, after.force, after.moment, on)
        place, tangent, _ = self.point(i, x)
        force, moment = needed.about(place)
        return -moment, -_cross(tangent, force), -(tangent * force).sum(axis=-1)

    def _whole(self, i: int) -> Sum:
        """What a part takes with its hub, masses and loads."""
        part, (q, _, more) = self.model.parts[i], self.own[i]
        out = self._fixed(i, np.full(len(self.t), -np.inf))
        if isinstance(part, CableLink):
            origin = np.zeros(len(self.t))
            part.add_line(q, more, origin, self.gravity, out.add)
            self._body(out, i, part.hub, 0.0, 1.0)
        return out

    def _fixed(self, i: int, x: np.ndarray) -> Sum:
        """What is fixed to part i from x (T,) on takes, but for a beam's hub; of a rigid link all
        its mass."""
        part, (q, v, more), out = self.model.parts[i], self.own[i], Sum(len(self.t))
        if isinstance(part, CableLink):
            for at, body in (*part.lumps, (self.model.robot.links[i].length_m, part.payload)):
                self._body(out, i, body, at, at >= x)
        elif isinstance(part, RigidLink):
            mass, centre, inertia = part.inertia
            force = mass * (part.acceleration(q, v, more, centre) - self.gravity)
            out.add(part.point(q, centre), force, inertia * more[:, 2])
        for k, load in enumerate(self.loads):
            if load.link == i + 1:
                assert load.at_m is not None
                place, tangent, _ = self.point(i, np.full(len(self.t), load.at_m))
                along, across, moment = self.values[:, k].T
                if load.frame == "link":
                    left = np.stack([-tangent[:, 1], tangent[:, 0]], axis=-1)
                    force = along[:, None] * tangent + across[:, None] * left
                else:
                    force = np.stack([along, across], axis=-1)
                out.add(place, -force, -moment, load.at_m >= x)
        return out

    def _body(self, out: Sum, i: int, body: PointMass, x: float, where: Any) -> None:
        """A body on a beam: its centre is at r + offset r', linear in the coordinates."""
        part, (q, _, more) = self.model.parts[i], self.own[i]
        assert isinstance(part, CableLink)
        at = np.full(len(self.t), x)
        place, slope, _ = part.at(q, at)
        faster, turned, _ = part.at(more, at)
        force = body.mass * (faster + turned @ body.offset.T - self.gravity)
        moment = body.inertia * _cross(slope, turned)
        out.add(place + slope @ body.offset.T, force, moment, where)


def reaction_channels(cuts: Cuts, places: list[tuple[np.ndarray, np.ndarray]]) -> Channels:
    """Reactions of all joints (139), (140).

    Args:
        cuts: the run.
        places: of each joint the point (T, 2) and the angle (T,) of the axis on which it slides.

    Returns:
        Values (T,) and units by channel.
    """
    out: Channels = {}
    for i, (place, axis) in enumerate(places):
        force, moment = cuts.beyond[i].about(place)
        found = {"x": (force[:, 0], "N"), "y": (force[:, 1], "N"), "moment": (moment, "N m")}
        if cuts.model.robot.links[i].joint.type != "R":
            turned = (force[:, 0] + 1j * force[:, 1]) * np.exp(-1j * axis)
            found |= {"along": (turned.real, "N"), "across": (turned.imag, "N")}
        out |= {f"joint/{i + 1}/reaction_{name}": each for name, each in found.items()}
    return out


def link_channels(cuts: Cuts) -> Channels:
    """Forces and stresses along the flexible links (141), (146), of one in a sleeve along its free
    length.

    Args:
        cuts: the run.

    Returns:
        Values (T,) and units by channel.
    """
    out: Channels = {}
    for i, link in enumerate(cuts.model.robot.links):
        if not link.flexible:
            continue
        length = np.full(len(cuts.t), link.length_m)
        free = cuts.position[:, i] if link.joint.type == "Pb" else length
        for k in range(STATIONS):
            x = np.minimum(length - free + k / (STATIONS - 1) * free, length)
            found = cuts.section(i, x)
            units = ("N m", "N", "N", "Pa")
            stress = link.bending_stress(found[0], x)
            values = found if stress is None else (*found, stress)
            for name, each, unit in zip(FORCE_KINDS, values, units, strict=False):
                out[f"link/{i + 1}/{name}/{k}"] = each, unit
    return out


def sensor_channels(cuts: Cuts) -> Channels:
    """Accelerometers, and sensors of forces and stresses on flexible links.

    Args:
        cuts: the run.

    Returns:
        Values (T,) and units by channel.
    """
    out: Channels = {}
    for i, link in enumerate(cuts.model.robot.links):
        for sensor in link.sensor:
            x = np.full(len(cuts.t), sensor.at_m)
            if sensor.kind == "acceleration":
                _, tangent, more = cuts.point(i, x)
                out[f"sensor/{sensor.name}"] = _cross(tangent, more), sensor.unit
            elif sensor.kind in FORCE_KINDS and link.flexible:
                found = cuts.section(i, x)
                if sensor.kind == "stress":
                    value = link.bending_stress(found[0], sensor.at_m, sensor.distance_m)
                else:
                    value = found[FORCE_KINDS.index(sensor.kind)]
                out[f"sensor/{sensor.name}"] = np.asarray(value), sensor.unit
    return out
