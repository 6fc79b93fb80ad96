"""The engine of populations: many robots of one topology through the compiled loop."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np

from . import loop
from .assembly import Systems
from .choice import keeps_modes, uncoupled
from .course import METHODS, Course, which
from .drive import Drive
from .exponential import EXPONENTIAL
from .many import Histories, collected, run, workplace

STEPS_A_CALL = 2000  # between two looks at whether to stop
WORDS = {loop.DONE: "done", loop.LIMIT: "limit", loop.STUCK: "stuck"}


def engine(
    systems: Systems,
    rows: Sequence[int],
    t: np.ndarray,
    drives: Sequence[Drive],
    states: np.ndarray,
    rtol: float,
    method: str,
    stop: np.ndarray,
) -> Histories:
    """Advance the robots `rows` from their rows of states (B, 2n + 2) along t (T,), as `simulate` does one, to the last bit.

    The compiled loop leaves Python's lock, and ends early once `stop` (1,) is set. A robot that gets stuck or reaches a limit
    ends alone.
    """
    B, size = states.shape
    out = Histories(
        np.full((B, len(t), size - 2), np.nan), np.full((B, len(t), 2), np.nan), np.full(B, loop.DONE), np.full(B, t[-1]),
        np.full(B, -1), np.zeros((B, len(systems.links))), np.zeros(B, dtype=np.int64),
    )  # fmt: skip
    plain = _plain(systems, t, drives, rtol, method)
    together = [k for k in rows if plain[k]]
    if together:
        x = collected(systems, drives, states)
        w, m, b, p, law, history = workplace(systems, len(t))
        run(x, w, m, b, p, law, rtol, t, stop, history, np.array(together), out)
    for k in rows:
        if not plain[k] or out.status[k] == loop.STUCK:
            _one(systems, k, t, drives[k], states[k], rtol, method, stop, out)
    return out


def _plain(systems: Systems, t: np.ndarray, drives: Sequence[Drive], rtol: float, method: str) -> np.ndarray:
    """Which robots (B,) take exponential steps for sure; what the others take is found for each (`course.which`)."""
    if method != "auto":
        return np.full(len(systems), METHODS[method] == EXPONENTIAL and len(t) > 1)
    if len(t) == 1 or not keeps_modes(systems.chains, rtol):
        return np.zeros(len(systems), dtype=bool)
    return uncoupled(systems.chains, np.array([drive.gains for drive in drives]))


def _one(
    systems: Systems, k: int, t: np.ndarray, drive: Drive, state: np.ndarray, rtol: float, method: str, stop: np.ndarray,
    out: Histories,
) -> None:  # fmt: skip
    """One robot by itself, into its row of `out`."""
    system = systems[k]
    course = Course(system, t, drive, state, which(system, t, drive, rtol, method))
    m, history, n = course.m, course.out, system.n
    while len(t) > 1 and m.s[loop.STATUS] == loop.RUNNING and not stop[0]:
        course.advance(rtol, STEPS_A_CALL)
    done, ended = int(m.s[loop.OUT]), int(m.s[loop.STATUS])
    out.states[k], out.work[k], out.reached[k], out.joint[k] = np.nan, np.nan, t[-1], -1
    out.states[k, :done], out.work[k, :done] = history[:done, : 2 * n], history[:done, 2 * n :]
    out.position[k] = m.z[system.joint_rows]
    out.steps[k], out.status[k] = int(m.s[loop.STEPS]), loop.DONE
    if ended in (loop.LIMIT, loop.STUCK):
        out.status[k], out.reached[k] = ended, m.s[loop.T]
        out.joint[k] = int(m.s[loop.FAULT]) if ended == loop.LIMIT else -1


def cores() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
