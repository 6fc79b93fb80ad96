"""Equations of docs/theory/10-time-integration.md, written down with plain NumPy,
against steps that the core makes one by one."""

import numpy as np
import pytest
from numpy.polynomial import polynomial as power
from numpy.polynomial.legendre import leggauss

import flexura as fx
import robots
from core_steps import simulation, steps
from flexura.signals import constant, harmonic
from flexura.simulation.dense.propagator import Modes

L, RHO, EI = 0.5, 0.3, 0.8


def moments(w2, d, h, count=6):
    """Impulse response of an oscillator, its derivative, A_m and B_m, by fine quadrature."""
    x, w = leggauss(60)
    t = h * (1 + x) / 2
    root = np.sqrt(complex(w2 - d * d / 4))
    g = lambda s: np.real(np.exp(-d * s / 2) * np.sin(root * s) / root)
    dg = lambda s: np.real(
        np.exp(-d * s / 2) * (np.cos(root * s) - d / 2 * np.sin(root * s) / root)
    )
    powers = np.array([(t / h) ** m for m in range(count)])
    return g(h), dg(h), powers @ (h * w / 2 * g(h - t)), powers @ (h * w / 2 * dg(h - t))


def test_moments_by_recurrence():
    """Integrals of the impulse response by parts.

    Equations: 90
    """
    for w2, d, h in ((9.0, 0.4, 2.0), (400.0, 1.0, 0.5), (4.0, 0.0, 0.1)):
        g, _, A, B = moments(w2, d, h)
        a = A / h**2
        assert B[0] == pytest.approx(g) and B[1:] == pytest.approx(np.arange(1, 6) * A[:-1] / h)
        for m in range(2, 6):
            assert w2 * h * h * a[m] + d * h * m * a[m - 1] + m * (m - 1) * a[
                m - 2
            ] == pytest.approx(1.0, abs=1e-12)


PENDULUM = (0.8, 0.2, 0.01, 9.81)  # mass, place of its centre, inertia, gravity


def test_exponential_steps():
    """A pendulum on a spring: predictor, pass, corrector, error and next length, step by step.

    Equations: 87, 88, 89, 90, 91, 92, 93
    """
    m, c, J, g0 = PENDULUM
    I, kp, kd, viscous, rtol, end = J + m * c * c, 20.0, 0.3, 0.05, 1e-4, 50.0
    length = 0.4
    system = robots.system(
        robots.rigid(length, m, c, J, viscous_friction=viscous), gravity=(0.0, -g0)
    )
    drive = fx.Drive.pd((constant(0.3),), [kp], [kd])
    made = steps(system, "exponential", [-1.0], [0.0], end, rtol, 40, first=1e-3, drive=drive)
    phi, w2, d = 1 / np.sqrt(I), kp / I, (kd + viscous) / I

    def acceleration(q, v):
        return (kp * (0.3 - q) - (kd + viscous) * v - m * g0 * c * np.cos(q)) / I

    def N(xi, rate):
        q, v = -1.0 + phi * xi, phi * rate
        return acceleration(q, v) / phi + d * rate + w2 * xi

    xi, rate, times, values = 0.0, 0.0, [0.0], [N(0.0, 0.0)]
    way = speed = 1e-3 * 0.0
    place_size = lambda: max(1e-3 * way, 1e-6 * length)
    rate_size = lambda: max(1e-3 * speed, 1e-6 * length)
    weigh = lambda now: (
        length * phi / (rtol * place_size()),
        length * phi / (rtol * rate_size()),
        now,
    )
    W, since, growths, lately = weigh(0.0), 0, 0, 0.0
    for old, new, after in zip(made, made[1:], made[2:]):
        h = new.t - old.t
        x = (np.array(times) - old.t) / h
        g, dg, A, B = moments(w2, d, h)
        P = sum(
            value * power.polyfromroots(np.delete(x, j)) / np.prod(x[j] - np.delete(x, j))
            for j, value in enumerate(values)
        )
        P = np.atleast_1d(P)
        ahead = (
            (dg + d * g) * xi + g * rate + A[: len(P)] @ P,
            -w2 * g * xi + dg * rate + B[: len(P)] @ P,
        )
        fresh = N(*ahead)
        gap = fresh - P.sum()
        late = power.polyfromroots(x) / np.prod(1 - x)
        older = power.polyfromroots(np.append(x[:-1], 1.0)) / np.prod(1 - x)
        xi, rate = ahead[0] + gap * A[: len(late)] @ late, ahead[1] + gap * B[: len(late)] @ late
        assert new.q[0] == pytest.approx(-1.0 + phi * xi, abs=1e-10) and new.v[0] == pytest.approx(
            phi * rate, abs=1e-9
        )
        lasting = min(1 / np.sqrt(w2), end - W[2])
        doubt = gap * A[: len(older)] @ older, gap * B[: len(older)] @ older
        E = 10 * np.sqrt(((W[0] * doubt[0]) ** 2 + (max(W[1], lasting * W[0]) * doubt[1]) ** 2) / 2)
        assert E < 1.0
        order, ratio = len(times) + 1, (after.t - new.t) / h
        lately = E if len(times) < 5 else max(E, 0.85 * lately)
        if ratio > 1.0 + 1e-6:  # it grows where the errors allow it, and at most doubles
            most = 3 if lately < 3e-4 else 2  # below 1e-4; so small an error is round-off in part
            assert 1.25 * (1 - 1e-9) <= ratio <= most * (1 + 1e-9)
            assert lately <= (0.85 / 1.25) ** order * 1.02
            growths, lately = growths + 1, 0.0
        elif after.refused == new.refused:
            assert ratio == pytest.approx(1.0, rel=1e-6)
        times, values = [new.t, *times][:5], [fresh, *values][:5]
        since += 1
        now = weigh(new.t)
        changed = any(now[k] < 0.9 * W[k] for k in range(2))
        if since % 8 == 0 or len(times) < 5 or changed:
            W = now
        way, speed = max(way, length * abs(new.q[0] + 1.0)), max(speed, length * abs(new.v[0]))
    assert growths > 3


