"""Identification of any robot from runs of it: nonlinear least squares of channels.

    minimise sum_c sum_t ((y_c(t) - z_c(t; p)) / sigma_c)^2

over parameters p, with z what channel c reads in a simulation under the run's own inputs, and
sigma_c the RMS of what is left of it, found along. Derivatives are differences of simulations to a
tight tolerance. A phase has many local minima over many periods, over a few it has one: the search
begins with a grid of stiffnesses and a short part of the runs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx
from flexura.control import Gains, load_gains
from flexura.io.quantities import listed

from ...runs.of_robot import check_channels
from ..estimate import Estimate
from . import findings
from .inputs import MOTION, REFERENCE, choose
from .model import Experiment, active, default_channels, settings_of
from .search import Search
from .unknowns import (
    Unknown,
    check_once,
    of_channel,
    unknown_of_channel,
    unknown_of_robot,
)

GRID = np.exp(np.linspace(np.log(0.5), np.log(2.0), 29))  # 5 % of stiffness: 2.5 % of frequency
FIRST_PERIODS, LONGER = 6.0, 3.0
FEWEST = 16  # samples that count


@dataclass(frozen=True)
class Quantity:
    """One fitted parameter: the file's value, the estimate and its 95 % interval, which is NaN
    where the runs do not tell it."""

    name: str
    unit: str
    file: float
    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Identification:
    """What `identify_robot` has found.

    `nominal`, `robot`: as given, and with the estimates. `values`: of all parameters, the fixed
    ones included. `findings`: sentences. `residuals`: by channel the RMS of what is left, the
    noise, and the RMS by the channel's peak.
    """

    nominal: fx.Robot
    robot: fx.Robot
    quantities: tuple[Quantity, ...]
    values: dict[str, float]
    experiments: tuple[Experiment, ...]
    estimate: Estimate
    residuals: dict[str, dict[str, float]]
    findings: tuple[str, ...]

    def readings(self, run: fx.Run, *, identified: bool = True) -> dict[str, np.ndarray]:
        """What the channels of another run would have read.

        Args:
            run: a run with the same inputs and channels.
            identified: with the identified values, else with those of the file.

        Returns:
            Values (T,) by channel.
        """
        first = self.experiments[0]
        other = Experiment(
            run, first.inputs, first.channels, _span(run, None, None), first.controller
        )
        values = self.values
        if not identified:
            at = {q.name: q.file for q in self.quantities if np.isfinite(q.file)}
            values = {**values, **{key: x for key, x in at.items() if of_channel(key)[0] == ""}}
        return dict(zip(other.channels, other.readings(self.nominal, values), strict=True))

    def predict(self, run: fx.Run, *, identified: bool = True) -> dict[str, float]:
        """How far the simulation of another run is off, by channel.

        Args:
            run: a run with the same inputs and channels.
            identified: with the identified values, else with those of the file.

        Returns:
            RMS deviation by the channel's largest measured value.
        """
        out = {}
        for name, z in self.readings(run, identified=identified).items():
            y = run[name]
            there = np.isfinite(y)
            out[name] = _rms((z - y)[there]) / float(np.abs(y[there]).max())
        return out


def identify_robot(
    robot: Any,
    runs: fx.Run | Sequence[fx.Run],
    fit: Sequence[str] | Mapping[str, float | None],
    *,
    fix: Mapping[str, float] | None = None,
    inputs: Sequence[str] = (),
    channels: Sequence[str] = (),
    controller: str | Path | Gains | None = None,
    from_s: float | None = None,
    to_s: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Identification:
    """Fit parameters of a robot file, and of channels, to runs.

    Args:
        robot: a Robot, a System, or the path or name of a robot file.
        runs: one run or several, with the same channels. They begin at rest.
        fit: keys as in `Robot.replace`, and CHANNEL.gain, .offset, .delay_s, .cutoff_Hz or
            .cutoff_ratio; as a dictionary with values to begin with, None for the file's.
        fix: values of further keys, which are kept.
        inputs: the channel that moves a joint, as joint/1/drive, or 1:CHANNEL; by default the
            reference under a controller, else the measured position, else the drive.
        channels: what is compared; by default sensors, tip deflections and positions that are not
            prescribed.
        controller: gains file of the controller that was at work; its references are inputs.
        from_s: count from then on [s].
        to_s: count until then [s].
        progress: called with the finished fraction.

    Returns:
        The estimates with their intervals, and what contradicts.

    Raises:
        InputError: an unknown key or channel, a run without what is needed, or a simulation that
            does not come to its end.
    """
    described = fx.load(robot) if isinstance(robot, str | Path) else getattr(robot, "robot", robot)
    if not isinstance(described, fx.Robot):
        raise fx.InputError("expected a robot", key="robot", value=robot)
    every = [runs] if isinstance(runs, fx.Run) else list(runs)
    if not every:
        raise fx.InputError("expected a run or more", key="runs")
    asked = dict(fit) if isinstance(fit, Mapping) else dict.fromkeys(fit)
    fixed = dict(fix or {})
    check_once([*(fit if not isinstance(fit, Mapping) else asked), *fixed], "fit, fix")
    if not asked:
        raise fx.InputError("expected a key or more to fit", key="fit")
    gains = controller if isinstance(controller, Gains | None) else load_gains(controller)
    own = {key: value for key, value in fixed.items() if not of_channel(key)[0]}
    begun = {
        key: value for key, value in asked.items() if value is not None and not of_channel(key)[0]
    }
    base = described.replace(own) if own else described
    started = base.replace(begun) if begun else base
    experiments = tuple(
        _experiment(run, started, asked, fixed, inputs, channels, gains, (from_s, to_s))
        for run in every
    )
    unknowns = _unknowns(base, asked, experiments)
    search = Search(base, unknowns, fixed, experiments)
    search, found = _search(search, progress or (lambda fraction: None))
    return _concluded(described, unknowns, search, found)


def _experiment(
    run: fx.Run,
    robot: fx.Robot,
    asked: Mapping[str, Any],
    fixed: Mapping[str, float],
    inputs: Sequence[str],
    channels: Sequence[str],
    gains: Gains | None,
    span: tuple[float | None, float | None],
) -> Experiment:
    for key in ("loads", "payloads"):
        if run.meta.get(key):
            raise fx.InputError(
                "expected a run without loads and changing payloads: a fit does not simulate them",
                key=key,
                value=len(run.meta[key]),
            )
    check_channels(run, robot)
    chosen = choose(run, robot, inputs, gains)
    simulated = _channels(robot)
    compared = tuple(channels) or default_channels(run, simulated, chosen)
    for name in compared:
        for where, has in (("the run", list(run)), ("a simulation", simulated)):
            if name not in has:
                raise fx.InputError(
                    f"{where} has no such channel; it has {listed(has)}",
                    key="--channel",
                    value=name,
                )
        if not np.isfinite(run[name]).any():
            raise fx.InputError("expected finite values", key=f"channel {name}")
    if not compared:
        raise fx.InputError(
            "nothing to compare: expected a sensor, a tip deflection, a position or the tip's "
            f"place; the run has {listed(run)}",
            key="RUN",
        )
    starts = frozenset(key for key in [*asked, *fixed] if ".start_" in key)
    out = Experiment(run, chosen, compared, _span(run, *span), gains, starts)
    if out.counted.sum() < FEWEST:
        raise fx.InputError(
            f"expected {FEWEST} samples or more between {out.span[0]:g} and {out.span[1]:g} s",
            key="samples",
            value=int(out.counted.sum()),
        )
    return out


def _channels(robot: fx.Robot) -> list[str]:
    """The channels of a simulation of this robot."""
    return list(fx.simulate(robot, [0.0], start="straight"))


def _span(run: fx.Run, low: float | None, high: float | None) -> tuple[float, float]:
    begin, end = float(run.t[0]), float(run.t[-1])
    first, last = begin if low is None else low, end if high is None else high
    if not (first < last and first < end and last > begin):
        raise fx.InputError(
            f"expected a part of the run, from {begin:.4g} to {end:.4g} s",
            key="from_s, to_s",
            value=f"{first:g} to {last:g} s",
        )
    return first, last


def _unknowns(
    robot: fx.Robot, asked: Mapping[str, float | None], experiments: Sequence[Experiment]
) -> tuple[Unknown, ...]:
    first = experiments[0]
    forces = {each.channel: each for each in first.inputs}
    units = fx.simulate(robot, [0.0], start="straight").units
    out = []
    for key, start in asked.items():
        channel, what = of_channel(key)
        if not channel:
            out.append(unknown_of_robot(robot, key, start))
            continue
        if channel not in first.channels and channel not in forces:
            known = ", ".join([*first.channels, *forces])
            raise fx.InputError(f"expected a channel that is used: {known}", key=key)
        unit = first.run.units[channel]
        size = float(np.nanstd(first.run[channel])) or 1.0
        if channel in forces and channel not in first.channels:
            given = forces[channel]
            if given.kind == REFERENCE or (what.startswith("cutoff")):
                raise fx.InputError("expected gain, offset or delay_s of a force", key=key)
            turns = robot.links[given.joint - 1].joint.type == "R"
            own = unit if given.kind == MOTION else "N m" if turns else "N"
            made = unknown_of_channel(key, start, own, size, unit)
        else:
            made = unknown_of_channel(key, start, unit, size, units[channel])
        out.append(made)
    return tuple(out)


def _search(search: Search, progress: Callable[[float], None]) -> tuple[Search, Estimate]:
    """Stages over longer and longer parts, the first from a grid of stiffnesses; measured motions
    with the smoothing that lets their noise move the estimates least."""
    first = search.first_frequency()
    starts = [active(each) for each in search.experiments]
    whole = max(
        each.span[1] - start for each, start in zip(search.experiments, starts, strict=True)
    )
    parts = []
    length = FIRST_PERIODS / first if first else whole
    while length < whole / 1.5:
        parts.append(length)
        length *= LONGER
    windows = [[start + length for start in starts] for length in parts] + [None]
    values = search.start
    if any(u.stiffness for u in search.unknowns):
        misfits = []
        for k, factor in enumerate(GRID):
            misfits.append(search.misfit(search.stiffer(values, factor), windows[0]))
            progress(0.3 * (k + 1) / len(GRID))
        values = search.stiffer(values, float(GRID[int(np.argmin(misfits))]))
    for k, window in enumerate(windows[:-1]):
        values = search.fit(values, window).values
        progress(0.3 + 0.4 * (k + 1) / len(windows))
    found = search.weighted_fit(values)
    if found.mostly_of_inputs.any() and not all(each.exact for each in search.experiments):
        other = search.smoother()
        again = other.weighted_fit(found.values)
        narrower = np.diag(again.covariance) / np.diag(found.covariance)
        if np.nansum(np.log(narrower)) < 0:
            search, found = other, again
    progress(1.0)
    return search, found


def _concluded(
    described: fx.Robot, unknowns: Sequence[Unknown], search: Search, found: Estimate
) -> Identification:
    told, idle = findings.told(found), findings.without_effect(found)
    # what nothing depends on stays as it is, and what the file does not have stays away
    kept = {u.name: u.file for u in unknowns if u.name in idle}
    values = {**search.fixed, **found.values}
    values = {**values, **{name: value for name, value in kept.items() if np.isfinite(value)}}
    quantities = []
    for u in unknowns:
        low, high = found.interval(u.name) if u.name in told else (np.nan, np.nan)
        edges = u.parameter.bounds
        low, high = max(low, min(edges)), min(high, max(edges))
        quantities.append(Quantity(u.name, u.unit, u.file, values[u.name], low, high))
    own = {
        key: value
        for key, value in values.items()
        if not of_channel(key)[0] and np.isfinite(kept.get(key, 0.0))
    }
    return Identification(
        described,
        described.replace(own) if own else described,
        tuple(quantities),
        values,
        search.experiments,
        found,
        search.residuals(values),
        tuple(findings.sentences(search, found, quantities)),
    )


def _rms(y: np.ndarray) -> float:
    return float(np.sqrt(np.mean(y**2)))


__all__ = ["Identification", "Quantity", "identify_robot", "settings_of"]
