"""Equations of docs/theory/07-small-motions.md, written down with plain NumPy,
against the system, statics and linear model."""

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from numpy.polynomial.polynomial import polyfromroots, polyint, polyval

import flexura as fx
import robots

L, RHO, EI = 0.5, 0.3, 0.8


def arm(**keys):
    """Two flexible links and a payload under gravity."""
    return robots.system(
        robots.beam(L, RHO, EI, 2, hub_inertia_kg_m2=0.01, damping={"beta_s": 1e-3}),
        robots.beam(L, RHO, EI, 2, hub_mass_kg=0.2, hub_inertia_kg_m2=0.01, viscous_friction=0.3),
        payload=0.1,
        payload_inertia=1e-3,
        **({"gravity": (0.0, -9.81)} | keys),
    )


def potential(system, q, force, moment):
    """Strain and gravity from a run's own channels, less the work of a dead load at the tip."""
    strain, gravity = system.observe(q[None], 0 * q[None])[0, -2:]
    x, y, angle = fx.tip_pose(system, q)
    return strain + gravity - force[0] * x - force[1] * y - moment * angle


def slopes(f, q, h=1e-3):
    """The derivative of f by q, of fourth order; the last axis belongs to q."""
    out = []
    for e in np.eye(len(q)):
        out.append(
            (8 * (f(q + h * e) - f(q - h * e)) - (f(q + 2 * h * e) - f(q - 2 * h * e))) / (12 * h)
        )
    return np.moveaxis(np.array(out), 0, -1)


def test_static_equilibrium():
    """The potential is stationary, and Newton's step from beside it leads back; the elastica's tip.

    Equations: 50
    """
    system, force, moment = arm(), (-2.0, 3.0), 0.2
    q = fx.static(system, [0.3, 0.5], force, moment)
    rows = system.elastic_rows
    R = lambda z: slopes(lambda y: potential(system, y, force, moment), z)
    assert np.abs(R(q)[rows]).max() < 1e-7
    tip = system.assembly.tip(q)
    J, turning = tip.velocity, tip.turning
    left = (
        system.elastic(q)
        + system.gravity(q)
        - np.real(J.conj() * (force[0] + 1j * force[1]))
        - turning * moment
    )
    assert np.abs(left[rows]).max() < 1e-8 and R(q) == pytest.approx(left, abs=1e-7)
    S = slopes(R, q)
    beside = q.copy()
    beside[rows] += 1e-3
    step = np.linalg.solve(S[np.ix_(rows, rows)], -R(beside)[rows])
    assert np.abs(beside[rows] + step - q[rows]).max() < 2e-4
    plain = slopes(lambda z: slopes(lambda y: potential(system, y, (0, 0), 0), z), q)
    assert system.tangent(q) == pytest.approx(plain, abs=1e-5 * np.abs(plain).max())
    cantilever = robots.system(robots.beam(1.0, 1.0, 1.0, 16))
    x, y, angle = fx.tip_pose(cantilever, fx.static(cantilever, tip_force=(0.0, 2.0)))
    assert [1 - x, y, angle] == pytest.approx([0.160642, 0.493457, 0.781750], abs=2e-6)


