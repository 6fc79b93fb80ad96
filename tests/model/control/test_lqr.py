"""LQR with an observer: its cost, its poles, and what it is good for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from controlled_robots import TICK, rig
from flexura import signals
from flexura.control import lqr

ROOT = Path(__file__).resolve().parents[3]


def quiet(sys: fx.System, references, **keys):
    pids = tuple(fx.PID(reference, **keys) for reference in references)
    return lqr(sys, fx.Controller(pids), [5.0, 0.5], position=[0.01, 0.05], deflection=0.005)


def test_the_lqrs_cost_is_its_riccati_matrix():
    """At rest beside small references, which the observer knows exactly: the weighted squares add
    up to x^T P x, x = -x_r."""
    sys, r = rig(), np.array([1e-5, 1e-4])
    drive, d = quiet(sys, [signals.constant(r[0]), signals.constant(r[1])])
    run = fx.simulate(sys, np.arange(4001) * TICK, drive, rtol=1e-9, method="explicit")
    weighed = [
        (run["joint/1/position"] - r[0]) / 0.01,
        (run["joint/2/position"] - r[1]) / 0.05,
        run["link/2/tip_deflection"] / 0.005,
        run["joint/1/drive"] / 5.0,
        run["joint/2/drive"] / 0.5,
    ]
    x = np.zeros(len(d.F))
    x[sys.joint_rows] = r
    assert sum(np.sum(w[:-1] ** 2) for w in weighed) == pytest.approx(x @ d.P @ x, rel=1e-4)
    assert np.abs(d.poles).max() < 1 and np.abs(d.observer_poles).max() < 1


def test_the_observers_error_falls_with_its_poles():
    """The law on the linear plant, from a small state that it does not know: z - x = (F (1 - L
    C))^k (z0 - x0)."""
    sys = rig()
    drive, d = quiet(sys, [signals.constant(0.0)] * 2)
    sampled = drive.sampler(sys)
    sampled.start(sys.start())
    x, wrong = np.linspace(1, 2, len(d.F)) * 1e-6, None
    half = len(d.F) // 2
    for k in range(200):
        error = np.asarray(sampled.prediction) - x
        wrong = error if wrong is None else d.F @ (np.eye(len(d.F)) - d.L @ d.C) @ wrong
        np.testing.assert_allclose(error, wrong, rtol=1e-7, atol=1e-9 * np.abs(x).max())
        force, _ = sampled.tick(k, k * TICK, x[:half].copy())
        x = d.F @ x + d.G @ force
    assert np.abs(d.observer_poles).max() < 1


def test_an_lqr_brings_the_rig_to_rest_where_pd_leaves_it_swinging():
    sys, t = rig(), np.arange(0, 2, TICK)
    references = [signals.cycloid(0.05, 0.4), signals.cycloid(0.4, 0.4)]
    drive, _ = quiet(sys, references, limit=20.0)
    pd = fx.Controller(
        tuple(fx.PID(m, kp=p, kd=d) for m, p, d in zip(references, (900, 6), (50, 0.1)))
    )
    good, plain = (fx.simulate(sys, t, c, rtol=1e-6) for c in (drive, pd))
    late = t > 1.0
    assert (
        np.abs(good["link/2/tip_deflection"][late]).max()
        < 0.1 * np.abs(plain["link/2/tip_deflection"][late]).max()
    )
    assert good["joint/2/position"][-1] == pytest.approx(0.4, abs=1e-3)


def test_an_lqr_is_found_for_a_light_rotor_too():
    """On the rig's own file, whose rotor of 5 g cm^2 makes the states' scales differ by six
    orders."""
    tables = fx.load(ROOT / "model" / "robots" / "rig.toml").to_dict()
    tables["link"][1]["modes"] = 2
    _, d = quiet(fx.assemble(fx.Robot.from_dict(tables)), [signals.constant(0.0)] * 2)
    assert np.abs(d.poles).max() < 1 and np.abs(d.observer_poles).max() < 1
