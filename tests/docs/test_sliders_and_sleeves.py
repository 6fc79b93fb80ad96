"""Equations of docs/theory/04-sliders-and-sleeves.md, written down with plain NumPy,
against the system and the core."""

import numpy as np
import pytest
from numpy.polynomial.legendre import Legendre, leggauss
from numpy.polynomial.polynomial import polyder, polyfromroots, polyint, polyval

import flexura as fx
import robots
from flexura.system.nodes import nodes_at

L, ELEMENTS = 0.8, 3
N, P = 2 * ELEMENTS, 2 * ELEMENTS + 1  # shapes and points of a link as one piece
RNG = np.random.default_rng(4)
TAPER = [
    {"at_m": 0.0, "width_m": 0.03, "height_m": 0.004},
    {"at_m": L, "width_m": 0.02, "height_m": 0.002},
]


def fine(count, a=0.0, b=1.0):
    x, w = leggauss(count)
    return a + (b - a) * (1 + x) / 2, (b - a) * w / 2


POINTS, G = fine(P)
POWERS = [
    polyfromroots(np.delete(POINTS, j)) / np.prod(x - np.delete(POINTS, j))
    for j, x in enumerate(POINTS)
]


def lagrange(xi, derivative=0):
    rows = [polyint(p) if derivative < 0 else polyder(p, derivative) for p in POWERS]
    return np.array([polyval(xi, row) for row in rows]).T


def shapes(xi, derivative=0):
    """Integrals of Legendre's polynomials on [0, 1], or their derivatives by xi: (..., N)."""
    out = []
    for k in range(N):
        P0, P1 = Legendre.basis(max(k - 1, 0)), Legendre.basis(k + 1)
        phi = Legendre([1, 1]) if k == 0 else (P1 - P0) / (2 * k + 1)
        out.append(
            (phi.deriv(derivative) if derivative else phi)(2 * np.asarray(xi) - 1) * 2.0**derivative
        )
    return np.array(out).T


B = shapes(POINTS)


def dot(a, b):
    return np.real(np.conj(a) * b)


def ridden():
    """A link in a sleeve at the base that a slider rides on: q = [d, shapes, eta]."""
    beam = robots.beam(L, 0.3, 0.8, ELEMENTS, "Pb", start=0.5, angle_rad=0.3)
    system = robots.system(
        beam, robots.rigid(0.1, 0.2, 0.05, 1e-3, "Pa", start=0.6, angle_rad=-0.2)
    )
    q, qd, qdd = (0.4 * RNG.normal(size=system.n) for _ in range(3))
    q[0], q[-1] = 0.5, 0.6
    return system, q, qd, qdd


def test_a_slider_on_a_link_in_a_sleeve():
    """Place, angle, velocity and acceleration of its hub, with all convective terms.

    Equations: 29, 30, 31
    """
    system, q, qd, qdd = ridden()
    d, y, eta = q[0], q[1:-1], q[-1]
    xi = (eta - L + d) / d
    xi_rate = (qd[-1] + (1 - xi) * qd[0]) / d
    e, spin, more = np.exp(1j * (0.3 + B @ y)), B @ qd[1:-1], B @ qdd[1:-1]
    w, l, dl = lagrange(xi, -1), lagrange(xi), lagrange(xi, 1)
    b, db, ddb = (shapes(xi, k) for k in range(3))
    tau, kappa = l @ e, db @ y / d
    place, angle = d * w @ e, 0.3 + b @ y
    hub = system.assembly.structure.states(q, qd)[1].hub
    found = np.ravel(system.line(q, 2, [0.0]))
    assert found == pytest.approx([place.real, place.imag, angle - 0.2], abs=1e-12)
    along = qd[-1] + (1 - xi) * qd[0]
    velocity = d * w @ (1j * e * spin) + qd[0] * (w @ e) + tau * along
    assert hub.velocity @ qd == pytest.approx(velocity, abs=1e-12)
    assert hub.turning @ qd == pytest.approx(b @ qd[1:-1] + kappa * along, abs=1e-12)
    second = (
        d * w @ (1j * e * more - e * spin**2) + tau * qdd[-1] + (w @ e + (1 - xi) * tau) * qdd[0]
    )
    second += 2 * qd[0] * w @ (1j * e * spin) + d * xi_rate * np.sum(
        2 * l * 1j * e * spin + xi_rate * dl * e
    )
    assert hub.velocity @ qdd + hub.rest == pytest.approx(second, abs=1e-11)
    turned = b @ qdd[1:-1] + kappa * (qdd[-1] + (1 - xi) * qdd[0])
    turned += xi_rate * (2 * db @ qd[1:-1] + xi_rate * ddb @ y) - 2 * kappa * xi_rate * qd[0]
    assert hub.turning @ qdd + hub.rest_turning == pytest.approx(turned, abs=1e-11)


