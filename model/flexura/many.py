"""Many robots of one topology by exponential steps, one after the other, with nothing of Python between two of them.

One workspace serves all robots of a call; each begins as a single run does, and gives the same numbers to the last bit.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from . import exponential, loop
from .acting import Inputs
from .assembly import Systems
from .basis import Basis, basis
from .chain import Chain, Work, of_many, one_of, workspace
from .compiled import compiled, internal
from .course import FIRST, slack
from .drive import Drive
from .lanes import room
from .law import Law, none
from .loop import Memory
from .observe import tip
from .past import Past, past
from .pinned import pinned
from .system import limits


class Many(NamedTuple):
    """What B runs begin with: an entry for each robot, or from where to where its rows are."""

    chains: Chain  # every field with a leading axis (B,)
    segments: np.ndarray  # (K, 10) of all drives, and below, their rows (B, 2)
    of_segments: np.ndarray
    breaks: np.ndarray  # (J,)
    of_breaks: np.ndarray
    ranges: np.ndarray  # (B, N, 4)
    kp: np.ndarray  # (B, N)
    kd: np.ndarray
    follows: np.ndarray
    low: np.ndarray
    high: np.ndarray
    states: np.ndarray  # (B, 2n + 2)


class Histories(NamedTuple):
    """What B runs give: states NaN from where a robot stopped, and how each ended."""

    states: np.ndarray  # (B, T, 2n) in the solver's coordinates
    work: np.ndarray  # (B, T, 2) of the drives, and lost [J]
    status: np.ndarray  # (B,) int: loop.DONE, LIMIT or STUCK
    reached: np.ndarray  # (B,) the last good instant [s]
    joint: np.ndarray  # (B,) int: the joint that reached its limit (from 0), -1
    position: np.ndarray  # (B, N) of the joints, at the last good instant
    steps: np.ndarray  # (B,) int


def collected(systems: Systems, drives: Sequence[Drive], states: np.ndarray) -> Many:
    """The robots' drives and limits beside their constants; a drive that several have stands there once."""
    known: dict[int, int] = {}
    packed: list[tuple[Any, ...]] = []
    for drive in drives:
        if id(drive) not in known:
            known[id(drive)] = len(packed)
            packed.append((*drive.packed(), drive.breaks, drive.follows.astype(np.int64)))
    segments, ranges, gains, breaks, follows = zip(*packed, strict=True)
    which = np.array([known[id(drive)] for drive in drives])
    ends = slack(limits(systems.robots))
    of = lambda parts: np.array([np.cumsum([0, *map(len, parts)])[k : k + 2] for k in range(len(parts))])[which]
    each = lambda parts: np.array(parts)[which]
    return Many(
        systems.chains, np.concatenate(segments), of(segments), np.concatenate(breaks), of(breaks), each(ranges),
        np.ascontiguousarray(each(gains)[:, :, 0]), np.ascontiguousarray(each(gains)[:, :, 1]), each(follows),
        np.ascontiguousarray(ends[:, :, 0]), np.ascontiguousarray(ends[:, :, 1]), states,
    )  # fmt: skip


@internal
def _begin(x: Many, k: int, w: Work, m: Memory, b: Basis, p: Past, t: np.ndarray) -> None:
    """Workspace and memory as new ones of robot k are at its start."""
    for j in range(m.s.shape[0]):
        m.s[j] = 0.0
    for j in range(p.s.shape[0]):
        p.s[j] = 0.0
    for i in range(m.big.shape[0]):
        for j in range(m.big.shape[1]):
            m.big[i, j] = 0.0
        w.held[i] = x.chains.locked[k, i] | x.follows[k, i]
    for i in range(b.phi.shape[0]):
        b.seen[i] = np.inf
        for j in range(b.phi.shape[1]):
            b.phi[i, j] = 1.0 if i == j else 0.0
    for i in range(b.w2.shape[0]):
        b.w2[i], b.d2[i] = 0.0, 0.0
    for j in range(m.z.shape[0]):
        m.z[j] = x.states[k, j]
    m.s[loop.T], m.s[loop.OUT], m.s[loop.ERR] = t[0], 1.0, 1.0
    m.s[loop.LONGEST], m.s[loop.H] = np.inf, (t[-1] - t[0]) * FIRST


@compiled
def run(
    x: Many, w: Work, m: Memory, b: Basis, p: Past, law: Law, rtol: float, t: np.ndarray, stop: np.ndarray, history: np.ndarray,
    rows: np.ndarray, out: Histories,
) -> None:  # fmt: skip
    """The runs `rows` of x along t (T,), into `out`, by way of `history` (T, 2n + 2), until `stop` (1,) is set."""
    n, x, out = m.a.shape[0], pinned(x), pinned(out)
    for k in rows:
        if stop[0]:
            return
        _begin(x, k, w, m, b, p, t)
        f, g = x.of_segments[k], x.of_breaks[k]
        chain = of_many(x.chains, k)
        inputs = Inputs(
            x.segments[f[0] : f[1]], x.ranges[k], x.kp[k], x.kd[k], x.follows[k], x.low[k], x.high[k], x.breaks[g[0] : g[1]], law
        )
        for j in range(m.z.shape[0]):
            history[0, j] = x.states[k, j]
        while m.s[loop.STATUS] == loop.RUNNING and not stop[0]:
            exponential.advance(chain, w, inputs, m, b, p, rtol, t, history, 2000)
        for r in range(int(m.s[loop.OUT])):
            for j in range(2 * n):
                out.states[k, r, j] = history[r, j]
            out.work[k, r, 0], out.work[k, r, 1] = history[r, 2 * n], history[r, 2 * n + 1]
        for i in range(out.position.shape[1]):
            out.position[k, i] = m.z[chain.first[i]]
        out.status[k], out.steps[k] = int(m.s[loop.STATUS]), int(m.s[loop.STEPS])
        if out.status[k] != loop.DONE:
            out.reached[k] = m.s[loop.T]
        if out.status[k] == loop.LIMIT:
            out.joint[k] = int(m.s[loop.FAULT])


@compiled
def tips(chains: Chain, states: np.ndarray, deflections: np.ndarray) -> None:
    """Tip deflections (B, N, T) [m] of states (B, T, 2n), as `observe` finds them, without all the rest."""
    for k in range(states.shape[0]):
        chain = pinned(of_many(chains, k))
        for i in range(deflections.shape[1]):
            for s in range(states.shape[1]):
                deflections[k, i, s] = tip(chain, i, states[k, s, chain.first[i] + 1 : chain.first[i + 1]])[0]


def workplace(systems: Systems, times: int) -> tuple[Work, Memory, Basis, Past, Law, np.ndarray]:
    """What `run` needs beside the robots, for such ones and so many times of output."""
    n, chain = len(systems.labels), one_of(systems.chains, 0)
    history = room(a=(times, 2 * n + 2))["a"]
    return workspace(chain), loop.memory(len(systems.links), n), basis(n), past(n), none(), history
