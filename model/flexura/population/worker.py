"""The robots of one chunk: simulated together in the core, observed, and reduced."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from .. import core
from ..errors import InputError
from ..io import STATIONS, balance_events
from ..robot import Robot
from ..signals import Drive, Loads, as_loads
from ..simulation.dynamics import simulate
from ..simulation.internal_forces import force_units
from ..simulation.recorder import LIMITS, LOSS, NUMERICAL, WORK, limit_event, recorded_channels
from ..simulation.start import (
    NO_START,
    apply_prescribed_motions,
    consistent_start,
    limit_error,
)
from ..system import NoEquilibrium, System, equilibrium
from ..threads import Threads
from .batch import Share
from .request import Request, check_drive
from .rows import ELEMENTS, START, Rows
from .store import Chunk

SILENT = ("still", "node", "payload")  # events that are no fault of a robot
WORDS = ("done", "limit", "stuck", "refused", "unbalanced")


Work = tuple[Share, list[bytes]]


def cores() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def compute(request: Request, share: Share, digests: list[bytes]) -> Chunk:
    """Simulate the robots of one chunk in this thread."""
    return chunk_of(request, share, digests, simulated(request, share, 1, core.Watch()))


class Part(NamedTuple):
    """The robots of a chunk, simulated: as in a Chunk, with the channels (b, T) of them all."""

    status: list[str]
    reached: np.ndarray
    steps: np.ndarray
    events: list[str]
    channels: dict[str, np.ndarray]


def simulated(request: Request, share: Share, threads: int, watch: Any) -> Part:
    """Run and observe robots, or begin to, if `watch` is stopped meanwhile.

    Args:
        request: what is asked.
        share: the robots.
        threads: how many work.
        watch: by which another thread stops the work.

    Returns:
        What was computed of each robot.

    Raises:
        InputError: a drive has another number of joints.
    """
    b, T, N = len(share), len(request.t), len(share.robots[0].links)
    for k, drive in enumerate(share.drives, 1):
        if drive is not None:
            check_drive(drive, N, f"robots[{share.first + k}].drive")
    part = Part(
        [""] * b,
        np.full(b, np.nan),
        np.zeros(b, dtype=np.int64),
        [""] * b,
        {name: np.full((b, T), np.nan) for name in request.channels},
    )
    first, columns = share.robots[0], _columns(share.robots[0], request.channels)
    dense = not first.stiffening or first.nodal
    if columns is None or dense or request.acting.payloads:
        _one_by_one(request, share, threads, watch, part)
        return part
    loads = _loads(request, share, part)
    for members, rows in share.groups:
        good = np.array([j for j, k in enumerate(members) if not part.status[k]], dtype=int)
        if len(good) < len(members):
            members, rows = members[good], rows.of(good.tolist())
        for some, q0 in _starts(request, share, members, rows, threads, part, loads):
            if len(some) and not watch.stopped:
                own = rows if len(some) == len(rows) else rows.of(some.tolist())
                _together(
                    request, share, members[some], own, q0, columns, threads, watch, part, loads
                )
    return part


def _loads(request: Request, share: Share, part: Part) -> dict[int, Loads]:
    """The loads on the links of each robot, by its number; `part` refuses one on which they have no
    place."""
    out: dict[int, Loads] = {}
    begin, end = float(request.t[0]), float(request.t[-1])
    for k in range(len(share)) if request.acting.loads else ():
        try:
            lengths = [link.length_m for link in share.robots[k].links]
            acting = request.acting.varied(share.values(k))
            out[k] = as_loads(acting.loads, lengths, begin, end)
        except InputError as error:
            part.status[k], part.events[k] = "refused", str(error)
    return out


def _bent(request: Request, rows: Rows) -> np.ndarray:
    """Which robots (B,) start in a static equilibrium of their own."""
    if request.q0 is not None or not (rows.counts[:, ELEMENTS] > 0).any():
        return np.zeros(len(rows), dtype=bool)
    if request.start is not None:
        return np.full(len(rows), request.start == "static")
    return np.asarray(rows.gravity.any(axis=1))


def _starts(
    request: Request,
    share: Share,
    members: np.ndarray,
    rows: Rows,
    threads: int,
    part: Part,
    loads: dict[int, Loads],
) -> list[tuple[np.ndarray, np.ndarray | None]]:
    """Robots of the same counts (B,) by their starts: which of them, and q0, (n,) for all of these,
    (count, n) for each, or None for straight links. `part` refuses one without equilibrium.

    loads: on the links of each robot, by its number; empty: none.
    """
    bent = _bent(request, rows)
    which = np.flatnonzero(bent)

    def start(j: int) -> np.ndarray | str | None:
        k, t = int(members[j]), float(request.t[0])
        drive = share.drives[k] or request.drive
        try:
            if not loads:
                return _equilibrium(rows.of([j]), drive, t)
            return consistent_start(
                System(share.robots[k]), t, drive, None, None, "static", loads[k]
            )[0]
        except NoEquilibrium as error:
            return f"{error}" if loads else f"{error}; {NO_START}"
        except InputError as error:
            return str(error)

    with Threads(threads) as pool:
        found = dict(zip(which, pool.each(start, map(int, which)), strict=True))
    for j, why in found.items():
        if isinstance(why, str):
            part.status[members[j]], part.events[members[j]] = "refused", why
    there = {j: q for j, q in found.items() if isinstance(q, np.ndarray)}
    # whom the core refuses has no equilibrium either, and is told why with those that are straight
    plain = np.flatnonzero(~bent).tolist() + [j for j, q in found.items() if q is None]
    each = (np.array(list(there), dtype=int), np.array(list(there.values())))
    return [(np.array(sorted(plain), dtype=int), request.q0), each]


def _equilibrium(rows: Rows, drive: Drive | None, t: float) -> np.ndarray | None:
    """The start (n,) of one robot: links in equilibrium, joints at their start or, if prescribed,
    on their motion at t [s]; None: the core refuses the robot, and will say why."""
    try:
        robot = core.Mechanics(
            rows.gravity[0],
            rows.payload[0],
            rows.counts,
            rows.numbers[0],
            rows.material[0],
            rows.lumps[0],
        )
    except core.Fault:
        return None
    q = np.zeros(robot.n)
    q[robot.first] = rows.numbers[0, :, START]
    if drive is not None:
        apply_prescribed_motions(robot.first, drive, t, q, np.zeros(robot.n))
    return equilibrium(robot, q)


OF_JOINTS = ("position", "velocity", "drive", "motor_position", "motor_velocity")


def _columns(robot: Robot, names: Sequence[str]) -> list[tuple[str, int]] | None:
    """The channels as the core names them; None if it does not have one of them."""
    known: dict[str, tuple[str, int]] = {}
    for i in range(len(robot.links)):
        known |= {f"joint/{i + 1}/{what}": (what, i) for what in OF_JOINTS}
    accounts = {"energy/work": WORK, "energy/loss": LOSS, "energy/numerical_loss": NUMERICAL}
    seen = [name for name in recorded_channels(robot)]
    known |= {name: ("account", k) for name, k in accounts.items()} | {
        name: ("seen", k) for k, name in enumerate(seen)
    }
    return [known[name] for name in names] if all(name in known for name in names) else None


def _packed(drive: Drive, loads: Loads | None) -> Any:
    """A drive, and loads on links, as the core takes them. Limits are each robot's own."""
    segments, ranges, gains = drive.packed()
    N = len(drive.joints)
    flags = drive.follows.astype(np.uint8)
    return core.Drive(
        segments,
        ranges,
        np.ascontiguousarray(gains),
        flags,
        np.zeros(N, dtype=np.uint8),
        np.tile([-np.inf, np.inf], (N, 1)),
        loads.packed() if loads else None,
    )


