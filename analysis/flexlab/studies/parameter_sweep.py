"""`flexura simulate --vary KEY=LOW:HIGH:COUNT`: a robot file with some of its numbers varied, as
one population."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx
from flexura.signals import Manoeuvre

MOST = 1_000_000


def grid(robot: fx.Robot, texts: Sequence[str]) -> tuple[fx.Batch, dict[str, np.ndarray]]:
    """The robots at every combination of the values of KEY=LOW:HIGH:COUNT, and these values (B,) by
    key."""
    columns: dict[str, np.ndarray] = {}
    for text in texts:
        try:
            key, values = text.split("=")
            low, high, count = values.split(":")
            ends = np.array([float(low), float(high)])
            columns[key] = (
                np.linspace(float(low), float(high), int(count))
                if np.isfinite(ends).all()
                else ends[:0]
            )
        except ValueError:
            example = "expected KEY=LOW:HIGH:COUNT, for example payload.mass_kg=0:0.1:11"
            raise fx.InputError(example, key="--vary", value=text) from None
        if len(columns[key]) < 1:
            raise fx.InputError(
                "expected finite LOW and HIGH and a COUNT of 1 or more", key="--vary", value=text
            )
    if np.prod([float(len(values)) for values in columns.values()]) > MOST:
        raise fx.InputError(f"expected at most {MOST} robots", key="--vary", value=list(texts))
    every = np.array(list(product(*columns.values())), dtype=float)
    chosen = {key: every[:, k] for k, key in enumerate(columns)}
    return fx.Batch.vary(robot, chosen), chosen


def simulate(
    robot: fx.Robot,
    asked: Manoeuvre,
    texts: Sequence[str],
    folder: Path,
    *,
    rtol: float,
    method: str,
    scheduler: str | None,
    progress: Callable[[float], None],
) -> tuple[fx.Population, dict[str, np.ndarray]]:
    """The population, kept in `folder`, and what was varied."""
    batch, chosen = grid(robot, texts)
    done = fx.simulate(
        batch,
        asked.t,
        asked.drive,
        rtol=rtol,
        method=method,
        folder=folder,
        scheduler=scheduler,
        progress=progress,
    )
    return done, chosen


def numbers(done: fx.Population, chosen: dict[str, np.ndarray], folder: Path) -> dict[str, Any]:
    """How the robots ended; of each channel the largest value in size, and what was varied
    there."""
    peaks: list[dict[str, Any]] = []
    for name, unit in done.units.items():
        size = np.concatenate([np.nan_to_num(np.abs(chunk[name])).max(axis=1) for chunk in done])
        at = int(done.robots[int(size.argmax())])
        where = {key: float(values[at]) for key, values in chosen.items()}
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
        "folder": str(folder),
    }


def table(found: dict[str, Any]) -> Any:
    from rich.table import Table

    ended = ", ".join(f"{count} {word}" for word, count in found["ended"].items())
    out = Table(title=f"{found['robots']} robots: {ended}", title_justify="left")
    for name in ("channel", "least peak", "largest peak", "there"):
        out.add_column(name, justify="left" if name in ("channel", "there") else "right")
    for row in found["peaks"]:
        where = ", ".join(f"{key} = {value:.5g}" for key, value in row["at"].items())
        out.add_row(
            f"{row['channel']} [{row['unit']}]",
            f"{row['least_peak']:.5g}",
            f"{row['peak']:.5g}",
            where,
        )
    return out
