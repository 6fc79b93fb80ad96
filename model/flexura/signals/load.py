"""Loads: forces and moments that act on points of links during a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np

from ..errors import InputError
from ..io import Tables, choice, number, whole
from .conversion import FunctionSignal, SignalLike, as_signal, spline
from .kinds import constant
from .parsing import PLAUSIBLE, from_spec, is_plausible
from .signal import COLUMNS, Signal

FRAMES = ("base", "link")
KEYS = ("link", "at_m", "force_N", "moment_N_m", "frame")
EXPECTED = (
    "expected loads: a list of fx.Load, or of tables with the keys link, at_m, force_N, moment_N_m "
    "and frame"
)


@dataclass(frozen=True)
class Load:
    """A force and a moment on a point of a link (133), (134).

    link: its number, from 1. at_m: the place along it from its proximal end [m]; None: its tip.
    force_N: two components [N], each a number, a Signal, a function of time, or None. moment_N_m:
    the moment [N m], likewise. frame: "base": the force is along the base's x and y; "link": it is
    along and across the line at the place, and turns with it. Raises InputError for other
    arguments, and if it has neither a force nor a moment.
    """

    link: int
    at_m: float | None = None
    force_N: Sequence[SignalLike] | None = None
    moment_N_m: SignalLike = None
    frame: str = "base"

    def __post_init__(self) -> None:
        object.__setattr__(self, "link", whole(self.link, "link", 1))
        if self.at_m is not None:
            object.__setattr__(self, "at_m", number(self.at_m, "at_m"))
        choice(self.frame, "frame", FRAMES)
        given = self.force_N
        parts: tuple[Signal | None, ...] = (None, None)
        expected = "expected two components, along x and y: numbers, Signals or functions of time"
        if given is not None:
            if not isinstance(given, Sequence | np.ndarray) or isinstance(given, str | bytes):
                raise InputError(expected, key="force_N", value=given)
            if len(given) != 2:
                raise InputError(expected, key="force_N", value=len(given))
            parts = tuple(_bounded(part, f"force_N[{k}]") for k, part in enumerate(given, 1))
        object.__setattr__(self, "force_N", parts)
        object.__setattr__(self, "moment_N_m", _bounded(self.moment_N_m, "moment_N_m"))
        if all(signal is None for signal in self.signals):
            raise InputError("missing: expected a force_N or a moment_N_m", key="force_N")

    @property
    def signals(self) -> tuple[Signal | None, ...]:
        """The force's two components and the moment (3,); None: none."""
        parts: Any = (*(self.force_N or (None, None)), self.moment_N_m)
        return tuple(parts)

    def at(self, t: float) -> np.ndarray:
        """The force's components [N] and the moment [N m] at a time, in the load's own axes.

        Args:
            t: time [s].

        Returns:
            (3,).
        """
        return np.array([_value(signal, t) for signal in self.signals])

    def spec(self) -> Tables:
        """Its table of a manoeuvre file."""
        out: Tables = {"link": self.link}
        *force, moment = self.signals
        if self.at_m is not None:
            out["at_m"] = self.at_m
        if any(part is not None for part in force):
            out["force_N"] = [(part or constant(0.0)).spec for part in force]
        if moment is not None:
            out["moment_N_m"] = moment.spec
        return out | {"frame": self.frame}


def _bounded(value: SignalLike, key: str) -> Signal | None:
    """A signal, or a number within the bounds of a manoeuvre file."""
    made = as_signal(value, key)
    plain = made is not None and made is not value and not isinstance(made, FunctionSignal)
    if made is not None and plain and not is_plausible(made(0.0)[0]):
        raise InputError(f"expected {PLAUSIBLE}", key=key, value=value)
    return made


def _value(signal: Signal | None, t: float) -> float:
    if signal is None:
        return 0.0
    return signal.value(t) if isinstance(signal, FunctionSignal) else signal(t)[0]


