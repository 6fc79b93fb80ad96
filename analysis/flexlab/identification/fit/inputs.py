"""How a run moves the model's joints: each joint has one channel of the run as its input.

A position is prescribed as it was measured. A reference is what a controller follows whose gains
are known. Any other channel is a force or torque, by its gain: the drive, a current, a voltage.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import flexura as fx
from flexura import signals
from flexura.control import Gains
from flexura.io.quantities import listed
from flexura.signals import COLUMNS, Signal

from ...comparison.replay.smoothing import (
    from_rest,
    hermite,
    recorded_samples,
    resolution,
    smoothed,
    smoothing_spline,
)

MOTION, FORCE, REFERENCE = "motion", "force", "reference"
_GIVEN = re.compile(r"(?:(\d{1,3}):)?(.+)")
_OF_JOINT = re.compile(r"joint/(\d{1,3})/(\w+)")
SLOW = 0.05  # of a joint's fastest rate: less is at rest
_MEDIAN = 0.674490  # the median's size, by the standard deviation


@dataclass(frozen=True)
class Input:
    """What moves joint `joint` (from 1): a channel, as MOTION, FORCE or REFERENCE."""

    joint: int
    channel: str
    kind: str


def choose(
    run: fx.Run, robot: fx.Robot, asked: Sequence[str], controller: Gains | None
) -> tuple[Input, ...]:
    """The inputs of all joints that are not locked.

    Args:
        run: the run.
        robot: the robot.
        asked: channels as joint/1/drive, or 1:CHANNEL for one that does not name its joint.
        controller: gains, for references.

    Returns:
        One a joint. Without a wish: the reference under a controller, else the measured position,
        else the drive.

    Raises:
        InputError: a channel is missing, or is none for a joint.
    """
    found: dict[int, Input] = {}
    for text in asked:
        joint, channel = _parsed(text, len(robot.links))
        if channel not in run:
            raise _missing(run, channel, "--input")
        if joint in found:
            raise fx.InputError(f"expected one input of joint {joint}", key="--input", value=text)
        found[joint] = Input(joint, channel, _kind(robot, joint, channel, controller))
    for i, link in enumerate(robot.links, 1):
        if i in found or link.joint.locked:
            continue
        names = ["reference"] if controller else ["position", "drive"]
        if not controller and link.joint.transmission is not None:
            names[0] = "motor_position"
        channel = next((f"joint/{i}/{n}" for n in names if f"joint/{i}/{n}" in run), "")
        if not channel:
            raise fx.InputError(
                f"nothing moves joint {i}: expected a channel joint/{i}/{names[0]}, or --input; "
                f"the run has {listed(run)}",
                key="RUN",
            )
        found[i] = Input(i, channel, _kind(robot, i, channel, controller))
    return tuple(found[i] for i in sorted(found))


def _parsed(text: str, joints: int) -> tuple[int, str]:
    match = _GIVEN.fullmatch(text)
    assert match is not None or not text
    number, channel = match.groups() if match else (None, "")
    own = _OF_JOINT.fullmatch(channel)
    joint = int(number or (own.group(1) if own else 0))
    if not 1 <= joint <= joints:
        raise fx.InputError(
            f"expected joint/N/NAME, or N:CHANNEL with N from 1 to {joints}",
            key="--input",
            value=text,
        )
    return joint, channel


def _kind(robot: fx.Robot, joint: int, channel: str, controller: Gains | None) -> str:
    own = _OF_JOINT.fullmatch(channel)
    name = own.group(2) if own else ""
    elastic = robot.links[joint - 1].joint.transmission is not None
    if name == "motor_position" or (name == "position" and not elastic):
        return MOTION
    if name == "position":
        raise fx.InputError(
            f"expected joint/{joint}/motor_position: behind a transmission the motor is moved",
            key="--input",
            value=channel,
        )
    if name == "reference":
        if controller is None:
            raise fx.InputError("expected together with --controller", key="--input", value=channel)
        return REFERENCE
    return FORCE


def _missing(run: fx.Run, channel: str, key: str) -> fx.InputError:
    return fx.InputError(
        f"the run has no such channel; it has {listed(run)}", key=key, value=channel
    )


def force_unit(robot: fx.Robot, joint: int) -> str:
    """The unit of a joint's drive, by its number from 1."""
    return "N m" if robot.links[joint - 1].joint.type == "R" else "N"


