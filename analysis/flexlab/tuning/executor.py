"""Where a population's runs are made: on this machine's cores or a Dask scheduler's workers. The
numbers are the same."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from types import TracebackType
from typing import Any, Protocol

import numpy as np

from flexura.errors import FlexuraError, InputError
from flexura.optional import load
from flexura.population import cores, program

from .task import Task

# that a worker of a cluster gets at a time; a core here gets one, so that all are done at about the
# same time
ROWS = 4
CONNECT_S = 20


class Runs(Protocol):
    """Figures (B, R, k) and fractions reached (B, R) of points (B, d) with limits (B,), in their
    order: `Task.run`."""

    def __call__(self, points: np.ndarray, limits: np.ndarray) -> tuple[np.ndarray, np.ndarray]: ...


class Engine(Runs, Protocol):
    """Those of a task, while it is open."""

    def __enter__(self) -> Engine: ...
    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...


class Threads:
    """On this machine: a thread a core; the runs leave Python's lock."""

    def __init__(self, task: Task, threads: int) -> None:
        self.task, self.trials, self.stopped = task, task.trials(), threading.Event()
        self.pool = ThreadPoolExecutor(threads)

    def __call__(self, points: np.ndarray, limits: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return _joined(list(self.pool.map(self._chunk, _chunks(points, 1), _chunks(limits, 1))))

    def _chunk(self, points: np.ndarray, limits: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if self.stopped.is_set():
            raise KeyboardInterrupt
        return self.task.run(self.trials, points, limits)

    def __enter__(self) -> Threads:
        return self

    def __exit__(self, kind: Any, error: Any, trace: Any) -> None:
        self.stopped.set()
        self.pool.shutdown(cancel_futures=True)


class Cluster:
    """On a Dask scheduler's workers (the extra `cluster`); what a lost worker had is given to
    another."""

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
        futures = [
            self.client.submit(_on_worker, program(), self.task, *chunk, pure=False, retries=3)
            for chunk in zip(_chunks(points, ROWS), _chunks(limits, ROWS), strict=True)
        ]
        try:
            return _joined(self.client.gather(futures))
        finally:
            self.client.cancel(futures)

    def __enter__(self) -> Cluster:
        return self

    def __exit__(self, kind: Any, error: Any, trace: Any) -> None:
        self.client.close()


def engine(task: Task, scheduler: str | None = None, threads: int | None = None) -> Engine:
    """The cluster at `scheduler`, or `threads` (default: all cores) here."""
    return Cluster(task, scheduler) if scheduler else Threads(task, threads or cores())


def _chunks(rows: np.ndarray, size: int) -> list[np.ndarray]:
    return [rows[k : k + size] for k in range(0, len(rows), size)]


def _joined(parts: list[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    return np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])


def _on_worker(
    version: str, task: Task, points: np.ndarray, limits: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """A chunk, on a worker. Another solver would give other numbers."""
    if program() != version:
        raise FlexuraError(
            f"a worker runs another version of the solver, {program()}; this is {version}"
        )
    held = _held(task.digest(), threading.get_ident())
    if not held:
        held += [task, task.trials()]
    return held[0].run(held[1], points, limits)


@lru_cache(maxsize=8)
def _held(digest: str, thread: int) -> list[Any]:
    """What a worker's thread keeps of a task between two chunks."""
    return []
