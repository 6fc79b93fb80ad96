"""Equations of docs/theory/10-time-integration.md, written down with plain NumPy,
against runs and the dense equations."""

import math

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from scipy.linalg import expm

import flexura as fx
import robots
from core_steps import steps
from flexura.signals import Signal, harmonic
from flexura.simulation.dense.propagator import Modes

L, RHO, EI = 0.5, 0.3, 0.8


def spring_and_force():
    """A body on a spring that follows a cubic motion: the system, its drive, its exact motion."""
    m, kp, c = 0.5, 5e4, 0.4
    system = robots.system(robots.rigid(0.1, m, 0.05, 0.0, "Pa", viscous_friction=c))
    r = np.polynomial.Polynomial([0.0, 0.2, 0.5, -0.4])
    motion = Signal(np.array([[0.0, *r.coef, 0.0, 0.0, 0.0, 0.0, 0.0]]))
    f, w2, d = kp / m * r, kp / m, c / m
    p = np.zeros(8)
    for k in range(3, -1, -1):  # the polynomial part of the motion, with h = 1
        p[k] = (f.coef[k] - (k + 1) * d * p[k + 1] - (k + 1) * (k + 2) * p[k + 2]) / w2
    part = np.polynomial.Polynomial(p[:6])
    z0, v0 = 1e-3 - part(0), -part.deriv()(0)
    root = np.sqrt(w2 - d * d / 4)

    def exact(t):
        e = np.exp(-d * t / 2)
        z = e * (z0 * np.cos(root * t) + (v0 + d / 2 * z0) / root * np.sin(root * t))
        v = e * (v0 * np.cos(root * t) - (w2 * z0 + d / 2 * v0) / root * np.sin(root * t))
        return part(t) + z, part.deriv()(t) + v

    return system, fx.Drive.pd((motion,), [kp], [0.0]), exact, (kp, c, r)


@pytest.mark.parametrize("method", ["exponential", "explicit", "implicit"])
def test_motion_and_accounts_within_steps(method):
    """Outputs within steps, work and loss against the integrals of an exact motion.

    Equations: 98, 100, 101
    """
    system, drive, exact, (kp, c, r) = spring_and_force()
    t = np.linspace(0, 0.9, 301)
    run = fx.simulate(system, t, drive, [1e-3], [0.0], rtol=1e-8, method=method)
    x, v = exact(t)
    assert run["joint/1/position"] == pytest.approx(x, abs=1e-8) and run[
        "joint/1/velocity"
    ] == pytest.approx(v, abs=1e-6)
    if method == "exponential":
        assert run.meta["steps"] < 0.5 * 0.9 * np.sqrt(
            kp / 0.5
        )  # longer than two radians: outputs lie within
    s, w = leggauss(600)
    s, w = 0.45 * (1 + s), 0.45 * w
    y, rate = exact(s)
    assert run["energy/work"][-1] == pytest.approx(w @ (kp * (r(s) - y) * rate), rel=1e-6)
    assert run["energy/loss"][-1] == pytest.approx(w @ (c * rate**2), rel=1e-6)


def test_the_strain_account_and_the_balance_of_a_run():
    """What a run says of its own energies, from its channels.

    Equations: 102, 100
    """
    beam = robots.beam(
        L, RHO, EI, 3, hub_inertia_kg_m2=1e-2, viscous_friction=0.02, damping={"beta_s": 1e-4}
    )
    system = robots.system(beam, gravity=(0.0, -9.81))
    drive, t = fx.Drive.force(harmonic(0.5, 1.0)), np.linspace(0, 1, 101)
    run = fx.simulate(system, t, drive, rtol=1e-3, method="exponential")
    kinetic, strain, height, work, loss, numerical = (
        run[f"energy/{name}"]
        for name in ("kinetic", "strain", "potential", "work", "loss", "numerical_loss")
    )
    total = kinetic + strain + height
    residual = np.abs(total - total[0] - work + loss + numerical).max()
    changes = [np.abs(x - x[0]).max() for x in (kinetic, strain, height)]
    scale = max(
        [np.abs(x).max() for x in (kinetic, strain, height, work, loss, numerical)] + changes
    )
    assert residual > 0 and run.meta["energy_error"] == pytest.approx(residual / scale, rel=1e-9)
    made = steps(
        system, "implicit", np.zeros(system.n), np.zeros(system.n), 1.0, 1e-8, 150, drive=drive
    )
    K = system.stiffness()
    assert made[-1].accounts[3] == pytest.approx(0.5 * made[-1].q @ K @ made[-1].q, rel=1e-5)


def test_functions_of_the_linear_part():
    """The tables of the dense equations against matrix exponentials, and the formulas of doubling.

    Equations: 99
    """
    M, K, D = np.diag([1.0, 2.0, 0.5]), np.diag([0.0, 50.0, 4e4]), np.diag([0.1, 0.3, 1.0]) + 0.05
    modes, h = Modes(M, K, D, np.zeros(3), 6, 0), 0.4
    Lin = np.block([[np.zeros((3, 3)), np.eye(3)], [-np.diag(modes.w2), -modes.C]])
    table = modes.table(h)
    scale = np.concatenate([np.maximum(np.sqrt(modes.w2), 1 / h), np.ones(3)])
    balanced = lambda X: X * scale[:, None] / scale
    assert balanced(table.free) == pytest.approx(balanced(expm(Lin * h)), abs=1e-9)
    # of a small matrix by their series
    X = Lin[np.ix_([1, 4], [1, 4])] * 0.1
    series = lambda k, X: sum(
        np.linalg.matrix_power(X, j) / math.factorial(j + k) for j in range(25)
    )
    for k in range(1, 5):
        mixed = expm(X) @ series(k, X) + sum(
            series(j, X) / math.factorial(k - j) for j in range(1, k + 1)
        )
        assert series(k, 2 * X) == pytest.approx(2.0**-k * mixed, rel=1e-10)
    rise = series(1, X) @ X
    assert expm(2 * X) - np.eye(2) == pytest.approx(2 * rise + rise @ rise, rel=1e-10)
    for p in range(6):  # h p! phi_(p + 1)(L h) by an exponential of a larger matrix
        f = np.zeros(6)
        f[3:] = [1.0, -2.0, 0.5]
        chain = np.zeros((6 + p + 1, 6 + p + 1))
        chain[:6, :6], chain[:6, 6] = Lin * h, f * h * math.factorial(p)
        chain[range(6, 6 + p), range(7, 7 + p)] = 1.0
        expected = expm(chain)[:6, -1]
        assert scale * (table.forced[p] @ f[3:]) == pytest.approx(scale * expected, abs=1e-8)
