"""Searches that repeat, resume and agree."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from pymoo.core.population import Population
from scipy.optimize import differential_evolution

import flexura as fx
from flexlab.tuning.executor import ThreadExecutor
from flexlab.tuning.objective import Weights
from flexlab.tuning.result import result
from flexlab.tuning.search import Search, _winners
from flexlab.tuning.search_space import free_gain
from flexura.control import gains
from flexura.errors import InputError
from tunings import FREE, GAINS, ROBOT, task, tuned


def stopped(one, how, folder, at):
    """A search that is interrupted in its generation `at`."""
    calls = []
    with ThreadExecutor(one, 1) as runs:

        def interrupted(points, limits):
            calls.append(len(points))
            if len(calls) == at:
                raise KeyboardInterrupt
            return runs(points, limits)

        assert tuned(one, how, folder, interrupted)[1] is False


def test_a_polish_goes_on_from_the_best_and_is_stored_like_the_rest(tmp_path):
    one, how = task(), Search("ga", population=8, generations=4, seed=5, polish=6)
    whole, _ = tuned(one, how)
    assert len(whole) == 10 and whole.convergence_measure(10) < whole.convergence_measure(4)
    best = whole.all("goals")[: whole.ends[3], 0].argmin()
    assert np.array_equal(whole.all("points")[whole.ends[3]], whole.all("points")[best])
    stopped(one, how, tmp_path, at=8)
    parts, done = tuned(one, how, tmp_path)
    assert done and parts.stored == 7 and np.array_equal(parts.all("points"), whole.all("points"))


@pytest.mark.parametrize("algorithm", ["ga", "pso", "cma-es", "nsga2"])
def test_an_interrupted_search_goes_on_to_the_same_end(tmp_path, algorithm):
    one = task(pareto=algorithm == "nsga2")
    how = Search(algorithm, population=8, generations=7, seed=5)
    whole, _ = tuned(one, how)
    stopped(one, how, tmp_path, at=4)
    parts, done = tuned(one, how, tmp_path)
    assert done and parts.stored == 3 and len(parts) == len(whole) == 7
    for name in ("points", "goals", "figures", "reached"):
        assert np.array_equal(parts.all(name), whole.all(name), equal_nan=True)
    longer, _ = tuned(one, how, tmp_path, generations=9)
    assert len(longer) == 9 and np.array_equal(
        longer.all("points")[: parts.evaluations], parts.all("points")
    )
    with pytest.raises(InputError, match="empty folder"):
        tuned(one, replace(how, seed=6), tmp_path)


def test_a_search_ends_when_nothing_gets_better():
    flat = lambda points, limits: (np.zeros((len(points), 1, 10)), np.ones((len(points), 1)))
    history, done = tuned(task(), Search("ga", 6, generations=50, patience=4), make_executor=flat)
    assert done and len(history) == 5


def test_a_tournament_is_won_by_the_best_of_all_three():
    population = Population.new(X=np.zeros((9, 1)), F=np.random.default_rng(1).random((9, 1)))
    drawn = np.array(list(permutations(range(9), 3)))
    won = _winners(population, drawn)[:, 0]
    assert all(
        J == min(three)
        for J, three in zip(population.get("F")[won, 0], population.get("F")[drawn, 0], strict=True)
    )


@pytest.mark.parametrize("algorithm", ["ga", "pso", "cma-es"])
def test_the_search_finds_what_scipys_differential_evolution_finds(algorithm):
    """Two gains, the same objective."""
    one = task(free=FREE[:2])
    trials = one.gain_sweeps()
    J = lambda X: one.score(*one.run(trials, np.ascontiguousarray(np.atleast_2d(X.T))))[:, 0]
    known = differential_evolution(
        J,
        [(0, 1)] * 2,
        rng=1,
        popsize=10,
        maxiter=40,
        tol=1e-6,
        vectorized=True,
        updating="deferred",
        polish=False,
    )
    history, _ = tuned(one, Search(algorithm, population=20, generations=40, seed=2))
    assert history.all("goals").min() == pytest.approx(known.fun, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("algorithm", ["ga", "pso"])
def test_an_observer_is_tuned_like_any_gain(algorithm):
    """A joint with dry friction: J falls if the observer's settings are free too."""
    data = ROBOT.to_dict()
    data["link"][0]["joint"]["coulomb_friction_N_m"] = 0.05
    robot = fx.Robot.from_dict(data)
    settings = GAINS.settings | {"jo_1_N_m_s2_rad": 5e-3}
    observer = (
        free_gain("observer_1_Hz", 0.1, 10),
        free_gain("jo_1_N_m_s2_rad", 1e-3, 1e-1),
    )
    least = []
    for more in ((), observer):
        one = task(robots=(robot,), gains=gains.Gains(settings), free=(*FREE[:2], *more))
        history, _ = tuned(one, Search(algorithm, population=24, generations=20, seed=3))
        least.append(history.all("goals").min())
    assert least[1] < 0.6 * least[0]


def test_the_front_is_of_gains_that_none_other_beats():
    one = task(pareto=True)
    history, _ = tuned(one, Search("nsga2", population=16, generations=10))
    objectives, front = history.all("goals"), history.pareto_front()
    for k in front:
        assert not (
            (objectives <= objectives[k]).all(axis=1) & (objectives < objectives[k]).any(axis=1)
        ).any()
    others = np.setdiff1d(np.arange(len(objectives)), front)
    assert all((objectives[front] <= objectives[k]).all(axis=1).any() for k in others)
    assert len(front) >= 3 and history.best in front


def test_the_result_is_simulated_again_with_the_robots_own_mesh():
    one = task()
    history, _ = tuned(one, Search("cma-es", 8, 10))
    found = result(one, Search("cma-es", 8, 10), history, True)
    assert found.runs[0].meta["unknowns"] == 5 and found.runs[0].meta["rtol"] == 1e-6
    searched = history.all("figures")[history.best, 0]
    assert found.responses[0].joints[0] == pytest.approx(searched[:6], rel=0.01, abs=1e-4)
    assert found.responses[0].strip == pytest.approx(searched[6:], rel=0.01, abs=1e-5)
    assert set(found.gains.settings) == {*GAINS.settings, "kf_1_N_m_m"}


def test_weights_must_be_numbers():
    with pytest.raises(InputError, match="vibration"):
        Weights(vibration=-1)
    assert Weights(vibration=0, overshoot=0, effort=0).text() == "J = sum_i [ itae_i / s^2 ]"
