"""Equations of docs/theory/10-time-integration.md, written down with plain NumPy,
against steps that the core makes one by one."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate._ivp import dop853_coefficients as dop853

import flexura as fx
import robots
from core_steps import simulation, steps
from flexura import core
from flexura.signals import polynomial

L, RHO, EI = 0.5, 0.3, 0.8


def clamped(**keys):
    """A clamped link of one element and its matrices; it moves so little that it is linear."""
    system = robots.system(robots.beam(L, RHO, EI, 1, locked=True, **keys), payload=0.1)
    return system, system.mass(np.zeros(3))[1:, 1:], np.diag([EI / L, 12 * EI / L])


def next_length(h, E, before, p):
    """The length that follows a good step of length h."""
    return 5 * h if E < 1e-12 else h * min(5, max(0.3, 0.9 * E ** (-0.7 / p) * before ** (0.3 / p)))


class Sizes:
    """Weights of a clamped link's unknowns and their rates, from what its tip has done."""

    lever = np.array([L / 2, L])  # of the rotation and of the bubble: how far a unit moves the tip

    def __init__(self, rtol, q, v):
        self.rtol, self.place, self.rate = rtol, 1e-6 * L, 1e-6 * L
        self.grow(q, v)

    def grow(self, q, v):
        self.place, self.rate = (
            max(self.place, abs(self.lever @ q)),
            max(self.rate, abs(self.lever @ v)),
        )

    def error(self, place, rate):
        parts = (
            np.linalg.norm(self.lever * e) / (self.rtol * S)
            for e, S in ((place, self.place), (rate, self.rate))
        )
        return max(parts)


A4 = np.array(
    [
        [0, 0, 0, 0, 0, 0],
        [1 / 4, 1 / 4, 0, 0, 0, 0],
        [8611 / 62500, -1743 / 31250, 1 / 4, 0, 0, 0],
        [5012029 / 34652500, -654441 / 2922500, 174375 / 388108, 1 / 4, 0, 0],
        [
            15267082809 / 155376265600,
            -71443401 / 120774400,
            730878875 / 902184768,
            2285395 / 8070912,
            1 / 4,
            0,
        ],
        [82889 / 524892, 0, 15625 / 83664, 69875 / 102672, -2260 / 8211, 1 / 4],
    ]
)
B3 = np.array(
    [
        4586570599 / 29645900160,
        0,
        178811875 / 945068544,
        814220225 / 1159782912,
        -3700637 / 11593932,
        61727 / 225920,
    ]
)


def test_implicit_steps_their_errors_and_lengths():
    """Stages on a linear robot, the error over the tolerance, and the next length.

    Equations: 85, 81, 82, 84
    """
    system, M, K = clamped(damping={"beta_s": 1e-3})
    D, rtol = 1e-3 * K, 1e-3
    made = steps(system, "implicit", [0, 1e-6, -2e-7], [0, 3e-5, 1e-5], 10.0, rtol, 25, first=1e-3)
    sizes, before = Sizes(rtol, made[0].q[1:], made[0].v[1:]), 1.0
    checked = 0
    for old, new, after in zip(made, made[1:], made[2:]):
        h, q, v = new.t - old.t, old.q[1:], old.v[1:]
        rates, seconds = [v], [-np.linalg.solve(M, K @ q + D @ v)]
        for s in range(1, 6):
            v_star = v + h * sum(a * x for a, x in zip(A4[s, :s], seconds))
            q_star = q + h * sum(a * x for a, x in zip(A4[s, :s], rates)) + h / 4 * v_star
            a = np.linalg.solve(M + (h / 4) ** 2 * K + h / 4 * D, -K @ q_star - D @ v_star)
            seconds.append(a)
            rates.append(v_star + h / 4 * a)
            place = q_star + (h / 4) ** 2 * a
        assert new.q[1:] == pytest.approx(place, rel=1e-6, abs=1e-13) and new.v[
            1:
        ] == pytest.approx(rates[-1], rel=1e-6, abs=1e-11)
        E = 4 * sizes.error(*(h * (A4[5] - B3) @ x for x in (rates, seconds)))
        sizes.grow(new.q[1:], new.v[1:])
        expected = next_length(h, E, before, 4)
        if after.refused == new.refused:
            assert after.t - new.t == pytest.approx(expected, rel=1e-3)
            checked += 1
        before = max(E, 1e-4)
    assert checked > 10


