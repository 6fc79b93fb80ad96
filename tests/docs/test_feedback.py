"""Equations of docs/theory/13-motions.md on feedback, written down with plain NumPy, against what
computes them."""

import numpy as np
import pytest

import flexura as fx
import robots
from flexura.control import loop_figures
from flexura.control.linear_quadratic.measurements import Measurements
from flexura.control.predictive.prediction import Prediction
from flexura.signals import step


def arm():
    """One flexible link with a strain gauge and a laser."""
    link = robots.beam(0.6, 0.2355, 0.5, 2, hub_inertia_kg_m2=2e-3, damping={"beta_s": 2e-3})
    link["sensor"] = [
        {"name": "gauge", "kind": "strain", "at_m": 0.05, "distance_m": 5e-4},
        {"name": "laser", "kind": "deflection", "at_m": 0.5},
    ]
    return robots.system(link, payload=0.05)


def two_links():
    links = [
        robots.beam(0.3, 0.7, 13.0, 1, hub_inertia_kg_m2=2e-3, damping={"beta_s": 1e-3}),
        robots.beam(0.3, 0.16, 0.33, 1, hub_mass_kg=0.28, damping={"beta_s": 1e-3}),
    ]
    return robots.system(*links, payload=0.02)


def design(system, **keys):
    count = len(system.robot.links)
    given = {"position": 0.05, "deflection": 0.01, "damping": 0.02, "disturbance": 0.05} | keys
    return fx.lqg(system, [step(0.5)] * count, [0.5] * count, 200.0, **given)[1]


def closed(d, factors, delay=0):
    """Spectral radius of the closed loop, with factors (m,) on the drives and a delay in ticks."""
    n, m = d.G.shape
    left = np.eye(n) - d.L @ d.C
    size = 2 * n + delay * m
    u = np.zeros((m, size), dtype=complex)
    u[:, :n], u[:, n : 2 * n] = -d.K @ d.L @ d.C, -d.K @ left
    A = np.zeros((size, size), dtype=complex)
    A[:n, :n], A[n : 2 * n, n : 2 * n] = d.F, (d.F - d.G @ d.K) @ left
    A[n : 2 * n, :n] = (d.F - d.G @ d.K) @ d.L @ d.C
    late = u
    for k in range(delay):
        rows = slice(2 * n + k * m, 2 * n + (k + 1) * m)
        A[rows] = late
        late = np.zeros_like(u)
        late[:, rows] = np.eye(m)
    A[:n] += d.G @ (np.asarray(factors)[:, None] * late)
    return np.abs(np.linalg.eigvals(A)).max()


def test_measurements_are_linear_about_the_equilibrium():
    """Values near the equilibrium, by the derivative.

    Equations: 127
    """
    system = arm()
    linear = fx.linearize(system)
    measured = Measurements(system, ["sensor/gauge", "joint/1/position", "sensor/laser"])
    C, m = measured.derivatives(linear), len(linear.M)
    dq = 1e-4 * np.random.default_rng(1).normal(size=m)
    moved = measured.at(linear.q + dq) - measured.at(linear.q)
    assert moved == pytest.approx(C @ np.append(dq, np.zeros(m)), rel=1e-5, abs=1e-10)
    assert not C[:, m:].any()
    run = fx.simulate(system, np.array([0.0, 0.1, 0.2]), [0.2])
    last = measured.at(run.states[-1, : system.n])
    assert last[0] == pytest.approx(run["sensor/gauge"][-1], rel=1e-9)
    assert last[2] == pytest.approx(run["sensor/laser"][-1], rel=1e-9)


@pytest.mark.parametrize("at", ["drives", "measurements"])
def test_the_loop_is_controller_times_robot(at):
    """Transfer matrices of controller and robot, and the sensitivity of one loop.

    Equations: 128
    """
    d = design(two_links())
    one = np.eye(len(d.F))
    left = one - d.L @ d.C
    found = loop_figures(d, at)
    for k in (40, 700, len(found.responses[0].values) - 30):
        z = np.exp(2j * np.pi * found.responses[0].frequencies_Hz[k] / 200.0)
        robot = d.C @ np.linalg.solve(z * one - d.F, d.G)
        F = (d.F - d.G @ d.K) @ left
        controller = d.K @ d.L + d.K @ left @ np.linalg.solve(z * one - F, (d.F - d.G @ d.K) @ d.L)
        loop = controller @ robot if at == "drives" else robot @ controller
        S = np.linalg.inv(np.eye(len(loop)) + loop)
        for i, response in enumerate(found.responses):
            assert response.values[k] == pytest.approx(1 / S[i, i] - 1, rel=1e-7)


