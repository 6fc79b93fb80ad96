"""One robot under many controllers, compiled: each row of gains is a run, of which only its figures are kept.

Nothing of Python runs between two rows, and a call leaves Python's lock, so that each core advances rows of its own. A trial has
all that a run needs (workspace, memory, law), made once; a row begins with everything set back.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from . import loop
from .chain import Chain, Work
from .choice import longest_step
from .compiled import compiled, inlined, internal
from .control import Controller
from .course import following, inputs_of, which
from .forward import initial, to_state
from .law import LIMIT, NONE, Law
from .pinned import pinned
from .response import EFFORT, JOINT, SETTLING, STRIP, joint_figures, strip_figures
from .signal import evaluate
from .system import System

CALL = 1000  # steps between two looks at how many a row has taken
PER_JOINT, OF_STRIP = len(JOINT), len(STRIP)
STEPS_A_TICK = 12  # more than that on average, and a row is given up: its gains make the robot chatter


class Trial(NamedTuple):
    """One robot's constants and one core's memory, for T samples of N joints."""

    chain: Chain
    work: Work
    inputs: loop.Inputs
    memory: loop.Memory
    method: int
    rtol: float
    start: np.ndarray  # (2n + 2,) state
    step: np.ndarray  # (2,) the longest step and the first [s]
    t: np.ndarray  # (T,)
    out: np.ndarray  # (T, 2n + 2)
    samples: np.ndarray  # (2, T) a joint's reference and position; the deflection
    fixed: np.ndarray  # (k, 10) the signals that the law overwrites, as they were


def trial(system: System, controller: Controller, duration_s: float, output_step_s: float, rtol: float) -> Trial:
    """What rows of gains are run with, from the robot's start at rest. Samples lie on ticks."""
    rate = controller.rate_Hz
    every = max(1, round(output_step_s * rate))
    t = np.arange(0, round(duration_s * rate) + 1, every) / rate
    start = to_state(system, *initial(system, 0.0, controller, None, None))
    method = which(system, t, controller, rtol, "auto")
    longest = longest_step(system, method)
    inputs = inputs_of(system, controller, t)
    return Trial(
        system.chain, following(system, controller), inputs, loop.memory(len(system.links), system.n), method, rtol,
        start, np.array([longest, min(0.02 * longest, t[-1] * 1e-4)]), t, np.zeros((len(t), len(start))),
        np.zeros((2, len(t))), inputs.segments.copy(),
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
def _effort(law: Law, i: int, limit: float) -> float:
    """Mean square of joint i's outputs over its limit, from the log of all ticks but the last."""
    total, ticks = 0.0, law.log.shape[0] - 1
    if not np.isfinite(limit):
        return 0.0
    for k in range(ticks):
        total += (law.log[k, i, 1] / limit) ** 2
    return total / ticks


@internal
def _figures(x: Trial, figures: np.ndarray) -> None:
    """A finished run's figures: those of each joint, then the strip's."""
    law, settled = x.inputs.law, 0.0
    r, y = x.samples[0], x.samples[1]
    for i in range(law.kind.shape[0]):
        row = figures[PER_JOINT * i : PER_JOINT * (i + 1)]
        if law.kind[i] == NONE:
            continue
        for k in range(x.t.shape[0]):
            r[k] = evaluate(law.segments[law.ranges[i, 0] : law.ranges[i, 1]], x.t[k])[0]
            y[k] = x.out[k, law.first[i]]
        joint_figures(x.t, r, y, row)
        row[EFFORT] = _effort(law, i, law.gains[i, LIMIT])
        settled = max(settled, row[SETTLING]) if not np.isnan(settled) and not np.isnan(row[SETTLING]) else np.nan
    for k in range(x.t.shape[0]):
        y[k] = 0.0
        for j in range(law.look.shape[1]):
            y[k] += law.look[0, j] * x.out[k, j]
    strip_figures(x.t, y, settled, figures[figures.shape[0] - OF_STRIP :])


@compiled
def run_rows(x: Trial, gains: np.ndarray, figures: np.ndarray, reached: np.ndarray) -> None:
    """Runs with gains (B, N, 20): figures (B, PER_JOINT N + OF_STRIP), and what fraction of the time each reached (B,)."""
    x = pinned(x)
    end = x.t[-1]
    most = STEPS_A_TICK * end * x.inputs.law.rate_Hz
    for b in range(gains.shape[0]):
        _set_back(x)
        _copy(gains[b], x.inputs.law.gains)
        s = x.memory.s
        while s[loop.STATUS] == loop.RUNNING and s[loop.STEPS] + s[loop.REJECTED] < most:
            loop.advance(x.chain, x.work, x.inputs, x.memory, x.method, x.rtol, x.t, x.out, CALL)
        reached[b] = 1.0 if s[loop.STATUS] == loop.DONE else min(s[loop.T] / end, 1.0 - 1e-9)
        for k in range(figures.shape[1]):
            figures[b, k] = np.nan
        if reached[b] == 1.0:
            _figures(x, figures[b])
