"""Trajectories to the board: motions in metres and radians as knots in its units, streamed ahead of
their time.

Knots are 2^period_log2 control ticks apart; the board joins set-points by cubics (position and
velocity at each knot) and holds each pair of open-loop drives for one period. A knot that is not
there in time is the fault `underrun`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .declaration import CONTROL_HZ, LOOKAHEAD_KNOTS, Flag, Mode, Result
from .session import Command, Link, Refused

FRACTION = 256  # set-points count in 1/256 of a count or microstep
VOLT_UNIT_V = 0.002  # voltages count in 2 mV
JOINTS = (1, 2)  # of the protocol
_SHARE = {"setpoints": 4, "drives": 8}  # knots in one command

# t [s] -> position, velocity, acceleration, as a flexura Signal
Function = Callable[[float], tuple[float, float, float]]


@dataclass(frozen=True)
class Knots:
    """What a trajectory's commands carry: the mode, the spacing, and one array of integers for each
    of the command's fields."""

    mode: Mode
    period_log2: int
    columns: dict[str, np.ndarray]

    @property
    def command(self) -> str:
        """The command that carries these knots."""
        return "setpoints" if self.mode is Mode.position else "drives"

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    @property
    def period_s(self) -> float:
        """Time between two knots [s]."""
        return 2**self.period_log2 / CONTROL_HZ


def _times(duration_s: float, period_log2: int) -> np.ndarray:
    period = 2**period_log2 / CONTROL_HZ
    return np.arange(int(np.ceil(duration_s / period - 1e-9)) + 1) * period


def setpoints(
    motions: Sequence[Function],
    duration_s: float,
    scales: Sequence[float],
    period_log2: int = 3,
) -> Knots:
    """Knots of the joints' motions from 0 to the duration, the last of them held.

    Args:
        motions: one a joint [m, rad]; a joint that is missing stays at 0.
        duration_s: end of the motions [s].
        scales: units of the board's set-points for 1 m or 1 rad, one a joint.
        period_log2: knots are 2^period_log2 ticks apart.
    """
    t = _times(duration_s, period_log2)
    columns = {}
    for number in JOINTS:
        r = v = np.zeros(len(t))
        if number <= len(motions):
            motion, scale = motions[number - 1], FRACTION * scales[number - 1]
            r, v, _ = np.array([motion(float(at)) for at in t]).T
            v[-1] = 0.0  # the last one is held
            r, v = scale * r, scale * v
        columns[f"position_{number}"] = np.round(r).astype(int)
        columns[f"velocity_{number}"] = np.round(v / CONTROL_HZ).astype(int)
    return Knots(Mode.position, period_log2, columns)


def drives(
    courses: Mapping[str, Callable[[float], float]], duration_s: float, period_log2: int = 3
) -> Knots:
    """Knots of what the drives get, each held for one period.

    Args:
        courses: "voltage" and "voltage_2" of motors [V], "rate" of a stepper [microstep/s]; what is
            missing is 0.
        duration_s: end of the profile [s].
        period_log2: knots are 2^period_log2 ticks apart.
    """
    t = _times(duration_s, period_log2)[:-1]
    columns = {}
    for name, unit in (("voltage", VOLT_UNIT_V), ("rate", 1.0), ("voltage_2", VOLT_UNIT_V)):
        course = courses.get(name, lambda at: 0.0)
        columns[name] = np.array([round(course(float(at)) / unit) for at in t], dtype=int)
    return Knots(Mode.open_loop, period_log2, columns)


class Player:
    """Streams knots to a board: `start`, then `run` until `done`."""

    def __init__(self, link: Link, knots: Knots) -> None:
        self.link, self.knots = link, knots
        self.sent = 0  # knots that the board has taken or is being asked to take
        self._asked: Command | None = None
        self._share = _SHARE[knots.command]
        self._room = 0
        self._report = 0  # number of the report that the room was taken from

    def start(self) -> None:
        """Arm, fill the look-ahead, start. Raises Refused when the board says no."""
        self.link.command("arm", mode=self.knots.mode)
        while self.sent < min(len(self.knots), LOOKAHEAD_KNOTS - self._share):
            self.link.command(self.knots.command, **self._next())
        self._report = self.link.counts.telemetry
        self.link.command("start", period_log2=self.knots.period_log2)

    def run(self, seconds: float) -> None:
        """Let time pass and keep the look-ahead filled. Raises Refused when the board takes no more
        set-points."""
        end = self.link.board.now() + seconds
        while (left := end - self.link.board.now()) > 1e-9:
            self.feed()
            self.link.run(min(0.002, left))

    def feed(self) -> None:
        """Queue the next knots, if the last ones were answered and there is room for more."""
        if self._asked is not None and self._asked.done:
            asked, self._asked = self._asked, None
            if (
                asked.result is Result.buffer_full
            ):  # the report that promised room was older than the last knots
                self.sent -= asked.values["count"]
                self._room = 0
            elif asked.result is not Result.ok:
                raise Refused(asked.name, asked.result or Result.ok, asked.detail)
        if self.link.counts.telemetry > self._report:
            self._report = self.link.counts.telemetry
            self._room = LOOKAHEAD_KNOTS - self.link.newest["buffered"]
        if self.sent < len(self.knots) and self._room >= self._share and self.link.idle:
            self._room -= self._share
            self._asked = self.link.submit(self.knots.command, **self._next())

    @property
    def done(self) -> bool:
        """The final knot is being held."""
        return self.sent == len(self.knots) and bool(self.link.newest["flags"] >> Flag.final & 1)

    def _next(self) -> dict[str, Any]:
        part = slice(self.sent, self.sent + self._share)
        values: dict[str, Any] = {
            name: column[part].tolist() for name, column in self.knots.columns.items()
        }
        count = len(self.knots.columns[next(iter(values))][part])
        first, self.sent = self.sent & 0xFFFF, self.sent + count
        return values | {"first": first, "count": count, "final": int(self.sent == len(self.knots))}
