"""Frames and lines of a chain with their columns: rates of place and angle by all unknowns.

Places are complex numbers x + iy in the base's axes, so that i turns a vector to the left.
n unknowns; P points of a line. Equations: docs/theory/mechanics.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..link.line import Piece


@dataclass(frozen=True)
class Frame:
    """A place and an angle that move with the robot (13).

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
    def tangent(self) -> complex:
        """The unit vector along the frame's x axis."""
        return complex(np.exp(1j * self.angle))


def base(n: int) -> Frame:
    """The frame of the base, which stands still."""
    return Frame(0j, 0.0, np.zeros(n, dtype=complex), np.zeros(n))


def turned(frame: Frame, angle: float, row: int | None = None) -> Frame:
    """The frame turned by an angle, which is the unknown `row` (None: a constant)."""
    turning = frame.turning.copy()
    if row is not None:
        turning[row] += 1.0
    return replace(frame, angle=frame.angle + angle, turning=turning)


def ahead(frame: Frame, x: float, rows: list[int], qd: np.ndarray) -> Frame:
    """The frame moved by x [m] along its x axis; the unknowns `rows` are summands of x."""
    t, spin = frame.tangent, frame.turning @ qd
    velocity = frame.velocity + 1j * x * t * frame.turning
    velocity[rows] += t
    rest = frame.rest + x * t * (1j * frame.rest_turning - spin**2) + 2j * t * spin * sum(qd[rows])
    return replace(frame, place=frame.place + x * t, velocity=velocity, rest=complex(rest))


@dataclass(frozen=True)
class Line:
    """A piece's line in a state: tangents e (P,), their columns E (P, n), and N (P,) (1), (2).

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
    N: np.ndarray
    q: np.ndarray
    qd: np.ndarray

    @property
    def rate(self) -> float:
        """d', the rate of the free length [m/s]."""
        return 0.0 if self.row is None else float(self.qd[self.row])


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
    """The line of a piece that begins at `start` (1); with `linear` (12) on the hub's frame `axis`."""
    angle = start.angle + piece.B @ q[own]
    columns = np.tile(start.turning, (piece.points, 1))
    columns[:, own] += piece.B
    if not linear:
        e = np.exp(1j * angle)
        N = e * (1j * start.rest_turning - (columns @ qd) ** 2)
        return Line(piece, start, own, free, row, e, 1j * e[:, None] * columns, N, q, qd)
    t, spin, bent = axis.tangent, axis.turning @ qd, columns - axis.turning
    e = t * (1 + 1j * (angle - axis.angle))
    E = 1j * e[:, None] * axis.turning + 1j * t * bent
    N = (
        e * (1j * axis.rest_turning - spin**2)
        - 2 * spin * t * (bent @ qd)
        + 1j * t * (start.rest_turning - axis.rest_turning)
    )
    return Line(piece, start, own, free, row, e, E, N, q, qd)


def station(line: Line, xi: float, slider: int | None = None) -> Frame:
    """The frame of a line at xi (11): of a material point, or of a slider at the unknown `slider`.

    d xi' = eta' + (1 - xi) d', so that a material point of a sleeved link runs through the mesh.
    """
    d, start = line.free, line.start
    w, l, dl, b, db, ddb = line.piece.tip if xi == 1.0 else line.piece.at(xi)
    flow = np.zeros(len(line.qd))
    if slider is not None:
        flow[slider] += 1.0
    if line.row is not None:
        flow[line.row] += 1.0 - xi
    run, spin = float(flow @ line.qd) / d, line.E @ line.qd
    y, yd = line.q[line.own], line.qd[line.own]

    velocity = start.velocity + d * w @ line.E + (l @ line.e) * flow
    turning = start.turning + (db @ y) / d * flow
    turning[line.own] += b
    if line.row is not None:
        velocity[line.row] += w @ line.e
    rest = (
        start.rest
        + d * w @ line.N
        + 2 * line.rate * (w @ spin)
        + d * run * (2 * l @ spin + run * (dl @ line.e))
    )
    rest_turning = start.rest_turning + run * (
        2 * db @ yd + run * ddb @ y - 2 * line.rate / d * (db @ y)
    )
    return Frame(
        complex(start.place + d * w @ line.e),
        float(start.angle + b @ y),
        velocity,
        turning,
        complex(rest),
        float(rest_turning),
    )
