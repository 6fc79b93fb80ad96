"""Reactions of the twin's joints and forces along its links, from the accelerations that Exudyn
finds.

All is in the base's axes: a part's accelerations are Exudyn's own coordinates and its own shapes,
so that no joint has a convective term. What lies beyond a cut takes what comes through it (137),
(138).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from ..io import STATIONS
from .links.ancf import CableLink
from .links.part import Motion, PointMass
from .links.rigid import RigidLink

if TYPE_CHECKING:
    from ..signals import Loads
    from .build import TwinModel

NEAR = 1e-9  # of a link's length: what is closer to a cut is at it


class Wrench:
    """Forces (T, 2) [N] and moments (T,) [N m] about the base's origin, summed up."""

    def __init__(self, times: int) -> None:
        self.force, self.moment = np.zeros((times, 2)), np.zeros(times)

    def add(self, place: np.ndarray, force: np.ndarray, moment: Any = 0.0, where: Any = 1.0) -> None:
        """Add a force (T, 2) at a place (T, 2), and a moment (T,), where (T,) is not 0."""
        self.force = self.force + force * np.reshape(where, (-1, 1))
        self.moment = self.moment + (_cross(place, force) + moment) * where

    def plus(self, other: Wrench) -> Wrench:
        """The sum of both."""
        out = Wrench(len(self.moment))
        out.force, out.moment = self.force + other.force, self.moment + other.moment
        return out

    def about(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Force (T, 2) and moment (T,) about a place (T, 2)."""
        return self.force, self.moment - _cross(place, self.force)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


class Cuts:
    """A twin's run, cut into parts.

    Args:
        model: the assembled robot.
        t: times (T,) [s].
        states: the system's coordinates, velocities and accelerations, (T, coordinates) each.
        loads: on its links.
        slides: places of the hubs of the joints (T, n), of Pa and Pb [m].
    """

    def __init__(
        self,
        model: TwinModel,
        t: np.ndarray,
        states: tuple[np.ndarray, np.ndarray, np.ndarray],
        loads: Loads,
        slides: np.ndarray,
    ) -> None:
        self.model, self.t, self.slides = model, t, slides
        self.gravity = np.array(model.robot.gravity_m_s2)
        self.loads, self.values = loads, [model.loads.values(at) for at in t]
        self.own = [tuple(x[:, index] for x in states) for index in model.index]
        self.whole = [self._part(i) for i in range(len(model.parts))]

    def beyond(self, i: int) -> Wrench:
        """What part i and all after it take (137), (138); their hubs are in them."""
        out = Wrench(len(self.t))
        for part in self.whole[i:]:
            out = out.plus(part)
        return out

    def section(self, i: int, s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Bending moment, shear force and axial force (T,) of a flexible link at s (T,) (139)."""
        part, (q, v, a) = self.model.parts[i], self.own[i]
        assert isinstance(part, CableLink)
        needed = self._fixed(i, s - NEAR * part.length)
        part.line_beyond(q, a, s, self.gravity, needed.add)
        if i + 1 < len(self.whole):
            after, rides = self.beyond(i + 1), self.model.robot.links[i + 1].joint.type == "Pa"
            on = self.slides[:, i + 1] >= s - NEAR * part.length if rides else np.ones(len(self.t))
            needed.add(np.zeros((len(self.t), 2)), after.force, after.moment, on)
        here, slope = part.place_and_slope(q, s)
        force, moment = needed.about(here)
        e = slope / np.hypot(slope[:, 0], slope[:, 1])[:, None]
        return -moment, -_cross(e, force), -(e * force).sum(axis=-1)

    def _part(self, i: int) -> Wrench:
        """What a part takes with its hub, masses and loads, about the base's origin."""
        part, (q, v, a) = self.model.parts[i], self.own[i]
        out = self._fixed(i, np.full(len(self.t), -np.inf))
        if isinstance(part, CableLink):
            start = np.zeros(len(self.t))
            part.line_beyond(q, a, start, self.gravity, out.add)
            here = part.body_motions(q, v, a)[0]
            self._body(out, part.hub, *here)
        return out

    def _fixed(self, i: int, s: np.ndarray) -> Wrench:
        """What is fixed to part i from s (T,) on takes but for its hub; of a rigid link all."""
        part, (q, v, a), out = self.model.parts[i], self.own[i], Wrench(len(self.t))
        length = self.model.robot.links[i].length_m
        if isinstance(part, CableLink):
            _, *lumps, tip = part.body_motions(q, v, a)
            for lump, motion in zip(part.lumps, lumps, strict=True):
                self._body(out, lump.body, *motion, where=lump.at >= s)
            self._body(out, part.payload, *tip, where=length >= s)
        elif isinstance(part, RigidLink):
            inertia = part.inertia
            centre, more = part.acceleration(q, v, a, inertia.centre)
            force = inertia.mass * (more - self.gravity)
            out.add(centre, force, inertia.inertia * a[:, 2])
        for k, load in enumerate(self.loads.each):
            if load.link - 1 == i:
                value = np.array([each[k] for each in self.values])
                place, e = part.place_and_slope(q, np.full(len(self.t), load.at_m))
                force = value[:, :2]
                if load.frame == "link":
                    e = e / np.hypot(e[:, 0], e[:, 1])[:, None]
                    left = np.stack([-e[:, 1], e[:, 0]], axis=-1)
                    force = value[:, :1] * e + value[:, 1:2] * left
                out.add(place, -force, -value[:, 2], load.at_m >= s)
        return out

    def _body(
        self,
        out: Wrench,
        body: PointMass,
        motion: Motion,
        place_more: np.ndarray,
        slope: np.ndarray,
        slope_more: np.ndarray,
        where: Any = 1.0,
    ) -> None:
        """A body on a beam: its centre is at r + offset r' (linear in the coordinates)."""
        centre, more = motion.r + slope @ body.offset.T, place_more + slope_more @ body.offset.T
        force = body.mass * (more - self.gravity)
        out.add(centre, force, body.inertia * _cross(slope, slope_more), where)


Channels = dict[str, tuple[np.ndarray, str]]
Section = Callable[[int, np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]


def force_channels(cuts: Cuts, places: list[tuple[np.ndarray, np.ndarray]]) -> Channels:
    """The channels of internal forces that a native run has, but for rigid links' sections.

    Args:
        cuts: the run.
        places: of each joint the place (T, 2) and the angle of the axis (T,) on which it slides.
    """
    out: Channels = {}
    links = cuts.model.robot.links
    for i, (place, axis) in enumerate(places):
        force, moment = cuts.beyond(i).about(place)
        found = {"x": (force[:, 0], "N"), "y": (force[:, 1], "N"), "moment": (moment, "N m")}
        if links[i].joint.type != "R":
            turned = (force[:, 0] + 1j * force[:, 1]) * np.exp(-1j * axis)
            found |= {"along": (turned.real, "N"), "across": (turned.imag, "N")}
        out |= {f"joint/{i + 1}/reaction_{name}": each for name, each in found.items()}
    for i, link in enumerate(links):
        if not link.flexible:
            continue
        free = cuts.slides[:, i] if link.joint.type == "Pb" else np.full(len(cuts.t), link.length_m)
        for k in range(STATIONS):
            s = np.minimum(link.length_m - free + k / (STATIONS - 1) * free, link.length_m)
            moment, shear, axial = cuts.section(i, s)
            out |= {
                f"link/{i + 1}/bending_moment/{k}": (moment, "N m"),
                f"link/{i + 1}/shear_force/{k}": (shear, "N"),
                f"link/{i + 1}/axial_force/{k}": (axial, "N"),
            }
            stress = link.bending_stress(moment, s)
            if stress is not None:
                out[f"link/{i + 1}/stress/{k}"] = stress, "Pa"
    return out
