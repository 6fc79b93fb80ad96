"""One robot under many controllers, compiled: each row of gains is a run, of which only its figures are kept.

Nothing of Python runs between two rows, and a call leaves Python's lock, so that each core advances rows of its own. A trial has
all that a run needs (workspace, memory, law), made once; a row begins with everything set back.

A row may have a limit to its cost, sum_k price_k max(0, figure_k - free_k) with prices on overshoot, ITAE, effort and vibration:
it is abandoned as soon as it is certain to cost more.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from . import acting, loop
from .chain import Chain, Work
from .choice import longest_step
from .compiled import compiled, inlined, internal
from .control import PID, Controller
from .course import following, inputs_of, which
from .forward import initial, to_state
from .law import LIMIT, NONE, TICK, Law
from .pinned import pinned
from .response import EFFORT, JOINT, SETTLING, STRIP, VIBRATION, joint_figures, joint_so_far, least_vibration, strip_figures
from .system import System

CALL, LOOK = 1000, 50  # steps between two looks at how many a row has taken, and at what it costs so far
PER_JOINT, OF_STRIP = len(JOINT), len(STRIP)
STEPS_A_TICK = 12  # more than that on average, and a row is given up: its gains make the robot chatter


class Trial(NamedTuple):
    """One robot's constants and one core's memory, for T samples of N joints."""

    chain: Chain
    work: Work
    inputs: acting.Inputs
    memory: loop.Memory
    method: int
    rtol: float
    start: np.ndarray  # (2n + 2,) state
    step: np.ndarray  # (2,) the longest step and the first [s]
    t: np.ndarray  # (T,)
    out: np.ndarray  # (T, 2n + 2)
    reference: np.ndarray  # (N, T) of each joint
    samples: np.ndarray  # (N + 1, T) the joints' positions, the deflection
    fixed: np.ndarray  # (k, 10) the signals that the law overwrites, as they were


def trial(system: System, controller: Controller, duration_s: float, output_step_s: float, rtol: float) -> Trial:
    """What rows of gains are run with, from the robot's start at rest. Samples lie on ticks."""
    rate = controller.rate_Hz
    every = max(1, round(output_step_s * rate))
    t = np.arange(0, round(duration_s * rate) + 1, every) / rate
    start = to_state(system, *initial(system, 0.0, controller, None, None))
    method = which(system, t, controller, rtol, "auto")
    longest = longest_step(system, method)
    inputs, joints = inputs_of(system, controller, t), controller.joints
    reference = np.array([[joint.reference(at)[0] if isinstance(joint, PID) else 0.0 for at in t] for joint in joints])
    return Trial(
        system.chain, following(system, controller), inputs, loop.memory(len(system.links), system.n), method, rtol,
        start, np.array([longest, min(0.02 * longest, t[-1] * 1e-4)]), t, np.zeros((len(t), len(start))),
        reference, np.zeros((len(joints) + 1, len(t))), inputs.segments.copy(),
    )  # fmt: skip


@internal
def _set_back(x: Trial) -> None:
    """Memory, law and signals as before the first tick."""
    m, law = x.memory, x.inputs.law
    for array in (m.s, law.sensor):
        for k in range(array.shape[0]):
            array[k] = 0.0
    for table in (m.big, law.memory, law.ring, law.z):
        for i in range(table.shape[0]):
            for k in range(table.shape[1]):
                table[i, k] = 0.0
    for k in range(x.start.shape[0]):
        m.z[k] = x.out[0, k] = x.start[k]
    m.s[loop.T], m.s[loop.OUT], m.s[loop.ERR] = x.t[0], 1.0, 1.0
    m.s[loop.LONGEST], m.s[loop.H] = x.step[0], x.step[1]
    _copy(x.fixed, x.inputs.segments)


@inlined
def _copy(source: np.ndarray, target: np.ndarray) -> None:
    for i in range(source.shape[0]):
        for k in range(source.shape[1]):
            target[i, k] = source[i, k]


@internal
def _spent(law: Law, i: int, begin: int, end: int) -> float:
    """Sum of the squares of joint i's outputs over its limit, of the ticks from `begin` to before `end`."""
    total, limit = 0.0, law.gains[i, LIMIT]
    if np.isfinite(limit):
        for k in range(begin, end):
            total += (law.log[k, i, 1] / limit) ** 2
    return total


