"""Energies and deviations of runs of the twin."""

from functools import partial

from flexura import twin
from robots import beam, rigid, robot

let_go = partial(twin.simulate, start="straight")  # links straight at the start


def total_energy(run):
    return run["energy/kinetic"] + run["energy/strain"] + run["energy/potential"]


def error(a, b, channel):
    """Of the largest magnitude."""
    return abs(a[channel] - b[channel]).max() / abs(b[channel]).max()


def soft(**keys):
    """PbPa that coasts under gravity: a slider with inertia on a soft link that leaves a sleeve."""
    return robot(
        beam(0.9, 0.5, 4.0, 4, "Pb", start=0.5, damping={"beta_s": 0.0}),
        rigid(0.2, 0.2, 0.1, 2e-3, "Pa", start=0.7, angle_rad=1.0, hub_mass_kg=0.1),
        gravity=(0.0, -1.0),
        payload=0.05,
        **keys,
    )
