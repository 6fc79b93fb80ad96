"""Clamped modes against characteristic equations."""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import iv, jv

from flexura.link.line import pieces
from flexura.link.modes import ClampedBody, clamped_matrices, clamped_modes
from flexura.link.section import Material
from flexura.robot import Link
from robots import beam

UNIT = Material(np.array([0.0, 1.0]), np.array([[1.0, 0, 0]]), np.array([[1.0, 0, 0, 0, 0]]))
# constant width, height that falls to nothing at the tip
WEDGE = Material(
    np.array([0.0, 1.0]), np.array([[1.0, -1.0, 0]]), np.array([[1.0, -3.0, 3.0, -1.0, 0]])
)


def roots(function, start, end, count):
    x = np.linspace(start, end, 2000)
    y = function(x)
    signs = np.flatnonzero(y[:-1] * y[1:] < 0)[:count]
    return np.array([brentq(function, x[k], x[k + 1], xtol=1e-14) for k in signs])


def modes(law, count=20, kept=4, free=1.0, mass=0.0):
    matrices = clamped_matrices(law, free, count, count + 1, [ClampedBody(1.0, mass, 0.0)])
    return matrices, *clamped_modes(*matrices, kept, False)


def test_a_uniform_cantilever():
    exact = roots(lambda x: np.cos(x) + 1 / np.cosh(x), 1, 15, 4)
    assert modes(UNIT)[2] ** 0.25 == pytest.approx(exact, rel=1e-11)


@pytest.mark.parametrize("mass", [0.1, 1.0, 100.0])
def test_a_cantilever_with_a_mass_at_its_tip(mass):
    tip = lambda x: (
        1 + np.cos(x) * np.cosh(x) + mass * x * (np.cos(x) * np.sinh(x) - np.sin(x) * np.cosh(x))
    )
    assert modes(UNIT, mass=mass)[2] ** 0.25 == pytest.approx(roots(tip, 0.1, 15, 4), rel=1e-10)


def test_a_wedge():
    """Kirchhoff's: J1(z) I2(z) + I1(z) J2(z) = 0, omega = z^2 / 4, the first 5.315."""
    z = roots(lambda z: jv(1, z) * iv(2, z) + iv(1, z) * jv(2, z), 1, 20, 3)
    assert np.sqrt(modes(WEDGE, kept=3)[2]) == pytest.approx(z**2 / 4, rel=1e-7)


def test_the_free_length_of_a_sleeve_is_a_cantilever_of_this_length():
    assert modes(UNIT, free=0.5)[2] == pytest.approx(16 * modes(UNIT)[2], rel=1e-10)


@pytest.mark.parametrize("statics", [False, True])
def test_modes_are_mass_normalised_and_move_the_tip_to_the_left(statics):
    M, K, tip = clamped_matrices(WEDGE, 1.0, 12, 13, [ClampedBody(1.0, 0.2, 0.1)])
    V, lam = clamped_modes(M, K, tip, 3, statics)
    assert V.shape == (12, 5 if statics else 3)
    assert V.T @ M @ V == pytest.approx(np.eye(len(lam)), abs=1e-9)
    assert V.T @ K @ V == pytest.approx(np.diag(lam), abs=1e-9 * lam[-1])
    assert (tip[0] @ V > 0).all() and (np.diff(lam) > 0).all()


def test_static_shapes_make_the_tip_right_under_a_force_and_a_moment():
    M, K, tip = clamped_matrices(UNIT, 1.0, 12, 13)
    V, lam = clamped_modes(M, K, tip, 2, True)
    flexibility = (tip @ V) @ np.diag(1 / lam) @ (tip @ V).T
    assert flexibility == pytest.approx(np.array([[1 / 3, 1 / 2], [1 / 2, 1]]), rel=1e-11)


@pytest.mark.parametrize("kept", [1, 3])
def test_few_shapes_are_enough_for_the_kept_modes(kept):
    (piece,) = pieces(Link.model_validate(beam(1.0, 1.0, 1.0, 4, modes=kept)))
    exact = roots(lambda x: np.cos(x) + 1 / np.cosh(x), 1, 15, kept)
    assert piece.K**0.25 == pytest.approx(exact, rel=1e-4)
