"""Colours that are told apart, and axes with numbers to read off."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexlab.review.sources import FAMILIES
from flexlab.review.ticks import Signal, value_range


def luminance(colour):
    """Relative luminance (WCAG 2)."""
    c = np.array(colour) / 255
    linear = np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def contrast(a, b):
    high, low = sorted((luminance(a), luminance(b)), reverse=True)
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("family", FAMILIES.values(), ids=map(str, FAMILIES))
def test_curves_are_seen_on_light_and_dark_and_differ(family):
    for k, colour in enumerate(family):
        assert contrast(colour, (255, 255, 255)) > 2.2 and contrast(colour, (13, 13, 13)) > 2.8
        for other in family[:k]:
            assert np.linalg.norm(np.subtract(colour, other)) > 50


@pytest.mark.parametrize("height", [140, 265])
@given(
    low=st.floats(-1e3, 1e3),
    size=st.floats(1e-4, 1e4),
    lines=st.integers(1, 3),
)
def test_a_plot_has_two_numbers_to_read_off_and_room_for_its_legend(height, low, size, lines):
    curves = {str(k): Signal("m", "x" * 30, low, low + size) for k in range(lines)}
    bottom, top = value_range(curves, height)
    assert bottom < low and low + size < top
    assert top - low - size > 0.98 * (23 * lines + 14) / height * 0.9 * (size)
    # the viewer numbers the smallest power of ten whose multiples are far enough apart
    step = 10.0 ** np.ceil(np.log10((top - bottom) * 20 / height))
    shown = np.floor(top / step * (1 - 1e-12)) - np.ceil(bottom / step * (1 - 1e-12)) + 1
    assert shown >= 2
