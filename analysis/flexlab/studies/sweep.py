"""Many simulations: cases in, one row of numbers each out, on all cores, and nothing lost when
interrupted."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx
from flexura.errors import OutOfMemory
from flexura.signals import Manoeuvre

POOL_PAYS_S = (
    5.0  # the work that is worth starting processes for, each of which imports the solver first
)

Row = dict[str, Any]


@dataclass(frozen=True)
class Case:
    """One simulation of a study: its place in the study (columns), robot, manoeuvre.

    `link`, from 1, is the one whose tip the study is about; `from_s` begins the later window.
    """

    values: Row
    robot: fx.Robot
    manoeuvre: Manoeuvre
    link: int
    from_s: float


@dataclass(frozen=True)
class Finding:
    """The dissertation's claim, whether these runs bear it out, in words and numbers; None: too few
    of them to say."""

    claim: str
    reproduced: bool | None
    words: str
    numbers: dict[str, float]


@dataclass(frozen=True)
class Study:
    """A finished study, or what an interruption left of it (`complete` false); `about`: the
    manoeuvre, and what was kept.

    `rows`: one dictionary a case: its `values`; `link_<i>_max_m` and `link_<i>_later_m`, the
    largest tip deflection in the whole run and from `from_s` on (NaN where that is beyond its end);
    `max_m`, `later_m`: the same of the study's own `link`; `joint_<i>_peak_N` or `_N_m`;
    `first_frequency_Hz` at the start, joints locked; `complete`, `energy_error`, `wall_s`, `error`.
    """

    name: str
    robot: fx.Robot
    about: str
    link: int
    rows: list[Row]
    finding: Finding
    complete: bool


def last_flexible(robot: fx.Robot) -> int:
    """The last flexible link, from 1. Raises InputError where none is."""
    flexible = [i for i, link in enumerate(robot.links, 1) if link.flexible]
    if not flexible:
        raise fx.InputError("expected a robot with a flexible link", key="link.elements", value=0)
    return flexible[-1]


def sweep(
    cases: Sequence[Case],
    *,
    rtol: float,
    jobs: int,
    progress: Callable[[float], None],
    channels: Path | None = None,
) -> tuple[list[Row], bool]:
    """The rows of all cases, in their order, and whether all were done; with `channels` every run
    is saved there.

    The first case is simulated here. Where the others would take longer than starting `jobs`
    processes does, these share them. Ctrl-C ends the sweep with the rows that are done.
    """
    done: dict[int, Row] = {}
    work = [
        (k, case, rtol, None if channels is None else channels / f"{k:03d}")
        for k, case in enumerate(cases)
    ]
    try:
        begun = time.perf_counter()
        done[0] = _row(work[0])
        progress(1 / len(work))
        rest = (time.perf_counter() - begun) * (len(work) - 1)
        for k, row in (
            _pool(work[1:], jobs)
            if jobs > 1 and rest > POOL_PAYS_S
            else ((w[0], _row(w)) for w in work[1:])
        ):
            done[k] = row
            progress(len(done) / len(work))
    except KeyboardInterrupt:
        pass
    return [done[k] for k in sorted(done)], len(done) == len(work)


_Work = tuple[int, Case, float, "Path | None"]


def _pool(work: list[_Work], jobs: int) -> Iterator[tuple[int, Row]]:
    pool = ProcessPoolExecutor(
        min(jobs, len(work)), get_context("spawn"), initializer=_leave_interrupts_to_the_parent
    )
    try:
        futures = {pool.submit(_row, one): one[0] for one in work}
        for future in as_completed(futures):
            yield futures[future], future.result()
    finally:
        pool.shutdown(cancel_futures=True)


def _leave_interrupts_to_the_parent() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _row(work: _Work) -> Row:
    """Simulate one case. What cannot be simulated is a row with its `error`; an interruption goes
    on."""
    _, case, rtol, folder = work
    robot, row = case.robot, dict(case.values)
    try:
        system = fx.assemble(robot)
        row["first_frequency_Hz"] = float(min(fx.frequencies(system), default=np.nan))
        run = fx.simulate(
            system,
            case.manoeuvre.t,
            case.manoeuvre.drive,
            rtol=rtol,
            start=case.manoeuvre.start,
            loads=case.manoeuvre.loads,
            payloads=case.manoeuvre.payloads,
        ).uninterrupted()
    except OutOfMemory:
        raise
    except fx.FlexuraError as error:
        return row | {"complete": False, "error": str(error)}
    later = run.t >= case.from_s - 1e-9
    for i, link in enumerate(robot.links, 1):
        if link.flexible:
            size = np.abs(run[f"link/{i}/tip_deflection"])
            row[f"link_{i}_max_m"] = float(size.max())
            row[f"link_{i}_later_m"] = float(size[later].max()) if later.any() else np.nan
    row["max_m"], row["later_m"] = row[f"link_{case.link}_max_m"], row[f"link_{case.link}_later_m"]
    for i in range(1, len(robot.links) + 1):
        unit = run.units[f"joint/{i}/drive"].replace(" ", "_")
        row[f"joint_{i}_peak_{unit}"] = float(np.abs(run[f"joint/{i}/drive"]).max())
    row |= {
        "complete": run.complete,
        "energy_error": run.meta["energy_error"],
        "wall_s": run.meta["wall_s"],
    }
    row["error"] = "; ".join(event["text"] for event in run.meta["events"])
    if folder is not None:
        run.meta["case"] = case.values
        run.save(folder)
    return row


def cores() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
