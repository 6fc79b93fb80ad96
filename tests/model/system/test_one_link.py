"""One link and two against other derivations, clamped frequencies, the linear line."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq

from flexura.link.quadrature import cells, collocation, gauss
from flexura.system.assembly import Assembly
from robots import beam, rigid, robot

CLAMPED = np.array(
    [
        brentq(lambda x: np.cos(x) * np.cosh(x) + 1, a, b, xtol=1e-15)
        for a, b in ((1, 3), (4, 5), (7, 9))
    ]
)


def clamped_frequencies(elements, **keys):
    assembly = Assembly(robot(beam(1.0, 1.0, 1.0, elements, **keys)))
    q = np.zeros(assembly.n)
    return np.sqrt(
        eigh(assembly.stiffness(q)[1:, 1:], assembly.mass(q)[1:, 1:], eigvals_only=True)[:3]
    )


def test_clamped_frequencies_converge_in_the_fourth_order():
    """The exact ones are the squares of the roots of cos x cosh x = -1."""
    error = {n: clamped_frequencies(n) / CLAMPED**2 - 1 for n in (2, 4, 8)}
    assert (np.abs(error[2][:2]) < (5e-4, 1e-2)).all()
    assert (np.abs(error[4]) < (3.5e-5, 1.3e-3, 8.5e-3)).all()
    assert (np.abs(error[8]) < (2.2e-6, 8.2e-5, 6.3e-4)).all()
    assert np.log2(error[4] / error[8]) == pytest.approx([4, 4, 4], abs=0.35)


def test_a_double_pendulum_is_the_textbooks():
    m1, c1, J1, L1, m2, c2, J2, g = 1.2, 0.3, 0.05, 0.7, 0.8, 0.25, 0.03, 9.81
    assembly = Assembly(robot(rigid(L1, m1, c1, J1), rigid(0.5, m2, c2, J2), gravity=(0.0, -g)))
    (a, b), (u, v) = q, qd = np.array([0.4, -1.1]), np.array([1.3, -0.7])
    k = m2 * L1 * c2
    M11 = J1 + m1 * c1**2 + J2 + m2 * (L1**2 + c2**2) + 2 * k * np.cos(b)
    M12, M22 = J2 + m2 * c2**2 + k * np.cos(b), J2 + m2 * c2**2
    assert assembly.mass(q) == pytest.approx(np.array([[M11, M12], [M12, M22]]), rel=1e-13)
    assert assembly.bias(q, qd) == pytest.approx(
        k * np.sin(b) * np.array([-v * (2 * u + v), u**2]), rel=1e-13
    )
    outer = m2 * c2 * g * np.cos(a + b)
    assert assembly.gravity(q) == pytest.approx(
        [(m1 * c1 + m2 * L1) * g * np.cos(a) + outer, outer], rel=1e-13
    )


def fine_forces(assembly, q, qd, qdd):
    """Newton's law for every point of a bent link, r = int e^(i Theta) by 60 cells; virtual
    work."""
    (piece,) = assembly.structure.links[0]
    L, breaks = piece.length, np.linspace(0, 1, 61)
    x, dx = cells(breaks, 4)
    b = np.column_stack([np.ones_like(x), piece.shapes(x)])
    e, spin, turning = np.exp(1j * (b @ q)), b @ qd, b @ qdd
    acceleration, columns = e * (1j * turning - spin**2), 1j * e[:, None] * b
    total = lambda f: _integrals(f, L, breaks)
    A, J = total(acceleration), total(columns)
    rho = assembly.robot.links[0].mass_per_length(L * x)
    return np.real(J.conj().T @ (rho * L * dx * A)), np.real(
        J.conj().T @ ((rho * L * dx)[:, None] * J)
    )


def _integrals(f, L, breaks):
    """int_0^s f ds at the four Gauss points of each cell."""
    C, w = collocation(4), gauss(4)[1]
    h = L * np.diff(breaks)
    parts = f.reshape(len(h), 4, -1)
    whole = np.einsum("c,p,cpk->ck", h, w, parts)
    before = np.vstack([np.zeros_like(whole[:1]), np.cumsum(whole, axis=0)[:-1]])
    inside = before[:, None] + h[:, None, None] * np.einsum("pj,cjk->cpk", C, parts)
    return inside.reshape(f.shape)


def test_a_bent_link_on_a_turning_hub_obeys_newtons_law():
    taper = [{"at_m": 0.0, "value": 1.0}, {"at_m": 1.3, "value": 0.4}]
    carrier = beam(1.3, taper, 1.0, 10)  # 16 polynomials, 17 points: a slider stands on it
    assembly = Assembly(robot(carrier, rigid(0.1, 0.0, 0.0, 0.0, "Pa", start=0.5)))
    rng = np.random.default_rng(2)
    own, low = slice(0, assembly.n - 1), slice(0, 5)
    size = np.append(1.0, 0.5 / np.sqrt(assembly.structure.links[0][0].K)) * (np.arange(17) < 5)
    q, qd, qdd = (np.append(rng.normal(size=17) * size, s) for s in (0.5, 0.0, 0.0))
    force, M = (f[low] for f in fine_forces(assembly, q[own], qd[own], qdd[own]))
    assert np.abs(assembly.line(q, 1, np.linspace(0, 1.3, 50))[2] - q[0]).max() > 0.3  # it is bent
    assert assembly.mass(q)[low, low] == pytest.approx(M[:, low], abs=1e-8 * M.max())
    inertial = assembly.mass(q) @ qdd + assembly.bias(q, qd)
    assert inertial[low] == pytest.approx(force, abs=1e-8 * np.abs(force).max())


@pytest.mark.parametrize("keys", [{}, {"modes": 2}])
def test_the_linear_line_is_the_dissertations(keys):
    """T = 1/2 w^2 (J + q Mc q) + w S q' + 1/2 q' Mc q' with constant J, S, Mc, at any q."""
    assembly = Assembly(
        robot(beam(1.0, 1.2, 1.0, 3, **keys), payload=0.2, payload_inertia=0.1, stiffening=False)
    )
    n = assembly.n
    rng = np.random.default_rng(4)
    q, qd = rng.normal(size=n), rng.normal(size=n)
    M0 = assembly.mass(np.zeros(n))
    J, S, Mc = M0[0, 0], M0[0, 1:], M0[1:, 1:]
    assert pytest.approx(1.2 / 3 + 0.2 + 0.1) == J
    if keys:
        assert Mc == pytest.approx(np.eye(2), abs=1e-12)
    y, v, w = q[1:], qd[1:], qd[0]
    turn = 0.1 * np.outer(
        *2 * [[*assembly.tip(np.zeros(n)).turning[1:]]]
    )  # the payload turns with w', not with the place
    assert assembly.mass(q)[0, 0] == pytest.approx(J + y @ (Mc - turn) @ y)
    assert assembly.mass(q)[0, 1:] == pytest.approx(S) and assembly.mass(q)[
        1:, 1:
    ] == pytest.approx(Mc)
    bias = np.append(2 * w * y @ (Mc - turn) @ v, -(w**2) * (Mc - turn) @ y)
    assert assembly.bias(q, qd) == pytest.approx(bias, abs=1e-12 * np.abs(bias).max())


def test_the_linear_and_the_exact_line_agree_for_small_bending():
    for keys in ({}, {"modes": 2}):
        links = robot(beam(1.0, 1.2, 1.0, 2, **keys), rigid(0.5, 1.0, 0.2, 0.1))
        exact, linear = Assembly(links, False), Assembly(links, True)
        q = np.random.default_rng(5).normal(size=exact.n)
        q[1:-1] *= 1e-4
        difference = np.abs(exact.mass(q) - linear.mass(q)).max()
        assert 0 < difference < 1e-3 * np.abs(exact.mass(q)).max()
        q[1:-1] *= 1e-3
        assert np.abs(exact.mass(q) - linear.mass(q)).max() < 2e-3 * difference
