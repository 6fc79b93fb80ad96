"""Signals against their formulas and against finite differences."""

import importlib
import json
import sys
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from flexura import signals
from flexura.signals import (
    bang_bang,
    cycloid,
    from_spec,
    harmonic,
    piecewise,
    polynomial,
    step,
    table,
)
from signal_strategies import SIGNALS, SMOOTH, duration, instant, level


@settings(max_examples=300, deadline=None)
@given(SIGNALS, st.floats(-1, 6))
def test_the_derivatives_are_those_of_the_values(s, t):
    """Central differences, away from the instants at which a signal isn't smooth."""
    h = 1e-4
    if np.abs(s.breaks - t).min() < 2 * h:
        return
    y, yd, ydd = s(t)
    before, after = s(t - h), s(t + h)
    size = max(
        1.0,
        np.abs(s.segments[:, 1:8]).max(),
        np.abs(s.segments[:, 7] * s.segments[:, 8] ** 4).max(),
    )
    assert yd == pytest.approx((after[0] - before[0]) / (2 * h), abs=1e-6 * size)
    assert ydd == pytest.approx((after[1] - before[1]) / (2 * h), abs=1e-5 * size)
    assert y == pytest.approx((after[0] + before[0]) / 2, abs=1e-6 * size)


@settings(max_examples=200, deadline=None)
@given(SMOOTH)
def test_a_smooth_signal_has_no_jumps(s):
    for t in s.breaks[1:]:
        before, after = s(np.nextafter(t, -np.inf)), s(t)
        assert before[0] == pytest.approx(after[0], abs=1e-9)


@settings(max_examples=200, deadline=None)
@given(level, duration, level, instant, st.sampled_from([cycloid, polynomial]))
def test_a_rise_starts_and_ends_at_rest(end, T, start, at, rise):
    s = rise(end, T, start, at)
    size = max(1.0, abs(end - start) / T**2)
    assert s(at - 1) == (start, 0.0, 0.0)
    np.testing.assert_allclose(s(at), (start, 0, 0), atol=1e-12 * size)
    np.testing.assert_allclose(s(np.nextafter(at + T, 0)), (end, 0, 0), atol=1e-7 * size)
    assert s(at + T)[0] == end and s(at + T + 5) == (end, 0.0, 0.0)
    assert s(at + T / 2)[0] == pytest.approx((start + end) / 2, abs=1e-9)


def test_a_cycloid_equals_its_formula():
    u = np.linspace(0, 1, 50, endpoint=False)
    s = cycloid(3.0, 0.8, 1.0)
    expected = 1 + 2 * (u - np.sin(2 * np.pi * u) / (2 * np.pi))
    np.testing.assert_allclose([s(0.8 * x)[0] for x in u], expected, atol=1e-15, rtol=1e-14)


def test_a_polynomial_equals_its_formula():
    u = np.linspace(0, 1, 50, endpoint=False)
    s = polynomial(3.0, 0.8, 1.0)
    np.testing.assert_allclose(
        [s(0.8 * x)[0] for x in u], 1 + 2 * (10 * u**3 - 15 * u**4 + 6 * u**5), rtol=1e-14
    )


@settings(max_examples=100, deadline=None)
@given(level, st.floats(0, 5), st.floats(-4, 4), level, st.floats(0, 5))
def test_a_harmonic_is_a_cosine(amplitude, f, phase, offset, t):
    w = 2 * np.pi * f
    y, yd, ydd = harmonic(amplitude, f, phase, offset)(t)
    angle = w * t + phase
    assert y == pytest.approx(offset + amplitude * np.cos(angle), abs=1e-12)
    assert yd == pytest.approx(-w * amplitude * np.sin(angle), abs=1e-10)
    assert ydd == pytest.approx(-w * w * amplitude * np.cos(angle), abs=1e-8)


