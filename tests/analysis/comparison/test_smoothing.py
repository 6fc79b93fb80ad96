"""Smoothed motions of measured ones."""

import numpy as np
import pytest

from flexlab.comparison.replay.smoothing import (
    recorded_samples,
    resolution,
    smoothing_spline,
)
from flexura.errors import InputError


def test_a_smoothed_motion_is_twice_differentiable_and_has_no_lag():
    t = np.arange(601) / 200.0
    true, step = 0.5 * np.sin(2 * np.pi * t), 2 * np.pi / 2400
    motion = smoothing_spline(t, np.round(true / step) * step)
    for at in motion.breaks[1:]:
        jump = np.subtract(motion(np.nextafter(at, -np.inf)), motion(at))
        assert (np.abs(jump) < [1e-9, 1e-8, 1e-5]).all()
    values = np.array([motion(at)[0] for at in t])
    assert np.sqrt(np.mean((values - true) ** 2)) < 0.5 * step / np.sqrt(12)  # of the noise
    lags = np.linspace(-2e-3, 2e-3, 81)
    left = [np.mean((values - 0.5 * np.sin(2 * np.pi * (t - lag))) ** 2) for lag in lags]
    assert abs(lags[np.argmin(left)]) <= 1e-4


def test_the_residual_is_what_quantisation_leaves():
    t = np.arange(401) / 200.0
    y = np.round(np.sin(5 * t) / 0.01) * 0.01
    motion = smoothing_spline(t, y)
    fit = np.array([motion(at)[0] for at in t])
    moving = np.append(np.diff(y) != 0, False) | np.insert(np.diff(y) != 0, 0, False)
    assert np.sqrt(np.mean((fit - y)[moving] ** 2)) == pytest.approx(0.01 / np.sqrt(12), rel=0.02)


def test_the_resolution_is_found():
    t = np.linspace(0, 1, 300)
    assert resolution(np.round(np.sin(9 * t) / 0.004) * 0.004) == pytest.approx(0.004)
    assert resolution(np.sin(9 * t)) == 0.0 and resolution(np.zeros(5)) == 0.0


def test_what_was_not_quantised_is_passed_through():
    t = np.linspace(0, 1, 50)
    motion = smoothing_spline(t, np.exp(t))
    np.testing.assert_allclose([motion(at)[0] for at in t], np.exp(t), atol=1e-14)


def test_a_motion_of_dropouts_is_refused():
    with pytest.raises(InputError, match="joint/1/position = 3: expected at least 8 samples"):
        recorded_samples(np.arange(9.0), np.array([1, 2, 3] + 6 * [np.nan]), "joint/1/position")
