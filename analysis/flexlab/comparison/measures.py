"""Measures of the deviation between simulation and experiment, as in the dissertation.

Largest deviations are relative to the simulation's peak.

**Response time**: from the start of execution (t = 0) until a joint variable has covered 90 % of
its largest distance from its start, each run by its own largest distance. The dissertation gives
deviations of the "response time" without a definition; this one holds for steps and for periodic
motions. It is unknown if a dropout hides the instant.

**Delay**: the shift in time by which the experiment fits the simulation best (least squares).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import flexura as fx
from flexura.errors import InputError
from flexura.io import called, kind
from flexura.io.quantities import listed

from ..runs.deviation import deviation, deviations, interpolate, shared

RESPONSE_LEVEL = 0.9  # of the largest distance, for the response time
LONGEST_DELAY_S = 0.25
# The dissertation's largest deviations of its rig, type IV [%] (Duong Xuan Bien, 2019, chapter 4).
PUBLISHED = {
    "forward": {"joint/1/position": 4.35, "joint/2/position": 7.5, "link/2/tip_deflection": 7.5},
    "inverse": {
        "joint/1/position": 8.3,
        "joint/2/position": 1.15,
        "link/2/tip_deflection": 11.5,
        "response": 17.8,
    },
}
_COMPARED = re.compile(r"joint/(\d+)/position|link/(\d+)/tip_deflection")
_JOINT = re.compile(r"joint/\d+/(motor_)?position")


@dataclass(frozen=True)
class Difference:
    """One quantity's deviation, experiment minus simulation, in `unit`.

    `peak` and relative values refer to the simulation's peak.
    """

    quantity: str
    channel: str
    unit: str
    peak: float
    max: float
    at_s: float
    rms: float
    max_relative: float
    rms_relative: float
    published_percent: float | None


@dataclass(frozen=True)
class ResponseTimes:
    """One joint's response times in both runs [s], their relative deviation, and the delay [s]."""

    quantity: str
    channel: str
    simulation_s: float
    experiment_s: float
    relative: float
    delay_s: float


@dataclass(frozen=True)
class Comparison:
    """Two runs and their deviations. `experiment` may be any second run.

    `lost`: samples of the experiment without a value in a compared channel.
    """

    simulation: fx.Run
    experiment: fx.Run
    differences: tuple[Difference, ...]
    responses: tuple[ResponseTimes, ...]
    lost: int  # samples of the experiment without a value in at least one compared channel

    @property
    def experiment_kind(self) -> str:
        """The dissertation's experiment: "forward", "inverse", or another; may be empty."""
        return str(self.experiment.meta.get("experiment", ""))

    @property
    def names(self) -> tuple[str, str]:
        """What both runs are called; the second has a number if it is called as the first."""
        first, second = called(self.simulation), called(self.experiment)
        return first, called(self.experiment, " 2") if second == first else second

    @property
    def worst_response(self) -> float:
        """The largest relative deviation of a response time; NaN if none is known."""
        found = [abs(r.relative) for r in self.responses if np.isfinite(r.relative)]
        return max(found, default=float("nan"))

    @property
    def published_response_percent(self) -> float | None:
        """The dissertation's deviation of the response time [%], or None."""
        return PUBLISHED.get(self.experiment_kind, {}).get("response")


def simulation_first(first: fx.Run, second: fx.Run) -> tuple[fx.Run, fx.Run]:
    """The two runs, the experiment last if exactly one of them is an experiment."""
    return (second, first) if kind(first) == "experiment" != kind(second) else (first, second)


