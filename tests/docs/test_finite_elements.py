"""Equations of docs/theory/02-finite-elements.md, written down with plain NumPy,
against flexura.link and the system."""

import numpy as np
import pytest
from numpy.polynomial.legendre import Legendre, leggauss
from numpy.polynomial.polynomial import polyfromroots, polyint, polyval

import flexura as fx
import robots
from flexura.link.line import pieces
from flexura.link.modes import ClampedBody, clamped_matrices, clamped_modes
from flexura.link.quadrature import lagrange, lagrange_integrals
from flexura.link.section import material
from flexura.link.shapes import legendre_shapes
from flexura.robot import Link

L = 0.5
TAPER = [
    {"at_m": 0.0, "width_m": 0.03, "height_m": 0.006},
    {"at_m": L, "width_m": 0.02, "height_m": 0.002},
]
STEEL = {
    "length_m": L,
    "elements": 3,
    "young_modulus_Pa": 2e11,
    "density_kg_m3": 7850.0,
    "joint": {"type": "R"},
}


def fine(count=40, a=0.0, b=1.0):
    x, w = leggauss(count)
    return a + (b - a) * (1 + x) / 2, (b - a) * w / 2


def taper(s):
    """Mass per length and bending stiffness of TAPER."""
    width, height = 0.03 - 0.02 * s, 0.006 - 0.008 * s
    return 7850.0 * width * height, 2e11 * width * height**3 / 12


def phi(k, u, derivative=False):
    """Shape k of a whole link at u on [-1, 1], or its derivative by u."""
    P = [Legendre.basis(n)(u) for n in range(k + 2)]
    if derivative:
        return P[k]
    return P[1] + 1 if k == 0 else (P[k + 1] - P[k - 1]) / (2 * k + 1)


def lagrange_of(points):
    """Lagrange's polynomials through points, by their roots, as powers."""
    return [
        polyfromroots(np.delete(points, j)) / np.prod(x - np.delete(points, j))
        for j, x in enumerate(points)
    ]


@pytest.fixture
def steel():
    return Link.model_validate(STEEL | {"section": TAPER})


def test_the_section(steel):
    """A tapered rectangular section, linear in its dimensions.

    Equations: 8
    """
    s = np.linspace(0, L, 17)
    law, (mass, stiffness) = material(steel), taper(s)
    assert law.mass_per_length(s) == pytest.approx(mass, rel=1e-12)
    assert law.bending_stiffness(s) == pytest.approx(stiffness, rel=1e-12)


def test_the_strain_energy_of_bending(steel):
    """The energy is the integral of EI kappa^2, and a sum of squares, at any bending.

    Equations: 9
    """
    robot = fx.Robot.from_dict({"link": [STEEL | {"section": TAPER}]})
    system = fx.assemble(robot)
    q = np.random.default_rng(0).normal(size=system.n)
    energy, h = 0.0, L / 3
    x, w = fine()
    for k, own in enumerate(q[1:].reshape(3, 2)):
        EI = taper(h * (k + x))[1]
        k12, k22 = (w * EI * shape @ (6 - 12 * x) for shape in (np.ones_like(x), 6 - 12 * x))
        c = k12 / k22
        curvature = (own[0] * (1 - c * (6 - 12 * x)) + own[1] * (6 - 12 * x)) / h
        energy += 0.5 * h * w @ (EI * curvature**2)
    assert system.assembly.energies(q, 0 * q).strain == pytest.approx(energy, rel=1e-12)
    K = np.concatenate([piece.K for piece in pieces(steel)])
    assert 0.5 * K @ q[1:] ** 2 == pytest.approx(energy, rel=1e-12)


def test_an_element(steel):
    """Shapes and stiffness of a tapered and of a uniform element.

    Equations: 10, 11
    """
    x, w = fine()
    h = L / 3
    for k, piece in enumerate(pieces(steel)):
        EI = taper(h * (k + x))[1]
        curvatures = np.array([np.ones_like(x), 6 - 12 * x]) / h
        (k11, k12), (_, k22) = (curvatures * (w * h * EI)) @ curvatures.T
        c = k12 / k22
        assert piece.K == pytest.approx([k11 - c * k12, k22], rel=1e-12)
        bubble = 6 * x * (1 - x)
        assert piece.shapes(x) == pytest.approx(
            np.column_stack([x - c * bubble, bubble]), abs=1e-13
        )
    uniform = Link.model_validate(robots.beam(L, 0.2, 0.7, 4))
    assert pieces(uniform)[0].K == pytest.approx(0.7 / (L / 4) * np.array([1, 12]), rel=1e-13)


