"""What of the tip follows a path: its place in the plane, its polar angle, or its place along a
rail."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import InputError
from ...io.quantities import note_turns
from ...signals import FunctionSignal, Signal, as_signals
from ...system import System

ANGLE, PLACE, ALONG = "angle", "place", "along"


@dataclass(frozen=True)
class TipPath:
    """A path of the tip over time, at rest before its start and after its end [s].

    `kind`: "place", x and y [m]; "angle", the polar angle seen from the first joint's axis [rad];
    "along", the place along the first joint's rail, of direction `angle` [rad], from the base's
    origin [m]. `signals`: one of each number.
    """

    kind: str
    signals: tuple[Signal, ...]
    start: float
    end: float
    angle: float = 0.0

    def at(self, t: np.ndarray) -> np.ndarray:
        """The path (T, m) at times t (T,)."""
        inside = np.clip(t, self.start, self.end)
        one = [s.value if isinstance(s, FunctionSignal) else _value(s) for s in self.signals]
        distinct, back = np.unique(inside, return_inverse=True)
        return np.array([[f(float(x)) for f in one] for x in distinct])[back]

    @property
    def breaks(self) -> np.ndarray:
        """The path's ends and the instants between at which its acceleration jumps [s]."""
        found = [self.start, self.end]
        for signal in self.signals:
            inside = signal.breaks[(signal.breaks > self.start) & (signal.breaks < self.end)]
            if len(inside):
                before = np.array([signal(np.nextafter(t, -np.inf))[2] for t in inside])
                after = np.array([signal(t)[2] for t in inside])
                size = max(np.abs(before).max(), np.abs(after).max())
                found += inside[np.abs(after - before) > 1e-5 * size].tolist()
        return np.unique(found)

    def deviation(
        self, tip: np.ndarray, by_q: np.ndarray, wanted: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """How far tips (T, 2) are from the path `wanted` (T, m), and the derivative by q.

        Args: by_q (T, 2, n): the derivatives of the tips.

        Returns: deviations (T, m) [m or rad] and their derivatives (T, m, n).
        """
        if self.kind == PLACE:
            return tip - wanted, by_q
        if self.kind == ALONG:
            way = np.array([np.cos(self.angle), np.sin(self.angle)])
            return (tip @ way)[:, None] - wanted, np.einsum("i,tin->tn", way, by_q)[:, None]
        x, y = tip.T
        cosine, sine = np.cos(wanted[:, 0]), np.sin(wanted[:, 0])
        off = np.arctan2(y * cosine - x * sine, x * cosine + y * sine)
        across = np.stack([-y, x], axis=1) / (x * x + y * y)[:, None]
        return off[:, None], np.einsum("ti,tin->tn", across, by_q)[:, None]

    def metres(self, deviation: np.ndarray, tip: np.ndarray) -> np.ndarray:
        """The distance (T,) [m] that a deviation (T, m) is at the tips (T, 2)."""
        reach = np.hypot(*tip.T) if self.kind == ANGLE else 1.0
        return np.asarray(np.linalg.norm(deviation, axis=1) * reach)


def tip_path(system: System, t: np.ndarray, tip: Any) -> TipPath:
    """The path that a robot's tip is asked to follow at the times t (T,).

    Args: tip: one entry, or a pair for x and y: Signals, functions of time, numbers, or values
        (T,) at t.

    Raises: InputError: it is nothing of this, does not fit the robot's joints, or does not begin
    and end at rest.
    """
    if len(t) < 2:
        raise InputError("expected two times or more", key="t", value=t)
    kind, angle = output_kind(system)
    pair = kind == PLACE
    if isinstance(tip, str | bytes | dict | set) or pair != _is_pair(tip, t, pair):
        counted = "two entries, (x, y)" if pair else "one entry, not a pair"
        text = f"expected a path of {counted}: so many of the robot's joints can move"
        values = f"values of shape {tip.shape}" if isinstance(tip, np.ndarray) else tip
        shown = "a function" if callable(tip) else values
        raise InputError(text, key="tip", value=shown)
    signals = as_signals(list(tip) if pair else [tip], 2 if pair else 1, "tip", t)
    if any(s is None for s in signals):
        raise InputError("expected a path, not None", key="tip")
    path = TipPath(kind, tuple(s for s in signals if s), float(t[0]), float(t[-1]), angle)
    _check_rest(path)
    if kind == ANGLE:
        note_turns("polar angle of the tip", *(path.signals[0](float(at))[0] for at in t[[0, -1]]))
    return path


def output_kind(system: System) -> tuple[str, float]:
    """What of a robot's tip can follow a path: `kind` and `angle` of a TipPath.

    Raises: InputError: other than one or two of its joints can move.
    """
    joints = np.flatnonzero(~system.locked)
    if len(joints) == 2:
        return PLACE, 0.0
    first = system.robot.links[0].joint
    if len(joints) != 1 or joints[0] != 0:
        raise InputError(
            f"expected a robot of which two joints can move, or only the first, not "
            f"{[int(i) + 1 for i in joints]}: lock others (locked = true)",
            key="robot",
        )
    return (ANGLE, 0.0) if first.type == "R" else (ALONG, first.angle_rad * (first.type == "Pb"))


def _is_pair(tip: Any, t: np.ndarray, wanted: bool) -> bool:
    if isinstance(tip, Signal) or callable(tip) or not np.iterable(tip):
        return False
    entries = list(tip)
    return len(entries) == 2 and (wanted or len(t) != 2)


def _check_rest(path: TipPath) -> None:
    """Refuses a path that begins or ends with a velocity: the tip rests before and after."""
    span = path.end - path.start
    h = 1e-5 * span
    values = path.at(np.linspace(path.start, path.end, 101))
    size = np.ptp(values, axis=0).max()
    first, last = (path.at(np.array([x, x + h])) for x in (path.start, path.end - h))
    for name, two in (("begins", first), ("ends", last)):
        speed = np.abs(np.diff(two, axis=0)).max() / h
        if speed > 1e-2 * size / span:
            raise InputError(
                f"expected a path that begins and ends at rest; this one {name} with a velocity",
                key="tip",
                value=f"{speed:.4g} per second",
            )


def _value(signal: Signal) -> Any:
    return lambda t: signal(t)[0]
