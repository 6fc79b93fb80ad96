"""Figures of a controlled motion, each with one definition, from samples: compiled, for populations and for single Runs alike.

Of joint i, with r(t) its reference before any filter, D = r(end) - q(0) the distance that it is to go, y = (q - q(0)) / D:

    rise        time from y = 10 % to y = 90 %, both crossed for the first time [s]
    settling    time after which |y - 1| stays within 2 % [s]
    overshoot   largest y - 1, not below 0 [1]
    error       |y - 1|, its mean over the last tenth of the time [1]
    itae        int t |r - q| dt / |D| [s^2]
    effort      int (u / limit)^2 dt / T, u the output of the law as given; 0 where it has no limit [1]

and of the last flexible link, with w its tip deflection and b the instant at which the slowest joint has settled, at the latest a
fifth of the time before the end:

    peak        largest |w - w(0)| [m]
    residual    half of w's range from b on [m]
    vibration   int t |w - w(end)| dt [m s^2], w(end) the mean over the last tenth: what bends the link for good doesn't count
    rms         sqrt(int (w - w(end))^2 dt / T) [m]

What never happens is NaN: the rise of a joint that doesn't arrive, settling of one that doesn't settle.

Overshoot, ITAE and effort only grow with the samples, so that a run under way has a lower bound of each. So has the vibration,
whatever w(end) will be: int t |w - w(end)| dt >= min_c int_0^now t |w - c| dt.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .compiled import compiled, inlined
from .run import Run

LOW, HIGH, BAND = 0.1, 0.9, 0.02
RISE, SETTLING, OVERSHOOT, ERROR, ITAE, EFFORT = range(6)  # columns of a joint's figures
PEAK, RESIDUAL, VIBRATION, RMS = range(4)  # of the strip's
JOINT = ("rise_s", "settling_s", "overshoot", "error", "itae_s2", "effort")
STRIP = ("peak_m", "residual_m", "vibration_m_s2", "rms_m")


@compiled
def joint_figures(t: np.ndarray, r: np.ndarray, q: np.ndarray, out: np.ndarray) -> None:
    """A joint's figures but the effort, into out (6,), from samples t, r, q (T,)."""
    count, way, end = t.shape[0], r[-1] - q[0], t[-1] - t[0]
    low, high, settled, most, itae = np.nan, np.nan, 0.0, 0.0, 0.0
    error, late = 0.0, 0
    for k in range(count):
        y = (q[k] - q[0]) / way
        most = max(most, y - 1.0)
        if t[k] >= t[-1] - 0.1 * end:
            error += abs(y - 1.0)
            late += 1
        if k > 0:
            before, dt = (q[k - 1] - q[0]) / way, t[k] - t[k - 1]
            if np.isnan(low) and y >= LOW:
                low = t[k] - dt * (y - LOW) / (y - before)
            if np.isnan(high) and y >= HIGH:
                high = t[k] - dt * (y - HIGH) / (y - before)
            off, was = abs(y - 1.0), abs(before - 1.0)
            if off > BAND:
                settled = np.nan
            elif was > BAND:
                settled = t[k] - t[0] - dt * (BAND - off) / (was - off)
            a, b = (t[k - 1] - t[0]) * abs(r[k - 1] - q[k - 1]), (t[k] - t[0]) * abs(r[k] - q[k])
            itae += 0.5 * dt * (a + b)
    out[RISE], out[SETTLING], out[OVERSHOOT], out[ERROR], out[ITAE] = high - low, settled, most, error / late, itae / abs(way)


@compiled
def strip_figures(t: np.ndarray, w: np.ndarray, settled: float, out: np.ndarray) -> None:
    """The strip's figures into out (4,), from samples t, w (T,); `settled` [s] may be NaN."""
    count, end = t.shape[0], t[-1] - t[0]
    rest, late = 0.0, 0
    for k in range(count):
        if t[k] >= t[-1] - 0.1 * end:
            rest += w[k]
            late += 1
    rest /= late
    begin = 0.8 * end if np.isnan(settled) or settled > 0.8 * end else settled
    peak, least, most, vibration, square = 0.0, np.inf, -np.inf, 0.0, 0.0
    for k in range(count):
        peak = max(peak, abs(w[k] - w[0]))
        if t[k] - t[0] >= begin:
            least, most = min(least, w[k]), max(most, w[k])
        if k > 0:
            dt, a, b = t[k] - t[k - 1], w[k - 1] - rest, w[k] - rest
            vibration += 0.5 * dt * ((t[k - 1] - t[0]) * abs(a) + (t[k] - t[0]) * abs(b))
            square += 0.5 * dt * (a * a + b * b)
    out[PEAK], out[RESIDUAL], out[VIBRATION], out[RMS] = peak, 0.5 * (most - least), vibration, np.sqrt(square / end)


