"""Tuning: figures against formulas, rows of a population against single runs, searches that repeat,
resume and agree."""

from __future__ import annotations

import json
import signal
import subprocess
import time
from dataclasses import replace
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from pymoo.core.population import Population
from scipy.optimize import differential_evolution, minimize_scalar

import flexura as fx
from flexlab.tuning import search_space as freedom
from flexlab.tuning.closed_loop import closed_loop_controller
from flexlab.tuning.executor import ThreadExecutor
from flexlab.tuning.history import FILE, History
from flexlab.tuning.objective import FAILURE_COST, Weights
from flexlab.tuning.result import metrics, result
from flexlab.tuning.search import Search, _winners, search
from flexlab.tuning.search_space import free_gain
from flexlab.tuning.task import perturbed_robots
from flexura.control import gains
from flexura.control.step_metrics import (
    ERROR,
    ITAE,
    OVERSHOOT,
    PEAK,
    RESIDUAL,
    RISE,
    RMS,
    SETTLING,
    VIBRATION,
    joint_metrics,
    strip_metrics,
    vibration_lower_bound,
)
from flexura.errors import InputError
from processes import command_line, environment
from tunings import FREE, GAINS, ROBOT, SWING, task

ROOT = Path(__file__).resolve().parents[3]
MODEL = ROOT / "model"


def joint(t, y, r=None):
    return joint_metrics(t, np.ones_like(t) if r is None else r, y)


# -- figures


def test_a_first_order_rise_has_its_formulas():
    """1 - exp(-t/T): rise T ln 9, settling T ln 50, ITAE T^2."""
    t, T = np.linspace(0, 5, 20_001), 0.2
    f = joint(t, 1 - np.exp(-t / T))
    assert f[[RISE, SETTLING, ITAE]] == pytest.approx(
        [T * np.log(9), T * np.log(50), T**2], rel=1e-5
    )
    assert f[OVERSHOOT] == 0 and f[ERROR] < 1e-9


def test_an_oscillating_rise_has_its_overshoot_and_settles_when_it_last_enters_the_band():
    zeta, w = 0.3, 8.0
    t, wd = np.linspace(0, 5, 50_001), w * np.sqrt(1 - zeta**2)
    e = np.exp(-zeta * w * t) * (np.cos(wd * t) + zeta / np.sqrt(1 - zeta**2) * np.sin(wd * t))
    f = joint(t, 3 - 2 * (1 - e), np.ones_like(t))  # from 3 down to 1: signs must not matter
    assert f[OVERSHOOT] == pytest.approx(np.exp(-np.pi * zeta / np.sqrt(1 - zeta**2)), rel=1e-6)
    late = t[np.abs(e) > 0.02].max()
    assert late <= f[SETTLING] <= late + 1e-4


def test_what_never_happens_is_not_a_number():
    t = np.linspace(0, 1, 101)
    f = joint(t, 0.5 * t)
    assert (
        np.isnan(f[RISE]) and np.isnan(f[SETTLING]) and f[ERROR] == pytest.approx(0.525, abs=1e-3)
    )


def test_the_strips_figures_of_a_decaying_vibration_about_a_bend():
    t, d, w = np.linspace(0, 5, 50_001), 2.0, 2 * np.pi * 5
    y = 1e-3 + 4e-3 * np.exp(-d * t) * np.sin(w * t)
    out = strip_metrics(t, y, 1.0)
    assert out[PEAK] == pytest.approx(np.abs(y - y[0]).max()) and out[RESIDUAL] == pytest.approx(
        np.ptp(y[t >= 1]) / 2
    )
    assert out[RMS] == pytest.approx(
        4e-3 * np.sqrt((1 / (4 * d) - 0.25 * d / (d**2 + w**2)) / 5), rel=1e-3
    )
    assert out[VIBRATION] == pytest.approx(
        4e-3 * (2 / np.pi) / d**2, rel=1e-2
    )  # the mean of |sin| is 2 / pi


# -- rows of a population


