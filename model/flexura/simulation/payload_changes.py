"""Runs in which the payload changes: one run after the other, with an impact between them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..control import Controller, Sampled
from ..errors import InputError
from ..signals import Drive, PayloadChange
from ..system import System, impact, with_payload
from .problem import Budget, Problem, Progress, Solution

Solver = Callable[[Problem, Progress], Solution]
ON_TICK = 1e-9  # of a tick: how near an instant must be to it


def check(problem: Problem, changes: Sequence[PayloadChange], until: Any) -> None:
    """Refuse what a change of the payload would interrupt.

    Args:
        problem: the run.
        changes: of its payload.
        until: the condition that ends it, or None.

    Raises:
        InputError: there is such a condition; a Controller, whose memory would begin anew; a
            Sampled, and an instant between two of its ticks.
    """
    drive, t0 = problem.drive, float(problem.t[0])
    if until is not None:
        text = "expected none where the payload changes: end the run at t_eval"
        raise InputError(text, key="until", value="a function")
    if isinstance(drive, Controller):
        text = (
            "expected a Drive, a function or a Sampled where the payload changes: a Controller "
            "would begin anew there"
        )
        raise InputError(text, key="drive", value="Controller")
    for i, change in enumerate(changes, 1) if isinstance(drive, Sampled) else ():
        ticks = (change.at_s - t0) * float(drive.rate_Hz)
        if abs(ticks - round(ticks)) > ON_TICK:
            text = f"expected an instant at a tick, a multiple of 1/{drive.rate_Hz:g} s"
            raise InputError(text, key=f"payload[{i}].at_s", value=change.at_s)


def solve(
    problem: Problem, changes: Sequence[PayloadChange], solver: Solver, progress: Progress
) -> Solution:
    """Integrate from change to change.

    Args:
        problem: the run, with the payload at its start.
        changes: of the payload, within the run.
        solver: of one part.
        progress: called with the finished fraction.

    Returns:
        The Solution; its `systems` say with which robot each row is. Its energy jumps by what (138)
            says and by what is let go.
    """
    t, parts = problem.t, []
    jumps: list[float] = []
    changed_by: list[dict[str, Any]] = []
    span, used = float(t[-1] - t[0]), 0
    system, q, qd = problem.system, problem.q, problem.qd
    ends = [change.at_s for change in changes] + [float(t[-1])]
    at = float(t[0])
    for k, end in enumerate(ends):
        last = k == len(changes)
        inside = t[(t > at) & (t < end)] if not last else t[t > at]
        times = np.concatenate([[at], inside, [] if last else [end]])
        budget = Budget(max(problem.budget.steps - used, 1), problem.budget.wall_s)
        part = replace(problem, system=system, t=times, q=q, qd=qd, budget=budget)
        done = solver(part, _share(progress, (at - t[0]) / span, (end - at) / span))
        used += int(done.meta.get("steps", 0)) + int(done.meta.get("rejected", 0))
        asked = np.ones(len(done.t), dtype=bool) if last else done.t != end
        asked &= (done.t != at) | np.isin(at, t)
        parts.append((system, done, asked))
        jumps.append(float(sum(jump["J"] for jump in changed_by)))
        if last or not done.meta["complete"]:
            break
        n = system.n
        q, before = done.states[-1, :n].copy(), done.states[-1, n:].copy()
        changed = with_payload(system, changes[k])
        rows = _given_rows(problem)
        happened = impact(system.fixed(q), changed.fixed(q), q, before, rows)
        qd = happened.qd
        energy = [
            float(one.observe(q[None], rate[None])[0, -3:].sum())
            for one, rate in ((system.fixed(q), before), (changed.fixed(q), qd))
        ]
        changed_by.append(_jump(changes[k], system, happened.lost, energy[1] - energy[0]))
        system, at = changed, end
    return _joined(parts, jumps, changed_by, problem, changes)


def _share(progress: Progress, begin: float, part: float) -> Progress:
    return None if progress is None else lambda fraction: progress(begin + part * fraction)


def _given_rows(problem: Problem) -> np.ndarray:
    """Rows of the joints that follow a motion."""
    if not isinstance(problem.drive, Drive):
        return np.zeros(0, dtype=int)
    return np.asarray(problem.system.joint_rows[problem.drive.follows])


def _jump(change: PayloadChange, system: System, lost: float, jump: float) -> dict[str, Any]:
    """What is said of a change: by how much the energy jumps, and what the impact takes [J]."""
    old = system.robot.payload.mass_kg
    what = f"the payload is {change.mass_kg:g} kg from here on, {old:g} kg before"
    text = f"{what}: the impact takes {lost:.6g} J, and the energy changes by {jump:.6g} J"
    return {"t": change.at_s, "text": text, "J": jump, "impact_J": lost}


def _joined(
    parts: list[tuple[System, Solution, np.ndarray]],
    jumps: list[float],
    changed_by: list[dict[str, Any]],
    problem: Problem,
    changes: Sequence[PayloadChange],
) -> Solution:
    """One Solution of all parts, with the rows that are asked for."""
    accounts, added, jumped, seen, begin = np.zeros(4), [], [], [], 0
    systems: list[tuple[System, int]] = []
    for (system, done, asked), jump in zip(parts, jumps, strict=True):
        added.append((accounts + done.accounts)[asked])
        jumped.append((jump + done.jumps * np.ones(len(done.t)))[asked])
        accounts = accounts + done.accounts[-1] if len(done.accounts) else accounts
        n, z = system.n, done.states
        found = system.observe(z[:, :n].copy(), z[:, n:].copy()) if done.seen is None else done.seen
        seen.append(found[asked])
        begin += int(asked.sum())
        systems.append((system, begin))
    pick = lambda name: np.concatenate([getattr(done, name)[asked] for _, done, asked in parts])
    metas = [done.meta for _, done, _ in parts]
    told = [event for done in metas for event in done["events"]]
    told += [
        {"t": jump["t"], "level": "INFO", "name": "payload", "text": jump["text"]}
        for jump in changed_by
    ]
    sums: dict[str, Any] = {
        key: sum(meta[key] for meta in metas)
        for key in ("steps", "rejected", "evaluations", "wall_s")
        if key in metas[0]
    }
    # a robot that slides from node to node has jumps of its own
    own = [jump for meta in metas for jump in meta.get("energy_jumps", [])]
    sums["energy_jumps"] = changed_by + own
    methods = dict.fromkeys(meta["method"] for meta in metas)
    meta = metas[0] | sums
    meta |= {
        "complete": metas[-1]["complete"],
        "events": sorted(told, key=lambda event: event["t"]),
        "method": ", ".join(methods),
        "max_steps": problem.budget.steps,
        "payloads": [change.spec() for change in changes],
    }
    return Solution(
        pick("t"),
        pick("states"),
        np.concatenate(added),
        pick("forces"),
        meta,
        np.concatenate(seen),
        jumps=np.concatenate(jumped),
        systems=tuple(systems),
    )
