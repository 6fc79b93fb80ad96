"""`flexura simulate --vary KEY=LOW:HIGH:COUNT`: a robot file, and the loads and payloads of a
manoeuvre file, with some of their numbers varied, as one population."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx
from flexura.signals import Acting, acts

from ..runs.formatting import number
from ..runs.table import Table

MOST = 1_000_000
SHOWN = 20  # robots of the terminal's table


def ranges(texts: Sequence[str]) -> dict[str, tuple[float, float, int]]:
    """LOW, HIGH, COUNT by key. Raises InputError for wrong ones, and for too many robots."""
    found: dict[str, tuple[float, float, int]] = {}
    robots = 1
    for text in texts:
        key, _, values = text.partition("=")
        try:
            low, high, count = values.split(":")
            ends, many = (float(low), float(high)), int(count)
        except ValueError:
            example = "expected KEY=LOW:HIGH:COUNT, for example payload.mass_kg=0:0.1:11"
            raise fx.InputError(example, key="--vary", value=text) from None
        if many < 1 or not np.isfinite(ends).all():
            raise fx.InputError(
                "expected finite LOW and HIGH and a COUNT of 1 or more", key="--vary", value=text
            )
        if key in found:
            raise fx.InputError(f"expected each key once: {key}", key="--vary", value=list(texts))
        found[key] = (*ends, many)
        robots *= many
    if robots > MOST:
        raise fx.InputError(
            f"{robots} robots: expected at most {MOST}", key="--vary", value=list(texts)
        )
    return found


def grid(
    robot: fx.Robot, texts: Sequence[str], asked: fx.Manoeuvre, file: str = ""
) -> tuple[fx.Batch, dict[str, np.ndarray]]:
    """The robots and loads at every combination of the values of KEY=LOW:HIGH:COUNT, and these
    values (B,) by key. Raises InputError for a wrong text, key or value; it names the robot's
    `file`, or the manoeuvre's."""
    columns = {key: np.linspace(*values) for key, values in ranges(texts).items()}
    every = np.array(list(product(*columns.values())), dtype=float)
    chosen = {key: every[:, k] for k, key in enumerate(columns)}
    acting = Acting(asked.loads, asked.payloads)
    for key, values in columns.items():
        for value in (values[0], values[-1]):
            of, at = (acting.varied, asked.file) if acts(key) else (robot.replace, file)
            try:
                of({key: float(value)})
            except fx.InputError as error:
                raise error.in_file(at) from None
    return fx.Batch.vary(robot, chosen), chosen


def numbers(done: fx.Population, chosen: dict[str, np.ndarray], folder: Path) -> dict[str, Any]:
    """How the robots ended; of each channel the largest value in size, and what was varied there;
    of the first robots all of that."""
    robots = done.robots
    peaks: list[dict[str, Any]] = []
    each: list[dict[str, Any]] = [
        {"robot": int(k), "vary": {key: float(values[k - 1]) for key, values in chosen.items()}}
        | {"ended": str(status), "peaks": {}}
        for k, status in zip(robots[:SHOWN], done.status[:SHOWN], strict=True)
    ]
    for name, unit in done.units.items():
        size = np.concatenate([np.nan_to_num(np.abs(chunk[name])).max(axis=1) for chunk in done])
        at = int(robots[int(size.argmax())])
        where = {key: float(values[at - 1]) for key, values in chosen.items()}
        for row, value in zip(each, size, strict=False):
            row["peaks"][name] = float(value)
        peaks.append(
            {
                "channel": name,
                "unit": unit,
                "peak": float(size.max()),
                "least_peak": float(size.min()),
                "at": where,
            }
        )
    ended = dict(Counter(map(str, done.status)))
    return {
        "robots": done.count,
        "complete": done.complete,
        "ended": ended,
        "peaks": peaks,
        "first": each,
        "folder": str(folder),
    }


def tables(found: dict[str, Any]) -> list[Table]:
    """The first robots with what was varied and their peaks; the peaks of all."""
    ended = ", ".join(f"{count} {word}" for word, count in found["ended"].items())
    varied = list(found["first"][0]["vary"])
    channels = [f"{row['channel']} [{row['unit']}]" for row in found["peaks"]]
    one = Table(f"{found['robots']} robots: {ended}", ("robot", *varied, "ended", *channels))
    for row in found["first"]:
        values = (number(row["vary"][key], 5) for key in varied)
        peaks = (number(value) for value in row["peaks"].values())
        one.add(str(row["robot"]), *values, row["ended"], *peaks)
    one.notes.append("channels: the largest value in size")
    if found["robots"] > SHOWN:
        one.notes.append(f"robots 1 to {SHOWN} of {found['robots']}")
    all_ = Table(
        "largest and least of all robots",
        ("channel", "least peak", "largest peak", *(f"there {key}" for key in varied)),
        ("channel",),
    )
    for row in found["peaks"]:
        all_.add(
            f"{row['channel']} [{row['unit']}]",
            number(row["least_peak"], 5),
            number(row["peak"], 5),
            *(number(row["at"][key], 5) for key in varied),
        )
    return [one, all_]