def test_a_row_is_the_run_of_simulate_and_rows_do_not_know_of_each_other():
    """Figures as from fx.simulate at the same tolerance to the bit; J from a Run by its definition;
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
        run = fx.simulate(system, np.arange(0, 1001, 5) / 1000, controller, rtol=1e-6)
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


# -- what is free


def test_places_and_values_of_free_settings():
    gain, through = free_gain("kp_1_V_m", 10, 1000), free_gain("kg_2_rad_m", -2, 2)
    assert (gain.scale, through.scale) == ("log", "linear")
    assert gain.from_unit_interval(np.array([0, 0.5, 1])) == pytest.approx(
        [10, 100, 1000]
    ) and through.from_unit_interval(np.array([0.25])) == [-1.0]
    assert (
        gain.to_unit_interval(100) == pytest.approx(0.5)
        and gain.to_unit_interval(1e9) == 1.0
        and through.to_unit_interval(1) == 0.75
    )
    assert free_gain("kg_2_rad_m", -100, -1).from_unit_interval(np.array([0.5])) == pytest.approx(
        [-10]
    )


def test_rows_of_the_law_are_those_of_a_controller_with_the_same_settings():
    settings = {
        "kp_1_N_m_rad": 3.0,
        "kt_1_N_m_s_rad": 0.2,
        "setpoint_1_Hz": 2.0,
        "torque_max_1_N_m": 0.7,
        "derivative_Hz": 33.0,
        "deflection_Hz": 21.0,
        "torque_slew_1_N_m_s": 9.0,
        "observer_1_Hz": 4.0,
        "jo_1_N_m_s2_rad": 0.01,
        "bo_1_N_m_s_rad": 0.02,
    }
    free_gains = [free_gain(name, value / 2, value * 2) for name, value in settings.items()]
    system = fx.assemble(ROBOT)
    made, plain = (
        closed_loop_controller(system, SWING, gains.Gains(GAINS.settings | more))
        for more in (settings, {})
    )
    base = plain.gains()
    row = freedom.rows(free_gains, np.array([list(settings.values())]), plain, base)
    assert np.array_equal(row[0], made.gains())


@pytest.mark.parametrize(
    "text, said",
    [
        ("[free]\nkp_1_V_mm = [1, 2]", "setting of a gains file"),
        ("[free]\nkp_1_V_m = [2, 1]", "LOW below HIGH"),
        ("[free]\nkp_1_V_m = 3", "[low, high]"),
        ("free = 1", "table [free]"),
        ("[frei]\nkp_1_V_m = [1, 2]", "unknown key"),
        ('[free]\nkp_1_V_m = { low = -1, high = 2, scale = "log" }', "one sign"),
        ("[free]\ndelay_1_s = [0, 1]", "expected a gain"),
    ],
)
def test_a_wrong_file_of_bounds_is_refused_by_key(tmp_path, text, said):
    (tmp_path / "free.toml").write_text(text)
    with pytest.raises(InputError) as caught:
        freedom.read(tmp_path / "free.toml")
    assert said in str(caught.value) and "free.toml" in str(caught.value)


def test_free_settings_are_those_of_the_controllers_outputs_and_once():
    with pytest.raises(InputError, match="torque"):
        task(free=(free_gain("kp_1_V_m", 1, 2),))
    with pytest.raises(InputError, match="once"):
        task(free=(FREE[0], FREE[0]))
    with pytest.raises(InputError, match="elsewhere"):
        _ = task(manoeuvre=replace(SWING, drive=fx.Drive((fx.JointDrive(),)))).controllers


# -- searches


def tuned(one, how, folder=None, make_executor=None, generations=None):
    history = History.open(folder, one.digest(how.identity())) if folder else History("")
    with ThreadExecutor(one, 1) as runs:
        done = search(
            one,
            replace(how, generations=generations or how.generations),
            make_executor or runs,
            history,
            lambda h: None,
        )
    return history, done


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


# -- the command

STEP, RIG = MODEL / "manoeuvres" / "rig-step.toml", MODEL / "controllers" / "rig.toml"
SMALL = (
    "tune",
    MODEL / "robots" / "rig.toml",
    STEP,
    "--controller",
    RIG,
    "--rig",
    ROOT / "firmware" / "rig.toml",
    "--free",
    "kf_2_rad_s_m=1:100",
    "--free",
    "kp_2_1_s=2:50",
    "--population",
    "6",
    "--out",
    "out",
    "--jobs",
    "1",
)


def start(*arguments, cwd):
    pipe, line = subprocess.PIPE, command_line(*arguments)
    return subprocess.Popen(
        line, cwd=cwd, env=environment(140), stdout=pipe, stderr=pipe, text=True
    )


def flexura(*arguments, cwd):
    process = start(*arguments, cwd=cwd)
    out, err = process.communicate(timeout=280)
    return process.returncode, out, err


def state(folder):
    with np.load(folder / "out" / FILE) as data:
        return {name: data[name] for name in ("points", "goals", "ends")}


def test_killed_and_interrupted_the_same_command_comes_to_the_same_end(tmp_path):
    """kill -9, then a real Ctrl-C (SIGINT), then to the end; beside a run that nothing
    disturbed."""
    (tmp_path / "a").mkdir(), (tmp_path / "b").mkdir()
    arguments = (*SMALL, "--generations", "16", "--json")
    for number, (sent, status) in enumerate(((signal.SIGKILL, -9), (signal.SIGINT, 130)), 1):
        process = start(*arguments, cwd=tmp_path / "a")
        until = time.monotonic() + 200
        while (
            not (tmp_path / "a" / "out" / FILE).exists()
            or len(state(tmp_path / "a")["ends"]) < 3 * number
        ):
            assert process.poll() is None and time.monotonic() < until, process.communicate()
            time.sleep(0.01)
        process.send_signal(sent)
        process.communicate(timeout=60)
        assert process.returncode == status
        assert 3 * number <= len(state(tmp_path / "a")["ends"]) < 16
    code, out, err = flexura(*arguments, cwd=tmp_path / "a")
    assert code == 0, err
    other = flexura(*arguments, cwd=tmp_path / "b")
    for name, array in state(tmp_path / "a").items():
        assert np.array_equal(array, state(tmp_path / "b")[name])
    assert (tmp_path / "a/out/gains.toml").read_bytes() == (
        tmp_path / "b/out/gains.toml"
    ).read_bytes()
    first, second = json.loads(out), json.loads(other[1])
    assert first["settings"] == second["settings"] and first["goals"] == second["goals"]
    assert not list((tmp_path / "a/out").glob(f".{FILE}*"))
    kept = fx.Run.read(tmp_path / "a/out/history")
    assert len(kept) == first["generations"] and kept["goal/J/best"][-1] == first["goals"]["J"]
    assert (
        "J = sum_i" in first["objective"]
        and kept.meta["task"]["free"]["kp_2_1_s"]["scale"] == "log"
    )
    assert (
        gains.load(tmp_path / "a/out/gains.toml").board()["kf_2_rad_s_m"]
        == first["settings"]["kf_2_rad_s_m"]
    )


@pytest.mark.parametrize(
    "change, said",
    [
        (("--algorithm", "annealing"), "--algorithm"),
        (("--free", "kp_9_V_m=1:2"), "kp_9_V_m"),
        (("--free", "kp_1_V_m"), "LOW:HIGH"),
        (("--payload-factors", "-1"), "--payload-factors"),
        (("--population", "1"), "--population"),
        (("--vibration", "-1"), "--vibration"),
        (("--dissertation",), "brings its own"),
    ],
)
def test_a_wrong_argument_is_one_line_and_status_2(tmp_path, change, said):
    code, _, err = flexura(*SMALL, *change, cwd=tmp_path)
    assert (
        code == 2
        and said in err
        and len(err.strip().splitlines()) == 1
        and not list(tmp_path.iterdir())
    )
