"""Populations: a batch of robots simulated chunk by chunk, in bounded memory, on all cores or a
cluster, and restartable."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import closing
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from threading import Timer
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from .. import core
from ..errors import InputError
from ..io import Run, Tables, check_memory, check_progress, summary, whole
from ..optional import Optional
from ..robot import Robot
from ..signals import Drive, LoadsLike, PayloadsLike, acts
from ..simulation.problem import Budget
from ..threads import Threads
from . import dask_cluster, worker
from .batch import Batch, Share
from .request import Request, units_of
from .results import one_run, tabulated
from .store import MANIFEST, Chunk, Store, in_memory, manifest

if TYPE_CHECKING:
    import pandas as pd

pandas = Optional("pandas")


@dataclass(frozen=True, repr=False)
class Population:
    """A simulated batch: `t` (T,) [s], units of the channels, whether all `count` robots are
    `complete`, and their chunks.

    `population["tip/x"]` is (count, T), a reduced number (count,), `population.status` (count,) of
    "done", "limit", "stuck", "unbalanced" (energies that miss more than a tenth) or "refused" (a
    robot that cannot be assembled or starts outside its limits). A robot's values are NaN from
    where it stopped. Of an interrupted population only the robots that are done have rows:
    `population.robots`, counted from 1. `base`: the robot that `Batch.vary` began with; None for
    other batches. `acting`: tables of the loads and changes of the payload, if there were any.
    """

    t: np.ndarray
    units: Mapping[str, str]
    count: int
    complete: bool
    store: Store
    base: Robot | None = None
    acting: Mapping[str, list[Tables]] = field(default_factory=dict)

    @staticmethod
    def read(folder: str | Path) -> Population:
        """Open a population's folder, complete or not.

        Args:
            folder: what `simulate` was given, or `flexura simulate --vary` left.

        Returns:
            The population; its chunks are read when they are needed.

        Raises:
            InputError: there is no population.
        """
        begun = manifest(folder)
        try:
            base = None if begun.get("base") is None else Robot.from_dict(begun["base"])
            t, count = np.array(begun["t_s"], dtype=float), int(begun["count"])
            units = {str(name): str(unit) for name, unit in begun.get("units", {}).items()}
            acting = begun.get("acting") or {}
            acting = {name: acting[name] for name in ("loads", "payloads") if name in acting}
        except (ValueError, TypeError, AttributeError) as error:
            raise InputError(
                f"not the request of a population ({error})", file=str(Path(folder) / MANIFEST)
            ) from None
        store = Store(Path(folder))
        return Population(t, units, count, store.rows() == count, store, base, acting)

    def __iter__(self) -> Iterator[Chunk]:
        """The chunks that are done, in order, one in memory at a time."""
        return self.store.chunks()

    def __getitem__(self, name: str) -> np.ndarray:
        """A channel (robots, T), or a reduced number (robots,)."""
        parts = [(chunk.values.get(name), len(chunk)) for chunk in self]
        known = next((values for values, _ in parts if values is not None), None)
        if known is None:
            kept = ", ".join(next(iter(self)).values) if len(self.robots) else "nothing"
            raise KeyError(f"no {name!r} was kept; kept are: {kept}")
        # a chunk of refused robots has no reduced numbers
        nothing = lambda rows: np.full((rows, *known.shape[1:]), np.nan)
        return np.concatenate(
            [nothing(rows) if values is None else values for values, rows in parts]
        )

    @property
    def robots(self) -> np.ndarray:
        """The numbers of the robots that are done, from 1, as `run` takes them."""
        return np.concatenate(
            [np.arange(c.first, c.first + len(c)) + 1 for c in self] or [np.zeros(0, dtype=int)]
        )

    @property
    def status(self) -> np.ndarray:
        """How each robot ended."""
        return np.concatenate([c.status for c in self] or [np.zeros(0, dtype=str)])

    def table(self) -> tuple[dict[str, np.ndarray], dict[str, str]]:
        """One row a robot that is done: what was varied, how it ended, and its results.

        Returns:
            Columns: `robot` (from 1); one a varied key, named as in `--vary`; `status`,
            `reached_s`, `event`; of a channel `CHANNEL/peak`, the largest magnitude, and
            `CHANNEL/end`, the last value; reduced numbers by their names. Units of the channels'
            columns.
        """
        return tabulated(self)

    def to_pandas(self) -> pd.DataFrame:
        """The table over the index `robot`, counted from 1; `attrs` has "units" by column.

        Raises:
            Missing: pandas is not installed.
        """
        columns, units = self.table()
        frame = pandas.DataFrame(columns).set_index("robot")
        frame.attrs = {"units": units}
        return frame

    def run(self, robot: int) -> Run:
        """What was kept of one robot, as a Run.

        Args:
            robot: its number, from 1.

        Returns:
            Its channels, with the robot in the metadata if it is known.

        Raises:
            InputError: there is no such robot, it is not done, or no channels were kept.
        """
        return one_run(self, robot)

    def __repr__(self) -> str:
        return summary.text(*self._summary())

    def _repr_html_(self) -> str:
        return summary.html(*self._summary())

    def _summary(self) -> tuple[str, list[tuple[str, str]]]:
        done = "complete" if self.complete else f"{self.store.rows()} of them done"
        first = next(iter(self), None)
        rows = [("t", f"{self.t[0]:.6g} to {self.t[-1]:.6g} s, {len(self.t)} samples")]
        if first is not None:
            rows += [("varied", summary.listed(first.vary))] if first.vary else []
            rows.append(("kept", summary.listed(first.values)))
        rows.append(
            ("chunks in", "memory" if self.store.folder is None else str(self.store.folder))
        )
        name = f" of {self.base.name}" if self.base is not None and self.base.name else ""
        return f"Population{name}: {self.count} robots, {done}", rows


def simulate(
    batch: Batch,
    t_eval: ArrayLike,
    drive: Drive | None = None,
    q0: ArrayLike | None = None,
    qd0: ArrayLike | None = None,
    rtol: float = 1e-6,
    *,
    method: str = "auto",
    start: str | None = None,
    numerical_damping: bool = True,
    progress: Callable[[float], None] | None = None,
    channels: Sequence[str] | None = None,
    reduce: Callable[[np.ndarray, dict[str, np.ndarray]], Any] | None = None,
    folder: str | Path | None = None,
    chunk: int = 256,
    threads: int | None = None,
    scheduler: str | None = None,
    max_steps: int | None = None,
    wall_time: float | None = None,
    loads: LoadsLike = None,
    payloads: PayloadsLike = None,
    internal_forces: bool = False,
) -> Population:
    """Simulate every robot of a batch as `flexura.simulate` does one, to the last bit.

    A robot that fails ends alone.

    Args:
        batch: the robots.
        t_eval: ascending times (T,) [s].
        drive: of robots without a drive of their own.
        q0: configuration of all at the start (n,); None: each robot's own `start`.
        qd0: its rates (n,).
        rtol: as in `flexura.simulate`.
        method: as in `flexura.simulate`.
        start: as in `flexura.simulate`.
        numerical_damping: as in `flexura.simulate`.
        progress: called with the finished fraction.
        channels: that are kept; None: joint positions and tip deflections.
        reduce: function of t and the channels that gives a number, or {name: number}; only these
            numbers are kept.
        folder: gets a Parquet file each `chunk` robots, written as a whole or not at all. The same
            call goes on where it was stopped. One that asks for something else is refused by name.
        chunk: robots in a file.
        threads: None: one a core.
        scheduler: address of a Dask scheduler, whose workers then do the chunks.
        max_steps: the budget of each robot, as in `flexura.simulate`.
        wall_time: seconds after which the population is stopped; it then has the chunks that are
            done.
        loads: as in `flexura.simulate`; `Batch.vary` varies their numbers.
        payloads: as in `flexura.simulate`; `Batch.vary` varies their numbers.
        internal_forces: all channels of internal forces are kept too. Some of them, and sensors,
            are named in `channels`.

    Returns:
        The Population.

    Raises:
        InputError: an argument is not what is expected, or does not fit into memory.
    """
    request = Request.checked(
        t_eval,
        drive,
        q0,
        qd0,
        rtol,
        method,
        start,
        numerical_damping,
        channels,
        reduce,
        max_steps,
        loads,
        payloads,
        internal_forces,
    )
    _check_varied(batch, request)
    late = time.perf_counter() + Budget.checked(None, wall_time).wall_s
    for key, value in (("chunk", chunk), ("threads", 1 if threads is None else threads)):
        whole(value, key, 1)
    for key, text in (("folder", folder), ("scheduler", scheduler)):
        if not (text is None or isinstance(text, str | Path)):
            raise InputError("expected a text", key=key, value=text)
    check_progress(progress)
    store, units, complete, done = in_memory(), {}, False, 0
    _check_memory(batch, request, chunk, folder)
    shares = batch.shares(chunk)
    try:
        first = next(shares)
        example = first.robots[0]
        request = request.fitted(example)
        _check_memory(batch, request, chunk, folder)
        units = (
            {}
            if request.reduce
            else {k: v for k, v in units_of(example).items() if k in request.channels}
        )
        store = (
            in_memory()
            if folder is None
            else Store.opened(folder, request.spec() | _contents(batch, chunk, units))
        )
        todo = _todo(chain([first], shares), store)
        source = (
            _local(request, todo, threads or worker.cores(), late)
            if scheduler is None
            else dask_cluster.run(request, todo, scheduler)
        )
        with closing(source) as chunks:
            for made in chunks:
                if isinstance(made, Chunk):
                    rows = slice(made.first, made.first + len(made))
                    values = {key: column[rows] for key, column in batch.varied.items()}
                    store.put(replace(made, vary=values))
                done += len(made)
                if progress is not None:
                    progress(done / batch.count)
                if time.perf_counter() > late:
                    break
        complete = done == batch.count
    except KeyboardInterrupt:
        pass
    acting = request.acting.spec()
    return Population(request.t, units, batch.count, complete, store, batch.base, acting)


def _check_varied(batch: Batch, request: Request) -> None:
    """Raises InputError for a key of loads and payloads that leads nowhere, and for a value that is
    wrong at an end of its range."""
    for key, values in batch.varied.items():
        for end in (values.min(), values.max()) if acts(key) else ():
            request.acting.varied({key: float(end)})


def _contents(batch: Batch, chunk: int, units: Mapping[str, str]) -> dict[str, Any]:
    """What a folder says of its robots, so that it can be read without the batch."""
    base = None if batch.base is None else batch.base.to_dict()
    about = {"count": batch.count, "chunk": chunk, "units": dict(units)}
    return about | {"base": base, "vary": list(batch.varied)}


def _todo(shares: Iterator[Share], store: Store) -> Iterator[worker.Work | range]:
    """Chunks to be done: robots and their digests, which only a folder needs; a range stands for
    one that the store has."""
    for share in shares:
        digests = [b""] * len(share) if store.folder is None else share.digests
        if store.has(share.first, digests):
            yield range(len(share))
        else:
            yield share, digests


A_ROBOT = 4096  # bytes that the description of one takes


def _check_memory(batch: Batch, request: Request, chunk: int, folder: Any) -> None:
    """Raises InputError for a population that does not fit into memory."""
    wide = 8.0 * len(request.t) * max(len(request.channels), 1)
    rows = "a chunk of" if folder is not None or request.reduce else ""
    count = min(chunk, batch.count) if rows else batch.count
    what = (
        f"{len(request.channels) or 'the'} channels at {len(request.t)} times of {rows} {count} "
        f"robots; "
        f"expected {'smaller chunks' if rows else 'a folder'}, fewer channels, times or robots"
    )
    check_memory(
        3.0 * wide * count + A_ROBOT * min(chunk, batch.count),
        " ".join(what.split()),
        "chunk" if rows else "robots",
        count,
    )


def _local(
    request: Request, todo: Iterator[worker.Work | range], threads: int, late: float = math.inf
) -> Generator[Chunk | range, None, None]:
    """The chunks, each worked on by all threads of the core; the rows of the next one are made here
    meanwhile. At the time `late` they are stopped, and what is not done is not given."""
    watch = core.Watch()
    timer = Timer(max(late - time.perf_counter(), 0.0), watch.stop) if late < math.inf else None
    waiting: deque[tuple[worker.Work | range, Future[worker.Part] | None]] = deque()

    def finished(pool: Threads) -> Chunk | range:
        work, part = waiting.popleft()
        if isinstance(work, range):
            return work
        assert part is not None
        return worker.chunk_of(request, *work, pool.result(part))

    with Threads(1) as pool:
        try:
            if timer is not None:
                timer.start()
            for work in todo:
                part = (
                    None
                    if isinstance(work, range)
                    else pool.submit(worker.simulated, request, work[0], threads, watch)
                )
                waiting.append((work, part))
                while len(waiting) > 2:
                    made = finished(pool)
                    if watch.stopped:
                        return
                    yield made
            while waiting:
                made = finished(pool)
                if watch.stopped:
                    return
                yield made
        except BaseException:
            watch.stop()
            pool.shutdown(wait=False, cancel_futures=True)
            raise
        finally:
            if timer is not None:
                timer.cancel()