def test_the_shapes_of_a_whole_link():
    """Integrals of Legendre's polynomials, and their number.

    Equations: 12
    """
    xi = np.linspace(0, 1, 9)
    u = 2 * xi - 1
    assert legendre_shapes(6, xi) == pytest.approx(
        np.column_stack([phi(k, u) for k in range(6)]), abs=1e-14
    )
    slopes = 2 * np.column_stack([phi(k, u, True) for k in range(6)])
    assert legendre_shapes(6, xi, 1) == pytest.approx(slopes, abs=1e-13)
    after = Link.model_validate(robots.rigid(0.1, 1.0, 0.05, 0.0, "Pa", start_m=0.1))
    tip = Link.model_validate(robots.rigid(0.1, 1.0, 0.05, 0.0))
    for elements, modes, next_link, shapes, points in (
        (3, None, after, 6, 7),
        (10, None, after, 16, 17),
        (10, 3, tip, 8, 9),
        (10, 3, None, 8, 8),
    ):
        keys = {} if modes is None else {"modes": modes}
        (piece,) = pieces(
            Link.model_validate(robots.beam(L, 0.2, 0.7, elements, **keys)), next_link
        )
        assert (len(piece.shapes.coefficients), piece.points) == (shapes, points)


@pytest.mark.parametrize("count", [3, 5, 9])
def test_lagranges_polynomials_as_sums_of_legendres(count):
    """The sums are the products of roots, and their integrals.

    Equations: 13
    """
    points, _ = fine(count)
    xi = np.linspace(0, 1, 11)
    rows = lagrange_of(points)
    assert lagrange(count, xi) == pytest.approx(
        np.column_stack([polyval(xi, r) for r in rows]), abs=1e-9
    )
    integrals = np.column_stack([polyval(xi, polyint(r)) for r in rows])
    assert lagrange_integrals(count, xi) == pytest.approx(integrals, abs=1e-10)
    u, g = leggauss(count)
    x = np.linspace(-1, 1, 11)
    sums = sum(
        (2 * k + 1) * np.outer(Legendre.basis(k)(x), g / 2 * Legendre.basis(k)(u))
        for k in range(count)
    )
    assert lagrange(count, xi) == pytest.approx(sums, abs=1e-12)


def test_the_constants_of_a_piece(steel):
    """Mass and moments of a tapered element.

    Equations: 14
    """
    points, _ = fine(3)
    x, dx = fine()
    h = L / 3
    w = h * np.column_stack([polyval(x, polyint(r)) for r in lagrange_of(points)])
    for k, piece in enumerate(pieces(steel)):
        dm = h * dx * taper(h * (k + x))[0]
        assert piece.mass.sum() == pytest.approx(dm.sum(), rel=1e-13)
        assert piece.s == pytest.approx(dm @ w, rel=1e-12, abs=1e-15)
        assert piece.W == pytest.approx(w.T @ (dm[:, None] * w), rel=1e-11, abs=1e-16)


def test_a_rigid_link_and_the_sum_of_squares():
    """The inertia that two joints of a rigid link move, in the core and in the assembly.

    Equations: 15
    """
    m, c, J = 0.7, 0.2, 3e-3
    system = robots.system(robots.rigid(0.0, 0.4, 0.0, 0.0, "Pa"), robots.rigid(0.5, m, c, J))
    q = np.array([0.1, 0.8])
    s, W = m * c, J + m * c**2
    expected = [[m + 0.4, -s * np.sin(0.8)], [-s * np.sin(0.8), W]]
    assert system.mass(q) == pytest.approx(np.array(expected), rel=1e-13)
    assert system.equations.mass(q) == pytest.approx(np.array(expected), rel=1e-13)


