"""Feedforward, shaped references, and the strip's slope in place of its deflection."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import flexura as fx
from controlled_robots import TICK, rig
from flexura import signals
from flexura.simulation import gravity, inverse_dynamics
from robots import rigid, system


def test_feedforwards_carry_the_motion():
    """Inverse dynamics in place of feedback; gravity in place of a sum."""
    sys, t = rig(), np.arange(0, 0.6, TICK)
    motions = [signals.cycloid(0.05, 0.5), signals.cycloid(0.4, 0.5)]
    ahead = inverse_dynamics(sys, motions, t)
    pids = tuple(
        fx.PID(m, kp=p, kd=d, feedforward=f)
        for m, f, p, d in zip(motions, ahead, (100, 1), (10, 0.05))
    )
    with_, without = (
        fx.simulate(sys, t, fx.Controller(c))["joint/2/position"] - [motions[1](s)[0] for s in t]
        for c in (pids, tuple(replace(p, feedforward=None) for p in pids))
    )
    assert np.abs(with_).max() < 0.05 * np.abs(without).max()
    hanging = system(rigid(0.5, 1.0, 0.25, 0.02, "R"), gravity=(0.0, -9.81))
    (ahead,) = gravity(hanging, [signals.constant(0.3)], [0.0, 5.0])
    arm = fx.PID(signals.constant(0.3), kp=20.0, kd=2.0, feedforward=ahead)
    assert fx.simulate(hanging, [0.0, 5.0], fx.Controller((arm,)))["joint/1/position"][
        -1
    ] == pytest.approx(0.3, abs=1e-6)


def test_shaped_references_leave_the_strip_at_rest():
    """ZV, ZVD and a matched cycloid at the clamped frequency, given to a stepper that counts its
    pulses."""
    sys, t = rig(), np.arange(0, 1.5, TICK)
    f = fx.frequencies(sys)[0]
    move = signals.polynomial(0.4, 0.25)
    held = fx.PID(signals.constant(0.0), kp=9000, kd=500)

    def left(reference) -> float:
        step = fx.PID(reference, fx.Stepper(), kp=20, kv=1, delay_s=TICK)
        return float(
            np.abs(
                fx.simulate(sys, t, fx.Controller((held, step)))["link/2/tip_deflection"][t > 0.8]
            ).max()
        )

    plain = left(move)
    for reference in (
        signals.shaping.zv(move, f),
        signals.shaping.zvd(move, f),
        signals.shaping.matched_cycloid(0.4, f),
    ):
        assert left(reference) < 0.1 * plain


def test_slope_terms_are_deflection_terms_on_a_strip_loaded_at_its_tip():
    c = fx.PID(signals.constant(0.0), kf=1.0, kg=0.5, ks=2.0, kt=0.1)
    one = c.one_sensor(0.3)
    assert (one.kf, one.kg, one.ks, one.kt) == pytest.approx(
        (1.0 + 2.0 * 5.0, 0.5 + 0.1 * 5.0, 0.0, 0.0)
    )
    bent = fx.static(rig(), tip_force=(0.0, 0.1))
    pulled = fx.simulate(
        rig(),
        [0.0, TICK],
        fx.Controller((fx.PID(signals.constant(0.0)), c), deflection_Hz=0.0),
        q0=bent,
    )["joint/2/drive"][0]
    same = fx.simulate(
        rig(),
        [0.0, TICK],
        fx.Controller((fx.PID(signals.constant(0.0)), one), deflection_Hz=0.0),
        q0=bent,
    )
    assert pulled == 0.0 and same["joint/2/drive"][0] == 0.0  # joint 2 takes the strip in odd ticks
