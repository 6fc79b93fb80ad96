"""The engine of populations: many robots of one topology through the compiled loop, on all cores."""

from __future__ import annotations

import os
import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from . import loop
from .course import Course, which
from .drive import Drive
from .system import System

STEPS_A_CALL = 2000  # between two looks at whether to stop
WORDS = {loop.DONE: "done", loop.LIMIT: "limit", loop.STUCK: "stuck"}


class Histories(NamedTuple):
    """What the engine gives for B robots: states NaN from where a robot stopped, and how each ended."""

    states: np.ndarray  # (B, T, 2n) in the solver's coordinates
    work: np.ndarray  # (B, T, 2) of the drives, and lost [J]
    status: np.ndarray  # (B,) int: loop.DONE, LIMIT or STUCK
    reached: np.ndarray  # (B,) the last good instant [s]
    joint: np.ndarray  # (B,) int: the joint that reached its limit (from 0), -1
    position: np.ndarray  # (B, N) of the joints, at the last good instant
    steps: np.ndarray  # (B,) int


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
    stop = threading.Event()

    def one(k: int) -> None:
        if stop.is_set():
            return
        system = systems[k]
        course = Course(system, t, drives[k], states[k], which(system, t, drives[k], rtol, method))
        m, history = course.m, course.out
        while len(t) > 1 and m.s[loop.STATUS] == loop.RUNNING and not stop.is_set():
            course.advance(rtol, STEPS_A_CALL)
        rows = int(m.s[loop.OUT])
        out.states[k, :rows], out.work[k, :rows] = history[:rows, : size - 2], history[:rows, size - 2 :]
        out.position[k] = m.z[system.joint_rows]
        out.steps[k] = int(m.s[loop.STEPS])
        if m.s[loop.STATUS] in (loop.LIMIT, loop.STUCK):
            out.status[k], out.reached[k] = int(m.s[loop.STATUS]), m.s[loop.T]
            out.joint[k] = int(m.s[loop.FAULT]) if m.s[loop.STATUS] == loop.LIMIT else -1

    if threads == 1:
        for k in range(B):
            one(k)
        return out
    with ThreadPoolExecutor(threads) as pool:
        try:
            list(pool.map(one, range(B)))
        except BaseException:
            stop.set()
            raise
    return out


def cores() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