@compiled
def joint_so_far(t: np.ndarray, r: np.ndarray, q: np.ndarray, begin: int, end: int, out: np.ndarray) -> None:
    """Add the samples from `begin` to before `end` to a joint's overshoot and ITAE so far, in out (6,); r is known to its end."""
    way = r[-1] - q[0]
    for k in range(begin, end):
        out[OVERSHOOT] = max(out[OVERSHOOT], (q[k] - q[0]) / way - 1.0)
        if k > 0:
            a, b = (t[k - 1] - t[0]) * abs(r[k - 1] - q[k - 1]), (t[k] - t[0]) * abs(r[k] - q[k])
            out[ITAE] += 0.5 * (t[k] - t[k - 1]) * (a + b) / abs(way)


@compiled
def least_vibration(t: np.ndarray, w: np.ndarray, count: int, enough: float) -> float:
    """What the strip's vibration comes to at least, from its first `count` samples.

    g(c) = int t |w - c| dt is convex: the tangents on both sides of its least value meet below it. They are drawn nearer until
    the bound is above `enough` or g, and with it every bound, is not.
    """
    weight, moment, low, high = 0.0, 0.0, np.inf, -np.inf
    for k in range(count):
        own = _weight(t, k, count)
        weight += own
        moment += own * w[k]
        low, high = min(low, w[k]), max(high, w[k])
    if not high > low or weight == 0.0:
        return 0.0
    a, ga, sa, b, gb, sb = low, moment - weight * low, -weight, high, weight * high - moment, weight
    floor, blur = 0.0, 1e-9 * weight * (high - low)  # far more than the rounding of these sums
    for _ in range(12):
        c = (gb - ga + sa * a - sb * b) / (sa - sb)
        floor = ga + sa * (c - a) - blur
        g, slope = 0.0, 0.0
        for k in range(count):
            own, off = _weight(t, k, count), w[k] - c
            g += own * abs(off)
            slope -= own if off > 0.0 else -own
        if floor > enough or g <= enough or g - floor < 1e-3 * g:
            break
        if slope < 0.0:
            a, ga, sa = c, g, slope
        else:
            b, gb, sb = c, g, slope
    return max(floor, 0.0)


@inlined
def _weight(t: np.ndarray, k: int, count: int) -> float:
    """Of sample k of `count` in int t f(t) dt by the trapezoidal rule."""
    dt = (t[k] - t[k - 1] if k > 0 else 0.0) + (t[k + 1] - t[k] if k + 1 < count else 0.0)
    return 0.5 * (t[k] - t[0]) * dt


@dataclass(frozen=True)
class Response:
    """The figures of one run: `joints` (N, 6), `strip` (4,), NaN for a robot without a flexible link."""

    joints: np.ndarray
    strip: np.ndarray

    def numbers(self) -> dict[str, float | None]:
        """By name and unit, None for what never happened."""
        clean = lambda x: float(x) if np.isfinite(x) else None
        out = {f"joint_{i}_{n}": clean(x) for i, row in enumerate(self.joints, 1) for n, x in zip(JOINT, row, strict=True)}
        return out | {name: clean(x) for name, x in zip(STRIP, self.strip, strict=True)}


def of_run(run: Run, references: list[np.ndarray], limits: list[float], settled: float | None = None) -> Response:
    """The figures of a Run without gaps: `references` the unfiltered set-points (T,) a joint, `limits` of the outputs.

    `settled` [s] replaces the instant from which the residual counts, to compare two runs from the same instant on.
    """
    joints, strip = np.full((len(references), len(JOINT)), np.nan), np.full(len(STRIP), np.nan)
    for i, (r, limit) in enumerate(zip(references, limits, strict=True), 1):
        joint_figures(run.t, r, np.ascontiguousarray(run[f"joint/{i}/position"]), joints[i - 1])
        joints[i - 1, EFFORT] = _effort(run, i, limit)
    bent = [name for name in run if name.endswith("tip_deflection")]
    if bent:
        slowest = float(joints[:, SETTLING].max()) if settled is None else settled
        strip_figures(run.t, np.ascontiguousarray(run[bent[-1]]), slowest, strip)
    return Response(joints, strip)


def _effort(run: Run, joint: int, limit: float) -> float:
    """From the voltage, the rate of the pulses, or the force, whichever the run has first."""
    if not np.isfinite(limit):
        return 0.0
    if f"joint/{joint}/pulses" in run:
        u = np.gradient(run[f"joint/{joint}/pulses"], run.t)
    else:
        u = run[f"joint/{joint}/{'voltage' if f'joint/{joint}/voltage' in run else 'drive'}"]
    return float(np.trapezoid((u / limit) ** 2, run.t) / (run.t[-1] - run.t[0]))