def test_margins_are_where_the_closed_loop_ends():
    """Poles of the closed loop with other gains and delays.

    Equations: 129
    """
    d = design(two_links())
    found = loop_figures(d)
    for i, m in enumerate(found.margins):
        factors = np.ones(2, dtype=complex)
        for factor, inwards in ((m.gain[0], 1.02), (m.gain[1], 0.98)):
            if 0 < factor < np.inf:
                factors[i] = factor * inwards
                assert closed(d, factors) < 1
                factors[i] = factor / inwards
                assert closed(d, factors) > 1
        factors[i] = np.exp(1j * m.phase_rad * 0.99)
        assert closed(d, factors) < 1 and closed(d, factors.conj()) < 1
        factors[i] = np.exp(1j * m.phase_rad * 1.01)
        assert max(closed(d, factors), closed(d, factors.conj())) > 1
    one = design(arm())
    ticks = loop_figures(one).margins[0].delay_s * one.rate_Hz
    assert closed(one, [1.0], int(ticks)) < 1 < closed(one, [1.0], int(ticks) + 1)


def test_the_disc_margin_is_the_nearest_factor_that_ends_stability():
    """A factor on the border of the disc, at the worst frequency; factors inside it.

    Equations: 130
    """
    d = design(two_links())
    found = loop_figures(d)
    for i, (m, response) in enumerate(zip(found.margins, found.responses, strict=True)):
        S = 1 / (1 + response.values)
        assert m.disc == pytest.approx(1 / np.abs(S - 0.5).max()) and m.sensitivity >= 1
        worst = int(np.argmax(np.abs(S - 0.5)))
        factors = np.ones(2, dtype=complex)
        factors[i] = -1 / response.values[worst]
        delta = 2 * (factors[i] - 1) / (factors[i] + 1)
        assert abs(delta) == pytest.approx(m.disc, rel=1e-6)
        assert closed(d, factors) == pytest.approx(1.0, abs=1e-6)
    assert 0 < found.disc <= min(m.disc for m in found.margins) + 1e-9
    rng = np.random.default_rng(3)
    for _ in range(60):
        delta = 0.99 * found.disc * np.exp(2j * np.pi * rng.uniform(size=2))
        assert closed(d, (1 + delta / 2) / (1 - delta / 2)) < 1


def prediction():
    system = two_links()
    return system, Prediction(system, [0, 1]), np.random.default_rng(5)


def test_the_prediction_is_linearised_exactly_and_damps_what_is_fast():
    """Accelerations, their derivatives by differences, and the order of the step.

    Equations: 131
    """
    system, p, rng = prediction()
    n = system.n
    x = 0.05 * rng.normal(size=(1, 2 * n)) * np.append(np.ones(n), 3 * np.ones(n))
    u = rng.normal(size=(1, 2))

    def rates(z, w):
        force = np.zeros(n)
        force[system.joint_rows] = w
        return np.append(z[n:], system.accelerations(z[:n], z[n:], force))

    f = rates(x[0], u[0])
    A, small = np.zeros((2 * n, 2 * n)), 1e-6
    for k in range(2 * n):
        e = small * np.eye(2 * n)[k]
        A[:, k] = (rates(x[0] + e, u[0]) - rates(x[0] - e, u[0])) / (2 * small)
    B = np.column_stack([rates(x[0], u[0] + e) - f for e in np.eye(2)])
    one, errors = np.eye(2 * n), []
    values, vectors = np.linalg.eig(A)  # coordinates without units
    for h in np.array([0.2, 0.1, 1e3]) / np.abs(values).max():
        R, G, d, a = (found[0] for found in p.steps(x, u, f[None, n:], np.array([h])))
        assert a == pytest.approx(f[n:], abs=1e-8 * np.abs(f).max())
        Z = h * A
        D = one - 2 / 3 * Z + Z @ Z / 6
        found = np.linalg.solve(D, one + Z / 3)
        assert R == pytest.approx(found, abs=1e-4 * np.abs(found).max())
        held = np.linalg.solve(D, (one - Z / 6) @ (h * np.column_stack([B, f])))
        assert G == pytest.approx(held[:, :2], abs=1e-4 * np.abs(held).max())
        c = R @ x[0] + G @ u[0] + d - x[0]
        assert c == pytest.approx(held[:, 2], abs=1e-4 * np.abs(held).max())
        own = np.linalg.solve(vectors, R @ vectors)
        errors.append(np.abs(own - np.diag(np.exp(h * values))).max())
    assert errors[0] / errors[1] == pytest.approx(2**4, rel=0.2)
    assert np.abs(np.linalg.eigvals(R)).min() < 0.01
    rough = p.steps(x, u, np.zeros((1, n)), np.array([0.01]))[3][0]
    assert rough == pytest.approx(f[n:], abs=1e-8 * np.abs(f).max())


