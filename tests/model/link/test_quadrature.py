"""Gauss points, and the integrals of the polynomials through them."""

import numpy as np
import pytest

from flexura.link.quadrature import (
    cells,
    collocation,
    gauss,
    lagrange,
    lagrange_integrals,
    legendre_integrals,
)


@pytest.mark.parametrize("count", [1, 3, 8, 21])
def test_collocation_integrates_what_the_points_determine(count):
    xi, _ = gauss(count)
    for k in range(count):
        assert collocation(count) @ xi**k == pytest.approx(xi ** (k + 1) / (k + 1), abs=3e-15)


@pytest.mark.parametrize("count", [1, 3, 8, 21])
def test_the_weights_of_the_whole_length_are_those_of_gauss(count):
    assert lagrange_integrals(count, np.ones(1))[0] == pytest.approx(gauss(count)[1], abs=1e-15)


def test_lagranges_polynomials_are_one_at_their_point_and_zero_at_the_others():
    assert lagrange(9, gauss(9)[0]) == pytest.approx(np.eye(9), abs=1e-13)


@pytest.mark.parametrize("derivative", [0, 1])
def test_a_derivative_integrated_is_the_polynomial(derivative):
    s, w = cells(np.array([0.0, 0.3]), 10)
    ends = lambda d: lagrange(6, np.array([0.3]), d) - lagrange(6, np.array([0.0]), d)
    assert w @ lagrange(6, s, derivative + 1) == pytest.approx(ends(derivative)[0], abs=1e-11)


def test_integrals_of_legendres_polynomials_vanish_at_both_ends_but_the_first():
    ends = legendre_integrals(7, np.array([0.0, 1.0]))
    assert ends == pytest.approx(np.array([[0] * 7, [2] + [0] * 6]), abs=1e-15)
