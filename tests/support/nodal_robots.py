"""Robots that slide from node to node."""

from __future__ import annotations

import numpy as np

import flexura as fx
from flexura import signals
from robots import beam, rigid, system

TAPER = (
    [{"at_m": 0.0, "value": 0.3}, {"at_m": 0.8, "value": 0.15}],
    [{"at_m": 0.0, "value": 2.0}, {"at_m": 0.8, "value": 0.7}],
)
KEYS = {"hub_mass_kg": 0.1, "hub_inertia_kg_m2": 2e-3}
DAMPED = {"alpha_1_s": 0.5, "beta_s": 1e-4}
TOTAL = ("energy/kinetic", "energy/strain", "energy/potential")


def total(run: fx.Run) -> np.ndarray:
    return sum(run[name] for name in TOTAL)


def steady(start: float, rate: float) -> signals.Signal:
    """Motion at a constant rate."""
    return signals.Signal(np.array([[0.0, start, rate, 0, 0, 0, 0, 0, 0, 0]]))


def under_a_slider(
    elements: int, sliding: str, start: float, stiffening: bool = False, **keys
) -> fx.System:
    """A swinging link, a slider with an arm on it, and a payload."""
    return system(
        beam(0.6, 0.2355, 0.5, elements, hub_inertia_kg_m2=2e-3),
        rigid(0.1, 0.05, 0.04, 1e-4, "Pa", start=start, angle_rad=0.7, hub_mass_kg=0.02, **keys),
        payload=0.01,
        gravity=(0.0, -1.0),
        stiffening=stiffening,
        sliding=sliding,
    )


def in_a_sleeve(
    elements: int, sliding: str, start: float, stiffening: bool = False, **keys
) -> fx.System:
    """An arm with a tapered link in a sleeve at its tip, and a link with a payload beyond."""
    sleeved = beam(
        0.8, *TAPER, elements, "Pb", start=start, angle_rad=0.3, damping=DAMPED, **KEYS, **keys
    )
    return system(
        rigid(0.3, 0.5, 0.15, 0.01),
        sleeved,
        rigid(0.2, 0.1, 0.1, 1e-3, viscous_friction=0.01),
        payload=0.05,
        payload_inertia=1e-4,
        gravity=(0.5, -1.0),
        stiffening=stiffening,
        sliding=sliding,
    )


def cart_with_sleeve(elements: int, start: float, slider: float = 0.7, **keys) -> fx.System:
    """A link in a sleeve on the base, with a slider beyond that carries a point mass."""
    return system(
        beam(0.8, 0.3, 1.5, elements, "Pb", start=start, **keys),
        rigid(0.0, 0.05, 0.0, 0.0, "Pa", start=slider, viscous_friction=0.3),
        gravity=(0.0, -2.0),
        stiffening=False,
        sliding="nodal",
    )
