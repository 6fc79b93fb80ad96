"""The benchmark: its two programs agree where they are converged, its error measure, its choices,
and its tables."""

import io

import numpy as np
import pytest
from rich.console import Console

import flexura as fx
from flexlab.benchmarks import (
    accuracy,
    equal_error,
    exudyn_search,
    native,
    native_search,
    report,
    timing,
)
from flexlab.benchmarks.exudyn_programs import run as exudyn_run
from flexlab.benchmarks.exudyn_programs.loads import sampled
from flexlab.benchmarks.problems import statics
from flexlab.benchmarks.problems.motions import all_motions
from flexlab.benchmarks.problems.problem import error, scale
from flexlab.benchmarks.problems.signals import piecewise

MOTIONS, STILL = all_motions(), statics.all_statics()
QUICK = ("rig-pd", "rig-sampled", "payload", "arm-pd", "arm-inverse", "python-law", "friction")
SLACK = 2e-3  # what a step four times shorter than the cheapest leaves


def converged_apart(problem):
    """How far flexura's converged motion is from Exudyn's with a quarter of its cheapest step."""
    choice = exudyn_search.choice(problem.name)
    finest = exudyn_run.Choice(problem.finer_elements or choice.elements, 4 * choice.substeps)
    theirs = exudyn_run.run(problem, finest if problem.hub_length_m else finest.tight())[1]
    return error(native.converged(problem, problem.finer), theirs)


@pytest.mark.parametrize("name", QUICK)
def test_the_two_programs_agree(name):
    assert converged_apart(MOTIONS[name]) <= 1.2 * exudyn_search.stored()[name]["apart"] + SLACK


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [name for name in MOTIONS if name not in QUICK and MOTIONS[name].available]
)
def test_the_two_programs_agree_on_all_problems(name):
    assert converged_apart(MOTIONS[name]) <= 1.2 * exudyn_search.stored()[name]["apart"] + SLACK


@pytest.mark.parametrize("name", ["rig-pd", "payload"])
def test_a_stored_choice_holds_the_error_that_it_states(name):
    problem, choice = MOTIONS[name], exudyn_search.choice(name)
    exact = exudyn_run.run(
        problem,
        exudyn_run.Choice(problem.finer_elements or choice.elements, 8 * choice.substeps).tight(),
    )[1]
    found = error(exudyn_run.run(problem, choice)[1], exact)
    assert found <= 1.1 * exudyn_search.TARGET and found == pytest.approx(
        exudyn_search.stored()[name]["error"], rel=0.2
    )


def test_every_motion_has_a_stored_choice_within_the_target():
    stored = exudyn_search.stored()
    assert len(MOTIONS) >= 20
    for name, problem in MOTIONS.items():
        if problem.available:
            assert stored[name]["error"] <= exudyn_search.TARGET, name
            assert exudyn_run.Choice(**stored[name]["choice"]).substeps % problem.ticks == 0, name


def test_the_cheapest_setting_holds_the_error():
    problem = MOTIONS["arm-pd"]
    system, exact = native.system(problem.robot), native.converged(problem)
    best, auto = native_search.cheapest(problem, system, exact, 1e-3)
    for setting in (best, auto):
        assert (
            error(native.run(problem, system, setting.rtol, setting.method).channels, exact) <= 1e-3
        )
    assert auto.method == "auto" and best.seconds <= auto.seconds


def test_a_lucky_hit_does_not_count(monkeypatch):
    errors = dict(zip(native_search.RTOLS, [1.0, 5e-4, 2e-3, 8e-4, 7e-4] + [1e-9] * 9, strict=True))
    third = native_search.RTOLS[3]
    errors |= {2.0 * third: 1.5e-3, 1.4 * third: 9e-4}  # between it and the next looser one
    answer = lambda problem, system, rtol, method, **keys: native.Answer(
        1.0, 10, method, {"off": np.array(errors[rtol])}
    )
    monkeypatch.setattr(native_search.native, "run", answer)
    monkeypatch.setattr(native_search, "error", lambda channels, exact: float(channels["off"]))
    found = native_search.loosest_tolerance(None, None, {}, 1e-3, "implicit", 1.0)
    assert found.rtol == 1.4 * third and found.error == 9e-4
    errors[1.4 * third] = 1.1e-3
    found = native_search.loosest_tolerance(None, None, {}, 1e-3, "implicit", 1.0)
    assert found.rtol == third and found.error == 8e-4


