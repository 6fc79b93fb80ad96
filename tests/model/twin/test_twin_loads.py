"""Loads on links: the native solver beside Exudyn, which turns and distributes them by its own
bodies."""

import numpy as np
import pytest

import flexura as fx
from flexura import signals, twin
from robots import beam, rigid, robot

pytest.importorskip("exudyn")
CHANNELS = ("joint/1/position", "joint/2/position", "tip/x", "tip/y", "link/2/tip_deflection")


def deviations(bot, loads, t, elements=None, **keys):
    """Largest differences of native solver and twin, relative to each channel's largest value."""
    native = fx.simulate(bot, t, loads=loads, rtol=1e-8, **keys)
    other = twin.simulate(bot, t, loads=loads, elements=elements, **keys)
    assert native.complete and other.complete
    names = [name for name in CHANNELS if name in native]
    return [np.abs(native[n] - other[n]).max() / np.abs(native[n]).max() for n in names]


@pytest.mark.slow
def test_forces_and_moments_in_both_frames():
    """On a rigid and on a flexible link, at nodes and between them, smooth and with a jump."""
    bot = robot(rigid(0.4, 0.5, 0.2, 0.01), beam(0.5, 0.3, 2.0, 6), payload=0.1)
    loads = [
        fx.Load(1, 0.3, [0.4, signals.harmonic(1.0, 2.0)]),
        fx.Load(2, 0.25, [0.1, 0.5], frame="link"),
        fx.Load(2, moment_N_m=signals.step(0.1, at_s=0.1)),
    ]
    assert max(deviations(bot, loads, np.linspace(0.0, 0.4, 41))) < 1e-3


@pytest.mark.slow
def test_a_static_start_under_a_load():
    bot = robot(beam(0.6, 0.2, 0.5, 6), gravity=(0.0, -1.0))
    loads = [fx.Load(1, force_N=[0.2, 0.6]), fx.Load(1, 0.3, moment_N_m=0.1)]
    assert max(deviations(bot, loads, np.linspace(0.0, 0.1, 11), elements=16)) < 1e-3


def test_a_beam_of_the_other_kind_has_loads_at_its_nodes():
    bot, t = robot(beam(0.6, 0.2, 0.5, 2)), [0.0, 0.01]
    with pytest.raises(fx.InputError, match="at a node"):
        twin.simulate(bot, t, loads=[fx.Load(1, 0.31, (0, 1))], beam="ge", elements=2)
