"""One run beside the robot's simulation under the same inputs: what channels would have read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

import flexura as fx
from flexura.control import Gains
from flexura.signals import JointDrive, Signal

from ...comparison.replay.smoothing import MIN_SAMPLES
from .inputs import FORCE, MOTION, REFERENCE, Input, exact_rates, misread, noise, wave
from .unknowns import CUTOFF_RATIO, of_channel

RTOL = 1e-7
KEPT = 3  # simulations of a run that are at hand
AT_START = 4.0  # standard deviations of its noise that a joint may be off the file's start
PLAIN = {"gain": 1.0, "offset": 0.0, "delay_s": 0.0, "cutoff_Hz": 0.0, "cutoff_ratio": CUTOFF_RATIO}


@dataclass(frozen=True)
class Experiment:
    """A run that parameters are fitted to.

    `channels`: those that are compared. `span`: from and to when [s]. `started`: names of keys that
    say where joints start; the run's first positions stand in for others. `smoother`: as in `wave`.
    `moved_by`: has the inputs in place of the run.
    """

    run: fx.Run
    inputs: tuple[Input, ...]
    channels: tuple[str, ...]
    span: tuple[float, float]
    controller: Gains | None = None
    started: frozenset[str] = frozenset()
    smoother: bool = False
    moved_by: fx.Run | None = None
    _cache: dict[tuple[tuple[str, float], ...], fx.Run] = field(default_factory=dict)

    @cached_property
    def measured(self) -> np.ndarray:
        """Values of the channels, (channels, T)."""
        return np.array([self.run[name] for name in self.channels])

    @cached_property
    def counted(self) -> np.ndarray:
        """Which of them count, (channels, T): those inside the span that are no dropouts."""
        t = self.run.t
        return np.isfinite(self.measured) & (t >= self.span[0]) & (t <= self.span[1])

    @cached_property
    def waves(self) -> dict[int, Signal]:
        """The inputs as signals, by joint from 1."""
        run = self.run if self.moved_by is None else self.moved_by
        return {each.joint: wave(run, each, self.smoother) for each in self.inputs}

    def misread(self, seed: int) -> Experiment | None:
        """The same under motions as they might have been measured; None: none has noise."""
        motions = [each for each in self.inputs if each.kind == MOTION]
        moved = [each for each in motions if exact_rates(self.run, each) is None]
        if not moved:
            return None
        read = {
            each.channel: misread(self.run, each, self.waves[each.joint], seed) for each in moved
        }
        other = replace(self.run, channels={**self.run.channels, **read})
        return replace(self, moved_by=other, _cache={})

    @property
    def exact(self) -> bool:
        """Whether no joint is prescribed by a motion that has noise."""
        return all(
            exact_rates(self.run, each) is not None for each in self.inputs if each.kind == MOTION
        )

    def coarser(self) -> Experiment | None:
        """The same under motions of which every second sample is known; None: none is prescribed,
        or too few are."""
        moved = [each.channel for each in self.inputs if each.kind == MOTION]
        known = {}
        for name in moved:
            known[name] = self.run[name].copy()
            there = np.flatnonzero(np.isfinite(known[name]))
            if len(there) < 2 * MIN_SAMPLES + 2:
                return None
            known[name][there[1:-1:2]] = np.nan
        if not moved:
            return None
        other = replace(self.run, channels={**self.run.channels, **known})
        return replace(self, moved_by=other, _cache={})

    def simulate(
        self, robot: fx.Robot, values: Mapping[str, float], end: float | None = None
    ) -> fx.Run:
        """The robot under the run's inputs.

        Args:
            robot: the robot, without `values`.
            values: of the unknowns, by name.
            end: until then; None: the whole run [s].

        Returns:
            The Run, perhaps an incomplete one. The last few are kept.
        """
        last = self.span[1] if end is None else min(end, self.span[1])
        t = self.run.t[: max(int(np.searchsorted(self.run.t, last, side="right")), 2)]
        inputs = {each.channel for each in self.inputs}
        acting = {
            key: value
            for key, value in values.items()
            if not of_channel(key)[0] or of_channel(key)[0] in inputs
        }
        key = (("t", float(len(t))), *sorted(acting.items()))
        if key not in self._cache:
            while len(self._cache) >= KEPT:
                self._cache.pop(next(iter(self._cache)))
            own = {key: value for key, value in acting.items() if not of_channel(key)[0]}
            made = robot.replace(self.starts(robot) | own)
            system, drive = fx.assemble(made), self._drive(made, acting)
            straight = "straight" if self.run.meta.get("start") == "straight" else None
            self._cache[key] = fx.simulate(
                system, t, drive, rtol=RTOL, start=straight
            ).uninterrupted()
        return self._cache[key]

    def starts(self, robot: fx.Robot) -> dict[str, float]:
        """Where joints start by the run, by key: those that forces move, and that are not where the
        file says."""
        out = {}
        for each in self.inputs:
            joint = robot.links[each.joint - 1].joint
            key = f"link.{each.joint}.joint.{joint.key('start')}"
            channel = f"joint/{each.joint}/position"
            if each.kind == MOTION or key in self.started or channel not in self.run:
                continue
            y = self.run[channel]
            y = y[np.isfinite(y)]
            if len(y) and abs(y[0] - joint.start) > max(AT_START * noise(y), 1e-9):
                out[key] = float(y[0])
        return out

    def _drive(self, robot: fx.Robot, values: Mapping[str, float]) -> fx.Drive | fx.Controller:
        joints, references = [JointDrive() for _ in robot.links], []
        for each in self.inputs:
            signal = self.waves[each.joint]
            settings = settings_of(each.channel, values)
            if each.kind == REFERENCE:
                references.append(signal)
                continue
            signal = _changed(signal, settings)
            joints[each.joint - 1] = (
                JointDrive(motion=signal, prescribed=True)
                if each.kind == MOTION
                else JointDrive(force=signal)
            )
        if self.controller is not None:
            return self.controller.controller(references)
        return fx.Drive(tuple(joints))

    def readings(
        self, robot: fx.Robot, values: Mapping[str, float], end: float | None = None
    ) -> np.ndarray:
        """What the channels would have read, (channels, T); NaN after a simulation's end.

        Args:
            robot: the robot, without `values`.
            values: of the unknowns, by name.
            end: as in `simulate`.
        """
        run = self.simulate(robot, values, end)
        out = np.full(self.measured.shape, np.nan)
        for k, name in enumerate(self.channels):
            out[k, : len(run)] = read(run.t, run[name], settings_of(name, values))
        return out


def settings_of(channel: str, values: Mapping[str, float]) -> dict[str, float]:
    """What a channel does to its quantity, by these values."""
    own = {of_channel(key)[1]: x for key, x in values.items() if of_channel(key)[0] == channel}
    return PLAIN | own


def _changed(signal: Signal, settings: Mapping[str, float]) -> Signal:
    """An input by its gain, offset and delay: the force is gain (reading(t + delay) - offset)."""
    gain, offset, late = settings["gain"], settings["offset"], settings["delay_s"]
    if (gain, offset, late) == (1.0, 0.0, 0.0):
        return signal
    rows = signal.segments.copy()
    rows[:, 0] -= late
    rows[:, 1] -= offset
    rows[:, 1:8] *= gain
    return Signal(rows, signal.spec)


def read(t: np.ndarray, y: np.ndarray, settings: Mapping[str, float]) -> np.ndarray:
    """What a channel reads of a quantity: filtered, late, by gain and offset.

    Args:
        t: times (T,) [s].
        y: the quantity (T,), at rest before.
        settings: gain, offset, delay_s, cutoff_Hz (0: no filter), cutoff_ratio.

    Returns:
        Readings (T,).
    """
    if settings["cutoff_Hz"]:
        y = low_pass(t, y, settings["cutoff_Hz"], settings["cutoff_ratio"])
    late = settings["delay_s"]
    if late and len(t) > 3:
        from scipy.interpolate import CubicSpline

        y = CubicSpline(t, y)(np.clip(t - late, t[0], t[-1]))
    return np.asarray(settings["gain"] * y + settings["offset"])


def low_pass(t: np.ndarray, y: np.ndarray, cutoff_Hz: float, ratio: float) -> np.ndarray:
    """A filter of second order z'' + 2 zeta omega z' + omega^2 z = omega^2 y.

    Exact for a y that is straight between samples.

    Args:
        t: ascending times (T,) [s].
        y: values (T,).
        cutoff_Hz: omega / 2 pi.
        ratio: zeta.

    Returns:
        z (T,), at rest at first.
    """
    from scipy.signal import cont2discrete, lfilter, ss2tf

    if len(t) < 2:
        return y
    w = 2 * np.pi * cutoff_Hz
    A = np.array([[0.0, 1.0], [-w * w, -2 * ratio * w]])
    system = (A, np.array([[0.0], [w * w]]), np.array([[1.0, 0.0]]), np.zeros((1, 1)))
    count = len(t)
    even = np.linspace(t[0], t[-1], count)
    *made, _ = cont2discrete(system, (t[-1] - t[0]) / (count - 1), method="foh")
    above, below = ss2tf(*made)
    out = lfilter(above[0], below, np.interp(even, t, y) - y[0])
    return np.asarray(np.interp(t, even, out) + y[0])


def default_channels(
    run: fx.Run, simulated: Sequence[str], inputs: Sequence[Input]
) -> tuple[str, ...]:
    """The channels that are compared without a wish: sensors, tip deflections, and positions of
    joints that are not prescribed; else the tip's place."""
    moved = {f"joint/{each.joint}/" for each in inputs if each.kind == MOTION}
    used = {each.channel for each in inputs}
    both = [name for name in run if name in simulated and name not in used]
    chosen = [
        name
        for name in both
        if name.startswith("sensor/")
        or name.endswith("/tip_deflection")
        or (
            name.endswith(("/position", "/motor_position"))
            and not any(name.startswith(joint) for joint in moved)
        )
    ]
    chosen = [name for name in chosen if np.isfinite(run[name]).any()]
    return tuple(chosen or [name for name in ("tip/x", "tip/y") if name in both])


def active(experiment: Experiment) -> float:
    """When something happens first in a run: a channel has moved by a twentieth of its range
    [s]."""
    first = []
    for y in experiment.measured:
        moved = np.abs(y - y[np.isfinite(y)][0]) > 0.05 * np.nanmax(np.abs(y - np.nanmean(y)))
        first.append(int(np.argmax(moved)))
    return float(experiment.run.t[min(first)])


__all__ = ["FORCE", "MOTION", "REFERENCE", "Experiment", "active", "default_channels", "read"]
