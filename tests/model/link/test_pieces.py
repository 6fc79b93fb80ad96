"""Shapes, sections and pieces of one link."""

import numpy as np
import pytest

from flexura.link.line import pieces
from flexura.link.quadrature import cells
from flexura.link.section import material
from flexura.link.shapes import ElementShapes, WholeShapes
from flexura.robot import Link
from robots import beam

SHAPES = [
    ElementShapes(),
    ElementShapes(0.2),
    WholeShapes(np.eye(6)),
    WholeShapes(np.arange(8.0).reshape(4, 2)),
]
SECTIONS = [
    {"at_m": 0.0, "width_m": 0.03, "height_m": 0.004},
    {"at_m": 0.2, "width_m": 0.02, "height_m": 0.004},
    {"at_m": 0.5, "width_m": 0.02, "height_m": 0.001},
]
STEEL = {
    "length_m": 0.5,
    "young_modulus_Pa": 2e11,
    "density_kg_m3": 7850.0,
    "section": SECTIONS,
    "joint": {"type": "R"},
}


@pytest.mark.parametrize("shapes", SHAPES)
@pytest.mark.parametrize("derivative", [0, 1])
def test_a_shapes_derivative_integrated_is_the_shape(shapes, derivative):
    xi, w = cells(np.array([0.0, 0.7]), 8)
    ends = shapes(np.array([0.0, 0.7]), derivative)
    assert w @ shapes(xi, derivative + 1) == pytest.approx(ends[1] - ends[0], abs=1e-12)


@pytest.mark.parametrize("shapes", SHAPES)
def test_shapes_do_not_turn_the_hub(shapes):
    assert shapes(np.zeros(1)) == pytest.approx(np.zeros((1, shapes.count)), abs=1e-15)


def test_a_taper_is_a_polynomial_of_its_dimensions():
    link = Link.model_validate(STEEL | {"elements": 3})
    law, s = material(link), np.linspace(0, 0.5, 41)
    assert law.mass_per_length(s) == pytest.approx(link.mass_per_length(s), rel=1e-13)
    assert law.bending_stiffness(s) == pytest.approx(link.bending_stiffness(s), rel=1e-12)
    x, dx = law.quadrature(0.0, 0.5, 4)
    assert dx @ law.mass_per_length(x, 1) == pytest.approx(
        np.diff(law.mass_per_length(np.array([0, 0.5])))[0], rel=1e-12
    )
    assert dx @ law.bending_stiffness(x, 1) == pytest.approx(
        np.diff(link.bending_stiffness(np.array([0, 0.5])))[0], rel=1e-12
    )


@pytest.mark.parametrize("section", [SECTIONS, SECTIONS[0] | {}])
def test_the_stiffness_of_an_element_is_diagonal(section):
    section = (
        section if isinstance(section, list) else {k: v for k, v in section.items() if k != "at_m"}
    )
    link = Link.model_validate(STEEL | {"elements": 3, "section": section})
    law, h = material(link), 0.5 / 3
    for e, piece in enumerate(pieces(link)):
        s, ds = law.quadrature(e * h, (e + 1) * h, 6)
        curvature = piece.shapes((s - e * h) / h, 1) / h
        K = curvature.T @ ((law.bending_stiffness(s) * ds)[:, None] * curvature)
        assert K == pytest.approx(np.diag(piece.K), rel=1e-12, abs=1e-12 * K[0, 0])
        assert piece.B_tip == pytest.approx([1, 0], abs=1e-15)


@pytest.mark.parametrize("keys", [{}, {"modes": 2}])
def test_moments_of_the_mass_are_those_of_a_straight_link(keys):
    """A straight piece: the sums of s_j and W_jl are the integrals of s dm and s^2 dm."""
    link = Link.model_validate(beam(0.8, 1.5, 2.0, 3, **keys))
    made = pieces(link)
    h = 0.8 / len(made)
    for piece in made:
        assert piece.mass.sum() == pytest.approx(1.5 * h, rel=1e-13)
        assert piece.s.sum() == pytest.approx(1.5 * h**2 / 2, rel=1e-13)
        assert piece.W.sum() == pytest.approx(1.5 * h**3 / 3, rel=1e-13)
        assert np.linalg.eigvalsh(piece.W)[0] > 0
