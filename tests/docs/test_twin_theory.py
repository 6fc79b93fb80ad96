"""Equations of docs/theory/11-twin.md, written down with plain NumPy,
against flexura.twin."""

import numpy as np
import pytest

import flexura as fx
import robots
from flexura.io import Run
from flexura.robot import Link
from flexura.twin.extrapolation import extrapolate
from flexura.twin.joints.mesh import hub_places, sleeve_places
from flexura.twin.links.properties import beam_values, without_ringing

SECTION = {"width_m": 0.02, "height_m": 0.004}
STEEL = {
    "length_m": 0.5,
    "elements": 4,
    "young_modulus_Pa": 2e11,
    "density_kg_m3": 7850.0,
    "joint": {"type": "R"},
}


def test_the_twins_beam():
    """Stiffnesses and rotary inertia of a rectangular section, and of a link that gives EI alone.

    Equations: 104
    """
    values = beam_values(Link.model_validate(STEEL | {"section": SECTION}), 5, 0.0)
    area, second = 0.02 * 0.004, 0.02 * 0.004**3 / 12
    assert values.axial == pytest.approx(
        np.full(5, 2e11 * area)
    ) and values.bending == pytest.approx(np.full(5, 2e11 * second))
    assert values.shear == pytest.approx(values.axial * (5 / 6) / (2 * (1 + 0.3)))
    assert values.rotary == pytest.approx(np.full(5, 7850 * area * second / area))
    plain = beam_values(Link.model_validate(robots.beam(0.5, 0.3, 0.8, 4)), 5, 0.0)
    assert plain.axial == pytest.approx(
        np.full(5, 1e5 * 0.8 / 0.5**2)
    ) and plain.shear == pytest.approx(plain.axial)


def test_the_twins_axial_damping():
    """Critical for a mass as large as the link's on a bar without mass: c^2 = 4 k m.

    Equations: 105
    """
    values = without_ringing(beam_values(Link.model_validate(STEEL | {"section": SECTION}), 5, 0.0))
    length = 5 * values.length
    stiffness, mass = values.axial[0] / length, values.mass[0] * length
    damping = values.stretch * values.axial[0] / length
    assert damping**2 == pytest.approx(4 * stiffness * mass)


def test_the_points_of_a_sleeve():
    """Spans near the exit, and the two points of a hub.

    Equations: 106
    """
    delta, h = 0.03, 0.02
    expected = delta / (2 * np.sqrt(3)) - 0.0108 * h**3 / delta**2 - delta * np.arange(4)
    found = sleeve_places(delta, 0.6, h)
    assert found[:4] == pytest.approx(expected)
    assert np.all(-np.diff(found[3:]) <= 0.6 / 8 + 1e-12) and found[-1] <= -0.6
    assert hub_places(delta) == pytest.approx([delta / 2, -delta / 2])


def test_the_extrapolation():
    """Channels with errors of order 1 and 2 in the hubs' length lose them.

    Equations: 107
    """
    t = np.linspace(0, 1, 5)
    y0, first, second = (
        np.cos(t),
        0.03 * t,
        0.02 * t**2,
    )  # errors of a hub and of a sleeve with delta

    def run(a, b):
        channels = {"joint/1/position": y0 + a * first + b * second}
        return Run(
            t,
            channels,
            {"joint/1/position": "m"},
            {"hub_length_m": 0.01, "wall_s": 0.0, "complete": True},
        )

    y, longer, sleeve = run(1, 1), run(2, 1), run(1, 4)
    found = extrapolate(y, {"Pa": longer, "Pb": sleeve})["joint/1/position"]
    name = "joint/1/position"
    expected = (
        y[name] + (y[name] - longer[name]) / (2**1 - 1) + (y[name] - sleeve[name]) / (2**2 - 1)
    )
    assert found == pytest.approx(expected) and expected == pytest.approx(y0)
    assert isinstance(y, fx.Run)
