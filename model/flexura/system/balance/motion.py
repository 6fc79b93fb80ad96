"""Places and accelerations of a robot at T times: chapters 1, 4 and 12 of the theory.

`kinematics` has the same with the columns of all unknowns, for one state.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...link.line import Piece
from ..structure import Structure


class Frames(NamedTuple):
    """A frame at T times: place x + iy [m] and angle [rad], its acceleration [m/s^2], its spin
    [rad/s] and the rate of that, each (T,)."""

    place: np.ndarray
    angle: np.ndarray
    acceleration: np.ndarray
    spin: np.ndarray
    spin_rate: np.ndarray

    @property
    def tangent(self) -> np.ndarray:
        """The unit vector along the frame's x axis (T,)."""
        return np.exp(1j * self.angle)

    def turned(self, angle: Any, rate: Any = 0.0, more: Any = 0.0) -> Frames:
        """The frame turned by an angle with a rate and an acceleration (T,)."""
        return self._replace(
            angle=self.angle + angle, spin=self.spin + rate, spin_rate=self.spin_rate + more
        )

    def moved(self, x: Any, rate: Any = 0.0, more: Any = 0.0) -> Frames:
        """The frame moved by x (T,) [m] along its x axis (by the imaginary part of x across it),
        with a rate and an acceleration along it."""
        t, spin = self.tangent, self.spin
        own = x * (1j * self.spin_rate - spin**2) + 2j * spin * rate + more
        return self._replace(place=self.place + x * t, acceleration=self.acceleration + own * t)


class Path(NamedTuple):
    """A length that changes: value, rate and second derivative, (T,) each or constant."""

    value: Any
    rate: Any = 0.0
    more: Any = 0.0

    def plus(self, x: Any) -> Path:
        """The length and a constant."""
        return self._replace(value=self.value + x)


class Lines(NamedTuple):
    """A piece's line at T times: tangents e (T, P) with two derivatives, unknowns (T, m) with two.

    `free`: the length on which xi = s / d runs; `start`: the frame at xi = 0.
    """

    piece: Piece
    start: Frames
    free: Path
    e: np.ndarray
    rates: np.ndarray
    more: np.ndarray
    y: tuple[np.ndarray, np.ndarray, np.ndarray]

    def points(
        self, xi: np.ndarray, slide: tuple[Any, Any] = (0.0, 0.0)
    ) -> tuple[np.ndarray, np.ndarray]:
        """Places and accelerations (T, S) at xi (S,) or (T, S): of the material, or of a slider
        that moves on the line as `slide` says, rate and acceleration (4), (5), (31)."""
        d, d_rate, d_more = (column(x) for x in self.free)
        w, l, dl = self._weights(xi)
        reach, tangent = mixed(w, self.e), mixed(l, self.e)
        run = (column(slide[0]) + (1 - xi) * d_rate) / d
        place = column(self.start.place) + d * reach
        out = column(self.start.acceleration) + d * mixed(w, self.more) + d_more * reach
        out += 2 * d_rate * mixed(w, self.rates)
        out += (column(slide[1]) + (1 - xi) * d_more) * tangent
        out += d * run * (2 * mixed(l, self.rates) + run * mixed(dl, self.e))
        return place, out

    def at(self, xi: Any, slide: tuple[Any, Any] = (0.0, 0.0)) -> Frames:
        """The frame of the line at xi, a number or (T,) (30), (31)."""
        xi = np.asarray(xi, dtype=float)
        place, acceleration = self.points(xi[..., None], slide)
        b, db, ddb = (self.piece.shapes(np.atleast_1d(xi), k) for k in (0, 1, 2))
        turn = lambda shapes, y: np.einsum("tm,tm->t", np.broadcast_to(shapes, y.shape), y)
        y, y_rate, y_more = self.y
        d, d_rate, d_more = self.free
        run = (slide[0] + (1 - xi) * d_rate) / d
        slope = turn(db, y) / d
        more = turn(b, y_more) + slope * (slide[1] + (1 - xi) * d_more)
        more += run * (2 * turn(db, y_rate) + run * turn(ddb, y) - 2 * d_rate * slope)
        return Frames(
            place[:, 0],
            self.start.angle + turn(b, y),
            acceleration[:, 0],
            self.start.spin + turn(b, y_rate) + run * turn(db, y),
            self.start.spin_rate + more,
        )

    def _weights(self, xi: np.ndarray) -> list[np.ndarray]:
        """The weights w / d, l and dl at xi, (S, P) or (T, S, P) (13), (30)."""
        flat, shape = xi.ravel(), (*xi.shape, self.piece.points)
        found = [self.piece.integrals(flat), *(self.piece.lagrange(flat, k) for k in (0, 1))]
        return [each.reshape(shape) for each in found]


