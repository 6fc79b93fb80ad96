"""Populations: a batch of robots simulated chunk by chunk, in bounded memory, on all cores or a cluster, and restartable."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from . import core, forward
from .batch import Batch, Share
from .chunks import Chunk, Store, in_memory
from .drive import Drive
from .errors import InputError
from .record import LOSS, NUMERICAL, WORK, channel_units, limit_event, observed
from .request import Request
from .robot import Robot
from .rows import Rows
from .run import STATIONS
from .system import System

WORDS = ("done", "limit", "stuck", "refused")


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
    method: str = "auto", numerical_damping: bool = True, progress: Callable[[float], None] | None = None,
    channels: Sequence[str] | None = None,
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
    request = Request.checked(t_eval, drive, q0, qd0, rtol, method, numerical_damping, channels, reduce)
    for key, value in (("chunk", chunk), ("threads", 1 if threads is None else threads)):
        if isinstance(value, bool) or not isinstance(value, int) or value < 1:
            raise InputError("expected a whole number, 1 or more", key=key, value=value)
    store, units, complete, done = in_memory(), {}, False, 0
    shares = batch.shares(chunk)
    try:
        first = next(shares)
        example = first.robots[0]
        request = request.fitted(example)
        units = {} if request.reduce else {k: v for k, v in channel_units(example).items() if k in request.channels}
        store = in_memory() if folder is None else Store.opened(folder, request.spec() | {"count": batch.count, "chunk": chunk})
        todo = _todo(chain([first], shares), store)
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


Work = tuple[Share, list[bytes]]


def _todo(shares: Iterator[Share], store: Store) -> Iterator[Work | range]:
    """Chunks to be done: robots and their digests, which only a folder needs; a range stands for one that the store has."""
    for share in shares:
        digests = [b""] * len(share) if store.folder is None else share.digests
        if store.has(share.first, digests):
            yield range(len(share))
        else:
            yield share, digests


def _local(request: Request, todo: Iterator[Work | range], threads: int) -> Generator[Chunk | range, None, None]:
    """The chunks, each worked on by all threads of the core; the rows of the next one are made here meanwhile."""
    watch = core.Watch()
    waiting: deque[tuple[Work | range, Future[Part] | None]] = deque()

    def finished() -> Chunk | range:
        work, part = waiting.popleft()
        if isinstance(work, range):
            return work
        assert part is not None
        return _chunk(request, *work, part.result())

    with ThreadPoolExecutor(1) as pool:
        try:
            for work in todo:
                part = None if isinstance(work, range) else pool.submit(simulated, request, work[0], threads, watch)
                waiting.append((work, part))
                if len(waiting) > 2:
                    yield finished()
            while waiting:
                yield finished()
        except BaseException:
            watch.stop()
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _cluster(request: Request, todo: Iterator[Work | range], scheduler: str) -> Generator[Chunk | range, None, None]:
    from . import cluster

    return cluster.run(request, todo, scheduler)


def cores() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def compute(request: Request, share: Share, digests: list[bytes]) -> Chunk:
    """Simulate the robots of one chunk in this thread."""
    return _chunk(request, share, digests, simulated(request, share, 1, core.Watch()))


class Part(NamedTuple):
    """The robots of a chunk, simulated: as in a Chunk, with the channels (b, T) of them all."""

    status: list[str]
    reached: np.ndarray
    steps: np.ndarray
    events: list[str]
    channels: dict[str, np.ndarray]


def simulated(request: Request, share: Share, threads: int, watch: Any) -> Part:
    """Run and observe robots, or begin to, if `watch` is stopped meanwhile.

    Raises: InputError: a drive has another number of joints.
    """
    b, T, N = len(share), len(request.t), len(share.robots[0].links)
    for k, drive in enumerate(share.drives, 1):
        if drive is not None and len(drive.joints) != N:
            raise InputError(
                f"expected {N} joint drives, one a joint", key=f"robots[{share.first + k}].drive", value=len(drive.joints)
            )
    part = Part([""] * b, np.full(b, np.nan), np.zeros(b, dtype=np.int64), [""] * b,
                {name: np.full((b, T), np.nan) for name in request.channels})  # fmt: skip
    columns = _columns(share.robots[0], request.channels)
    if columns is None or not share.robots[0].stiffening:
        _one_by_one(request, share, watch, part)
        return part
    for members, rows in share.groups:
        _together(request, share, members, rows, columns, threads, watch, part)
    return part


def _columns(robot: Robot, names: Sequence[str]) -> list[tuple[str, int]] | None:
    """The channels as the core names them; None if it does not have one of them."""
    known: dict[str, tuple[str, int]] = {}
    for i in range(len(robot.links)):
        known |= {f"joint/{i + 1}/{what}": (what, i) for what in ("position", "velocity", "drive")}
    accounts = {"energy/work": WORK, "energy/loss": LOSS, "energy/numerical_loss": NUMERICAL}
    seen = [name for name in observed(robot)]
    known |= {name: ("account", k) for name, k in accounts.items()} | {name: ("seen", k) for k, name in enumerate(seen)}
    return [known[name] for name in names] if all(name in known for name in names) else None


def _packed(drive: Drive) -> Any:
    """A drive as the core takes it. Limits are each robot's own."""
    segments, ranges, gains = drive.packed()
    N = len(drive.joints)
    flags = drive.follows.astype(np.uint8)
    return core.Drive(
        segments, ranges, np.ascontiguousarray(gains), flags, np.zeros(N, dtype=np.uint8), np.tile([-np.inf, np.inf], (N, 1))
    )


