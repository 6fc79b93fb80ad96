"""Motions that leave a mode at rest: exact sums, residual vibration in closed form, and benchmark
B8 (a clamp on a cart)."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import flexura as fx
from flexura import signals
from flexura.signals import (
    Signal,
    bang_bang,
    cycloid,
    harmonic,
    polynomial,
    step,
    table,
    trapezoidal,
)
from flexura.signals.shaping import matched_cycloid, zv, zvd
from robots import beam, system

COPIES = {zv: lambda k: [1, k], zvd: lambda k: [1, 2 * k, k * k]}
MOTIONS = (
    cycloid(0.3, 0.5, 0.1, 0.2),
    harmonic(1.0, 2.0, 0.3, 0.1),
    polynomial(1.0, 0.7),
    trapezoidal(1.0, 1.0, 0.2),
    bang_bang(1.0, 1.0, 0.1),
    step(1.0, 0.3),
    table([0.0, 0.3, 0.5, 1.0], [0.0, 1.0, 2.0, -1.0]),
    zv(cycloid(0.3, 0.5), 3.0, 0.1),
)


@pytest.mark.parametrize("shape", COPIES)
@settings(max_examples=200, deadline=None)
@given(
    base=st.sampled_from(MOTIONS), f=st.floats(0.2, 20), zeta=st.floats(0, 0.9), t=st.floats(-1, 6)
)
def test_a_shaped_signal_is_the_weighted_sum_of_its_delayed_copies(shape, base, f, zeta, t):
    """y, dy/dt and d2y/dt2: weights and delays from Singer and Seering's formulas."""
    root = np.sqrt(1 - zeta**2)
    weights = np.array(COPIES[shape](np.exp(-np.pi * zeta / root)))
    delays = np.arange(len(weights)) / (2 * f * root)
    wanted = sum(w * np.array(base(t - d)) for w, d in zip(weights / weights.sum(), delays))
    if (
        np.abs(np.add.outer(base.breaks, delays) - t).min() > 1e-9
    ):  # at a jump round-off decides which side counts
        np.testing.assert_allclose(shape(base, f, zeta)(t), wanted, atol=1e-10)


def response(motion: Signal, end: float, w: float, zeta: float) -> complex:
    """|int y'' exp((zeta w + i wd) t) dt| / exp(zeta w end): the speed that an oscillator driven by
    y'' is left with at `end`.

    Gauss-Legendre of order 40 between the breaks.
    """
    x, weight = np.polynomial.legendre.leggauss(40)
    rate = zeta * w + 1j * w * np.sqrt(1 - zeta**2)
    total = 0j
    for a, b in pairwise(np.unique(np.clip([*motion.breaks, end], 0.0, end))):
        t = a + (b - a) * (x + 1) / 2
        total += (
            (b - a)
            / 2
            * np.sum(weight * np.array([motion(s)[2] for s in t]) * np.exp(rate * (t - end)))
        )
    return total


@pytest.mark.parametrize("zeta", [0.0, 0.03, 0.4])
@pytest.mark.parametrize("shape", COPIES)
@pytest.mark.parametrize(
    "base", [cycloid(0.3, 0.37), polynomial(0.3, 0.5), trapezoidal(0.3, 0.61, 0.2)]
)
def test_shaping_leaves_an_oscillator_at_rest_to_round_off(base, shape, zeta):
    f = 1.3
    shaken = abs(response(base, 3.0, 2 * np.pi * f, zeta))
    left = abs(response(shape(base, f, zeta), 3.0, 2 * np.pi * f, zeta))
    assert left < 1e-13 and shaken * np.exp(zeta * 2 * np.pi * f * 3.0) > 1e-2


@pytest.mark.parametrize(("shape", "order"), [(zv, 1), (zvd, 2)])
def test_what_a_wrong_frequency_leaves_is_of_first_order_and_of_second_with_a_derivative(
    shape, order
):
    base, f = cycloid(0.3, 0.37), 1.3
    left = [abs(response(shape(base, f), 3.0, 2 * np.pi * f * (1 + e), 0.0)) for e in (0.01, 0.02)]
    assert np.log2(left[1] / left[0]) == pytest.approx(order, abs=0.1)
    plain = abs(response(base, 3.0, 2 * np.pi * f * 1.05, 0.0))
    off = abs(response(shape(base, f), 3.0, 2 * np.pi * f * 1.05, 0.0))
    assert off / plain == pytest.approx(
        {1: np.sin(np.pi * 0.025), 2: np.sin(np.pi * 0.025) ** 2}[order], rel=0.05
    )


@pytest.mark.parametrize("periods", [2, 3, 7])
def test_a_matched_cycloid_is_orthogonal_to_its_mode(periods):
    motion = matched_cycloid(0.3, 1.3, periods)
    assert motion.breaks[-1] == periods / 1.3 and motion(9.0) == (0.3, 0.0, 0.0)
    assert abs(response(motion, 7.0, 2 * np.pi * 1.3, 0.0)) < 1e-13
    assert abs(response(cycloid(0.3, 1 / 1.3), 7.0, 2 * np.pi * 1.3, 0.0)) > 0.1