def _together(
    request: Request,
    share: Share,
    members: np.ndarray,
    rows: Rows,
    q0: np.ndarray | None,
    columns: list[tuple[str, int]],
    threads: int,
    watch: Any,
    part: Part,
    loads: dict[int, Loads],
) -> None:
    """Robots of the same counts through the core, into their places of `part`.

    q0, loads: as `_starts` gives and takes them.
    """
    common = request.drive or Drive.none(rows.numbers.shape[1])
    begin, end = float(request.t[0]), float(request.t[-1])
    given = [share.drives[k] or common for k in members]
    within = {id(drive): drive.within(begin, end) for drive in given}
    # robots that share a drive share its rows; one with loads of its own has its own
    keys = [(id(drive), k if loads else -1) for drive, k in zip(given, members, strict=True)]
    number = {key: j for j, key in enumerate(dict.fromkeys(keys))}
    packed = [_packed(within[drive], loads.get(k)) for drive, k in number]
    start = [np.zeros(0) if q is None else q.ravel() for q in (q0, request.qd0)]
    values, words, reached, steps, joints, positions, texts, balances = core.population(
        rows.counts,
        rows.numbers,
        rows.material,
        rows.lumps,
        rows.gravity,
        rows.payload,
        rows.limits,
        packed,
        np.array([number[key] for key in keys]),
        request.t,
        *start,
        request.rtol,
        request.method,
        request.numerical_damping,
        request.max_steps,
        columns,
        STATIONS,
        threads,
        watch,
    )
    for name, found in zip(request.channels, values, strict=True):
        part.channels[name][members] = found
    part.steps[members] = steps
    for j, k in enumerate(members):
        word = words[j]
        part.status[k] = word if word in WORDS else "stuck"
        if word != "refused":
            part.reached[k] = reached[j]
        if word == "done":
            part.status[k], part.events[k] = _trust(float(balances[j]))
        else:
            part.events[k] = _event(
                share.robots[k], word, int(joints[j]), float(reached[j]), positions[j], texts.get(j)
            )