def test_explicit_steps_their_errors_and_lengths():
    """DOP853 on a linear robot: the state, both error estimates, the next length, the longest one.

    Equations: 83, 84
    """
    system, M, K = clamped()
    rtol, omega = 1e-6, np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)).real.max())
    made = steps(system, "explicit", [0, 1e-6, -2e-8], [0, 0, 0], 10.0, rtol, 40, first=1e-3)
    sizes, before, longest, checked = Sizes(rtol, made[0].q[1:], made[0].v[1:]), 1.0, 5.3 / omega, 0
    slope = lambda z: np.concatenate([z[2:], -np.linalg.solve(M, K @ z[:2])])
    for old, new, after in zip(made, made[1:], made[2:]):
        h, z = new.t - old.t, np.concatenate([old.q[1:], old.v[1:]])
        stages = [slope(z)]
        for s in range(1, 12):
            stages.append(slope(z + h * dop853.A[s, :s] @ stages))
        end = z + h * dop853.B @ stages
        stages.append(slope(end))
        assert np.concatenate([new.q[1:], new.v[1:]]) == pytest.approx(end, rel=1e-6, abs=1e-15)
        E5, E3 = (sizes.error(*np.split(h * e @ stages, 2)) for e in (dop853.E5, dop853.E3))
        E = E5**2 / np.sqrt(E5**2 + 0.01 * E3**2)
        sizes.grow(new.q[1:], new.v[1:])
        wish = next_length(h, E, before, 8)
        if after.refused == new.refused:
            assert after.t - new.t == pytest.approx(min(wish, longest), rel=2e-2)
            checked += 1
        before = max(E, 1e-4)
    assert checked > 10
    loose = steps(
        system, "explicit", [0, 1e-12, 0], [0, 0, 0], 10.0, 0.1, 40
    )  # too little for any error
    most = max(b.t - a.t for a, b in pairwise(loose))
    assert 0.9 * longest < most < 1.001 * longest  # the power iteration errs upwards


def test_the_method_that_gets_furthest_a_pass():
    """Progress in the second half of a trial of 60 passes decides what "auto" takes.

    Equations: 103
    """
    beam = robots.beam(L, RHO, EI, 4, hub_inertia_kg_m2=1e-3, coulomb_friction=0.05)
    system = robots.system(beam, payload=0.1)
    drive, end = fx.Drive.pd((polynomial(0.8, 1.0),), [300.0], [20.0]), 20.0
    progress = {}
    for method in ("implicit", "explicit"):
        run = simulation(
            system, method, np.zeros(system.n), np.zeros(system.n), end, 1e-5, drive=drive
        )
        begin = half = t = None
        while run.advance(1):
            at = run.progress()
            begin = at["passes"] if begin is None else begin
            if 2 * (at["passes"] - begin) <= 60:
                half, t = at["passes"], at["t"]
            if at["passes"] - begin >= 60:
                break
        progress[method] = (at["t"] - t) / (at["passes"] - half)
    run = fx.simulate(system, np.linspace(0, end, 3), drive, rtol=1e-5)
    assert (
        max(progress, key=progress.get) == "implicit"
        and progress["implicit"] > 4 * progress["explicit"]
    )
    assert run.meta["method"] == "implicit"


def test_step_of_a_given_length():
    """Of a clamped link that is linear, with matrices.

    Equations: 86
    """
    system, M, K = clamped(damping={"beta_s": 2e-3})
    h, gamma = 4e-3, 1 - 1 / np.sqrt(2)
    q, v = np.array([[0.0, 2e-7, -1e-7]]), np.array([[0.0, 3e-6, 2e-6]])
    z = np.concatenate([q[0, 1:], v[0, 1:]])
    fall = -np.linalg.solve(M, np.hstack([K, 2e-3 * K]))
    A = np.vstack([np.hstack([np.zeros((2, 2)), np.eye(2)]), fall])
    for _ in range(3):
        k1 = np.linalg.solve(np.eye(4) - gamma * h * A, A @ z)
        k2 = np.linalg.solve(np.eye(4) - gamma * h * A, A @ (z + h * k1) - 2 * k1)
        z = z + h * (1.5 * k1 + 0.5 * k2)
    tips = np.zeros((1, 1)), np.zeros((1, 2))
    moves, arrived = np.ones(1, dtype=bool), np.zeros(1, dtype=bool)
    free = np.array([[-np.inf], [np.inf]])
    core.Copies(system.equations).advance(
        q, v, np.zeros((1, 1)), free, moves, *tips, arrived, h, 3, 1
    )
    assert arrived.all() and q[0, 0] == 0
    assert q[0, 1:] == pytest.approx(z[:2], rel=1e-9)
    assert v[0, 1:] == pytest.approx(z[2:], rel=1e-9)
    assert tips[0][0, 0] == pytest.approx(np.array([L / 2, L]) @ q[0, 1:], rel=1e-9)
