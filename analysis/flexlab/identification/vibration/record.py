"""The free vibration in a run: which channel rings, and from when on it is left alone."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

import flexura as fx
from flexura.errors import InputError
from flexura.io.quantities import listed

FEWEST = 32  # samples of a free vibration
# The first of these that a run has: the channel that rings, in the order of what tells most.
KINDS = (
    r"link/\d+/tip_deflection",
    r"sensor/.*",
    r"link/\d+/tip_slope",
    r"tip/[xy]",
    r"joint/\d+/(motor_position|position)",
    r".*",
)
COMMANDS = re.compile(r"joint/\d+/(reference|pulses|voltage)")
JOINTS = re.compile(r"joint/\d+/(motor_)?position")
LEVEL = 0.5  # of the largest swing: a record that begins beyond it begins free


@dataclass(frozen=True)
class Record:
    """A channel from an instant on: times (T,) [s] and values (T,) without gaps."""

    channel: str
    unit: str
    t: np.ndarray
    y: np.ndarray
    why: str

    @property
    def length(self) -> float:
        """From the first to the last sample [s]."""
        return float(self.t[-1] - self.t[0])


def record(
    run: fx.Run, channel: str | None = None, start: float | None = None, end: float | None = None
) -> Record:
    """The free vibration of a run.

    Args:
        run: any run.
        channel: by default the tip deflection, or else the sensor, that swings most.
        start: the first instant [s]; by default after the last command, from the largest swing on.
        end: the last instant [s]; by default the run's.

    Raises:
        InputError: no such channel, or too few samples.
    """
    name = _chosen(run) if channel is None else channel
    if name not in run:
        raise InputError(
            f"expected a channel of the run: {listed(run)}", key="--channel", value=name
        )
    there = np.isfinite(run[name])
    if end is not None:
        there &= run.t <= end
    if start is not None:
        there &= run.t >= start
        why = f"from {start:g} s on"
    else:
        last = _last_command(run, run.t[there][-1] if there.any() else 0.0)
        there &= run.t > last
        why = f"after the last command at {last:.4g} s" if np.isfinite(last) else "from the start"
    t, y = run.t[there], run[name][there]
    if start is None and len(y):
        first = _free(t, y)
        if first:
            why = f"from the largest swing at {t[first]:.4g} s on"
        t, y = t[first:], y[first:]
    if len(y) < FEWEST:
        until = "" if end is None else f" until {end:g} s"
        raise InputError(
            f"{len(y)} samples {why}{until}, of a run from {run.t[0]:.4g} to {run.t[-1]:.4g} s: "
            f"expected {FEWEST} of a free vibration or more",
            key=f"channel {name}",
        )
    if np.ptp(y) == 0:
        raise InputError("it does not move: expected a free vibration", key=f"channel {name}")
    return Record(name, run.units[name], t, y, why)


def _chosen(run: fx.Run) -> str:
    """The channel of the first kind that the run has; of several the one that swings most."""
    for kind in KINDS:
        swings = {
            name: _swing(values)
            for name, values in run.items()
            if re.fullmatch(kind, name) and not name.endswith("_std")
        }
        moving = {name: swing for name, swing in swings.items() if swing > 0}
        if moving:
            return max(moving, key=lambda name: moving[name])
    raise InputError("expected a run with a channel that moves", key="RUN", value=listed(run))


def _swing(values: np.ndarray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.std(finite[len(finite) // 4 :])) if len(finite) > 4 else 0.0


def _last_command(run: fx.Run, end: float) -> float:
    """When a set-point, pulses, a voltage or a joint that comes to rest last changed [s]; -inf if
    none does, or to the end."""
    last = -np.inf
    for name, values in run.items():
        least = 1e-3 if COMMANDS.fullmatch(name) else 1e-6 if JOINTS.fullmatch(name) else None
        if least is not None:
            step = np.abs(np.diff(values))
            moved = np.flatnonzero(step > least * np.nanmax(np.abs(values), initial=0.0))
            if len(moved) and run.t[moved[-1] + 1] < 0.8 * end:
                last = max(last, float(run.t[moved[-1] + 1]))
    return last


def _free(t: np.ndarray, y: np.ndarray) -> int:
    """The first sample of the free vibration: the first one if it rings from there, else that of
    the largest swing."""
    late = y[len(y) // 2 :]
    size = np.abs(y - np.median(late))
    beyond = int((size >= LEVEL * size.max()).argmax())
    step = float(t[-1] - t[0]) / (len(t) - 1)
    spectrum = np.abs(np.fft.rfft(y - y.mean()))
    period = len(y) / max(int(spectrum[1:].argmax()) + 1, 1) * step
    largest = int(size.argmax())
    free = beyond * step < 0.5 * period or len(y) - largest < FEWEST
    return 0 if free else largest
