"""A batch of robots for the tests of populations; imported by their processes and workers too."""

from __future__ import annotations

from typing import Any

import numpy as np

import flexura as fx
from flexura.signals import bang_bang
from robots import beam, rigid, robot

ARM = robot(
    rigid(0.1, 1.0, 0.05, 1e-3, "Pa", hub_mass_kg=0.1),
    beam(0.3, 0.157, 0.33, 3, modes=2, hub_inertia_kg_m2=1e-3, damping={"beta_s": 1e-4}),
    payload=0.02,
)
DRIVE = fx.Drive.force(bang_bang(2.0, 0.1, 0.01), bang_bang(0.05, 0.1, 0.01))


def varied(count: int = 20) -> fx.Batch:
    return fx.Batch.vary(
        ARM,
        {
            "payload.mass_kg": np.linspace(0, 0.1, count),
            "link.2.length_m": np.linspace(0.25, 0.35, count),
        },
    )


def same(a: fx.Population, b: fx.Population) -> bool:
    """Equal to the last bit, NaN where NaN is."""
    return set(a.units) == set(b.units) and all(
        np.array_equal(a[name], b[name], equal_nan=True) for name in a.units
    )


def no_number(t: Any, channels: Any) -> str:
    return "no"