def test_a_trapezoid_of_velocity_has_its_shape():
    s = trapezoidal(1.4, 1.0, 0.25, 0.2, 0.5)
    v = 1.2 / 0.75
    assert s(0.4) == (0.2, 0.0, 0.0) and s(2.0) == (1.4, 0.0, 0.0)
    assert s(0.6) == pytest.approx((0.2 + v / 0.25 * 0.1**2 / 2, v / 0.25 * 0.1, v / 0.25))
    assert s(1.0) == pytest.approx((0.8, v, 0.0)) and s(1.4) == pytest.approx(
        (1.4 - v / 0.25 * 0.1**2 / 2, v / 0.25 * 0.1, -v / 0.25)
    )
    assert trapezoidal(1.0, 1.0, 0.5)(0.5) == pytest.approx((0.5, 2.0, -4.0))


def test_what_cannot_be_shaped_is_named():
    two = Signal(
        np.vstack([harmonic(1.0, 1.0).segments, harmonic(1.0, 2.0).segments + np.eye(10)[0]])
    )
    for make, key in (
        (lambda: zv(two, 1.0), "signal"),
        (lambda: zv(step(1.0), 0.0), "frequency_Hz"),
        (lambda: zvd(step(1.0), 1.0, 1.0), "damping_ratio"),
        (lambda: matched_cycloid(1.0, 1.0, 1), "periods"),
        (lambda: trapezoidal(1.0, 1.0, 0.6), "rise_s"),
    ):
        with pytest.raises(fx.InputError) as caught:
            make()
        assert caught.value.key == key
    nested = {"kind": "step", "value": 1.0}
    for k in range(40):  # 2^40 segments
        nested = {"kind": "zv", "signal": nested, "frequency_Hz": 2.0**k / 3}
    with pytest.raises(fx.InputError, match="at most 50000 segments"):
        signals.from_spec(nested)
    with pytest.raises(fx.InputError, match=r"signal.signal.kind = 'sine'"):
        signals.from_spec({"kind": "zv", "signal": {"kind": "sine"}, "frequency_Hz": 1.0})


def test_kinds_of_all_modules_have_names_of_their_own():
    each = (signals.kinds.KINDS, signals.shaping.KINDS, signals.composite.KINDS)
    assert sum(map(len, each)) == len(signals.KINDS)


# B8: a clamp on a cart


def cart() -> fx.System:
    """The bench link in three modes, clamped across a rail, its transverse axis along the cart's
    motion; linear theory."""
    link = beam(0.6, 0.2355, 0.5, 8, "Pa", angle_rad=-np.pi / 2, modes=3)
    return system(link, payload=0.05, stiffening=False)


@pytest.mark.slow
def test_a_clamp_on_a_cart_swings_as_in_benchmark_b8():
    t = np.linspace(0.0, 2.0, 2001)
    run = fx.inverse(cart(), t, cycloid(0.3, 0.5), rtol=1e-8)
    tip = run["link/1/tip_deflection"]
    assert tip[[250, 500, 1000, 2000]] == pytest.approx(
        [-0.130374, 0.169413, -0.222778, 0.253735], abs=2e-6
    )
    assert np.abs(tip).max() == pytest.approx(0.261072, abs=2e-6)
    assert run["joint/1/position"][-1] == 0.3


@pytest.mark.slow
def test_a_cart_that_takes_two_periods_leaves_nothing_behind():
    """B8, the zero-residual case: 0.025496 during the move, 8e-6 after it (what mode 2 keeps)."""
    sys = cart()
    f1 = fx.frequencies(sys)[0]
    assert f1 == pytest.approx(1.449720, abs=2e-6)
    move = matched_cycloid(0.3, f1)
    assert move.breaks[-1] == pytest.approx(1.379577, abs=2e-6)
    t = np.linspace(0.0, 4.0, 8001)
    tip = np.abs(fx.inverse(sys, t, move, rtol=1e-9)["link/1/tip_deflection"])
    assert tip.max() == pytest.approx(0.025496, abs=1e-6)
    assert tip[t >= move.breaks[-1]].max() == pytest.approx(8e-6, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("shape", "left"), [(zv, 1e-3), (zvd, 1e-3)])
def test_shaping_calms_all_but_the_higher_modes_of_the_cart(shape, left):
    """Unshaped the tip is left with 0.261 m."""
    sys = cart()
    motion = shape(cycloid(0.3, 0.5), fx.frequencies(sys)[0])
    t = np.linspace(0.0, 3.0, 3001)
    tip = np.abs(fx.inverse(sys, t, motion, rtol=1e-9)["link/1/tip_deflection"])
    assert tip[t >= motion.breaks[-1]].max() < left
