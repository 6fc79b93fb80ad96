"""Populations: a batch of robots simulated chunk by chunk, in bounded memory, on all cores or a cluster, and restartable."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from . import forward, loop
from .assembly import assemble_all
from .batch import Batch, Item, digest
from .chunks import Chunk, Store, in_memory
from .course import applied, inputs_of
from .drive import Drive
from .engine import WORDS, Histories, cores, engine
from .errors import InputError
from .observe import tips
from .record import channel_units, limit_event, record
from .request import Request
from .system import System


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
    """Chunks to be done: (first robot, robots, digests); a range stands for one that the store has."""
    first = 0
    while items := list(islice(robots, size)):
        digests = [digest(robot, drive) for robot, drive in items]
        if store.has(first, digests):
            yield range(len(items))
        else:
            yield first, items, digests
        first += len(items)


def _local(request: Request, todo: Iterator[Work | range], threads: int) -> Generator[Chunk | range, None, None]:
    for work in todo:
        yield work if isinstance(work, range) else compute(request, *work, threads)


def _cluster(request: Request, todo: Iterator[Work | range], scheduler: str) -> Generator[Chunk | range, None, None]:
    from . import cluster

    return cluster.run(request, todo, scheduler)


def compute(request: Request, first: int, items: list[Item], digests: list[bytes], threads: int) -> Chunk:
    """Simulate the robots of one chunk; `first` is the number of its first robot, from 0."""
    B, t = len(items), request.t
    events, status = [""] * B, ["refused"] * B
    reached, steps = np.full(B, np.nan), np.zeros(B, dtype=np.int64)
    starts: list[tuple[int, System, Drive, np.ndarray]] = []
    for k, system in enumerate(assemble_all([robot for robot, _ in items])):
        own = items[k][1] or request.drive or Drive.none(len(items[k][0].links))
        if len(own.joints) != len(items[k][0].links):
            raise InputError(
                f"expected {len(items[k][0].links)} joint drives, one a joint", key=f"robots[{first + k + 1}].drive",
                value=len(own.joints),
            )  # fmt: skip
        try:
            if isinstance(system, InputError):
                raise system
            q, qd = forward.initial(system, t[0], own, request.q0, request.qd0)
            starts.append((k, system, own, forward.to_state(system, q, qd)))
        except InputError as error:
            events[k] = str(error)
    values: dict[str, np.ndarray] = {}
    if not request.reduce:
        values = {name: np.full((B, len(t)), np.nan) for name in request.channels}
    if starts:
        rows, systems, drives, states = zip(*starts, strict=True)
        done = engine(systems, t, drives, np.array(states), request.rtol, request.method, threads)
        for j, k in enumerate(rows):
            status[k], reached[k], steps[k] = WORDS[int(done.status[j])], done.reached[j], done.steps[j]
            events[k] = _event(systems[j], done, j)
            kept = observed(systems[j], t, done.states[j], done.work[j], drives[j], request.channels)
            if request.reduce:
                kept = request.reduced(kept, first + k)
                if not values:
                    values = {name: np.full(B, np.nan) for name in kept}
                if set(values) != set(kept):
                    text = f"expected the same numbers of every robot, {sorted(values)}"
                    raise InputError(text, key="reduce", value=sorted(kept))
            for name, value in kept.items():
                values[name][k] = value
    return Chunk(first, np.array(status), reached, steps, events, digests, values)


def _event(system: System, done: Histories, j: int) -> str:
    if done.status[j] == loop.STUCK:
        return f"got no further than t = {done.reached[j]:.6g} s"
    if done.status[j] != loop.LIMIT:
        return ""
    joint = int(done.joint[j])
    return str(limit_event(system, joint, float(done.reached[j]), done.position[j])["text"])


def observed(
    system: System, t: np.ndarray, states: np.ndarray, work: np.ndarray, drive: Drive, names: Sequence[str]
) -> dict[str, np.ndarray]:
    """The channels `names` (T,) of states (T, 2n): the same numbers as a Run has, NaN where the states are."""
    good = int(np.count_nonzero(~np.isnan(states[:, 0])))
    out = {name: np.full(len(t), np.nan) for name in names}
    direct = {f"joint/{i}/position": row for i, row in enumerate(system.joint_rows, 1)}
    direct |= {f"joint/{i}/velocity": system.n + row for i, row in enumerate(system.joint_rows, 1)}
    ends = {f"link/{i}/tip_deflection": i - 1 for i, link in enumerate(system.robot.links, 1) if link.flexible}
    if drive.follows.any() or not all(name in direct or name in ends for name in names):
        part = states[:good].copy()
        run = record(system, t[:good], part, work[:good], applied(system, t[:good], part, drive, inputs_of(system, drive)), {})
        for name in names:
            out[name][:good] = run[name]
        return out
    deflection = np.zeros((good, len(system.links)))
    tips(system.chain, states[:good], deflection)
    for name in names:
        out[name][:good] = states[:good, direct[name]] if name in direct else deflection[:, ends[name]]
    return out
