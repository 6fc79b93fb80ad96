"""Extrapolation from runs with hubs of two lengths to hubs of none."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..io import Run
from .joints.mesh import ORDER

LENGTH_FACTOR = 2.0  # the second length of hubs and sleeves' spans, relative to the first
JUDGED_CHANNELS = ("position", "tip_deflection")  # the channels that `meta["extrapolation"]` judges


def extrapolate(run: Run, longer: Mapping[str, Run]) -> Run:
    """The run as hubs and sleeves get infinitely short, delta -> 0 (107).

    Richardson's extrapolation: errors are c delta^p, with p = ORDER[type], and those of both types
    add up. `meta["extrapolation"]` has by type the largest change of a joint position or tip
    deflection, relative to its largest magnitude.

    Args:
        run: with the shorter hubs.
        longer: by joint type, the run in which delta of joints of that type is LENGTH_FACTOR times
            as long.
    """
    count = min(len(other) for other in (run, *longer.values()))
    values = {name: channel[:count].copy() for name, channel in run.channels.items()}
    sizes = {}
    for kind, other in longer.items():
        weight = 1 / (LENGTH_FACTOR ** ORDER[kind] - 1)
        steps = {name: weight * (run[name][:count] - other[name][:count]) for name in values}
        for name, step in steps.items():
            values[name] += step
        sizes[kind] = max(
            float(np.abs(step).max() / max(np.abs(run[name][:count]).max(), 1e-12))
            for name, step in steps.items()
            if name.endswith(JUDGED_CHANNELS)
        )
    lengths = {
        kind: [run.meta["hub_length_m"], other.meta["hub_length_m"]]
        for kind, other in longer.items()
    }
    runs = [run, *longer.values()]
    meta = run.meta | {
        "complete": all(each.complete for each in runs),
        "wall_s": sum(each.meta["wall_s"] for each in runs),
        "hub_lengths_m": lengths,
        "extrapolation": sizes,
    }
    return Run(run.t[:count], values, run.units, meta)