def wave(run: fx.Run, given: Input, smoother: bool = False) -> Signal:
    """A run's channel as a signal: motions smoothed, forces as splines, references from sample to
    sample.

    Args:
        run: the run.
        given: the channel, and what it is.
        smoother: smooth a motion as far as its noise allows, which blurs fast parts; else as far
            as cross-validation finds, which leaves more noise at rest. A quantised motion is
            smoothed as far as its quantisation in either case.

    Raises:
        InputError: the channel has too few samples.
    """
    t, y = recorded_samples(run.t, run[given.channel], given.channel)
    if given.kind == MOTION:
        rates = exact_rates(run, given)
        if rates is not None:
            return hermite(t, y, rates)
        if resolution(y):
            return from_rest(smoothing_spline(t, y))
        step = noise(y) * np.sqrt(12)
        return from_rest(smoothing_spline(t, y, step) if smoother else smoothed(t, y))
    if held := _hold_s(run, given, t):
        return _steps(t, y, held)
    if given.kind == FORCE:
        return signals.table(t, y)
    rows = np.zeros((len(t), COLUMNS))
    rows[:, 0], rows[:, 1], rows[:-1, 2] = t, y, np.diff(y) / np.diff(t)
    return Signal(rows, {"kind": "linear", "t_s": t.tolist(), "y": y.tolist()})


def exact_rates(run: fx.Run, given: Input) -> np.ndarray | None:
    """The rates (k,) of a motion's samples, where a simulation recorded them beside positions
    without noise; else None.

    A spline of the positions alone begins with a rate that the joint did not have: one that is
    released moves at its rate within less than a sample.
    """
    name = given.channel.replace("position", "velocity")
    if given.kind != MOTION or run.meta.get("source") != "simulation" or name not in run:
        return None
    t, y = recorded_samples(run.t, run[given.channel], given.channel)
    rates = run[name][np.isfinite(run[given.channel])]
    if not np.isfinite(rates).all():
        return None
    # what positions and rates differ by, and what the rates' curvature leaves room for
    off = np.abs(np.diff(y) - np.diff(t) * (rates[1:] + rates[:-1]) / 2)
    room = np.median(np.diff(t)) * np.median(np.abs(np.diff(rates, 2)))
    return rates if np.median(off) <= room + 1e-9 * np.ptp(y) else None


def rate_at_start(run: fx.Run, given: Input) -> float:
    """The rate with which a joint moves at once; 0 if it begins at rest as far as the run tells.

    Where a simulation did not record the rate, it is that between the first samples of a motion, if
    it is more than their noise and more than SLOW of the fastest.
    """
    name = f"joint/{given.joint}/velocity"
    if run.meta.get("source") == "simulation" and name in run:
        rates = run[name][np.isfinite(run[name])]
        moves = len(rates) and abs(rates[0]) > SLOW * np.abs(rates).max()
        return float(rates[0]) if moves else 0.0
    if given.kind != MOTION:
        return 0.0
    t, y = recorded_samples(run.t, run[given.channel], given.channel)
    rates = np.diff(y) / np.diff(t)
    least = max(6 * noise(y), 2 * resolution(y))
    fast = abs(rates[0]) > SLOW * np.abs(rates).max() and abs(y[1] - y[0]) > least
    return float(rates[0]) if fast else 0.0


def _hold_s(run: fx.Run, given: Input, t: np.ndarray) -> float:
    """For how long a sampled controller of flexura held this drive [s]; 0: it is continuous."""
    own = run.meta.get("drive")
    rate = own.get("rate_Hz", 0.0) if isinstance(own, dict) else 0.0
    drive = given.kind == FORCE and given.channel == f"joint/{given.joint}/drive"
    return 1 / rate if rate and drive and len(t) > 1 else 0.0


def _steps(t: np.ndarray, y: np.ndarray, held_s: float) -> Signal:
    """A drive that is held: exact where each tick has a sample; where samples are further apart,
    the curve through them, later by half a tick."""
    if np.median(np.diff(t)) > 1.001 * held_s:
        through = signals.table(t, y)
        rows = through.segments.copy()
        rows[:, 0] += held_s / 2
        return Signal(rows, through.spec)
    rows = np.zeros((len(t), COLUMNS))
    rows[:, 0], rows[:, 1] = t, y
    return Signal(rows, {"kind": "piecewise", "at_s": t.tolist(), "value": y.tolist()})


def misread(run: fx.Run, given: Input, motion: Signal, seed: int) -> np.ndarray:
    """What the channel of a motion might have read, had the joint moved on its smoothed motion.

    Args:
        run: the run.
        given: a MOTION.
        motion: its smoothed motion, `wave`.
        seed: of the noise.

    Returns:
        Values (T,), NaN where the channel has none.
    """
    y, random = run[given.channel], np.random.default_rng(seed)
    there = np.isfinite(y)
    out, step = np.full(len(y), np.nan), resolution(y[there])
    smooth = np.array([motion(at)[0] for at in run.t[there]])
    if step:
        phase = random.uniform(0, step)
        out[there] = step * np.round((smooth + phase) / step) - phase
    else:
        out[there] = smooth + random.normal(0.0, noise(y), int(there.sum()))
    return out


def noise(y: np.ndarray) -> float:
    """The standard deviation of a white noise in values (T,) of a smooth quantity, from their
    differences: of the order that leaves least of the quantity itself."""
    y = y[np.isfinite(y)]
    orders = range(3, min(9, len(y) - 4))
    return min(
        (
            float(np.median(np.abs(np.diff(y, k))) / (_MEDIAN * np.sqrt(math.comb(2 * k, k))))
            for k in orders
        ),
        default=0.0,
    )