def test_when_modes_are_taken_again():
    """The dense equations judge changes just below and above what is put up with, 1/20 there.

    Equations: 94
    """
    rng = np.random.default_rng(1)
    root = rng.normal(size=(3, 3))
    M = root @ root.T + np.eye(3)
    K, D = np.diag([4.0, 90.0, 900.0]), np.diag([0.1, 0.2, 0.3])
    modes, slow = Modes(M, K, D, np.zeros(3), 6, 0), 3.0
    w = np.maximum(np.sqrt(modes.w2), slow)
    changes = (
        (
            np.linalg.inv(modes.phi).T @ np.ones((3, 3)) @ np.linalg.inv(modes.phi),
            lambda x: (M + x, K, D),
            np.ones(3),
        ),
        (
            np.linalg.inv(modes.phi).T @ np.ones((3, 3)) @ np.linalg.inv(modes.phi),
            lambda x: (M, K + x, D),
            w,
        ),
    )
    for change, put, scale in changes:
        size = np.linalg.norm(np.ones((3, 3)) / np.outer(scale, scale))
        assert modes.poor(*put(0.051 / size * change), slow) and not modes.poor(
            *put(0.049 / size * change), slow
        )


def modal_link(first, ratio):
    """A clamped link bent in two modes: the system, q0, frequencies, share of the second."""
    system = robots.system(robots.beam(L, RHO, EI, 4, modes=2, locked=True))
    unit = np.array([system.places(np.eye(3)[k] * 1e-6)[0][0] for k in (1, 2)]) / 1e-6
    q0 = np.array([0.0, first / unit[0], ratio * first / unit[1]])
    alpha = np.abs(
        q0[1:] * unit
    )  # f / w^2 of what is out of balance at the start, times the outputs
    return system, q0, 2 * np.pi * fx.frequencies(system), alpha[1] / abs(q0[1:] @ unit)


@pytest.mark.parametrize(("ratio", "damped"), [(0.8, True), (1.2, False)])
def test_numerical_damping(ratio, damped):
    """A mode is damped if its share is below a quarter of rtol; its decay, and what it loses.

    Equations: 95, 96, 97, 101
    """
    rtol = 1e-3
    system, q0, omega, share = modal_link(1e-6, ratio * rtol / 4)
    assert (share < rtol / 4) == damped
    run = simulation(system, "exponential", q0, np.zeros(3), 0.5, rtol)
    while run.advance(1000):
        pass
    z, t = np.array(run.state()), 0.5
    d = 2 * 0.05 * omega[1] if damped else 0.0
    damped_rate = np.sqrt(omega[1] ** 2 - d * d / 4)
    xi = (
        q0[2]
        * np.exp(-d * t / 2)
        * (np.cos(damped_rate * t) + d / 2 / damped_rate * np.sin(damped_rate * t))
    )
    speed = -q0[2] * np.exp(-d * t / 2) * omega[1] ** 2 / damped_rate * np.sin(damped_rate * t)
    assert z[2] == pytest.approx(xi, abs=2e-3 * abs(q0[2]))
    lost = 0.5 * omega[1] ** 2 * q0[2] ** 2 - 0.5 * (speed**2 + omega[1] ** 2 * xi**2)
    assert z[8] == pytest.approx(lost if damped else 0.0, rel=5e-3, abs=1e-30)


def test_the_cutoff_is_above_harmonic_forces():
    """With a harmonic drive of a fifth of the second mode's frequency no mode is damped.

    Equations: 97
    """
    lost = []
    for factor in (0.1, 0.3):
        system = robots.system(robots.beam(L, RHO, EI, 4, modes=3, hub_inertia_kg_m2=5.0))
        third = fx.frequencies(system, joints="free")[-1]
        drive = fx.Drive.force(harmonic(1.0, factor * third))
        run = simulation(system, "exponential", np.zeros(4), np.zeros(4), 0.2, 0.05, drive=drive)
        while run.advance(1000):
            pass
        lost.append(np.array(run.state())[8 + 2])
    assert lost[0] > 0.0 and lost[1] == 0.0
