"""The pool of threads whose caller does not wait for ever."""

from __future__ import annotations

import subprocess
import sys
import time
from concurrent.futures import Future

import pytest

from flexura.threads import Threads


def test_results_in_order_and_errors():
    with Threads(2) as pool:
        assert pool.each(pow, range(5), [2] * 5) == [0, 1, 4, 9, 16]
        with pytest.raises(ZeroDivisionError):
            pool.each(divmod, [1, 1], [1, 0])
        with pytest.raises(TimeoutError, match="its own"):
            pool.each(_too_late, [1])


def _too_late(_: int) -> None:
    raise TimeoutError("its own")


def test_a_thread_that_ends_without_a_word():
    """As `concurrent.futures` does where memory is so short that the error can't be kept."""
    futures: list[Future[None]] = []

    def no_room(_: object) -> None:
        raise MemoryError

    def job() -> None:
        futures[0].set_exception = no_room  # type: ignore[method-assign]
        raise MemoryError

    with Threads(1) as pool:
        futures.append(pool.submit(_wait_for, futures, job))
        with pytest.raises(MemoryError, match="a thread ended"):
            pool.result(futures[0])


def _wait_for(there, job):
    while not there:
        pass
    job()


def test_where_one_raises_those_that_wait_do_not_begin():
    begun = []

    def job(k):
        begun.append(k)
        time.sleep(0.05)
        return 1 / k

    with Threads(1) as pool, pytest.raises(ZeroDivisionError):
        pool.each(job, range(40))
    assert len(begun) < 20


def test_no_room_for_a_thread():
    code = (
        "import resource, flexura.threads as t\n"
        "pages = int(open('/proc/self/statm').read().split()[0]) * resource.getpagesize()\n"
        "resource.setrlimit(resource.RLIMIT_AS, (pages + 8_000_000,) * 2)\n"
        "try: t.Threads(1).submit(print, 'it ran')\n"
        "except MemoryError as error: print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout == "17 MB for a thread\n", done.stderr