def test_the_error_is_that_of_places_and_deflections_over_the_largest_deflection():
    t = np.linspace(0, 1, 101)
    exact = {
        "tip/x": np.cos(t),
        "tip/y": np.sin(t),
        "link/1/tip_deflection": 0.1 * np.sin(t * np.pi),
    }
    assert scale(exact) == pytest.approx(0.1)
    moved = exact | {"tip/x": exact["tip/x"] + 3e-4, "tip/y": exact["tip/y"] + 4e-4}
    assert error(moved, exact) == pytest.approx(5e-3)
    assert error(exact | {"tip/x": np.full(101, np.nan)}, exact) == np.inf
    stiff = exact | {"link/1/tip_deflection": 1e-9 * t}
    assert scale(stiff) == pytest.approx(1e-3, rel=1e-3)  # of a path of 1 m
    driven = exact | {"joint/1/drive": 2 * t}
    assert error(driven | {"joint/1/drive": 2 * t + 0.02}, driven) == pytest.approx(0.01)


def test_exudyns_table_of_a_signal_that_jumps_has_its_impulse():
    signal, step, steps = piecewise([0.0, 0.0333, 0.07], [1.0, -2.0, 0.0]), 0.01, 10
    table = sampled([signal], steps, step)[:, 0]
    impulse = step * (
        table.sum() - table[[0, -1]].sum() / 2
    )  # trapezoidal rule, as the solver takes a load
    assert impulse == pytest.approx(1.0 * 0.0333 - 2.0 * (0.07 - 0.0333), rel=1e-12)


def test_frequencies_and_statics_agree():
    tables = statics.chain(2, 6)
    ours, theirs = statics.spectrum(tables)()[1], statics.exudyn_spectrum(tables, 6, False)()[1]
    assert statics.nearest(ours[:8], theirs) <= 1e-4
    hanging = STILL["static"]
    assert hanging.difference(hanging.ours()[1], hanging.theirs()[1]) <= 1e-4


def test_a_row_fits_and_tells_what_failed(monkeypatch):
    monkeypatch.setattr(
        equal_error,
        "run_times",
        lambda programs, rounds: np.array([[4.0] + [0.02] * (len(programs) - 1)] * rounds),
    )
    row = equal_error.motion_row(MOTIONS["arm-pd"], 2)
    assert row["auto"]["ratio"] == {"low": 200.0, "median": 200.0, "high": 200.0}
    assert row["default"]["error"] < 1e-3 and row["exudyn"]["error"] <= exudyn_search.TARGET
    if not MOTIONS["python-tick"].available:
        assert "fx.Sampled" in equal_error.motion_row(MOTIONS["python-tick"], 2)["failed"]
    row["asked"] = 300
    text = printed(
        report.motions([row, {"name": "other", "asked": None, "failed": "why"}]),
        report.summary([row]),
    )
    assert "200" in text and "asked 300" in text and "geometric mean 200 of 1" in text


