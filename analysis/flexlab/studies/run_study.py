"""A study from its name: cases, sweep, finding."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

import flexura as fx
from flexura.signals import Manoeuvre

from . import boundary, length_ratio, payload
from .sweep import Finding, Study, cores, last_flexible, sweep

KINDS = {"payload": payload, "length-ratio": length_ratio, "boundary": boundary}


def run(
    kind: str,
    robot: fx.Robot,
    manoeuvre: Manoeuvre | None = None,
    values: str | None = None,
    *,
    keep: str = "total",
    rtol: float = 1e-6,
    jobs: int | None = None,
    progress: Callable[[float], None] = lambda fraction: None,
    channels: Path | None = None,
) -> Study:
    """Do a study of a robot.

    Args:
        kind: "payload", "length-ratio" or "boundary".
        robot: the robot.
        manoeuvre: what it does; None: a default one of the study.
        values: "LOW:HIGH:COUNT" of the study's parameter: payload [kg], ratio, or free length [m].
        keep: as in `length_ratio.KEEP`.
        rtol: of the simulations.
        jobs: processes; None: one a core.
        progress: called with the finished fraction.
        channels: a folder for all runs.

    Returns:
        The study.

    Raises:
        InputError: there is no such study of this robot.
    """
    if kind not in KINDS:
        raise fx.InputError(f"expected one of {', '.join(KINDS)}", key="KIND", value=kind)
    last_flexible(robot)
    low, high, count = KINDS[kind].values(robot) if values is None else _values(values)
    if kind == "length-ratio":
        cases = length_ratio.cases(
            robot, manoeuvre, np.geomspace(low, high, count) if low > 0 else np.array([low]), keep
        )
    else:
        cases = KINDS[kind].cases(robot, manoeuvre, np.linspace(low, high, count))
    rows, complete = sweep(
        cases, rtol=rtol, jobs=jobs or cores(), progress=progress, channels=channels
    )
    usable = [row for row in rows if row["complete"]]
    if len(usable) >= 3:
        found = KINDS[kind].finding(usable)
    else:
        found = Finding(
            KINDS[kind].CLAIM,
            None,
            f"only {len(usable)} of {len(cases)} runs came to their end",
            {},
        )
    about = cases[0].manoeuvre.name + (
        f"; {length_ratio.KEEP[keep]}" if kind == "length-ratio" else ""
    )
    return Study(kind, robot, about, cases[0].link, rows, found, complete)


def _values(text: str) -> tuple[float, float, int]:
    try:
        first, last, number = text.split(":")
        low, high, count = float(first), float(last), int(number)
    except ValueError:
        raise fx.InputError(
            "expected LOW:HIGH:COUNT, for example 0:0.2:21", key="values", value=text
        ) from None
    if not (np.isfinite(low) and np.isfinite(high) and low < high and 3 <= count <= 10_000):
        raise fx.InputError(
            "expected LOW below HIGH, and a COUNT from 3 to 10000", key="values", value=text
        )
    return low, high, count