def sleeved():
    """A carriage, a turning sleeve and a tapered link in it: q = [x, angle, d, shapes]."""
    link = {
        "length_m": L,
        "elements": ELEMENTS,
        "section": TAPER,
        "young_modulus_Pa": 2e9,
        "density_kg_m3": 3000.0,
    }
    system = robots.system(
        robots.rigid(0.0, 0.4, 0.0, 0.0, "Pa"),
        robots.rigid(0.0, 0.0, 0.0, 2e-3),
        link | {"joint": {"type": "Pb", "start_m": 0.5}},
    )
    q, qd, qdd = (0.5 * RNG.normal(size=system.n) for _ in range(3))
    q[2] = 0.5
    return system, q, qd, qdd


def section(X):
    """Mass per length, its slope, and bending stiffness of TAPER."""
    width, height, dw, dh = 0.03 - 0.01 * X / L, 0.004 - 0.002 * X / L, -0.01 / L, -0.002 / L
    return 3000 * width * height, 3000 * (dw * height + width * dh), 2e9 * width * height**3 / 12


def free_length(q, qd):
    """C, F, e, Omega, V, mu and mu' at the points of the free length."""
    d = q[2]
    C = lagrange(POINTS, -1)
    F = C + np.diag(1 - POINTS)
    e, spin = np.exp(1j * (q[1] + B @ q[3:])), qd[1] + B @ qd[3:]
    V = d * C @ (1j * e * spin) + qd[2] * F @ e
    rho, slope, _ = section(L - d + POINTS * d)
    mu, mu_d = rho * d * G, G * (rho + d * slope * (POINTS - 1))
    return C, F, e, spin, V, mu, mu_d


def test_the_kinetic_energy_of_a_link_in_a_sleeve():
    """Free length and rod, with the carriage and the sleeve.

    Equations: 32, 33, 34
    """
    system, q, qd, _ = sleeved()
    *_, V, mu, _ = free_length(q, qd)
    v, t = qd[0] + 0j, np.exp(1j * q[1])
    energy = 0.5 * (mu @ np.abs(v + V) ** 2)
    X, dX = fine(20, 0.0, L - q[2])
    x = X - L + q[2]
    energy += 0.5 * (dX * section(X)[0]) @ np.abs(v + x * qd[1] * 1j * t + qd[2] * t) ** 2
    energy += 0.5 * 0.4 * qd[0] ** 2 + 0.5 * 2e-3 * qd[1] ** 2
    assert system.assembly.energies(q, qd).kinetic == pytest.approx(energy, rel=1e-11)
    assert system.observe(q[None], qd[None])[0, -3] == pytest.approx(energy, rel=1e-11)


def stiffness(d):
    slopes = shapes(POINTS, 1)
    return slopes.T @ ((section(L - d + POINTS * d)[2] * G / d)[:, None] * slopes)


def test_the_strain_energy_of_the_free_length():
    """The energy, and the stiffness that depends on the free length.

    Equations: 35
    """
    system, q, qd, _ = sleeved()
    K = stiffness(q[2])
    assert system.observe(q[None], qd[None])[0, -2] == pytest.approx(
        0.5 * q[3:] @ K @ q[3:], rel=1e-11
    )
    assert system.assembly.stiffness_blocks(q)[3:, 3:] == pytest.approx(
        K, rel=1e-9, abs=1e-9 * np.abs(K).max()
    )


