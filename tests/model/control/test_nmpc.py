"""NMPC: residuals beside LQG's, limits, spread linearisation, and what is refused."""

import numpy as np
import pytest

import flexura as fx
import robots
from flexura import core
from flexura.errors import InputError
from flexura.signals import polynomial, step

END, T_END = (0.8, -0.5), 0.3
LIMIT = np.array([2.0, 0.4])
COMMON = {"limit": LIMIT, "disturbance": [0.05, 0.02], "damping": 0.02}


def two_links(modes=0):
    data = fx.load("type-1-rr").to_dict()
    for link in data["link"]:
        link["damping"] = {"beta_s": 2e-3}
        if modes:
            link["modes"] = modes
    return fx.Robot.from_dict(data)


def residual(run, robot):
    """Largest distance of the tip from its end after the move [m]."""
    x, y, _ = fx.tip_pose(robot, fx.static(robot, joints=list(END)))
    off = np.hypot(run["tip/x"] - x, run["tip/y"] - y)
    return off[run.t >= T_END].max()


def predictive(rate=500.0, **keys):
    moves = [polynomial(end, T_END) for end in END]
    given = {"intervals": 20, "position": 0.005, "deflection": 0.05} | COMMON | keys
    return fx.nmpc(two_links(2), moves, 3 * LIMIT, rate, **given)


@pytest.mark.slow
def test_the_residual_is_a_tenth_of_lqgs_at_equal_time():
    """The best of many LQG designs, each under a step and under the same motion; a design on two
    modes, on the whole mesh."""
    plant, t = two_links(), np.linspace(0, 0.6, 301)
    law = predictive(deflection_limit=0.04)
    run = fx.simulate(plant, t, law)
    ours = residual(run, plant)
    assert law.function.failures == 0
    for i, limit in enumerate(LIMIT, 1):
        assert np.abs(run[f"joint/{i}/drive"]).max() <= limit + 1e-12
    best = np.inf
    for signal in (step, lambda end: polynomial(end, T_END)):
        for deflection in (0.005, 0.02, 0.05):
            for position in (0.005, 0.02):
                for share in (0.5, 3.0):
                    weights = {"position": position, "deflection": deflection, "follow": "tips"}
                    other, _ = fx.lqg(
                        two_links(2),
                        [signal(end) for end in END],
                        share * LIMIT,
                        500.0,
                        **weights,
                        **COMMON,
                    )
                    theirs = fx.simulate(plant, t, other, rtol=1e-5)
                    best = min(best, residual(theirs, plant) if theirs.complete else np.inf)
    assert best < 0.1
    assert ours < 0.1 * best


def arm(**keys):
    link = robots.beam(
        0.6, 0.2355, 0.5, 2, modes=2, hub_inertia_kg_m2=2e-3, damping={"beta_s": 2e-3}
    )
    return robots.robot(link, payload=0.05, **keys)


def turning(robot, rate=100.0, **keys):
    given = {"intervals": 20, "limit": 0.5, "disturbance": 0.02, "position": 0.01} | keys
    return fx.nmpc(robot, [step(1.0)], 1.5, rate, deflection=0.1, damping=0.02, **given)


def test_limits_of_speed_and_deflection_are_kept():
    t = np.linspace(0, 1.2, 241)
    free = fx.simulate(arm(), t, turning(arm()))
    assert np.abs(free["joint/1/velocity"]).max() > 4.5
    assert np.abs(free["link/1/tip_deflection"]).max() > 0.1
    law = turning(arm(), speed_limit=3.0, deflection_limit=0.05)
    run = fx.simulate(arm(), t, law)
    assert law.function.failures == 0
    assert np.abs(run["joint/1/velocity"]).max() < 3.0 * 1.1
    assert np.abs(run["link/1/tip_deflection"]).max() < 0.05 * 1.1
    assert run["joint/1/position"][-1] == pytest.approx(1.0, abs=5e-3)
    again = fx.simulate(arm(), t, law)
    assert np.array_equal(again["joint/1/position"], run["joint/1/position"])


def test_a_linearisation_that_is_spread_over_ticks_does_nearly_the_same():
    t = np.linspace(0, 1.0, 201)
    whole, spread = (fx.simulate(arm(), t, turning(arm(), 200.0, spread=k)) for k in (1, 4))
    assert spread["joint/1/position"] == pytest.approx(whole["joint/1/position"], abs=0.06)
    assert np.abs(spread["link/1/tip_deflection"][-20:]).max() < 0.01


def test_a_tick_that_is_spread_does_less(monkeypatch):
    """Intervals that are linearised in a tick, and programs that are condensed."""
    law = turning(arm(), 200.0, spread=5)
    own, rows, made = law.function, [], []
    steps, condensed = own.prediction.steps, core.condensed_program
    monkeypatch.setattr(own.prediction, "steps", lambda *a: (rows.append(len(a[3])), steps(*a))[1])
    monkeypatch.setattr(core, "condensed_program", lambda *a: (made.append(1), condensed(*a))[1])
    fx.simulate(arm(), np.linspace(0, 0.1, 21), law)
    assert rows == [20] + [5, 1, 5, 1, 5, 1, 5, 1, 1] * 4 and len(made) == 1 + 4


def test_gravity_is_held():
    heavy = arm(gravity=(0.0, -9.81))
    law = fx.nmpc(
        heavy, [0.3], 1.5, 100.0, position=0.01, deflection=0.1, disturbance=0.02, limit=3.0
    )
    run = fx.simulate(heavy, np.linspace(0, 1.5, 151), law)
    hold = fx.linearize(heavy, fx.static(heavy, joints=[0.3])).hold[0]
    assert run["joint/1/position"][-1] == pytest.approx(0.3, abs=5e-3)
    assert run["joint/1/drive"][-1] == pytest.approx(hold, rel=0.02)


@pytest.mark.parametrize(
    ("keys", "key"),
    [
        ({"intervals": 1}, "intervals"),
        ({"intervals": 300}, "intervals"),
        ({"horizon_s": 0.05}, "horizon_s"),
        ({"horizon_s": -1.0}, "horizon_s"),
        ({"spread": 0}, "spread"),
        ({"speed_limit": 0.0}, "speed_limit"),
        ({"deflection_limit": -0.1}, "deflection_limit"),
        ({"follow": "hub"}, "follow"),
        ({"rate": 0.0}, "rate_Hz"),
    ],
)
def test_what_cannot_be_is_refused(keys, key):
    with pytest.raises(InputError) as caught:
        turning(arm(), **keys)
    assert caught.value.key == key


def test_models_that_have_no_derivatives_or_no_period_are_refused():
    with pytest.raises(InputError, match="stiffening"):
        turning(arm(stiffening=False))
    with pytest.raises(InputError, match="no period"):
        turning(robots.robot(robots.rigid(0.3, 0.2, 0.1, 1e-3)))