def _together(
    request: Request,
    share: Share,
    members: np.ndarray,
    rows: Rows,
    columns: list[tuple[str, int]],
    threads: int,
    watch: Any,
    part: Part,
) -> None:
    """Robots of the same counts through the core, into their places of `part`."""
    common = request.drive or Drive.none(rows.numbers.shape[1])
    drives = [share.drives[k] or common for k in members]
    number = {id(drive): j for j, drive in enumerate({id(drive): drive for drive in drives}.values())}
    packed = [_packed(drive) for drive in {id(drive): drive for drive in drives}.values()]
    start = [np.zeros(0) if q is None else q for q in (request.q0, request.qd0)]
    values, words, reached, steps, joints, positions, texts = core.population(
        rows.counts, rows.numbers, rows.material, rows.gravity, rows.payload, rows.limits, packed,
        np.array([number[id(drive)] for drive in drives]), request.t, *start, request.rtol, request.method,
        request.numerical_damping, forward.MOST_STEPS, columns, STATIONS, threads, watch,
    )  # fmt: skip
    for name, found in zip(request.channels, values, strict=True):
        part.channels[name][members] = found
    part.steps[members] = steps
    for j, k in enumerate(members):
        word = words[j]
        part.status[k] = word if word in WORDS else "stuck"
        if word != "refused":
            part.reached[k] = reached[j]
        if word != "done":
            part.events[k] = _event(share.robots[k], word, int(joints[j]), float(reached[j]), positions[j], texts.get(j))


def _event(robot: Robot, word: str, joint: int, t: float, position: np.ndarray, text: tuple[int, str, str] | None) -> str:
    """Why a robot has not run to the end."""
    if word == "limit":
        return str(limit_event(System(robot), joint, t, position)["text"])
    if word == "refused" and text is None:
        limits = robot.links[joint].joint.limits
        assert limits is not None
        return str(forward.outside(joint, limits, float(position[joint])))
    link, key, said = text or (-1, "", "")
    if word != "refused":
        return said
    return str(InputError(said, key=key if link < 0 else f"link[{link + 1}].{key}"))


def _one_by_one(request: Request, share: Share, watch: Any, part: Part) -> None:
    """Robots by `simulate`: of the dissertation's model, and for channels that the core does not have."""
    for k in range(len(share)):
        if watch.stopped:
            return
        drive = share.drives[k] or request.drive
        try:
            run = forward.simulate(
                share.robots[k], request.t, drive, request.q0, request.qd0, request.rtol, method=request.method,
                numerical_damping=request.numerical_damping,
            )  # fmt: skip
        except InputError as error:
            part.status[k], part.events[k] = "refused", str(error)
            continue
        texts = [event["text"] for event in run.meta["events"] if event["level"] == "ERROR"]
        part.status[k] = "done" if run.complete else "limit" if any("stopped" in text for text in texts) else "stuck"
        part.reached[k], part.steps[k], part.events[k] = run.t[-1], run.meta["steps"], "" if run.complete else "; ".join(texts)
        rows = int(np.count_nonzero(np.isin(run.t, request.t)))
        for name in request.channels:
            part.channels[name][k, :rows] = run[name][:rows]


def _chunk(request: Request, share: Share, digests: list[bytes], part: Part) -> Chunk:
    """The chunk, reduced if so asked."""
    values = {name: part.channels[name] for name in request.channels}
    if request.reduce:
        channels, values = values, {}
        for k in range(len(share)):
            if part.status[k] == "refused":
                continue
            kept = request.reduced({name: rows[k] for name, rows in channels.items()}, share.first + k)
            values = values or {name: np.full(len(share), np.nan) for name in kept}
            if set(values) != set(kept):
                text = f"expected the same numbers of every robot, {sorted(values)}"
                raise InputError(text, key="reduce", value=sorted(kept))
            for name, value in kept.items():
                values[name][k] = value
    return Chunk(share.first, np.array(part.status), part.reached, part.steps, part.events, digests, values)
