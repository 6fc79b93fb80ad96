"""Loads on links: the native solver beside Exudyn, which turns and distributes them by its own
bodies."""

import numpy as np
import pytest

import flexura as fx
from flexura import signals, twin
from robots import beam, rigid, robot

pytest.importorskip("exudyn")
CHANNELS = ("joint/1/position", "joint/2/position", "tip/x", "tip/y", "link/2/tip_deflection")


def deviations(bot, loads, t, **keys):
    """Largest differences of native solver and twin, relative to each channel's largest value."""
    native = fx.simulate(bot, t, loads=loads, rtol=1e-8, **keys)
    other = twin.simulate(bot, t, loads=loads, **keys)
    assert native.complete and other.complete
    names = [name for name in CHANNELS if name in native]
    return [np.abs(native[n] - other[n]).max() / np.abs(native[n]).max() for n in names]


def arm(elements=6, **keys):
    """A rigid and a flexible link; a hub and damping, so that all programs' meshes are fine."""
    hub = {"hub_mass_kg": 0.2, "hub_inertia_kg_m2": 0.01, "damping": {"beta_s": 1e-3}}
    links = rigid(0.4, 0.5, 0.2, 0.01), beam(0.5, 0.3, 2.0, elements, **hub)
    return robot(*links, payload=0.1, payload_inertia=1e-3, **keys)


@pytest.mark.slow
def test_forces_and_moments_in_both_frames():
    """On a rigid and on a flexible link, at nodes and between them, smooth and with a jump."""
    loads = [
        fx.Load(1, 0.3, [0.4, signals.harmonic(1.0, 2.0)]),
        fx.Load(2, 0.27, [0.1, 0.5], frame="link"),
        fx.Load(2, moment_N_m=signals.step(0.1, at_s=0.1)),
    ]
    assert max(deviations(arm(), loads, np.linspace(0.0, 0.3, 31))) < 1e-3


@pytest.mark.slow
def test_a_static_start_under_a_load():
    bot = robot(beam(0.6, 0.2, 0.5, 8, locked=True), gravity=(0.0, -1.0))
    loads = [fx.Load(1, force_N=[0.2, 0.6]), fx.Load(1, 0.3, moment_N_m=0.1)]
    t = np.linspace(0.0, 0.02, 3)
    runs = [f(bot, t, loads=loads) for f in (fx.simulate, twin.simulate)]
    for name in ("tip/x", "tip/y", "link/1/tip_slope"):
        native, other = (run[name] for run in runs)
        assert np.ptp(native) < 1e-6 and native == pytest.approx(other, abs=1e-3 * abs(native[0]))


def test_a_beam_of_the_other_kind_has_loads_at_its_nodes():
    bot, t = robot(beam(0.6, 0.2, 0.5, 2)), [0.0, 0.01]
    with pytest.raises(fx.InputError, match="at a node"):
        twin.simulate(bot, t, loads=[fx.Load(1, 0.31, (0, 1))], beam="ge", elements=2)


@pytest.mark.slow
@pytest.mark.parametrize("flexible", [False, True])
def test_taking_up_and_letting_go(flexible):
    """Exudyn's own mass matrices and constraints give the same rates after the impact."""
    rigid_arm = robot(*[rigid(0.5, 0.4, 0.25, 0.01)] * 2, payload=0.05, payload_inertia=1e-3)
    bot = arm(8) if flexible else rigid_arm
    fine = {"elements": 16, "step_s": 1e-4} if flexible else {}
    system, t = fx.assemble(bot), np.linspace(0.0, 0.25, 26)
    rates = np.zeros(system.n)
    rates[system.joint_rows] = 2.0, -3.0
    payloads = [fx.PayloadChange(0.083, 0.3, 2e-3), {"at_s": 0.17, "mass_kg": 0.0}]
    native = fx.simulate(bot, t, qd0=rates, payloads=payloads, rtol=1e-8)
    other = twin.simulate(bot, t, qd0=[2.0, -3.0], payloads=payloads, **fine)
    assert native.complete and other.complete and other.t == pytest.approx(t)
    for name in CHANNELS:
        if name in native:
            size = np.abs(native[name]).max()
            assert np.abs(native[name] - other[name]).max() < 1e-3 * size, name


def test_the_other_kind_of_beam_takes_nothing_up():
    bot, change = robot(beam(0.6, 0.2, 0.5, 2)), [fx.PayloadChange(0.005, 0.1)]
    with pytest.raises(fx.InputError, match="ancf"):
        twin.simulate(bot, [0.0, 0.01], payloads=change, beam="ge")
