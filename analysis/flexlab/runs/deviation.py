"""The deviation of one run from another: second minus first, on one grid.

Both runs may be simulations, twins or experiments, with different time grids. The second is
interpolated linearly onto the first run's times within the range that both cover. Where either has
no value (NaN) there is no deviation (NaN): a gap in a measurement is neither bridged nor widened
beyond the intervals that touch it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from flexura.errors import InputError
from flexura.io import Run
from flexura.io.quantities import listed

TIP_DISTANCE = "tip_distance"  # the distance between the two tips [m]; not a channel of a Run
SLACK = 1e-9  # s: time stamps that differ by less are the same time
_COMPARED = re.compile(r"joint/\d+/position|link/\d+/tip_deflection|tip/[xy]")


@dataclass(frozen=True)
class Deviation:
    """The size of one channel's deviation.

    `max` and `rms` in `unit`; `peak` is the channel's largest magnitude in the first run (for
    `tip_distance`: the tip's largest distance from the base), to which `max_relative` and
    `rms_relative` (fractions) refer: NaN when it is 0. All are NaN when the runs have no common
    value.
    """

    channel: str
    unit: str
    max: float
    rms: float
    max_relative: float
    rms_relative: float
    peak: float


def deviation(first: Run, second: Run, channel: str) -> tuple[np.ndarray, np.ndarray]:
    """Second minus first: times (K,) [s] of the first run inside the common range, and values (K,)
    in the channel's unit.

    The channel `tip_distance` is the distance between both tips. K is 0 when the runs have no time
    in common. Raises InputError for a channel that either run lacks, or that has different units.
    """
    if channel == TIP_DISTANCE:
        t, dx = deviation(first, second, "tip/x")
        return t, np.hypot(dx, deviation(first, second, "tip/y")[1])
    for run, which in ((first, "first"), (second, "second")):
        if channel not in run:
            raise InputError(
                f"expected a channel of both runs; the {which} has: {listed(run)}",
                key="channel",
                value=channel,
            )
    if first.units[channel] != second.units[channel]:
        raise InputError(
            f"expected the same unit in both runs, not {first.units[channel]} and "
            f"{second.units[channel]}",
            key=channel,
        )
    inside = common(first, second)
    t = first.t[inside]
    return t, interpolate(t, second.t, second[channel]) - first[channel][inside]


def deviations(first: Run, second: Run, channels: Iterable[str] | None = None) -> list[Deviation]:
    """One row a channel; by default joint positions, tip deflections and the tip, as far as both
    runs have them."""
    return [
        _row(first, second, channel)
        for channel in (compared(first, second) if channels is None else channels)
    ]


def compared(first: Run, second: Run) -> list[str]:
    """The channels of the default comparison that both runs have in the same unit, in the first
    run's order; without any of them, all channels that both runs have so."""
    both = shared(first, second)
    usual = [name for name in both if _COMPARED.fullmatch(name)]
    return (usual or both) + ([TIP_DISTANCE] if {"tip/x", "tip/y"} <= set(usual) else [])


def shared(first: Run, second: Run) -> list[str]:
    """The channels that both runs have in the same unit, in the first run's order."""
    return [name for name in first if name in second and first.units[name] == second.units[name]]


def common(first: Run, second: Run) -> np.ndarray:
    """Which of the first run's times lie in the range of both, (T,) of bool."""
    if len(second) == 0:
        return np.zeros(len(first), dtype=bool)
    return (first.t >= second.t[0] - SLACK) & (first.t <= second.t[-1] + SLACK)


def interpolate(t: np.ndarray, known_t: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Linear interpolation at t (K,) of `known` (N,) at ascending `known_t` (N,); held beyond both
    ends.

    A NaN spreads over the two intervals that touch it and not onto their other ends (numpy.interp
    loses one of these).
    """
    t, known_t, known = (np.asarray(a, dtype=float) for a in (t, known_t, known))
    if len(known_t) < 2:
        return np.full(len(t), known[0] if len(known) else np.nan)
    left = np.clip(np.searchsorted(known_t, t, side="right") - 1, 0, len(known_t) - 2)
    span = known_t[left + 1] - known_t[left]
    share = np.clip((t - known_t[left]) / np.where(span > 0, span, 1.0), 0.0, 1.0)
    near = SLACK / np.where(span > SLACK, span, np.inf)
    between = known[left] + share * (known[left + 1] - known[left])
    return np.where(
        share <= near, known[left], np.where(share >= 1 - near, known[left + 1], between)
    )


def _row(first: Run, second: Run, channel: str) -> Deviation:
    _, values = deviation(first, second, channel)
    values = np.abs(values[np.isfinite(values)])
    own = np.hypot(first["tip/x"], first["tip/y"]) if channel == TIP_DISTANCE else first[channel]
    own = np.abs(own[np.isfinite(own)])
    peak = float(own.max()) if len(own) else float("nan")
    largest = float(values.max()) if len(values) else float("nan")
    rms = float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")
    unit = "m" if channel == TIP_DISTANCE else first.units[channel]
    scale = 1 / peak if peak > 0 else float("nan")
    return Deviation(channel, unit, largest, rms, largest * scale, rms * scale, peak)
