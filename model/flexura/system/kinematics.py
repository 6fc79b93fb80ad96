"""Frames and lines of a chain with their columns: rates of place and angle by all unknowns.

Places are complex numbers x + iy in the base's axes, so that i turns a vector to the left.
n unknowns; P points of a line. Equations: docs/theory/01-kinematics.md.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike

from ..link.line import Piece


class Frame(NamedTuple):
    """A place and an angle that move with the robot (39).

    place [m], angle [rad]; velocity (n,) complex and turning (n,): columns of their rates; rest and
    rest_turning: their second derivatives at zero accelerations of the unknowns.
    """

    place: complex
    angle: float
    velocity: np.ndarray
    turning: np.ndarray
    rest: complex = 0j
    rest_turning: float = 0.0

    @property
    def tangent(self) -> Any:
        """The unit vector along the frame's x axis, a complex number."""
        return np.exp(1j * self.angle)


def base(n: int, kind: DTypeLike = float) -> Frame:
    """The frame of the base, which stands still; all that is built on it has numbers of this
    kind."""
    return Frame(0j, 0.0, np.zeros(n, np.result_type(kind, complex)), np.zeros(n, kind))


def rotate(frame: Frame, angle: float, row: int | None = None) -> Frame:
    """The frame turned by an angle, which is the unknown `row` (None: a constant)."""
    turning = frame.turning
    if row is not None:
        turning = turning.copy()
        turning[row] += 1.0
    return frame._replace(angle=frame.angle + angle, turning=turning)


def translate(frame: Frame, x: complex, rows: list[int], qd: np.ndarray) -> Frame:
    """The frame moved by x [m] along its x axis (by the imaginary part of x across it); the
    unknowns `rows` are summands of x."""
    t, spin = frame.tangent, frame.turning @ qd
    velocity = frame.velocity + (1j * x * t) * frame.turning
    for row in rows:
        velocity[row] += t
    rate = sum(qd[row] for row in rows)
    rest = frame.rest + x * t * (1j * frame.rest_turning - spin**2) + 2j * t * spin * rate
    return frame._replace(place=frame.place + x * t, velocity=velocity, rest=rest)


class Line(NamedTuple):
    """A piece's line in a state: tangents e (P,), their columns E (P, n), their rates e' = E q'
    (P,), and N (P,) (2), (5).

    N: second derivatives of e at zero accelerations of the unknowns.

    start: the frame at xi = 0. free [m]: the length d on which xi = s/d runs. row: the unknown that
    d is (None: constant). own: the slice of the piece's unknowns.
    """

    piece: Piece
    start: Frame
    own: slice
    free: float
    row: int | None
    e: np.ndarray
    E: np.ndarray
    rates: np.ndarray
    N: np.ndarray
    q: np.ndarray
    qd: np.ndarray

    @property
    def rate(self) -> Any:
        """d', the rate of the free length [m/s]."""
        return 0.0 if self.row is None else self.qd[self.row]


def line(
    piece: Piece,
    start: Frame,
    axis: Frame,
    own: slice,
    free: float,
    row: int | None,
    q: np.ndarray,
    qd: np.ndarray,
    linear: bool = False,
) -> Line:
    """The line of a piece that begins at `start`: a point on a bent link is the integral of its
    tangents (3), (5). With `linear` (7) it is on the hub's frame `axis`."""
    bent, bending = piece.B @ q[own], piece.B @ qd[own]
    spin = start.turning @ qd
    if not linear:
        e = np.exp(1j * (start.angle + bent))
        turn, left = spin + bending, 1j * e
        E = left[:, None] * start.turning
        E[:, own] += left[:, None] * piece.B
        N = e * (1j * start.rest_turning - turn**2)
        return Line(piece, start, own, free, row, e, E, left * turn, N, q, qd)
    t, hub = axis.tangent, axis.turning @ qd
    e = t + 1j * t * (start.angle - axis.angle + bent)
    E = (1j * e)[:, None] * axis.turning
    E[:, own] += 1j * t * piece.B
    bending += spin - hub
    N = e * (1j * axis.rest_turning - hub**2) - (2 * hub * t) * bending
    if start is not axis:
        E += 1j * t * (start.turning - axis.turning)
        N += 1j * t * (start.rest_turning - axis.rest_turning)
    return Line(piece, start, own, free, row, e, E, 1j * hub * e + 1j * t * bending, N, q, qd)


def station(line: Line, xi: float, slider: int | None = None) -> Frame:
    """The frame of a line at xi: a point on a bent link (3), (30), (31), of the material, or of a
    slider at the unknown `slider`.

    d xi' = eta' + (1 - xi) d': a material point of a sleeved link runs through the mesh.
    """
    d, start, y = line.free, line.start, line.q[line.own]
    w, l, dl, b, db, ddb = line.piece.tip if xi == 1.0 else line.piece.at(xi)
    reach = w @ line.e
    velocity, turning = start.velocity + d * (w @ line.E), start.turning.copy()
    turning[line.own] += b
    rest, rest_turning = start.rest + d * (w @ line.N), start.rest_turning
    moved = [] if slider is None else [(slider, 1.0)]
    if line.row is not None:
        velocity[line.row] += reach
        rest += 2 * line.rate * (w @ line.rates)
        moved += [(line.row, 1.0 - xi)] if xi < 1.0 else []
    if moved:
        tangent, curvature = l @ line.e, db @ y / d
        for row, share in moved:
            velocity[row] += share * tangent
            turning[row] += share * curvature
        run = sum(share * line.qd[row] for row, share in moved) / d
        rest += d * run * (2 * (l @ line.rates) + run * (dl @ line.e))
        rest_turning += run * (
            2 * (db @ line.qd[line.own]) + run * (ddb @ y) - 2 * line.rate * curvature
        )
    return Frame(
        start.place + d * reach, start.angle + b @ y, velocity, turning, rest, rest_turning
    )
