"""Metrics of a motion against formulas."""

from __future__ import annotations

import numpy as np
import pytest

from flexura.control.step_metrics import (
    ERROR,
    ITAE,
    OVERSHOOT,
    PEAK,
    RESIDUAL,
    RISE,
    RMS,
    SETTLING,
    VIBRATION,
    joint_metrics,
    strip_metrics,
)


def joint(t, y, r=None):
    return joint_metrics(t, np.ones_like(t) if r is None else r, y)


def test_a_first_order_rise_has_its_formulas():
    """1 - exp(-t/T): rise T ln 9, settling T ln 50, ITAE T^2."""
    t, T = np.linspace(0, 5, 20_001), 0.2
    f = joint(t, 1 - np.exp(-t / T))
    assert f[[RISE, SETTLING, ITAE]] == pytest.approx(
        [T * np.log(9), T * np.log(50), T**2], rel=1e-5
    )
    assert f[OVERSHOOT] == 0 and f[ERROR] < 1e-9


def test_an_oscillating_rise_has_its_overshoot_and_settles_when_it_last_enters_the_band():
    zeta, w = 0.3, 8.0
    t, wd = np.linspace(0, 5, 50_001), w * np.sqrt(1 - zeta**2)
    e = np.exp(-zeta * w * t) * (np.cos(wd * t) + zeta / np.sqrt(1 - zeta**2) * np.sin(wd * t))
    f = joint(t, 3 - 2 * (1 - e), np.ones_like(t))  # from 3 down to 1: signs must not matter
    assert f[OVERSHOOT] == pytest.approx(np.exp(-np.pi * zeta / np.sqrt(1 - zeta**2)), rel=1e-6)
    late = t[np.abs(e) > 0.02].max()
    assert late <= f[SETTLING] <= late + 1e-4


def test_what_never_happens_is_not_a_number():
    t = np.linspace(0, 1, 101)
    f = joint(t, 0.5 * t)
    assert (
        np.isnan(f[RISE]) and np.isnan(f[SETTLING]) and f[ERROR] == pytest.approx(0.525, abs=1e-3)
    )


def test_the_strips_figures_of_a_decaying_vibration_about_a_bend():
    t, d, w = np.linspace(0, 5, 50_001), 2.0, 2 * np.pi * 5
    y = 1e-3 + 4e-3 * np.exp(-d * t) * np.sin(w * t)
    out = strip_metrics(t, y, 1.0)
    assert out[PEAK] == pytest.approx(np.abs(y - y[0]).max()) and out[RESIDUAL] == pytest.approx(
        np.ptp(y[t >= 1]) / 2
    )
    assert out[RMS] == pytest.approx(
        4e-3 * np.sqrt((1 / (4 * d) - 0.25 * d / (d**2 + w**2)) / 5), rel=1e-3
    )
    assert out[VIBRATION] == pytest.approx(
        4e-3 * (2 / np.pi) / d**2, rel=1e-2
    )  # the mean of |sin| is 2 / pi
