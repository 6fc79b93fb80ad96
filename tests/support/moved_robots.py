"""Robots that a time loop moves by every method."""

from __future__ import annotations

import flexura as fx
from flexura import signals
from robots import beam, rigid, system

METHODS = ("explicit", "implicit", "exponential")
SMOOTH = fx.Drive.force(signals.polynomial(0.02, 0.3))


def cart(mass: float = 2.0, **joint) -> fx.System:
    return system(rigid(0.0, mass, 0.0, 0.0, "Pa", **joint))


def arm_with_friction() -> fx.System:
    """Two flexible links with gravity, damping and viscous friction."""
    links = (
        beam(
            0.4,
            0.3,
            1.0,
            2,
            hub_inertia_kg_m2=5e-3,
            viscous_friction=0.01,
            damping={"beta_s": 1e-4},
        ),
        beam(0.3, 0.2, 0.4, 2, hub_mass_kg=0.1, hub_inertia_kg_m2=1e-3, start=0.5),
    )
    return system(*links, payload=0.05, gravity=(0.0, -1.0))
