"""Identities of mass matrix, energies, forward and inverse dynamics on random robots."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given

import flexura as fx
from identities import (
    acceleration,
    at_rest_if_locked,
    close,
    energy,
    gradient,
    recursion,
    steps,
)
from robots import (
    beam,
    fast,
    few,
    forces,
    robots,
    seeds,
    state,
    system,
    turning,
)

# Mass matrix and energies


@fast
@given(robots(), seeds)
def test_the_mass_matrix_is_symmetric_and_positive_definite(bot, seed):
    sys = fx.assemble(bot)
    M = sys.mass(state(sys, seed)[0])
    assert np.abs(M - M.T).max() < 1e-12 * np.abs(M).max()
    scale = 1 / np.sqrt(np.diag(M))
    assert np.linalg.eigvalsh(M * scale * scale[:, None])[0] > 1e-9


@fast
@given(robots(), seeds)
def test_the_mass_matrix_is_the_hessian_of_the_kinetic_energy(bot, seed):
    """T is quadratic in qd, so that T(a + b) - T(a) - T(b) = a^T M b exactly."""
    sys = fx.assemble(bot)
    q, a = state(sys, seed)
    b = state(sys, seed + 1)[1]
    M = sys.mass(q)
    T = [energy(sys, "kinetic", q, v) for v in (a, b, a + b)]
    assert T[0] == pytest.approx(a @ M @ a / 2, rel=1e-10)
    assert T[2] - T[0] - T[1] == pytest.approx(a @ M @ b, rel=1e-10, abs=1e-10 * (T[0] + T[1]))


@few
@given(robots(max_links=3), seeds)
def test_bias_forces_follow_from_the_mass_matrix(bot, seed):
    """Lagrange: bias(q, qd) - bias(q, 0) = dM/dt qd - 1/2 d(qd^T M qd)/dq; bias(q, 0) is the strain
    energy's part beyond K."""
    sys = fx.assemble(bot)
    q, qd = state(sys, seed)
    h = 1e-3
    rate = (
        (
            8 * (sys.mass(q + h * qd) - sys.mass(q - h * qd))
            - (sys.mass(q + 2 * h * qd) - sys.mass(q - 2 * h * qd))
        )
        @ qd
        / (12 * h)
    )
    slope = gradient(lambda z: qd @ sys.mass(z) @ qd / 2, q, steps(sys, 5e-4))
    close(
        (sys.bias(q, qd) - sys.bias(q, 0 * q)) / turning(sys),
        (rate - slope) / turning(sys),
        1e-7,
        least=1e-3,
    )


@few
@given(robots(max_links=3), seeds)
def test_gravity_and_stiffness_are_gradients_of_the_energies(bot, seed):
    """gravity = dV/dq; K q + bias(q, 0) = dU/dq, and K is the Hessian of U at 0."""
    sys = fx.assemble(bot)
    q, _ = state(sys, seed)
    h = steps(sys, 2e-3)
    scale = np.abs(sys.gravity(q)).max()
    got = gradient(lambda z: energy(sys, "potential", z), q, h)
    assert np.abs(got - sys.gravity(q)).max() <= 1e-7 * max(scale, 1e-12)
    close(gradient(lambda z: energy(sys, "strain", z), q, h) * h, sys.elastic(q) * h, 1e-6)
    z = sys.start()
    z[sys.elastic_rows] = 1e-4 * q[sys.elastic_rows]  # so small that only K is left
    bent = z - sys.start()
    assert energy(sys, "strain", z) == pytest.approx(bent @ sys.stiffness() @ bent / 2, rel=1e-6)


# Forward and inverse dynamics


@fast
@given(robots(coulomb=True, locked=True), seeds)
def test_the_recursion_solves_the_assembled_equations(bot, seed):
    """accelerate, of cost O(N), against M^-1 (F - bias - D qd - K q - gravity), to the digits that
    solving with M leaves."""
    sys = fx.assemble(bot)
    q, qd = state(sys, seed)
    qd = at_rest_if_locked(sys, qd)
    tau = forces(sys, seed)
    size = turning(sys)
    M, scale = sys.mass(q), 1 / np.sqrt(np.diag(sys.mass(q)))
    lost = np.finfo(float).eps * np.linalg.cond(scale[:, None] * M * scale)
    close(recursion(sys, q, qd, tau) * size, acceleration(sys, q, qd, tau) * size, max(1e-8, lost))


@fast
@given(robots(), seeds)
def test_inverse_dynamics_returns_the_forces_that_were_applied(bot, seed):
    """forces(q, qd, accelerations under tau) = tau in the joints' rows and 0 elsewhere."""
    sys = fx.assemble(bot)
    q, qd = state(sys, seed)
    tau = forces(sys, seed)
    qdd = recursion(sys, q, qd, tau)
    got = sys.forces(q, qd, qdd)
    expected = np.zeros(sys.n)
    expected[sys.joint_rows] = tau
    scale = (
        np.abs(sys.mass(q)) @ np.abs(qdd)
        + np.abs(sys.elastic(q))
        + np.abs(sys.bias(q, qd))
        + np.abs(sys.gravity(q))
    )
    assert (np.abs(got - expected) < 1e-11 * (1 + scale)).all()


@fast
@given(robots(stiffening=False, modes=False, gravity=False, sliding=False), seeds)
def test_the_extended_assembly_is_the_dissertations(bot, seed):
    """M_ij = int m J^T J dx of each element by four Gauss points, J = dr/dq through the chain of
    homogeneous transforms, scattered over all unknowns; hubs, rotors and the payload added
    (dissertation, 2.3 and 2.4)."""
    sys = fx.assemble(bot)
    q, _ = state(sys, seed)
    T = nodal(sys)
    close(sys.mass(q), T.T @ by_elements(bot, T @ q) @ T, 1e-9)