def test_a_tick_is_one_step_of_newtons_method_with_limits():
    """The program of a tick as bounded least squares, and its condensed matrices.

    Equations: 132
    """
    from scipy.optimize import lsq_linear

    system, p, _ = prediction()
    n, N, T = system.n, 8, 0.005
    weights = {"position": 0.02, "deflection": 0.05, "damping": 0.02, "noise": 1e-4}
    effort, limit = np.array([1.0, 0.3]), np.array([0.9, 0.15])
    law = fx.nmpc(
        system,
        [step(0.3), step(-0.2)],
        effort,
        1 / T,
        intervals=N,
        horizon_s=N * 0.02,
        limit=limit,
        disturbance=0.05,
        **weights,
    ).function
    found = law(0.0, np.zeros(2), np.zeros(2), 0.0, tip_deflections=np.zeros(2), sensors={})
    h = law.problem.h
    assert h[0] == pytest.approx(T) and h.sum() == pytest.approx(N * 0.02)
    assert h[1:] / h[:-1] == pytest.approx(h[1] / h[0]) and h[1] > h[0]
    R, G, c, _ = p.steps(np.zeros((N, 2 * n)), np.zeros((N, 2)), np.zeros((N, n)), h)
    linear = fx.linearize(system)
    names = [f"joint/{i}/position" for i in (1, 2)] + [f"link/{i}/tip_deflection" for i in (1, 2)]
    C = linear.C[[linear.outputs.index(name) for name in names]]
    W = np.vstack([(C[:2] + C[2:] / 0.3) / 0.02, C[2:] / 0.05])
    W = np.vstack([W, np.roll(C[2:], n, axis=1) * 0.02 / 0.05])
    wanted = np.zeros(2 * n)
    wanted[system.joint_rows] = 0.3, -0.2
    values, vectors = np.linalg.eigh(law.problem.end)
    root = np.sqrt(np.maximum(values, 0))[:, None] * vectors.T
    rows, right, state, rest = [], [], np.zeros((2 * n, 2 * N)), np.zeros(2 * n)
    for k in range(N):
        state, rest = R[k] @ state, R[k] @ rest + c[k]
        state[:, 2 * k : 2 * k + 2] = G[k]
        for X, scale in ((W, np.sqrt(h[k])), *(((root, 1.0),) if k == N - 1 else ())):
            rows.append(scale * X @ state)
            right.append(scale * X @ (wanted - rest))
    rows.append(np.kron(np.diag(np.sqrt(h)), np.diag(1 / effort)))
    right.append(np.zeros(2 * N))
    best = lsq_linear(
        np.vstack(rows), np.concatenate(right), (-np.tile(limit, N), np.tile(limit, N)), tol=1e-14
    )
    assert np.any(np.abs(best.x) > 0.999 * np.tile(limit, N))
    assert found == pytest.approx(best.x[:2], rel=1e-4, abs=1e-5) and law.failures == 0
