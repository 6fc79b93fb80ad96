"""An identification of a robot as tables and as JSON."""

from __future__ import annotations

from typing import Any

import numpy as np

from flexura.io import EMULATED, emulated

from ...runs.formatting import finite, number, percent
from ...runs.table import Table
from .identify_robot import Identification
from .inputs import MOTION, REFERENCE

HOW = {MOTION: "moved as measured", REFERENCE: "a controller's reference"}


def tables(found: Identification) -> list[Table]:
    """Parameters, and what is left of each channel."""
    first = Table(
        f"{found.nominal.name or 'robot'}: identified from {_runs(found)}",
        ("parameter", "unit", "file", "estimate", "low", "high", "+-"),
        ("parameter", "unit"),
    )
    for q in found.quantities:
        spread = (q.high - q.low) / 2 / abs(q.value) if q.value else np.nan
        values = (number(x, 5) for x in (q.file, q.value, q.low, q.high))
        first.add(q.name, q.unit, *values, percent(spread))
    if any(emulated(each.run) for each in found.experiments):
        first.notes.append(EMULATED)
    first.notes.append("low, high: the 95 % interval, from what is left (Newey-West)")
    inputs = (
        f"{each.channel} ({HOW.get(each.kind, 'a force, by its gain')})"
        for each in found.experiments[0].inputs
    )
    first.notes.append(f"inputs: {', '.join(inputs)}")
    first.notes += found.findings
    left = Table(
        "what is left",
        ("channel", "RMS", "noise", "RMS of peak"),
        ("channel",),
    )
    for name, row in found.residuals.items():
        left.add(name, number(row["rms"], 3), number(row["noise"], 3), percent(row["by_peak"]))
    return [first, left]


def checked(found: Identification, errors: dict[str, tuple[float, float]]) -> Table:
    """The prediction of another run, by the file and by the estimates."""
    out = Table("another run: RMS of peak", ("channel", "file", "identified"), ("channel",))
    for name, (before, after) in errors.items():
        out.add(name, percent(before), percent(after))
    return out


def numbers(found: Identification) -> dict[str, Any]:
    """For JSON."""
    return {
        "robot": found.nominal.name,
        "emulated": any(emulated(each.run) for each in found.experiments),
        "parameters": [
            {
                "name": q.name,
                "unit": q.unit,
                "file": finite(q.file),
                "value": finite(q.value),
                "low": finite(q.low),
                "high": finite(q.high),
            }
            for q in found.quantities
        ],
        "fixed": {
            key: value
            for key, value in found.values.items()
            if key not in {q.name for q in found.quantities}
        },
        "inputs": {each.channel: each.kind for each in found.experiments[0].inputs},
        "residuals": {
            name: {key: finite(value) for key, value in row.items()}
            for name, row in found.residuals.items()
        },
        "findings": list(found.findings),
        "evaluations": found.estimate.evaluations,
    }


def _runs(found: Identification) -> str:
    count = len(found.experiments)
    return "one run" if count == 1 else f"{count} runs"