@internal
def _sample(x: Trial, begin: int, end: int) -> None:
    """Positions and deflection from the rows of `out` from `begin` to before `end`."""
    law, w = x.inputs.law, x.samples[x.samples.shape[0] - 1]
    for k in range(begin, end):
        for i in range(law.kind.shape[0]):
            x.samples[i, k] = x.out[k, law.first[i]]
        w[k] = 0.0
        for j in range(law.look.shape[1]):
            w[k] += law.look[0, j] * x.out[k, j]


@internal
def _figures(x: Trial, figures: np.ndarray) -> None:
    """A finished run's figures: those of each joint, then the strip's."""
    law, settled = x.inputs.law, 0.0
    ticks = law.log.shape[0] - 1  # all but the last
    for i in range(law.kind.shape[0]):
        row = figures[PER_JOINT * i : PER_JOINT * (i + 1)]
        if law.kind[i] == NONE:
            continue
        joint_figures(x.t, x.reference[i], x.samples[i], row)
        row[EFFORT] = _spent(law, i, 0, ticks) / ticks
        settled = max(settled, row[SETTLING]) if not np.isnan(settled) and not np.isnan(row[SETTLING]) else np.nan
    strip_figures(x.t, x.samples[x.samples.shape[0] - 1], settled, figures[figures.shape[0] - OF_STRIP :])


@internal
def _cost_so_far(
    x: Trial, prices: np.ndarray, limit: float, seen: int, count: int, spent: int, ticks: int, figures: np.ndarray
) -> float:  # fmt: skip
    """What a run costs at least. Adds to the lower bounds `figures` the samples from `seen` to before `count` and the ticks from
    `spent` to before `ticks`."""
    law, strip = x.inputs.law, figures.shape[0] - OF_STRIP
    for i in range(law.kind.shape[0]):
        if law.kind[i] == NONE:
            continue
        row = figures[PER_JOINT * i : PER_JOINT * (i + 1)]
        joint_so_far(x.t, x.reference[i], x.samples[i], seen, count, row)
        row[EFFORT] += _spent(law, i, spent, ticks) / (law.log.shape[0] - 1)
    cost = 0.0
    for k in range(strip):
        cost += prices[0, k] * max(0.0, figures[k] - prices[1, k])
    price = prices[0, strip + VIBRATION]
    if price > 0.0 and cost <= limit:
        enough = (limit - cost) / price
        figures[strip + VIBRATION] = least_vibration(x.t, x.samples[x.samples.shape[0] - 1], count, enough)
    return cost + price * figures[strip + VIBRATION]


@compiled
def run_rows(
    x: Trial, prices: np.ndarray, gains: np.ndarray, limits: np.ndarray, figures: np.ndarray, reached: np.ndarray
) -> None:  # fmt: skip
    """Runs with gains (B, N, 20): figures (B, PER_JOINT N + OF_STRIP), and what fraction of the time each reached (B,).

    `prices` (2, PER_JOINT N + OF_STRIP) and what is free of each figure; `limits` (B,), inf for none, which an abandoned row's
    cost would exceed by a billionth or more. Of such a row the figures are lower bounds, 0 where it has none, and of one that
    failed NaN.
    """
    x = pinned(x)
    end = x.t[-1]
    most = int(STEPS_A_TICK * end * x.inputs.law.rate_Hz)
    for b in range(gains.shape[0]):
        _set_back(x)
        _copy(gains[b], x.inputs.law.gains)
        s, row, limited = x.memory.s, figures[b], np.isfinite(limits[b])
        call, limit, lost = LOOK if limited else CALL, limits[b] * (1.0 + 1e-9), False
        seen, spent, left = 0, 0, most
        for k in range(row.shape[0]):
            row[k] = 0.0
        while s[loop.STATUS] == loop.RUNNING and left > 0 and not lost:
            loop.advance(x.chain, x.work, x.inputs, x.memory, x.method, x.rtol, x.t, x.out, min(call, left))
            left = most - int(s[loop.STEPS] + s[loop.REJECTED])
            count, ticks = int(s[loop.OUT]), min(int(x.inputs.law.sensor[TICK]), x.inputs.law.log.shape[0] - 1)
            _sample(x, seen, count)
            if limited:
                lost = _cost_so_far(x, prices, limit, seen, count, spent, ticks, row) > limit
            seen, spent = count, ticks
        done = s[loop.STATUS] == loop.DONE
        reached[b] = 1.0 if done else min(s[loop.T] / end, 1.0 - 1e-9)
        if done or not lost:
            for k in range(row.shape[0]):
                row[k] = np.nan
        if done:
            _figures(x, row)