def _trust(balance: float) -> tuple[str, str]:
    """What a balance (102) makes of a robot that is done, and what is said of it."""
    said = balance_events(balance, 0.0)
    text = said[0]["text"] if said else ""
    return "unbalanced" if said and said[0]["level"] == "ERROR" else "done", text


def _event(
    robot: Robot,
    word: str,
    joint: int,
    t: float,
    position: np.ndarray,
    text: tuple[int, str, str] | None,
) -> str:
    """Why a robot has not run to the end."""
    if word == "limit":
        return str(limit_event(System(robot), joint, t, position)["text"])
    if word == "refused" and text is None:
        return str(limit_error(System(robot), joint, float(position[joint])))
    link, key, said = text or (-1, "", "")
    if word != "refused":
        return said
    return str(InputError(said, key=key if link < 0 else f"link[{link + 1}].{key}"))


def _one_by_one(request: Request, share: Share, threads: int, watch: Any, part: Part) -> None:
    """Robots by `simulate`: of the dissertation's models, with payloads that change, and for
    channels that the core does not have (sensors, internal forces)."""

    def work(k: int) -> None:
        if not watch.stopped:
            _alone(request, share, k, part)

    with Threads(threads) as pool:
        pool.each(work, range(len(share)))


def _alone(request: Request, share: Share, k: int, part: Part) -> None:
    """Robot k by `simulate`, into its place of `part`."""
    robot = share.robots[k]
    forces = set() if robot.nodal else set(force_units(robot))
    try:
        acting = request.acting.varied(share.values(k))
        run = simulate(
            robot,
            request.t,
            share.drives[k] or request.drive,
            request.q0,
            request.qd0,
            request.rtol,
            method=request.method,
            start=request.start,
            numerical_damping=request.numerical_damping,
            loads=acting.loads,
            payloads=acting.payloads,
            internal_forces=not forces.isdisjoint(request.channels),
            max_steps=request.max_steps,
        )
        for name in request.channels:
            if name not in run:
                text = "expected a robot with the channels of the first one"
                raise InputError(text, key="channels", value=name)
    except (InputError, NoEquilibrium) as error:
        part.status[k], part.events[k] = "refused", str(error)
        return
    said = [e for e in run.meta["events"] if e["name"] not in SILENT]
    names = {event["name"] for event in said}
    part.status[k] = (
        "done"
        if run.complete
        else "limit"
        if names & set(LIMITS)
        else "unbalanced"
        if names <= {"balance", "not_finite"}
        else "stuck"
    )
    part.reached[k], part.steps[k], part.events[k] = (
        run.t[-1],
        run.meta["steps"],
        "; ".join(event["text"] for event in said),
    )
    rows = int(np.count_nonzero(np.isin(run.t, request.t)))
    for name in request.channels:
        part.channels[name][k, :rows] = run[name][:rows]


def chunk_of(request: Request, share: Share, digests: list[bytes], part: Part) -> Chunk:
    """The chunk, reduced if so asked."""
    values = {name: part.channels[name] for name in request.channels}
    if request.reduce:
        channels, values = values, {}
        for k in range(len(share)):
            if part.status[k] == "refused":
                continue
            kept = request.reduced(
                {name: rows[k] for name, rows in channels.items()}, share.first + k
            )
            values = values or {name: np.full(len(share), np.nan) for name in kept}
            if set(values) != set(kept):
                text = f"expected the same numbers of every robot, {sorted(values)}"
                raise InputError(text, key="reduce", value=sorted(kept))
            for name, value in kept.items():
                values[name][k] = value
    return Chunk(
        share.first, np.array(part.status), part.reached, part.steps, part.events, digests, values
    )
