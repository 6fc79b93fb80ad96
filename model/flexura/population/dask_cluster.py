"""Chunks of a population on the workers of a Dask scheduler (the extra `cluster`)."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from typing import TYPE_CHECKING, Any

from ..errors import FlexuraError, InputError
from ..optional import load
from .request import program
from .worker import compute

if TYPE_CHECKING:
    from .batch import Share
    from .request import Request
    from .store import Chunk

AHEAD = 2  # chunks a worker's thread has waiting, so that it never waits itself
CONNECT_S = 20


def run(
    request: Request, todo: Iterator[Any], scheduler: str
) -> Generator[Chunk | range, None, None]:
    """The chunks as they come back, each once; a range of `todo`, which is done already, is handed
    on.

    Work that a lost worker had is given to another by the scheduler; what comes back is kept here,
    by one process. Whatever ends this early cancels what is left. Raises InputError for an address
    at which there is no scheduler.
    """
    distributed = load("distributed")
    try:
        client = distributed.Client(scheduler, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        text = f"expected the address of a Dask scheduler, tcp://host:port ({error})"
        raise InputError(text, key="scheduler", value=scheduler) from None
    with client:
        client.wait_for_workers(1, timeout=CONNECT_S)
        coming, ended = distributed.as_completed(loop=client.loop), False
        waiting: set[Any] = set()
        try:
            while True:
                room = AHEAD * max(1, sum(client.nthreads().values()))
                while len(waiting) < room and not ended:
                    work = next(todo, None)
                    if work is None:
                        ended = True
                    elif isinstance(work, range):
                        yield work
                    else:
                        future = client.submit(
                            _chunk, program(), request, *work, pure=False, retries=3
                        )
                        waiting.add(future)
                        coming.add(future)
                if not waiting:
                    return
                future = next(coming)
                waiting.remove(future)
                yield future.result()
                future.release()
        finally:
            client.cancel(list(waiting))


def _chunk(version: str, request: Request, share: Share, digests: list[bytes]) -> Chunk:
    """One chunk, on a worker, in one thread: a worker has its own. Another solver would give other
    numbers."""
    if program() != version:
        raise FlexuraError(
            f"a worker runs another version of the solver, {program()}; this is {version}"
        )
    return compute(request, share, digests)