@pytest.mark.parametrize("load", [(0.0, 0.0, 0.4), (0.0, 1.0, 0.0), (-0.5, 0.8, 0.2)])
def test_the_force_that_pushes_a_bent_link_out_of_its_sleeve(load):
    """At rest the drive holds the link against M0^2 / (2 EI) and against the load along the sleeve.

    Equations: 36
    """
    EI, d = 0.8, 0.5
    system = robots.system(robots.beam(L, 0.3, EI, 8, "Pb", start=d))
    q = fx.static(system, tip_force=load[:2], tip_moment=load[2])
    x, y, _ = (a[0] for a in system.line(q, 1, [L]))
    M0 = load[2] + x * load[1] - y * load[0]
    reach = np.array([x, y]) / d  # of the tip by d, the shapes held
    hold = system.elastic(q)[0] - reach @ load[:2]
    assert abs(y) > 0.05
    assert hold == pytest.approx(-(M0**2) / (2 * EI) - load[0], rel=1e-6)


def test_the_rows_of_a_link_in_a_sleeve():
    """Forces on carriage, sleeve, flow and shapes that a motion needs.

    Equations: 37
    """
    system, q, qd, qdd = sleeved()
    d, d_rate = q[2:3].item(), qd[2]
    C, F, e, spin, V, mu, mu_d = free_length(q, qd)
    t, n = np.exp(1j * q[1]), 1j * np.exp(1j * q[1])
    turn = np.column_stack([np.ones(P), B])  # what turning and each shape turns
    columns = d * C @ (1j * e[:, None] * turn)
    A = d_rate * (C + F) @ (1j * e * spin) - d * C @ (e * spin**2)
    V2 = columns @ np.append(qdd[1], qdd[3:]) + F @ e * qdd[2] + A + qdd[0]
    density = section(L - d)[0]
    left = mu * (1 - POINTS)
    forces = np.zeros(system.n)
    forces[0] = np.real(mu @ V2 + d_rate * mu_d @ V - density * d_rate**2 * t)
    for row, (a, b) in zip([1, *range(3, system.n)], zip(columns.T, turn.T)):
        forces[row] = mu @ dot(a, V2) + d_rate * np.sum(dot(mu_d * a - left * 1j * e * b, V))
    forces[2] = mu @ dot(F @ e, V2) + d_rate * mu_d @ dot(F @ e, V) + left @ dot(1j * e * spin, V)
    forces[2] += -0.5 * mu_d @ np.abs(V) ** 2 - 0.5 * density * d_rate**2
    X, dX = fine(20, 0.0, L - d)
    x, dm = X - L + d, dX * section(X)[0]
    second = qdd[0] + x * n * qdd[1] + t * qdd[2] + 2 * d_rate * qd[1] * n - x * qd[1] ** 2 * t
    forces[:3] += [dm @ second.real, (dm * x) @ dot(n, second), dm @ dot(t, second)]
    forces[0] += 0.4 * qdd[0]
    forces[1] += 2e-3 * qdd[1]
    h = 1e-5
    forces[2] += q[3:] @ (stiffness(d + h) - stiffness(d - h)) @ q[3:] / (4 * h)
    forces[3:] += stiffness(d) @ q[3:]
    assert system.forces(q, qd, qdd) == pytest.approx(forces, rel=1e-7, abs=1e-9)
    assert system.equations.forces(q, qd, qdd, True, True, True) == pytest.approx(
        forces, rel=1e-7, abs=1e-9
    )


def test_the_node_of_a_slider_and_the_nodes_in_a_sleeve():
    """The dissertation's table: the node that ends the slider's element, and the last node at rest.

    Equations: 38
    """
    rider = robots.rigid(0.1, 0.2, 0.05, 1e-3, "Pa", start=0.1)
    slider = robots.robot(robots.beam(L, 0.3, 0.8, 4), rider, sliding="nodal")
    for eta in (0.05, 0.21, 0.39, 0.41, 0.79):
        assert nodes_at(slider, np.array([0.0, eta]))[1] == int(np.ceil(eta / (L / 4)))
    sleeve = robots.robot(robots.beam(L, 0.3, 0.8, 4, "Pb", start=0.5), sliding="nodal")
    for d in (0.19, 0.21, 0.45, 0.79):
        at_rest = [k for k in range(5) if k * L / 4 <= L - d]
        assert nodes_at(sleeve, np.array([d]))[0] == min(max(at_rest), 3)