def compare(
    simulation: fx.Run, experiment: fx.Run, channels: Sequence[str] | None = None
) -> Comparison:
    """Compare channels that both runs have.

    Args:
        simulation: the first run.
        experiment: the second run.
        channels: by default joint variables and tip displacements; without any in common, all
            channels that both runs have in one unit.

    Raises:
        InputError: the runs have no such channel in common.
    """
    names = list(channels or _usual(simulation, experiment))
    published = PUBLISHED.get(str(experiment.meta.get("experiment", "")), {})
    rows = []
    for row in deviations(simulation, experiment, names):
        t, values = deviation(simulation, experiment, row.channel)
        size = np.where(np.isfinite(values), np.abs(values), -1.0)
        at = float(t[size.argmax()]) if len(t) and size.max() >= 0 else float("nan")
        rows.append(
            Difference(
                quantity(row.channel),
                row.channel,
                row.unit,
                row.peak,
                row.max,
                at,
                row.rms,
                row.max_relative,
                row.rms_relative,
                published.get(row.channel),
            )
        )
    joints = [n for n in names if _JOINT.fullmatch(n)]
    gone = ~np.isfinite(np.array([experiment[n] for n in names])).all(axis=0)
    return Comparison(
        simulation,
        experiment,
        tuple(rows),
        tuple(_response(simulation, experiment, n) for n in joints),
        int(gone.sum()),
    )


def quantity(channel: str) -> str:
    """The name of a channel: `joint/1/position` is "joint variable 1"; others keep theirs."""
    found = _COMPARED.fullmatch(channel)
    if found is None:
        return channel
    return f"joint variable {found[1]}" if found[1] else f"tip displacement of link {found[2]}"


def _usual(first: fx.Run, second: fx.Run) -> list[str]:
    """Joint variables and tip displacements that both runs have, else all that both have."""
    both = shared(first, second)
    names = [name for name in both if _COMPARED.fullmatch(name)] or both
    if not names:
        raise InputError(
            f"expected two runs with a channel in common, in one unit; the first has: "
            f"{listed(first)}; the second: {listed(second)}",
            key="RUN",
        )
    return names


def _response(simulation: fx.Run, experiment: fx.Run, channel: str) -> ResponseTimes:
    first, second = (
        response_time(run.t, run[channel]) - _begin(run) for run in (simulation, experiment)
    )
    relative = second / first - 1 if first > 0 else float("nan")
    return ResponseTimes(
        quantity(channel),
        channel,
        first,
        second,
        relative,
        best_fit_delay(simulation, experiment, channel),
    )


def _begin(run: fx.Run) -> float:
    """The start of execution [s]: t = 0, or the first sample of a clock that began before."""
    return max(0.0, float(run.t[0])) if len(run) and "shift_s" not in run.meta else 0.0


def response_time(t: np.ndarray, y: np.ndarray) -> float:
    """Time at which |y - y(0)| first reaches RESPONSE_LEVEL of its largest value [s].

    Args:
        t: times (T,) [s].
        y: values (T,).

    Returns:
        NaN if y does not move, or if a dropout hides the instant.
    """
    there = np.isfinite(y)
    if not there.any():
        return float("nan")
    size = np.abs(y - y[there.argmax()])
    level = RESPONSE_LEVEL * size[there].max()
    beyond = size >= level  # a NaN is not
    k = int(beyond.argmax())
    if level == 0.0 or k == 0 or not there[k - 1]:
        return float("nan")
    return float(t[k - 1] + (t[k] - t[k - 1]) * (level - size[k - 1]) / (size[k] - size[k - 1]))


def best_fit_delay(simulation: fx.Run, experiment: fx.Run, channel: str) -> float:
    """Delay of the experiment: the tau that minimises sum (y_exp(t) - y_sim(t - tau))^2 [s].

    Returns:
        At most LONGEST_DELAY_S either way; NaN if nothing moves.
    """
    from scipy.optimize import minimize_scalar

    y, t, known = experiment[channel], experiment.t, simulation[channel]
    inside = (
        np.isfinite(y)
        & (t >= simulation.t[0] + LONGEST_DELAY_S)
        & (t <= simulation.t[-1] - LONGEST_DELAY_S)
    )
    if inside.sum() < 8 or np.ptp(y[inside]) == 0 or np.ptp(known) == 0:
        return float("nan")

    def left(tau: float) -> float:
        difference = y[inside] - interpolate(t[inside] - tau, simulation.t, known)
        return float(np.nanmean(difference**2))

    grid = np.linspace(-LONGEST_DELAY_S, LONGEST_DELAY_S, 101)
    near = grid[np.argmin([left(tau) for tau in grid])]
    step = grid[1] - grid[0]
    found = minimize_scalar(
        left, bounds=(near - step, near + step), method="bounded", options={"xatol": 1e-6}
    )
    return float(found.x)
