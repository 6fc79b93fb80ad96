"""`flexura study control`: what each method of control achieves."""

from __future__ import annotations

from pathlib import Path

import flexura as fx
from flexura.optional import need

from ..runs.table import Table
from ..studies.control import TASKS, Judged, Task, compare, numbers, save, table
from ..tuning.cases import PUBLISHED, TABLE
from .output import message, print_results, progress_bars
from .results import results

TYPE = {"rig": "IV"}  # of the dissertation's cases


def study_control(
    robot: Path | None, out: Path | None, rtol: float, *, force: bool, json: bool
) -> None:
    """Compare all methods on one robot's motion, or on both, and store the table and a figure."""
    if robot is not None and str(robot) not in TASKS:
        expected = f"expected {' or '.join(TASKS)}, or none for both"
        raise fx.InputError(expected, key="ROBOT", value=str(robot))
    names = [str(robot)] if robot is not None else list(TASKS)
    need("matplotlib", "daqp")
    with results(out, "study-control", *names, force=force) as draft:
        with progress_bars(*names) as report:
            found = {}
            for name in names:
                progress = lambda fraction, name=name: report(name, fraction)
                found[name] = (TASKS[name], compare(TASKS[name], rtol=rtol, progress=progress))
        stored = [path.name for path in save(found, draft.folder)]
        folder = draft.keep()
    published = {name: [PUBLISHED[key, c] for c in (1, 2)] for name, key in TYPE.items()}
    paths = [str(folder / name) for name in stored]
    print_results(
        json,
        lambda: [_table(name, *one) for name, one in found.items()],
        lambda: numbers(found) | {"dissertation": published, "stored": paths},
    )
    message(json, f"stored {folder}: {', '.join(stored)}")


def _table(name: str, task: Task, judged: list[Judged]) -> Table:
    """A robot's table, with the dissertation's cases below."""
    out = table(task, judged)
    if name in TYPE:
        out.notes.append(f"beside it, the dissertation's PID ({TABLE[TYPE[name]]}), on steps:")
        for case, what in ((1, "elasticity ignored"), (2, "elasticity considered")):
            rows = PUBLISHED[TYPE[name], case]
            settled = ", ".join(f"{row[1]:g} s" for row in rows)
            over = ", ".join(f"{row[2]:g} %" for row in rows)
            out.notes.append(f"  case {case}, {what}: settles in {settled}; overshoot {over}")
    return out