def nodal(sys: fx.System) -> np.ndarray:
    """Joints, and deflection and slope at each node, from the unknowns of each element: (n, n), for
    the linear line."""
    T = np.eye(sys.n)
    for i, link in enumerate(sys.robot.links):
        own, n = sys.link_rows(i), link.elements
        if len(own):
            angle = sys.angles(i + 1, np.linspace(0, link.length_m, 2 * n + 1))
            T[own[1::2]] = angle[2::2]
            T[own[0::2]] = np.cumsum(
                (angle[0:-1:2] + 4 * angle[1::2] + angle[2::2]) * link.length_m / n / 6, axis=0
            )
    return T


def by_elements(bot: fx.Robot, q: np.ndarray) -> np.ndarray:
    """M(q) of the linear model: positions of mass points, directions of rotary inertias,
    differentiated with complex steps."""
    n = len(q)
    first = np.cumsum([0] + [1 + 2 * link.elements for link in bot.links])
    weights, M = [], np.zeros((n, n))
    s, gauss = np.polynomial.legendre.leggauss(4)
    for i, link in enumerate(bot.links):
        if link.flexible:
            h = link.length_m / link.elements
            # properties are linear between given places: split elements there, so that Gauss points
            # stay exact
            ends = np.unique(
                np.round([*np.linspace(0, link.length_m, link.elements + 1), *link.breaks()], 12)
            )
            for a, b in itertools.pairwise(ends):
                for p, w in zip(s, gauss):
                    x = (a + b) / 2 + p * (b - a) / 2
                    element = min(int((a + b) / 2 / h), link.elements - 1)
                    weights.append(
                        (w * (b - a) / 2 * float(link.mass_per_length(x)), i, x, element)
                    )
        else:
            weights.append((link.mass_kg, i, link.centre_of_mass_m, -1))
        weights.append((link.joint.hub_mass_kg, i, 0.0, 0))
    last = len(bot.links) - 1
    weights.append(
        (bot.payload.mass_kg, last, bot.links[last].length_m, bot.links[last].elements - 1)
    )

    def places(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """All mass points (k, 2), and the angles of hubs, links and payload."""
        H, frames, angles, angle, end = (
            np.eye(3, dtype=complex),
            [],
            [],
            0,
            np.zeros(2, dtype=complex),
        )
        for i, link in enumerate(bot.links):
            before = bot.links[i - 1] if i else None
            eta = z[first[i]]
            turn = eta if link.joint.type == "R" else link.joint.angle_rad
            along = eta if link.joint.type == "Pa" else (before.length_m if before else 0.0)
            psi = end[1] + turn
            c, d = np.cos(psi), np.sin(psi)
            H = H @ np.array([[c, -d, along], [d, c, end[0]], [0, 0, 1]])
            angle = angle + psi
            frames.append(H)
            angles.append(angle)
            end = z[first[i + 1] - 2 : first[i + 1]] if link.flexible else np.zeros(2)
        angles.append(angle + end[1])
        points = []
        for _, i, x, element in weights:
            w = 0.0
            if bot.links[i].flexible:
                l = bot.links[i].length_m / bot.links[i].elements
                u = np.concatenate([np.zeros(2), z[first[i] + 1 : first[i + 1]]])[
                    2 * element : 2 * element + 4
                ]
                r = x / l - element
                w = u @ np.array(
                    [
                        1 - 3 * r**2 + 2 * r**3,
                        l * (r - 2 * r**2 + r**3),
                        3 * r**2 - 2 * r**3,
                        l * (r**3 - r**2),
                    ]
                )
            points.append((frames[i] @ np.array([x, w, 1.0]))[:2])
        return np.array(points), np.array(angles)

    slopes = [places(q + 1e-30j * e) for e in np.eye(n)]
    J = np.array([p.imag for p, _ in slopes]) / 1e-30  # (n, k, 2)
    A = np.array([a.imag for _, a in slopes]) / 1e-30  # (n, N + 1)
    masses = np.array([w for w, *_ in weights])
    M += np.einsum("akx,k,bkx->ab", J, masses, J)
    for i, link in enumerate(bot.links):
        inertia = link.joint.hub_inertia_kg_m2 + (0.0 if link.flexible else link.inertia_kg_m2)
        M += inertia * np.outer(A[:, i], A[:, i])
        M[first[i], first[i]] += link.joint.rotor_inertia
    return M + bot.payload.inertia_kg_m2 * np.outer(A[:, -1], A[:, -1])


@pytest.mark.parametrize("stiffening", [True, False])
def test_a_payloads_inertia_turns_with_the_tip_only(stiffening):
    """A payload without mass turns at the rate of the tip's angle: T = J (qd + d theta(L)/dt)^2/2
    beyond the bare link's."""
    J = 0.02
    bare, loaded = (
        system(beam(0.5, 0.2, 1.0, 2), payload_inertia=j, stiffening=stiffening) for j in (0.0, J)
    )
    q, qd = state(bare, 5, slope=0.3)
    rate = qd[0] + bare.angles(1, 0.5)[0] @ qd
    extra = energy(loaded, "kinetic", q, qd) - energy(bare, "kinetic", q, qd)
    assert extra == pytest.approx(J * rate**2 / 2, rel=1e-9)
