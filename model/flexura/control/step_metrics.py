"""Metrics of a controlled motion, each with one definition (80), computed from samples by the core
for gain sweeps and Runs alike.

Of joint i, with r(t) its reference before any filter, D = r(end) - q(0) the distance that it is to
go, y = (q - q(0)) / D:

- rise [s]: from y = 10 % to y = 90 %, both crossed for the first time;
- settling [s]: time after which |y - 1| stays within 2 %;
- overshoot [1]: largest y - 1, not below 0;
- error [1]: |y - 1|, its mean over the last tenth of the time;
- itae [s^2]: int t |r - q| dt / |D|;
- effort [1]: int (u / limit)^2 dt / T, u the output as given; 0 where it has no limit.

Of the last flexible link, with w its tip deflection and b the instant at which the slowest joint
has settled, at the latest a fifth of the time before the end:

- peak [m]: largest |w - w(0)|;
- residual [m]: half of w's range from b on;
- vibration [m s^2]: int t |w - w(end)| dt, w(end) the mean over the last tenth: a lasting bend
  does not count;
- rms [m]: sqrt(int (w - w(end))^2 dt / T).

What never happens is NaN: the rise of a joint that doesn't arrive, settling of one that doesn't
settle.

Overshoot, ITAE and effort only grow with the samples, so that a run under way has a lower bound of
each. So has the vibration, whatever w(end) will be: int t |w - w(end)| dt >= min_c int_0^now t |w -
c| dt.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import core
from ..errors import InputError
from ..io import Run, number
from ..io.quantities import listed

RISE, SETTLING, OVERSHOOT, ERROR, ITAE, EFFORT = range(6)  # columns of a joint's figures
PEAK, RESIDUAL, VIBRATION, RMS = range(4)  # of the strip's
JOINT = ("rise_s", "settling_s", "overshoot", "error", "itae_s2", "effort")
STRIP = ("peak_m", "residual_m", "vibration_m_s2", "rms_m")


def joint_metrics(t: np.ndarray, r: np.ndarray, q: np.ndarray) -> np.ndarray:
    """The metrics of a joint (80).

    Args:
        t: times (T,) [s].
        r: unfiltered set-points (T,) [m or rad].
        q: positions (T,) [m or rad].

    Returns:
        Rise, settling, overshoot, error, ITAE, and an effort of 0 (6,).
    """
    return np.asarray(core.joint_metrics(*_flat(t, r, q)))


def strip_metrics(t: np.ndarray, w: np.ndarray, settled: float) -> np.ndarray:
    """The metrics of the last flexible link (80).

    Args:
        t: times (T,) [s].
        w: tip deflections (T,) [m].
        settled: when the slowest joint has settled [s]; may be NaN.

    Returns:
        Peak, residual, vibration and RMS (4,).
    """
    return np.asarray(core.strip_metrics(*_flat(t, w), settled))


def vibration_lower_bound(t: np.ndarray, w: np.ndarray, seen: int, enough: float) -> float:
    """A lower bound of a link's vibration from the first samples.

    It is raised until it is above `enough`, or certain not to come there.

    Args:
        t: times (T,) [s].
        w: tip deflections (T,) [m].
        seen: how many samples are known.
        enough: bound that suffices [m s^2].

    Returns:
        The bound [m s^2].
    """
    return float(core.vibration_lower_bound(*_flat(t, w), seen, enough))


def _flat(*samples: np.ndarray) -> list[np.ndarray]:
    return [np.ascontiguousarray(x, dtype=float) for x in samples]


@dataclass(frozen=True)
class StepResponse:
    """The figures of one run: `joints` (N, 6), `strip` (4,), NaN for a robot without a flexible
    link."""

    joints: np.ndarray
    strip: np.ndarray

    def numbers(self) -> dict[str, float | None]:
        """By name and unit, None for what never happened."""
        clean = lambda x: float(x) if np.isfinite(x) else None
        out = {
            f"joint_{i}_{n}": clean(x)
            for i, row in enumerate(self.joints, 1)
            for n, x in zip(JOINT, row, strict=True)
        }
        return out | {name: clean(x) for name, x in zip(STRIP, self.strip, strict=True)}


def step_response(
    run: Run, references: list[np.ndarray], limits: list[float], settled: float | None = None
) -> StepResponse:
    """The metrics of a Run without gaps (80).

    Args:
        run: the Run.
        references: the unfiltered set-points (T,), one a joint [m or rad].
        limits: of the outputs, one a joint.
        settled: instant from which the residual counts [s]; None: when the slowest joint has
            settled. Two runs are compared from the same instant on.

    Returns:
        The StepResponse.
    """
    joints, strip = np.full((len(references), len(JOINT)), np.nan), np.full(len(STRIP), np.nan)
    for i, (r, limit) in enumerate(zip(references, limits, strict=True), 1):
        joints[i - 1] = joint_metrics(run.t, r, run[f"joint/{i}/position"])
        joints[i - 1, EFFORT] = _effort(run, i, limit)
    bent = [name for name in run if name.endswith("tip_deflection")]
    if bent:
        slowest = float(joints[:, SETTLING].max()) if settled is None else settled
        strip = strip_metrics(run.t, run[bent[-1]], slowest)
    return StepResponse(joints, strip)


def step_figures(
    run: Run, channel: str, target: float | None = None, start: float | None = None
) -> dict[str, float | None]:
    """Rise, settling, overshoot and remaining error of a step in any Run, measured too (80).

    Args:
        run: any run; gaps are left out.
        channel: for example "joint/1/position".
        target: what is to be reached, in the channel's unit; by default the end of
            joint/i/reference if the run has it, else the mean of the last tenth of the time.
        start: when the step begins [s]; by default when joint/i/reference moves, else at 0, or at
            the first sample if that is later.

    Returns:
        rise_s, settling_s, overshoot [1], error [1]; None for what never happened.

    Raises:
        InputError: no such channel, a target or start that is no finite number, no two samples
            after the start, or nothing to go.
    """
    if channel not in run:
        raise InputError(
            f"expected a channel of the run: {listed(run)}", key="channel", value=channel
        )
    for key, value in (("target", target), ("start", start)):
        if value is not None:
            number(value, key)
    reference = run.channels.get(channel.replace("/position", "/reference"))
    asked = None if reference is None or not channel.endswith("/position") else reference
    there = np.isfinite(run[channel])
    t, q = run.t[there], run[channel][there]
    if len(t) and asked is not None and np.isfinite(asked[there]).all():
        r = asked[there]
        moved = np.flatnonzero(r != r[0])
        target = float(r[-1]) if target is None else target
        start = float(t[moved[0] - 1]) if start is None and len(moved) else start
    start = max(0.0, float(t[0])) if start is None and len(t) else start
    if len(t) < 2 or start is None or (t >= start).sum() < 2:
        raise InputError("expected two samples after the start", key="start", value=start)
    before = q[t <= start]
    first = float(before[-1]) if len(before) else float(q[0])
    t, q = t[t >= start] - start, q[t >= start].copy()
    q[0] = first
    if target is None:
        target = float(q[t >= 0.9 * t[-1]].mean())
    if target == first:
        raise InputError("expected a step: it ends where it begins", key="channel", value=channel)
    rise, settling, overshoot, error = joint_metrics(t, np.full(len(t), target), q)[:ITAE]
    found = zip(JOINT, (rise, settling, overshoot, error), strict=False)
    return {name: float(x) if np.isfinite(x) else None for name, x in found}


def _effort(run: Run, joint: int, limit: float) -> float:
    """From the voltage, the rate of the pulses, or the force, whichever the run has first."""
    if not np.isfinite(limit):
        return 0.0
    if f"joint/{joint}/pulses" in run:
        u = np.gradient(run[f"joint/{joint}/pulses"], run.t)
    else:
        u = run[f"joint/{joint}/{'voltage' if f'joint/{joint}/voltage' in run else 'drive'}"]
    return float(np.trapezoid((u / limit) ** 2, run.t) / (run.t[-1] - run.t[0]))