def integral(s, end, order):
    """The first or second integral of a signal from 0 to the end, exact for its polynomials:
    Gauss-Legendre on each piece."""
    places = np.unique(np.clip([0.0, *s.breaks, end], 0.0, end))
    x, w = np.polynomial.legendre.leggauss(6)
    total = 0.0
    for a, b in pairwise(places):
        t = a + (b - a) * (x + 1) / 2
        weight = 1.0 if order == 1 else end - t  # Cauchy's formula for repeated integration
        total += np.sum(w * weight * [s(time)[0] for time in t]) * (b - a) / 2
    return total


@settings(max_examples=100, deadline=None)
@given(st.floats(0.1, 10), duration, st.just(0.0) | st.floats(1e-3, 0.25), instant)
def test_bang_bang_ends_at_rest(a, T, part, at):
    """Its area is zero; a unit mass that it pushes has gone A (T - r)^2/4: rises, r, smooth a
    profile that much shorter."""
    s = bang_bang(a, T, part * T, at)
    assert integral(s, at + T + 1, 1) == pytest.approx(0, abs=1e-12 * a * T)
    assert integral(s, at + T + 1, 2) == pytest.approx(a * T**2 * (1 - part) ** 2 / 4, rel=1e-9)


def test_bang_bang_without_a_rise_goes_a_quarter_of_a_t_squared():
    assert integral(bang_bang(3.0, 0.8), 0.8, 2) == pytest.approx(3.0 * 0.8**2 / 4, rel=1e-14)
    s = bang_bang(3.0, 0.8, at_s=0.5)
    assert [s(t)[0] for t in (0, 0.49, 0.5, 0.89, 0.91, 1.29, 1.3, 9)] == [0, 0, 3, 3, -3, -3, 0, 0]


@settings(max_examples=50, deadline=None)
@given(st.lists(st.floats(0.1, 1), min_size=2, max_size=8), st.data())
def test_a_table_goes_through_its_points_as_the_natural_spline(gaps, data):
    t = np.cumsum(gaps)
    y = data.draw(st.lists(level, min_size=len(t), max_size=len(t)))
    s, spline = table(t, y), CubicSpline(t, y, bc_type="natural")
    np.testing.assert_allclose([s(x)[0] for x in t], y, atol=1e-12)
    for x in np.linspace(t[0], t[-1], 30, endpoint=False):
        np.testing.assert_allclose(s(x), [spline(x, k) for k in range(3)], atol=1e-9)
    assert s(t[0] - 1) == (y[0], 0.0, 0.0) and s(t[-1] + 1) == (y[-1], 0.0, 0.0)


def test_piecewise_and_step_change_at_their_instants():
    s = piecewise([0.1, 0.2, 0.4], [5, -5, 0])
    assert [s(t)[0] for t in (-1, 0.1, 0.19, 0.2, 0.39, 0.4, 9)] == [5, 5, 5, -5, -5, 0, 0]
    assert [step(2.0, 0.5)(t)[0] for t in (-1, 0.0, 0.49, 0.5, 9)] == [0, 0, 0, 2, 2]
    assert step(2.0)(0.0)[0] == 2.0


@settings(max_examples=100, deadline=None)
@given(SIGNALS, st.floats(0.01, 10))
def test_before_its_start_a_signal_holds_its_first_value(s, before):
    first = s.breaks[0]
    if first > -1e9:
        assert s(first - before) == (s(first)[0], 0.0, 0.0)


@settings(max_examples=100, deadline=None)
@given(SIGNALS)
def test_a_signal_survives_its_table_and_json(s):
    again = from_spec(json.loads(json.dumps(s.spec)))
    assert np.array_equal(again.segments, s.segments) and again.spec == s.spec
    assert not s.segments.flags.writeable and np.all(np.diff(s.breaks) >= 0)


def test_a_signal_without_segments_is_zero():
    assert signals.Signal(np.zeros((0, signals.COLUMNS)))(1.0) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(("old", "new"), [("signal", "signals"), ("shaping", "signals.shaping")])
def test_an_old_name_is_answered_with_the_new_one(old, new):
    sys.modules.pop(f"flexura.{old}", None)
    with pytest.warns(DeprecationWarning, match=f"flexura.{old} is now flexura.{new}"):
        module = importlib.import_module(f"flexura.{old}")
    assert module.zv is signals.zv if old == "shaping" else module.cycloid is signals.cycloid
