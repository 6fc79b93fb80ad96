"""Threads that no caller waits for in vain when memory is short."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, TypeVar

from .errors import room_for

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
            room_for(ROOM, "a thread")
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
        """What a function returns for each row of the columns, in their order. Where one raises,
        those that have not begun do not begin."""
        futures: list[Future[Result]] = []
        try:
            for row in zip(*columns, strict=True):
                futures.append(self.submit(function, *row))
            return [self.result(future) for future in futures]
        finally:
            for future in futures:
                future.cancel()