def test_tangent_stiffness_with_geometric_stiffness():
    """The second variation of the potential, point by point, for a chain of R joints under gravity.

    Equations: 51
    """
    system, g, h = arm(), -9.81j, L / 2
    q = 0.4 * np.random.default_rng(1).normal(size=system.n)
    points = (1 + leggauss(3)[0]) / 2
    powers = [
        polyint(polyfromroots(np.delete(points, j)) / np.prod(x - np.delete(points, j)))
        for j, x in enumerate(points)
    ]
    y, dy = leggauss(10)
    w_tip = h * np.array([polyval(1.0, p) for p in powers])
    s = (RHO * h * dy / 2) @ (h * np.column_stack([polyval((1 + y) / 2, p) for p in powers]))
    beyond = [3 * RHO * h + 0.2 + 0.1, 2 * RHO * h + 0.2 + 0.1, RHO * h + 0.1, 0.1]
    S, angle, turned = np.zeros((system.n, system.n)), 0.0, np.zeros(system.n)
    for k, (joint, own) in enumerate([(0, 1), (None, 3), (5, 6), (None, 8)]):
        if joint is not None:
            angle += q[joint]
            turned[joint] = 1.0
        B = np.column_stack([points, 6 * points * (1 - points)])
        e = np.exp(1j * (angle + B @ q[own : own + 2]))
        gamma = np.real(np.conj(w_tip * beyond[k] * g + s * g) * e)
        d = np.tile(turned, (3, 1))
        d[:, own : own + 2] = B
        S += d.T @ (gamma[:, None] * d)
        S[own, own] += EI / h
        S[own + 1, own + 1] += 12 * EI / h
        angle += q[own]
        turned[own] = 1.0
    assert system.tangent(q) == pytest.approx(S, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("rate", [0.0, 6.0])
def test_the_linear_model_and_its_state_space(rate):
    """Slopes of all forces at rest and about a steady rotation, and the matrices made of them.

    Equations: 52, 53
    """
    system = arm() if rate == 0 else arm(gravity=(0.0, 0.0))
    qd = np.zeros(system.n)
    qd[0] = rate
    linear = fx.linearize(system, qd=None if rate == 0 else qd)
    zero = np.zeros(system.n)
    M = slopes(lambda a: system.forces(linear.q, qd, a), zero)
    D = slopes(lambda v: system.forces(linear.q, v, zero), qd)
    S = slopes(lambda q: system.forces(q, qd, zero), linear.q)
    assert linear.M == pytest.approx(M, rel=1e-7, abs=1e-9)
    assert linear.G == pytest.approx(D, rel=1e-6, abs=1e-7 * np.abs(D).max())
    assert linear.K == pytest.approx(S, rel=1e-6, abs=1e-7 * np.abs(S).max())
    assert linear.hold == pytest.approx(
        system.forces(linear.q, qd, zero)[system.joint_rows], abs=1e-10
    )
    e = np.eye(system.n)[:, system.joint_rows]
    lower = np.hstack([-np.linalg.inv(M) @ S, -np.linalg.inv(M) @ D])
    A = np.vstack([np.hstack([np.zeros_like(M), np.eye(system.n)]), lower])
    assert linear.A == pytest.approx(A, abs=1e-5 * np.abs(A).max())
    assert linear.B == pytest.approx(
        np.vstack([0 * e, np.linalg.inv(M) @ e]), abs=1e-6 * np.abs(linear.B).max()
    )
    c = slopes(lambda q: np.concatenate([q[system.joint_rows], *system.places(q)]), linear.q)
    assert linear.C == pytest.approx(np.hstack([c, 0 * c]), abs=1e-7)
    assert not linear.D.any()


def test_natural_frequencies():
    """Eigenvalues of the tangent stiffness and the mass matrix, joints locked.

    Equations: 54
    """
    system = arm()
    q = fx.static(system)
    rows = system.elastic_rows
    S, M = system.tangent(q)[np.ix_(rows, rows)], system.mass(q)[np.ix_(rows, rows)]
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(M, S)).real)
    assert fx.frequencies(system) == pytest.approx(np.sqrt(squares) / (2 * np.pi), rel=1e-9)
    x = fx.modes(system).shapes[rows]
    assert x.T @ M @ x == pytest.approx(np.eye(len(rows)), abs=1e-9)
    assert S @ x == pytest.approx(M @ x * squares, abs=1e-7 * np.abs(S @ x).max())


def test_the_lowest_few_of_many():
    """Of a long chain they are the largest eigenvalues of the shifted inverse.

    Equations: 55
    """
    system = robots.system(
        *[robots.beam(L, RHO, EI, 20, hub_mass_kg=0.1) for _ in range(4)],
        gravity=(9.81, 0.0),
        payload=0.2,
    )
    q = system.start()
    rows, sigma = system.free_rows, 3.0
    S, M = (x[np.ix_(rows, rows)] for x in (system.tangent(q), system.mass(q)))
    values = np.sort(np.linalg.eigvals(np.linalg.solve(S + sigma * M, M)).real)[::-1][:5]
    found = 2 * np.pi * fx.frequencies(system, q, "free", count=5)
    assert 1 / (found**2 + sigma) == pytest.approx(values, rel=1e-8)


def test_transmission_zeros():
    """To the joint they are clamped frequencies; to the tip of a free beam they are real.

    Equations: 56
    """
    linear = fx.linearize(arm(gravity=(0.0, 0.0)))
    found = linear.zeros("joint/1/drive", "tip/y")
    N = np.linalg.svd(linear.outlook[[linear.outputs.index("tip/y")]])[2][1:].T
    left = np.linalg.svd(linear.E[:, :1].T)[2][1:].T
    for s in found[np.abs(found) > 1][:6]:
        values = np.linalg.svd(
            left.T @ (s * s * linear.M + s * linear.G + linear.K) @ N, compute_uv=False
        )
        other = 1.3 * s + 0.1j * abs(s)
        beside = np.linalg.svd(
            left.T @ (other**2 * linear.M + other * linear.G + linear.K) @ N, compute_uv=False
        )
        assert values[-1] < 1e-6 * beside[-1]
    beam = fx.linearize(robots.system(robots.beam(L, RHO, EI, 20)))
    colocated = np.unique(np.round(np.abs(beam.zeros("joint/1/drive", "joint/1/position")), 6))[:3]
    clamped = np.array([1.8751040687, 4.6940911330, 7.8547574382]) ** 2 / L**2 * np.sqrt(EI / RHO)
    assert colocated == pytest.approx(clamped, rel=1e-4)
    y = np.array([2.3650203724, 5.4978037760])  # tan y = -tanh y
    real = np.sort(np.abs(beam.zeros("joint/1/drive", "tip/y")))[:4]
    assert np.tan(y) == pytest.approx(-np.tanh(y), abs=1e-4)
    assert real == pytest.approx(np.repeat(2 * y**2 * np.sqrt(EI / RHO) / L**2, 2), rel=1e-3)
