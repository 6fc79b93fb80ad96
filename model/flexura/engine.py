"""The engine of populations: many robots of one topology through the compiled loop, on all cores."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from . import loop
from .course import Course, which
from .drive import Drive
from .exponential import EXPONENTIAL
from .many import Histories, collected, run, workplace
from .system import System

STEPS_A_CALL, ROBOTS_A_CALL = 2000, 64  # between two looks at whether to stop, and of one piece of work
WORDS = {loop.DONE: "done", loop.LIMIT: "limit", loop.STUCK: "stuck"}


def engine(
    systems: Sequence[System],
    t: np.ndarray,
    drives: Sequence[Drive],
    states: np.ndarray,
    rtol: float,
    method: str,
    threads: int = 1,
) -> Histories:
    """Advance every system from its row of states (B, 2n + 2) along t (T,), as `simulate` does one, to the last bit.

    The compiled loop leaves Python's lock, so that `threads` robots advance at a time. A robot that gets stuck or reaches a
    limit ends alone. Raises KeyboardInterrupt as soon as all threads have seen it.
    """
    B, size = states.shape
    out = Histories(
        np.full((B, len(t), size - 2), np.nan), np.full((B, len(t), 2), np.nan), np.full(B, loop.DONE), np.full(B, t[-1]),
        np.full(B, -1), np.zeros((B, len(systems[0].links))), np.zeros(B, dtype=np.int64),
    )  # fmt: skip
    stop = np.zeros(1, dtype=bool)

    def some(rows: range) -> None:
        """A block of robots: those that take exponential steps in one compiled call, the others, and who gets stuck, singly."""
        methods = [which(systems[k], t, drives[k], rtol, method) for k in rows]
        together = [k for k, chosen in zip(rows, methods, strict=True) if chosen == EXPONENTIAL and len(t) > 1]
        if together:
            x = collected([systems[k] for k in together], [drives[k] for k in together], states[together])
            w, m, b, p, law, history = workplace(systems[together[0]], len(t))
            run(x, w, m, b, p, law, rtol, t, stop, history, np.array(together), out)
        for k, chosen in zip(rows, methods, strict=True):
            if k not in together or out.status[k] == loop.STUCK:
                one(k, chosen)

    def one(k: int, chosen: int) -> None:
        course = Course(systems[k], t, drives[k], states[k], chosen)
        m, history = course.m, course.out
        while len(t) > 1 and m.s[loop.STATUS] == loop.RUNNING and not stop[0]:
            course.advance(rtol, STEPS_A_CALL)
        rows, ended = int(m.s[loop.OUT]), int(m.s[loop.STATUS])
        out.states[k, :rows], out.work[k, :rows] = history[:rows, : size - 2], history[:rows, size - 2 :]
        out.position[k] = m.z[systems[k].joint_rows]
        out.steps[k], out.status[k] = int(m.s[loop.STEPS]), loop.DONE
        if ended in (loop.LIMIT, loop.STUCK):
            out.status[k], out.reached[k] = ended, m.s[loop.T]
            out.joint[k] = int(m.s[loop.FAULT]) if ended == loop.LIMIT else -1

    block = max(1, min(ROBOTS_A_CALL, -(-B // threads)))
    with ThreadPoolExecutor(threads) as pool:
        try:
            list(pool.map(some, (range(k, min(k + block, B)) for k in range(0, B, block))))
        except BaseException:
            stop[0] = True
            raise
    return out


def cores() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
