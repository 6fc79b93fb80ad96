"""Rows of gains against single runs, and the runs that a search gives up."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import flexura as fx
from flexlab.tuning.closed_loop import closed_loop_controller
from flexlab.tuning.executor import ThreadExecutor
from flexlab.tuning.objective import FAILURE_COST
from flexlab.tuning.result import metrics
from flexlab.tuning.search import Search
from flexlab.tuning.task import perturbed_robots
from flexura.control.step_metrics import (
    vibration_lower_bound,
)
from tunings import GAINS, ROBOT, SWING, task, tuned

# -- rows of a population


def test_a_row_is_the_run_of_simulate_and_rows_do_not_know_of_each_other():
    """Figures as from fx.simulate to the bit; J from a Run by its definition;
    any order, any thread."""
    one = task(rtol=1e-6, modes=0)
    points = np.random.default_rng(3).random((9, 3))
    found, reached = one.run(one.gain_sweeps(), points)
    again, _ = one.run(one.gain_sweeps(), points[::-1])
    with ThreadExecutor(one, 2) as make_executor:
        shared, _ = make_executor(points, np.full(9, np.inf))
    assert np.array_equal(found, again[::-1], equal_nan=True) and np.array_equal(
        found, shared, equal_nan=True
    )
    for k in (0, 4):
        tuned = one.tuned(one.values(points[k : k + 1])[0])
        system = fx.assemble(ROBOT)
        controller = closed_loop_controller(system, SWING, tuned)
        t = np.arange(0, 1001, 5) / 1000
        run = fx.simulate(system, t, controller, rtol=1e-6)
        direct = metrics(run, controller)
        assert np.array_equal(
            np.delete(direct.joints[0], 5), np.delete(found[k, 0, :6], 5), equal_nan=True
        )
        assert np.array_equal(direct.strip, found[k, 0, 6:])
        e, w = np.pi / 4 - run["joint/1/position"], run["link/1/tip_deflection"]
        itae = np.trapezoid(run.t * np.abs(e), run.t) / (np.pi / 4)
        rest = w[run.t >= 0.9 - 1e-12].mean()
        J = (
            itae
            + 100 * np.trapezoid(run.t * np.abs(w - rest), run.t) / 0.3
            + max(0, (-e).max() / (np.pi / 4) - 0.05)
        )
        J += 0.01 * found[k, 0, 5]
        assert one.score(found, reached)[k, 0] == pytest.approx(J, rel=1e-9)


def test_the_effort_is_the_outputs_mean_square_over_the_limit():
    one = task(modes=0, rtol=1e-6)
    found, _ = one.run(one.gain_sweeps(), one.start()[None])
    system = fx.assemble(ROBOT)
    run = fx.simulate(
        system,
        np.arange(0, 10_001) / 10_000,
        closed_loop_controller(system, SWING, GAINS),
        rtol=1e-6,
    )
    assert found[0, 0, 5] == pytest.approx(np.mean((run["joint/1/drive"] / 0.5) ** 2), rel=2e-3)


def test_gains_that_break_the_robot_cost_more_than_any_that_do_not():
    data = ROBOT.to_dict()
    data["link"][0]["joint"]["limits_rad"] = [-0.1, 0.5]
    broken = task(robots=(fx.Robot.from_dict(data),))
    found, reached = broken.run(broken.gain_sweeps(), np.array([[0.9, 0.3, 0.5]]))
    assert 0 < reached[0, 0] < 1 and np.isnan(found).all()
    assert broken.score(found, reached)[0, 0] == pytest.approx(FAILURE_COST * (2 - reached[0, 0]))


def test_of_several_robots_the_worst_counts():
    robots = perturbed_robots(ROBOT, (0.0, 1.0, 2.0), (0.9, 1.0))
    assert len(robots) == 6 and [r.payload.mass_kg for r in robots] == [
        0.02,
        0.0,
        0.0,
        0.02,
        0.04,
        0.04,
    ]
    many = task(robots=robots)
    each = [task(robots=(r,)) for r in robots]
    point = many.start()[None]
    worst = many.score(*many.run(many.gain_sweeps(), point))[0, 0]
    assert worst == max(one.score(*one.run(one.gain_sweeps(), point))[0, 0] for one in each)


# -- runs that a search has no use for


def test_the_least_vibration_is_below_that_of_any_rest_and_close():
    """Against SciPy's search for the best rest, at every length of the record; it stops early only
    where that is enough."""
    rng, t = np.random.default_rng(7), np.linspace(0, 3, 601)
    for _ in range(5):
        a, b, d, f = rng.uniform([-1e-2, -5e-3, 0.1, 1], [1e-2, 5e-3, 3, 9])
        w = b + a * np.exp(-d * t) * np.sin(2 * np.pi * f * t) + 1e-4 * rng.standard_normal(len(t))
        for count in (3, 20, 200, 601):
            of = lambda c, n=count, w=w: np.trapezoid(t[:n] * np.abs(w[:n] - c), t[:n])
            least = minimize_scalar(
                of, bounds=(w.min(), w.max()), method="bounded", options={"xatol": 1e-9}
            ).fun
            assert (
                0.999 * least
                < vibration_lower_bound(t, w, count, 0.999 * least)
                <= least * (1 + 1e-9)
            )
            assert vibration_lower_bound(t, w, count, 2 * least) <= least * (1 + 1e-9)
        assert (
            vibration_lower_bound(t, w, 2, 0.0) == 0.0
        )  # the first sample, at t = 0, has no weight
    assert vibration_lower_bound(t, np.full(601, 3e-3), 601, 0.0) == 0.0


def test_a_run_is_abandoned_exactly_where_its_j_exceeds_the_limit():
    """For limits about every run's own J, and what an abandoned run has of J is between the limit
    and it."""
    one = task()
    points = np.random.default_rng(8).random((40, 3))
    whole, reached = one.run(one.gain_sweeps(), points)
    J = one.score(whole, reached)[:, 0]
    fine = J < FAILURE_COST
    assert fine.sum() > 30
    for part in (0.3, 0.9, 1 - 1e-6, 1.0, 1 + 1e-6):
        found, far = one.run(one.gain_sweeps(), points, np.where(fine, part * J, np.inf))
        objectives = one.score(found, far)[:, 0]
        if part >= 1:
            assert np.array_equal(found, whole, equal_nan=True)
            continue
        assert (objectives[fine] > part * J[fine]).all() and (
            objectives[fine] <= J[fine] * (1 + 1e-9)
        ).all()
        assert part > 0.9 or (far[fine] < 1).mean() > 0.5


def test_on_several_robots_none_is_tried_after_one_that_was_too_bad():
    many = task(robots=perturbed_robots(ROBOT, (1.0, 2.0), (0.9,)))
    points = np.random.default_rng(9).random((12, 3))
    J = many.score(*many.run(many.gain_sweeps(), points))[:, 0]
    limits = np.full(12, np.median(J))
    found, reached = many.run(many.gain_sweeps(), points, limits)
    objectives = many.score(found, reached)[:, 0]
    kept = limits >= J
    assert (
        np.array_equal(objectives[kept], J[kept])
        and (objectives[~kept] > limits[~kept]).all()
        and (reached[~kept, -1] == 0).any()
    )


@pytest.mark.parametrize("algorithm", ["ga", "pso", "cma-es"])
def test_a_search_that_abandons_goes_the_same_way_to_the_bit(algorithm):
    """Points of every generation, survivors and best J, with limits and without; limits too low by
    a tenth are noticed."""
    one, how = task(), Search(algorithm, population=10, generations=25, seed=6)
    trials = one.gain_sweeps()
    with_limits, _ = tuned(
        one, how, make_executor=lambda points, limits: one.run(trials, points, limits)
    )
    without, _ = tuned(one, how, make_executor=lambda points, limits: one.run(trials, points))
    assert np.array_equal(with_limits.all("points"), without.all("points"))
    assert [with_limits.convergence_measure(k) for k in range(1, 26)] == [
        without.convergence_measure(k) for k in range(1, 26)
    ]
    cut = with_limits.all("reached")[:, 0] < 1
    kept = ~cut
    assert np.array_equal(with_limits.all("goals")[kept], without.all("goals")[kept])
    assert (with_limits.all("goals")[cut] <= without.all("goals")[cut] * (1 + 1e-9)).all()
    if algorithm == "cma-es":
        assert not cut.any()
        return
    assert cut.mean() > 0.1
    wrong, _ = tuned(
        one, how, make_executor=lambda points, limits: one.run(trials, points, 0.9 * limits)
    )
    assert not np.array_equal(wrong.all("points"), without.all("points"))