def test_turning_energy_as_a_sum_of_squares():
    """The core's kinetic energy of a bent link that turns about its hub, by Cholesky's factor of W.

    Equations: 16
    """
    system = robots.system(robots.beam(L, 0.2, 0.7, 1))
    rng = np.random.default_rng(3)
    q, qd = rng.normal(size=(2, 3))
    points, _ = fine(3)
    x, dx = fine()
    w = L * np.column_stack([polyval(x, polyint(r)) for r in lagrange_of(points)])
    W = w.T @ ((0.2 * L * dx)[:, None] * w)
    B = np.column_stack([points, 6 * points * (1 - points)])
    e, spin = np.exp(1j * (q[0] + B @ q[1:])), qd[0] + B @ qd[1:]
    R = np.linalg.cholesky(W).T
    squares = np.abs(R @ (1j * e * spin)) ** 2
    products = np.real(np.conj(e)[:, None] * e) * np.outer(spin, spin)
    assert np.sum(W * products) == pytest.approx(squares.sum(), rel=1e-13)
    kinetic = system.observe(q[None], qd[None])[0, -3]
    assert kinetic == pytest.approx(0.5 * squares.sum(), rel=1e-12)


def own_matrices(count, points, mass=0.0, inertia=0.0):
    """M_c and K_c of the tapered link with a payload, and its tip's deflections and angles."""
    nodes, _ = fine(points)
    B = np.column_stack([phi(k, 2 * nodes - 1) for k in range(count)])
    x, dx = fine()
    w = L * np.column_stack([polyval(x, polyint(r)) for r in lagrange_of(nodes)])
    w_tip = L * np.array([polyval(1.0, polyint(r)) for r in lagrange_of(nodes)])
    rho, EI = taper(L * x)
    W = w.T @ ((rho * L * dx)[:, None] * w)
    tip_angle = np.array([phi(k, 1.0) for k in range(count)])
    slopes = 2 / L * np.column_stack([phi(k, 2 * x - 1, True) for k in range(count)])
    M = (
        B.T @ W @ B
        + mass * np.outer(B.T @ w_tip, B.T @ w_tip)
        + inertia * np.outer(tip_angle, tip_angle)
    )
    return M, slopes.T @ ((EI * L * dx)[:, None] * slopes), B.T @ w_tip, tip_angle


def test_the_clamped_matrices(steel):
    """Mass and stiffness of a straight tapered link with a payload.

    Equations: 17
    """
    M, K, w_tip, tip_angle = own_matrices(6, 7, 0.05, 2e-4)
    found = clamped_matrices(material(steel), L, 6, 7, [ClampedBody(L, 0.05, 2e-4)])
    assert found[0] == pytest.approx(M, rel=1e-9, abs=1e-13)
    assert found[1] == pytest.approx(K, rel=1e-9, abs=1e-9)
    assert found[2] == pytest.approx(np.vstack([w_tip, tip_angle]), abs=1e-13)


def test_the_clamped_modes(steel):
    """The modes are those of the pair of matrices; of a uniform cantilever the first has 1.875^2.

    Equations: 18
    """
    M, K, w_tip, _ = own_matrices(8, 8, 0.05)
    _, made, tip = clamped_matrices(material(steel), L, 8, 8, [ClampedBody(L, 0.05, 0.0)])
    V, squares = clamped_modes(M, made, tip, 3, False)
    expected = np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)[:3]
    assert squares == pytest.approx(expected, rel=1e-8)
    assert V.T @ M @ V == pytest.approx(np.eye(3), abs=1e-9)
    assert K @ V == pytest.approx(M @ V * squares, abs=1e-8 * np.abs(K @ V).max())
    assert np.all(w_tip @ V > 0)
    uniform = robots.robot(robots.beam(L, 0.2, 0.7, 4, modes=2))
    assert fx.frequencies(uniform)[0] == pytest.approx(
        1.8751040687**2 / (2 * np.pi * L**2) * np.sqrt(0.7 / 0.2), rel=1e-6
    )


def test_static_shapes_join_the_modes(steel):
    """With another link behind it, the modes contain what a tip force and a tip moment bend.

    Equations: 19
    """
    M, K, w_tip, tip_angle = own_matrices(8, 9)
    _, made, tip = clamped_matrices(material(steel), L, 8, 9)
    V, _ = clamped_modes(M, made, tip, 2, False)
    squares = np.sum(V * (K @ V), axis=0)
    rest = [np.linalg.solve(K, f) - V @ (V.T @ f / squares) for f in (w_tip, tip_angle)]
    whole, _ = clamped_modes(M, made, tip, 2, True)
    assert whole.shape == (8, 4)
    for z in (*V.T, *rest):
        left = z - whole @ (whole.T @ M @ z)
        assert np.sqrt(left @ M @ left) < 1e-6 * np.sqrt(z @ M @ z)
