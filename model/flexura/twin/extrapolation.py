"""From runs with hubs of two lengths to a hub of none."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..io import Run
from .joints.mesh import ORDER

LONGER = 2.0  # the second length of hubs and sleeves' spans, relative to the first
SENSITIVE = ("position", "tip_deflection")  # the channels that `meta["extrapolation"]` judges


def extrapolate(run: Run, longer: Mapping[str, Run]) -> Run:
    """The run as hubs and sleeves get infinitely short, delta -> 0 (105).

    `longer`: by joint type, the run in which delta of joints of that type is LONGER times as long.
    Errors c delta^p, of order p = ORDER[type], of both types add up: y + sum_types (y -
    y_longer)/(LONGER^p - 1). `meta["extrapolation"]` is by type how far the joint position or tip
    deflection that moved most did so, relative to its largest magnitude.
    """
    count = min(len(other) for other in (run, *longer.values()))
    values = {name: channel[:count].copy() for name, channel in run.channels.items()}
    sizes = {}
    for kind, other in longer.items():
        weight = 1 / (LONGER ** ORDER[kind] - 1)
        steps = {name: weight * (run[name][:count] - other[name][:count]) for name in values}
        for name, step in steps.items():
            values[name] += step
        sizes[kind] = max(
            float(np.abs(step).max() / max(np.abs(run[name][:count]).max(), 1e-12))
            for name, step in steps.items()
            if name.endswith(SENSITIVE)
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
