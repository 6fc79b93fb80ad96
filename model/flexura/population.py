"""Populations: a batch of robots simulated chunk by chunk, in bounded memory, on all cores or a cluster, and restartable."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from . import forward, loop
from .assembly import Systems, assemble_all
from .batch import Batch, Item, digest
from .chunks import Chunk, Store, in_memory
from .course import applied, inputs_of
from .drive import Drive
from .engine import WORDS, Histories, cores, engine
from .errors import InputError
from .many import tips
from .record import channel_units, limit_event, record
from .request import Request
from .system import System

BLOCK = 128  # robots that are assembled together


@dataclass(frozen=True)
class Population:
    """A simulated batch: `t` (T,) [s], units of the channels, whether all `count` robots are `complete`, and their chunks.

    `population["tip/x"]` is (count, T), a reduced number (count,), `population.status` (count,) of "done", "limit", "stuck" or
    "refused" (a robot that cannot be assembled or starts outside its limits); a robot's values are NaN from where it stopped.
    Of an interrupted population only the robots that are done have rows: `population.robots`, counted from 0.
    """

    t: np.ndarray
    units: Mapping[str, str]
    count: int
    complete: bool
    store: Store

    def __iter__(self) -> Iterator[Chunk]:
        """The chunks that are done, in order, one in memory at a time."""
        return self.store.chunks()

    def __getitem__(self, name: str) -> np.ndarray:
        parts = [(chunk.values.get(name), len(chunk)) for chunk in self]
        known = next((values for values, _ in parts if values is not None), None)
        if known is None:
            raise KeyError(f"no {name!r} was kept")
        nothing = lambda rows: np.full((rows, *known.shape[1:]), np.nan)  # a chunk of refused robots has no reduced numbers
        return np.concatenate([nothing(rows) if values is None else values for values, rows in parts])

    @property
    def robots(self) -> np.ndarray:
        return np.concatenate([np.arange(c.first, c.first + len(c)) for c in self] or [np.zeros(0, dtype=int)])

    @property
    def status(self) -> np.ndarray:
        return np.concatenate([c.status for c in self] or [np.zeros(0, dtype=str)])


def simulate(
    batch: Batch, t_eval: Any, drive: Drive | None = None, q0: Any = None, qd0: Any = None, rtol: float = 1e-6, *,
    method: str = "auto", progress: Callable[[float], None] | None = None, channels: Sequence[str] | None = None,
    reduce: Callable[[np.ndarray, dict[str, np.ndarray]], Any] | None = None, folder: str | Path | None = None,
    chunk: int = 256, threads: int | None = None, scheduler: str | None = None,
) -> Population:  # fmt: skip
    """Simulate every robot of the batch as `simulate` does one, to the last bit.

    `drive`, `q0`, `qd0` (n,) hold for robots without a drive of their own, and for all. `channels` are kept, by default joint
    positions and tip deflections; with `reduce(t, channels) -> number or {name: number}` only these numbers are. `folder`: a
    Parquet file each `chunk` robots, written as a whole or not at all; the same call goes on where it was stopped, by Ctrl-C or
    by force, and one that asks for something else is refused by name. `threads`: by default one a core. `scheduler`: the address
    of a Dask scheduler, whose workers then do the chunks. Raises InputError for wrong arguments; a robot that fails ends alone.
    """
    request = Request.checked(t_eval, drive, q0, qd0, rtol, method, channels, reduce)
    for key, value in (("chunk", chunk), ("threads", 1 if threads is None else threads)):
        if isinstance(value, bool) or not isinstance(value, int) or value < 1:
            raise InputError("expected a whole number, 1 or more", key=key, value=value)
    store, units, complete, done = in_memory(), {}, False, 0
    robots = iter(batch)
    try:
        first = next(robots)
        request = request.fitted(first[0])
        units = {} if request.reduce else {k: v for k, v in channel_units(first[0]).items() if k in request.channels}
        store = in_memory() if folder is None else Store.opened(folder, request.spec() | {"count": batch.count, "chunk": chunk})
        todo = _todo(_chained(first, robots), request, store, chunk)
        source = _local(request, todo, threads or cores()) if scheduler is None else _cluster(request, todo, scheduler)
        with closing(source) as chunks:
            for made in chunks:
                if isinstance(made, Chunk):
                    store.put(made)
                done += len(made)
                if progress is not None:
                    progress(done / batch.count)
        complete = True
    except KeyboardInterrupt:
        pass
    return Population(request.t, units, batch.count, complete, store)


def _chained(first: Item, rest: Iterator[Item]) -> Iterator[Item]:
    yield first
    yield from rest


Work = tuple[int, list[Item], list[bytes]]


def _todo(robots: Iterator[Item], request: Request, store: Store, size: int) -> Iterator[Work | range]:
    """Chunks to be done: (first robot, robots, their digests, which only a folder needs); a range stands for one that the store
    has."""
    first = 0
    while items := list(islice(robots, size)):
        digests = [b"" if store.folder is None else digest(robot, drive) for robot, drive in items]
        if store.has(first, digests):
            yield range(len(items))
        else:
            yield first, items, digests
        first += len(items)


def _local(request: Request, todo: Iterator[Work | range], threads: int) -> Generator[Chunk | range, None, None]:
    """The chunks, each worked on by all threads; the robots of the next one are made and assembled here meanwhile."""
    stop = np.zeros(1, dtype=bool)
    waiting: deque[tuple[Work | range, list[Future[Part]]]] = deque()

    def finished() -> Chunk | range:
        work, parts = waiting.popleft()
        return work if isinstance(work, range) else _joined(request, *work, [part.result() for part in parts])

    with ThreadPoolExecutor(threads) as pool:
        try:
            for work in todo:
                blocks = [] if isinstance(work, range) else _blocks(*work[:2], threads)
                own = [pool.submit(simulated, request, prepared(request, block), stop) for block in blocks]
                waiting.append((work, own))
                if len(waiting) > 1:
                    yield finished()
            while waiting:
                yield finished()
        except BaseException:
            stop[0] = True
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _cluster(request: Request, todo: Iterator[Work | range], scheduler: str) -> Generator[Chunk | range, None, None]:
    from . import cluster

    return cluster.run(request, todo, scheduler)


def compute(request: Request, first: int, items: list[Item], digests: list[bytes]) -> Chunk:
    """Simulate the robots of one chunk in this thread; `first` is the number of its first robot, from 0."""
    stop = np.zeros(1, dtype=bool)
    parts = [simulated(request, prepared(request, block), stop) for block in _blocks(first, items, 1)]
    return _joined(request, first, items, digests, parts)


def _blocks(first: int, items: list[Item], threads: int) -> Iterator[tuple[int, list[Item]]]:
    """Shares of a chunk for the threads, each with the number of its first robot."""
    size = min(BLOCK, -(-len(items) // threads))
    for k in range(0, len(items), size):
        yield first + k, items[k : k + size]


class Block(NamedTuple):
    """Robots that are ready to run: their Systems and drives, states (b, 2n + 2) at the start, and why robots are refused."""

    systems: Systems
    drives: list[Drive]
    states: np.ndarray
    refused: dict[int, InputError]


class Part(NamedTuple):
    """A block of robots, simulated: as in a Chunk, with the channels (b, T) of all that were started."""

    status: list[str]
    reached: np.ndarray
    steps: np.ndarray
    events: list[str]
    channels: dict[str, np.ndarray]


def prepared(request: Request, block: tuple[int, list[Item]]) -> Block:
    """A block assembled. Raises InputError for drives of another number of joints."""
    first, items = block
    N = len(items[0][0].links)
    drives = [drive or request.drive or Drive.none(N) for _, drive in items]
    for k, drive in enumerate(drives, 1):
        if len(drive.joints) != N:
            key = f"robots[{first + k}].drive"
            raise InputError(f"expected {N} joint drives, one a joint", key=key, value=len(drive.joints))
    systems = assemble_all([robot for robot, _ in items])
    return Block(systems, drives, *_starts(systems, request.t[0], drives, request))


def simulated(request: Request, block: Block, stop: np.ndarray) -> Part:
    """Run and observe a block, or begin to, where `stop` (1,) is set meanwhile."""
    systems, drives, states, refused = block
    B, t = len(systems), request.t
    started = [k for k in range(B) if k not in refused]
    done = engine(systems, started, t, drives, states, request.rtol, request.method, stop)
    status, reached, steps, events = [WORDS[int(k)] for k in done.status], done.reached, done.steps, [""] * B
    for j in np.flatnonzero(done.status != loop.DONE):
        events[j] = _event(systems[int(j)], done, int(j))
    for k, error in refused.items():
        status[k], reached[k], events[k] = "refused", np.nan, str(error)
    return Part(status, reached, steps, events, _observed(systems, started, t, done, drives, request.channels))


def _starts(systems: Systems, t: float, drives: list[Drive], request: Request) -> tuple[np.ndarray, dict[int, InputError]]:
    """The states (B, 2n + 2) at t, and why robots are refused."""
    n, rows, refused = len(systems.labels), systems.chains.first[0, :-1], dict(systems.refused)
    states = np.zeros((len(systems), 2 * n + 2))
    states[:, rows] = [robot.start for robot in systems.robots]
    given = request.q0 is not None or request.qd0 is not None
    for k, drive in enumerate(drives):
        if k not in refused and (given or drive.follows.any()):  # from elsewhere than the robot's start, at rest
            try:
                states[k] = forward.to_state(systems[k], *forward.initial(systems[k], t, drive, request.q0, request.qd0))
            except InputError as error:
                refused[k] = error
    return states, refused


def _joined(request: Request, first: int, items: list[Item], digests: list[bytes], parts: list[Part]) -> Chunk:
    """The blocks of a chunk in one, reduced if so asked."""
    status = [word for part in parts for word in part.status]
    values = {name: np.concatenate([part.channels[name] for part in parts]) for name in request.channels}
    if request.reduce:
        channels, values = values, {}
        for k in range(len(items)):
            if status[k] == "refused":
                continue
            kept = request.reduced({name: rows[k] for name, rows in channels.items()}, first + k)
            values = values or {name: np.full(len(items), np.nan) for name in kept}
            if set(values) != set(kept):
                text = f"expected the same numbers of every robot, {sorted(values)}"
                raise InputError(text, key="reduce", value=sorted(kept))
            for name, value in kept.items():
                values[name][k] = value
    reached, steps = (np.concatenate(arrays) for arrays in ([p.reached for p in parts], [p.steps for p in parts]))
    events = [event for part in parts for event in part.events]
    return Chunk(first, np.array(status), reached, steps, events, digests, values)


def _event(system: System, done: Histories, j: int) -> str:
    if done.status[j] == loop.STUCK:
        return f"got no further than t = {done.reached[j]:.6g} s"
    joint = int(done.joint[j])
    return str(limit_event(system, joint, float(done.reached[j]), done.position[j])["text"])


def _observed(
    systems: Systems, rows: list[int], t: np.ndarray, done: Histories, drives: list[Drive], names: Sequence[str]
) -> dict[str, np.ndarray]:
    """The channels `names` (B, T) of the robots `rows`: the same numbers as a Run has, NaN where the states are."""
    n, first = len(systems.labels), systems.chains.first[0]
    direct = {f"joint/{i}/position": row for i, row in enumerate(first[:-1], 1)}
    direct |= {f"joint/{i}/velocity": n + row for i, row in enumerate(first[:-1], 1)}
    ends = {f"link/{i}/tip_deflection": i - 1 for i, link in enumerate(systems.robots[0].links, 1) if link.flexible}
    plain = all(name in direct or name in ends for name in names)
    deflections = np.zeros((len(systems), len(systems.links), len(t)))
    if plain and any(name in ends for name in names):
        tips(systems.chains, done.states, deflections)
    out = {name: np.full((len(systems), len(t)), np.nan) for name in names}
    for name in names if plain else ():
        out[name][rows] = done.states[rows, :, direct[name]] if name in direct else deflections[rows, ends[name]]
    for k in rows:
        if not plain or drives[k].follows.any():
            system, good = systems[k], int(np.count_nonzero(~np.isnan(done.states[k, :, 0])))
            part, work = done.states[k, :good].copy(), done.work[k, :good]
            forces = applied(system, t[:good], part, drives[k], inputs_of(system, drives[k]))
            run = record(system, t[:good], part, work, forces, {})
            for name in names:
                out[name][k, :good] = run[name]
    return out
