"""Threads that no caller waits for in vain when memory is short."""

from __future__ import annotations

import mmap
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, TypeVar

Result = TypeVar("Result")
ROOM = 16 << 20  # bytes that a thread takes for its stack and its first objects
LOOK_S = 0.5  # between two looks whether the threads still live


class Threads(ThreadPoolExecutor):
    """A pool of threads whose `result` and `each` raise MemoryError where a thread has ended
    without a word.

    Python ends a thread that has no memory left to report that, and who waits for its result waits
    for ever.
    """

    def submit(self, fn: Callable[..., Result], /, *args: Any, **kwargs: Any) -> Future[Result]:
        """See `concurrent.futures`.

        Raises:
            MemoryError: a thread more does not fit.
        """
        if len(self._threads) < self._max_workers:
            try:
                mmap.mmap(-1, ROOM).close()
            except OSError:
                raise MemoryError(f"{ROOM / 1e6:.0f} MB for a thread") from None
        return super().submit(fn, *args, **kwargs)

    def result(self, future: Future[Result]) -> Result:
        """What a submitted call returns, or raises.

        Raises:
            MemoryError: a thread has ended.
        """
        while not future.done():
            try:
                return future.result(LOOK_S)
            except TimeoutError:
                if not future.done() and not all(each.is_alive() for each in self._threads):
                    raise MemoryError("a thread ended") from None
        return future.result()

    def each(self, function: Callable[..., Result], *columns: Iterable[Any]) -> list[Result]:
        """What a function returns for each row of the columns, in their order."""
        futures = [self.submit(function, *row) for row in zip(*columns, strict=True)]
        return [self.result(future) for future in futures]
