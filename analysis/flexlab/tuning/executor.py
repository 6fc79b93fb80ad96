"""Executors of a population's runs: this machine's cores or a Dask cluster; same results."""

from __future__ import annotations

import threading
from functools import lru_cache
from types import TracebackType
from typing import Any, Protocol

import numpy as np

from flexura.errors import FlexuraError, InputError
from flexura.optional import load
from flexura.population import cores, program
from flexura.threads import Threads

from .task import Task

# that a worker of a cluster gets at a time; a core here gets one, so that all are done at about the
# same time
ROWS_PER_TASK = 4
CONNECT_S = 20


class Evaluator(Protocol):
    """Evaluates points (B, d) with cost limits (B,), as `Task.run`."""

    def __call__(self, points: np.ndarray, limits: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Metrics (B, R, k) and fractions reached (B, R), in the order of the points."""
        ...


class Executor(Evaluator, Protocol):
    """An evaluator of a task, while it is open."""

    def __enter__(self) -> Executor: ...
    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...


class ThreadExecutor:
    """Runs on this machine, one thread a core; the runs release Python's lock."""

    def __init__(self, task: Task, threads: int) -> None:
        self.task, self.sweeps, self.stopped = task, task.gain_sweeps(), threading.Event()
        self.pool = Threads(threads)

    def __call__(self, points: np.ndarray, limits: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See `Evaluator`."""
        return _concatenated(self.pool.each(self._chunk, _chunks(points, 1), _chunks(limits, 1)))

    def _chunk(self, points: np.ndarray, limits: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if self.stopped.is_set():
            raise KeyboardInterrupt
        return self.task.run(self.sweeps, points, limits)

    def __enter__(self) -> ThreadExecutor:
        return self

    def __exit__(self, kind: Any, error: Any, trace: Any) -> None:
        self.stopped.set()
        self.pool.shutdown(cancel_futures=True)


class DaskExecutor:
    """Runs on a Dask scheduler's workers (extra `cluster`); work of a lost worker is repeated."""

    def __init__(self, task: Task, scheduler: str) -> None:
        distributed = load("distributed")
        try:
            self.client = distributed.Client(scheduler, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError) as error:
            text = f"expected the address of a Dask scheduler, tcp://host:port ({error})"
            raise InputError(text, key="--scheduler", value=scheduler) from None
        self.client.wait_for_workers(1, timeout=CONNECT_S)
        self.task = task

    def __call__(self, points: np.ndarray, limits: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See `Evaluator`."""
        futures = [
            self.client.submit(_on_worker, program(), self.task, *chunk, pure=False, retries=3)
            for chunk in zip(
                _chunks(points, ROWS_PER_TASK), _chunks(limits, ROWS_PER_TASK), strict=True
            )
        ]
        try:
            return _concatenated(self.client.gather(futures))
        finally:
            self.client.cancel(futures)

    def __enter__(self) -> DaskExecutor:
        return self

    def __exit__(self, kind: Any, error: Any, trace: Any) -> None:
        self.client.close()


def make_executor(task: Task, scheduler: str | None = None, threads: int | None = None) -> Executor:
    """The executor of a task.

    Args:
        task: what is evaluated.
        scheduler: address of a Dask scheduler; None: threads on this machine.
        threads: their number, by default all cores.

    Raises:
        InputError: there is no scheduler, or the extra is missing.
    """
    return DaskExecutor(task, scheduler) if scheduler else ThreadExecutor(task, threads or cores())


def _chunks(rows: np.ndarray, size: int) -> list[np.ndarray]:
    return [rows[k : k + size] for k in range(0, len(rows), size)]


def _concatenated(parts: list[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    return np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])


def _on_worker(
    version: str, task: Task, points: np.ndarray, limits: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Evaluate a chunk on a worker, whose solver must have the same version."""
    if program() != version:
        raise FlexuraError(
            f"a worker runs another version of the solver, {program()}; this is {version}"
        )
    state = _worker_state(task.digest(), threading.get_ident())
    if not state:
        state += [task, task.gain_sweeps()]
    return state[0].run(state[1], points, limits)


@lru_cache(maxsize=8)
def _worker_state(digest: str, thread: int) -> list[Any]:
    """The task and its trials, kept by a worker's thread between chunks."""
    return []