@pytest.mark.parametrize("longest", [12345.6])
def test_tables_fit_80_columns_without_cutting(longest):
    ratio = {"low": longest, "median": longest, "high": longest}
    setting = {
        "method": "exponential",
        "took": "exponential",
        "rtol": 3e-5,
        "error": 9e-4,
        "ms": longest,
        "ratio": ratio,
    }
    row = {
        "name": "pendulum-long",
        "what": "w" * 60,
        "asked": 100.0,
        "best": setting,
        "auto": setting,
        "exudyn": {"ms": longest},
    }
    row["default"] = {"ms": longest, "error": 3e-5}
    tables = [
        report.motions([row]),
        report.statics([row | {"name": "frequencies-sparse"}]),
        report.summary([row]),
        report.populations([{"what": "p" * 40, "us": longest, "ratio": ratio, "asked": 1000.0}]),
        report.growths([{"what": "elements of a link", "count": 64, "us": longest, "times": 2.0}]),
        report.accuracies(
            [
                {
                    "name": "pendulum-long",
                    "undamped": True,
                    "scale": 0.0123,
                    "default": {"error": 1e-4},
                    "errors": [{"rtol": r, "error": 123.4 * r} for r in accuracy.TOLERANCES],
                }
            ]
        ),
        report.passes(
            [
                {
                    "name": "pendulum-long",
                    "methods": ["exponential"],
                    "passes": [
                        {"error": e, "passes": {"exponential": 123456}} for e in accuracy.ERRORS
                    ],
                }
            ]
        ),
    ]
    for table in tables:
        text = printed(table)
        assert "…" not in text
        assert max(len(line.rstrip()) for line in text.splitlines()) <= report.WIDTH
    assert "12346" in printed(tables[0]) and "123456" in printed(tables[-1])


def printed(*parts):
    console = Console(width=report.WIDTH, file=io.StringIO())
    for part in parts:
        console.print(part)
    return console.file.getvalue()


def test_ratios_are_formed_round_by_round():
    slow, fast = np.array([8.0, 4.0, 6.0]), np.array([2.0, 2.0, 1.0])
    assert timing.ratio(slow, fast) == timing.Ratio(3.0, 4.0, 5.0)
    assert timing.geometric_mean([10.0, 1000.0]) == pytest.approx(100.0)
    calls = iter(
        [1.0, 0.03, 3.0, 0.05, 0.02, 0.04, 0.06, 0.01]
    )  # first runs say how often a round repeats
    run = lambda: next(calls)
    assert timing.run_times([run, run], 1).tolist() == [[3.0, 0.05]]


def test_accuracy_says_what_is_beyond_what_is_asked():
    entry = {"name": "a", "undamped": False, "default": {"error": 2e-4}}
    entry["errors"] = [
        {"rtol": 1e-3, "error": 1e-3},
        {"rtol": 1e-4, "error": 4e-3},
        {"rtol": 1e-5, "error": None},
    ]
    said = accuracy.beyond([entry, entry | {"name": "b", "undamped": True}])
    assert len(said) == 3 and all(line.startswith("a:") for line in said)


def test_passes_say_where_auto_is_dear_or_fails():
    at = lambda error, **passes: {"error": error, "passes": passes}
    row = {
        "name": "a",
        "passes": [
            at(1e-2, auto=300, implicit=100),  # just within
            at(1e-3, auto=301, implicit=100),
            at(1e-4, auto=None, explicit=5000),
            at(1e-5, auto=None, explicit=None),  # no method gets there
        ],
    }
    said = accuracy.slower([row])
    assert len(said) == 2 and "0.001" in said[0] and "0.0001" in said[1]


def test_a_run_that_fails_is_not_one_that_takes_too_long():
    """The energies of `payload` do not balance at this tolerance: tighter ones are still tried."""
    problem = MOTIONS["payload"]
    system, exact = native.system(problem.robot), native.converged(problem)
    at = lambda rtol, limit: accuracy.measured(problem, system, exact, rtol, "auto", limit)
    assert at(3.3e-2, 30.0) == (np.inf, 0)
    assert at(1e-2, 30.0)[0] < 0.1
    assert at(1e-2, 1e-9) is None


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name, p in MOTIONS.items() if p.available])
def test_tighter_tolerances_come_closer(name):
    """The default setting's error is below 1e-2 of the scale on every problem that it can run."""
    problem = MOTIONS[name]
    system = native.system(problem.robot)
    try:
        answer = native.run(problem, system, native.default_rtol(), limit_s=100.0)
    except native.TooSlow:
        pytest.skip("takes more than 100 s")
    assert error(answer.channels, native.converged(problem)) <= 1e-2


def test_the_public_interface_is_all_that_is_used():
    assert {"simulate", "inverse", "static", "frequencies", "Drive", "Controller", "PID"} <= set(
        dir(fx)
    )