class LinkMotion(NamedTuple):
    """A link at T times: frame of its hub (Pb: exit), its lines (none: rigid), its tip; `ahead`:
    how far its proximal end is ahead of the hub, 0 but for Pb."""

    number: int
    hub: Frames
    lines: tuple[Lines, ...]
    tip: Frames
    ahead: Path

    def at(self, s: Any) -> Frames:
        """The frame of the material at the abscissa s, a number, of a link in a sleeve also (T,),
        [m] (4), (30)."""
        x = self.ahead.plus(s)
        behind = self.hub.moved(*x)
        if not self.lines:
            return behind
        if np.ndim(x.value):
            line = self.lines[0]
            ahead = line.at(np.clip(x.value / line.free.value, 0.0, 1.0))
            pairs = zip(ahead, behind, strict=True)
            return Frames(*(np.where(x.value >= 0, here, there) for here, there in pairs))
        left = x.value
        for line in self.lines[:-1]:
            if left < line.free.value:
                return line.at(left / line.free.value)
            left -= line.free.value
        return self.lines[-1].at(min(left / self.lines[-1].free.value, 1.0))


def link_motions(
    structure: Structure, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray
) -> list[LinkMotion]:
    """The links of a robot at T times, from the base outwards.

    Args:
        structure: the robot's numbering and pieces.
        q: configurations (T, n).
        qd: their rates (T, n).
        qdd: their accelerations (T, n).

    Returns:
        One entry a link.
    """
    out: list[LinkMotion] = []
    for i, link in enumerate(structure.robot.links):
        joint = Path(*(x[:, structure.rows[i]] for x in (q, qd, qdd)))
        hub = _hub(structure, i, out[-1] if out else None, joint, (q, qd, qdd))
        ahead = joint.plus(-link.length_m) if structure.sleeved(i) else Path(0.0)
        lines, tip = [], hub
        for piece, own in zip(structure.links[i], structure.own[i], strict=True):
            free = joint if structure.sleeved(i) else Path(piece.length)
            y = (q[:, own], qd[:, own], qdd[:, own])
            lines.append(_line(piece, tip, hub, free, y, structure.linear))
            tip = lines[-1].at(1.0)
        if not lines:
            tip = hub.moved(*ahead.plus(link.length_m))
        out.append(LinkMotion(i, hub, tuple(lines), tip, ahead))
    return out


def _hub(
    structure: Structure,
    i: int,
    before: LinkMotion | None,
    own: Path,
    states: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> Frames:
    """The frame of link i's hub (Pb: of the sleeve's exit) on the link before it (1), (30)."""
    joint, still = structure.robot.links[i].joint, np.zeros(len(states[0]))
    base = Frames(still + 0j, still, still + 0j, still, still)
    tip = before.tip if before else base
    if joint.type == "R":
        hub = tip.turned(*own)
        if i in structure.windups:  # (109)
            hub = hub.turned(*(x[:, structure.windups[i]] for x in states))
        return hub.moved(joint.hub_radius_m) if joint.hub_radius_m else hub  # (112)
    if joint.type == "Pb":
        return tip.turned(joint.angle_rad)
    if before is None:
        return base.moved(*own).turned(joint.angle_rad)
    x = Path(*(a + b for a, b in zip(own, before.ahead, strict=True)))
    if before.lines:
        line = before.lines[0]
        return line.at(x.value / line.free.value, own[1:]).turned(joint.angle_rad)
    return before.hub.moved(*x).turned(joint.angle_rad)


def _line(
    piece: Piece,
    start: Frames,
    hub: Frames,
    free: Path,
    y: tuple[np.ndarray, np.ndarray, np.ndarray],
    linear: bool,
) -> Lines:
    """The line of a piece that begins at `start` (2), (5); with `linear` (7) on the hub's frame."""
    angle, rate, more = (x @ piece.B.T for x in y)
    if not linear:
        e = np.exp(1j * (column(start.angle) + angle))
        spin, spin_rate = column(start.spin) + rate, column(start.spin_rate) + more
        return Lines(piece, start, free, e, 1j * spin * e, (1j * spin_rate - spin**2) * e, y)
    t, spin, spin_rate = column(hub.tangent), column(hub.spin), column(hub.spin_rate)
    angle, rate, more = (
        x + column(a) - column(b)
        for x, a, b in zip(
            (angle, rate, more),
            (start.angle, start.spin, start.spin_rate),
            (hub.angle, hub.spin, hub.spin_rate),
            strict=True,
        )
    )
    e = t * (1 + 1j * angle)
    rates = 1j * spin * e + 1j * t * rate
    bent = 1j * spin_rate * e + 1j * t * more - spin**2 * e - 2 * spin * rate * t
    return Lines(piece, start, free, e, rates, bent, y)


def column(x: Any) -> Any:
    """A value at each time (T,) as a column (T, 1); a constant stays."""
    return x[:, None] if np.ndim(x) else x


def mixed(weights: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Sums (T, S) of values (T, P) with weights (S, P), or (T, S, P)."""
    if weights.ndim == 2:
        return np.asarray(values @ weights.T)
    return np.einsum("tsp,tp->ts", weights, values)