@dataclass(frozen=True)
class Loads:
    """All loads of a run, on links whose lengths are known; `at_m` of each is a number."""

    each: tuple[Load, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.each)

    @property
    def signals(self) -> list[Signal]:
        """The signals that there are."""
        return [signal for load in self.each for signal in load.signals if signal is not None]

    @property
    def breaks(self) -> np.ndarray:
        """Instants at which a load isn't smooth, ascending [s]."""
        found = [signal.breaks for signal in self.signals]
        return np.unique(np.concatenate(found)) if found else np.zeros(0)

    @property
    def shortest_period(self) -> float:
        """The shortest period of the waves in the signals [s]; infinity without waves."""
        rows = np.concatenate([np.zeros((0, COLUMNS)), *(s.segments for s in self.signals)])
        w = np.abs(rows[rows[:, 7] != 0, 8]).max(initial=0.0)
        return 2 * np.pi / w if w > 0 else np.inf

    @property
    def rows(self) -> np.ndarray:
        """Where the loads act (L, 3): link from 0, abscissa [m], 1 for axes of the link."""
        rows = [(load.link - 1, load.at_m, float(load.frame == "link")) for load in self.each]
        return np.array(rows, dtype=float).reshape(-1, 3)

    def values(self, t: float) -> np.ndarray:
        """Forces [N] and moments [N m] at a time, in the loads' own axes.

        Args:
            t: time [s].

        Returns:
            (L, 3).
        """
        return np.array([load.at(t) for load in self.each]).reshape(-1, 3)

    def packed(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """`rows`, the ranges (L, 6) of their signals, and the segments (k, 10) of these, as the
        core takes them."""
        parts, ranges, row = [np.zeros((0, COLUMNS))], [], 0
        for load in self.each:
            own: list[int] = []
            for signal in load.signals:
                count = 0 if signal is None else len(signal.segments)
                parts += [] if signal is None else [signal.segments]
                own += [row, row + count]
                row += count
            ranges.append(own)
        index = np.array(ranges, dtype=np.int64).reshape(-1, 6)
        return self.rows, index, np.ascontiguousarray(np.concatenate(parts))

    def spec(self) -> list[Tables]:
        """Their tables of a manoeuvre file."""
        return [load.spec() for load in self.each]


LoadsLike: TypeAlias = Loads | Load | Tables | Sequence[Load | Tables] | None


def as_loads(value: LoadsLike, lengths: Sequence[float], start: float, end: float) -> Loads:
    """The loads of a run.

    Args:
        value: None, a Load, or a list of Loads or tables.
        lengths: of the robot's links [m].
        start: begin of the run [s].
        end: end of the run [s].

    Returns:
        The Loads. Functions of time are splines of fifth order.

    Raises:
        InputError: anything else, no such link, a place beyond its ends, a function that jumps.
    """
    if isinstance(value, Loads):
        value = value.each
    if value is None:
        return Loads()
    entries: Any = [value] if isinstance(value, Load | dict) else value
    if isinstance(entries, str | bytes) or not isinstance(entries, Sequence):
        raise InputError(EXPECTED, key="loads", value=value)
    return Loads(
        tuple(_on_link(entry, i, lengths, start, end) for i, entry in enumerate(entries, 1))
    )


def _on_link(entry: Any, i: int, lengths: Sequence[float], start: float, end: float) -> Load:
    key = f"load[{i}]"
    if isinstance(entry, dict):
        entry = load_from_table(entry, i)
    if not isinstance(entry, Load):
        raise InputError(EXPECTED, key="loads", value=entry)
    if entry.link > len(lengths):
        raise InputError(
            f"expected a link from 1 to {len(lengths)}", key=f"{key}.link", value=entry.link
        )
    length = lengths[entry.link - 1]
    at = length if entry.at_m is None else entry.at_m
    if not 0.0 <= at <= length * (1 + 1e-12):
        text = f"expected a place from 0 to the link's length, {length:g} m"
        raise InputError(text, key=f"{key}.at_m", value=at)
    return replace(splined(entry, i, start, end), at_m=min(at, length))


def splined(load: Load, i: int, start: float, end: float) -> Load:
    """A load whose functions of time are splines of fifth order.

    Args:
        load: the load.
        i: its number, from 1.
        start: begin of the run [s].
        end: end of the run [s].

    Returns:
        The Load.

    Raises:
        InputError: a function that jumps.
    """
    *parts, moment = load.signals
    force = tuple(_as_spline(part, f"load[{i}].force_N", start, end) for part in parts)
    moment = _as_spline(moment, f"load[{i}].moment_N_m", start, end)
    return replace(load, force_N=force, moment_N_m=moment)


def _as_spline(signal: Signal | None, key: str, start: float, end: float) -> Signal | None:
    """A function as a spline."""
    if not isinstance(signal, FunctionSignal):
        return signal
    try:
        return spline(replace(signal, key=key), start, end)
    except InputError as error:
        if "jumps" not in error.expected:
            raise
        text = (
            "expected a function without jumps in value and slope: give what jumps as a Signal, "
            "for example signals.step, piecewise or table"
        )
        raise InputError(text, key=key) from None


def load_from_table(entry: Any, i: int) -> Load:
    """A load from its table [[load]] of a manoeuvre file.

    Args:
        entry: the table.
        i: its number, from 1.

    Returns:
        The Load.

    Raises:
        InputError: an unknown or a wrong value; it names the key.
    """
    key = f"load[{i}]"
    if not isinstance(entry, dict):
        raise InputError("expected a table", key=key, value=entry)
    for name, value in entry.items():
        if name not in KEYS:
            text = f"an unknown key; known here: {', '.join(KEYS)}"
            raise InputError(text, key=f"{key}.{name}", value=value)
    if "link" not in entry:
        raise InputError("missing: expected the link's number, from 1", key=f"{key}.link")
    given = dict(entry)
    if isinstance(given.get("force_N"), Sequence) and not isinstance(given["force_N"], str):
        parts = enumerate(given["force_N"], 1)
        given["force_N"] = [_signal(part, f"{key}.force_N[{k}]") for k, part in parts]
    if "moment_N_m" in given:
        given["moment_N_m"] = _signal(given["moment_N_m"], f"{key}.moment_N_m")
    try:
        return Load(**given)
    except InputError as error:
        raise InputError(error.expected, key=f"{key}.{error.key}", value=error.value) from None


def _signal(value: Any, key: str) -> Any:
    """The table of a signal as a Signal; anything else as it is."""
    return from_spec(value, key=key) if isinstance(value, dict) else value
