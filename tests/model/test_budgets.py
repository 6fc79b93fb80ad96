"""What a run may take: steps, which decide, time, which only stops, and memory, which is asked
first."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg

import flexura as fx
from flexura.errors import guarded
from flexura.io import Run, judged
from robots import beam, robot, two_link_arm

T = np.linspace(0.0, 2.0, 201)
FAST = robot(beam(0.5, 0.2, 50.0, 8), gravity=(0.0, -9.81))


def event(run: fx.Run, name: str) -> dict:
    return next(e for e in run.meta["events"] if e["name"] == name)


@pytest.mark.parametrize("method", ["auto", "explicit", "implicit", "exponential"])
def test_a_budget_of_steps_ends_a_run_at_the_same_step(method):
    runs = [
        fx.simulate(FAST, T, method=method, start="straight", max_steps=200, rtol=1e-10)
        for _ in range(2)
    ]
    run = runs[0]
    said = event(run, "exhausted")
    assert not run.complete and said["level"] == "ERROR"
    assert 0 < said["t"] < T[-1] and "200 steps are used up" in said["text"]
    assert "a few modes" in said["text"] and run.meta["steps"] <= 200
    assert said == event(runs[1], "exhausted") and np.array_equal(run["tip/y"], runs[1]["tip/y"])


def test_a_larger_budget_changes_no_digit():
    small, large = (fx.simulate(FAST, T, start="straight", max_steps=n) for n in (10**5, 10**7))
    assert small.complete and all(np.array_equal(small[name], large[name]) for name in small)


@pytest.mark.parametrize("stiffening", [True, False])
def test_the_last_step_of_a_budget_may_be_the_last_of_the_run(stiffening):
    made = FAST.replace({"stiffening": stiffening})
    t, keys = np.linspace(0.0, 1e-2, 11), {"start": "straight", "method": "explicit"}
    run = fx.simulate(made, t, **keys)
    taken = run.meta["steps"] + run.meta.get("rejected", 0)
    last, one_less = (fx.simulate(made, t, max_steps=taken - k, **keys) for k in (0, 1))
    assert last.complete and np.array_equal(last["tip/y"], run["tip/y"])
    assert not one_less.complete and event(one_less, "exhausted")["t"] < t[-1]


@pytest.mark.parametrize("stiffening", [True, False])
def test_wall_time_stops_and_labels(stiffening):
    made = FAST.replace({"stiffening": stiffening})
    t = np.linspace(0.0, 1000.0, 11)
    run = fx.simulate(made, t, start="straight", method="explicit", wall_time=0.2)
    said = event(run, "wall_time")
    assert not run.complete and run.stopped and not run.interrupted and said["level"] == "WARN"
    assert "0.2 s of wall time are over" in said["text"] and run.meta["wall_s"] < 30


def test_a_dense_run_has_a_budget_too():
    made = FAST.replace({"stiffening": False})
    run = fx.simulate(made, T, start="straight", method="explicit", max_steps=20)
    assert not run.complete and event(run, "exhausted")["t"] < T[-1]


def test_a_population_has_budgets():
    batch = fx.Batch.vary(FAST, {"payload.mass_kg": np.linspace(0.01, 0.1, 6)})
    keys = {"start": "straight", "method": "explicit"}
    found = fx.simulate(batch, T, max_steps=50, **keys)
    assert found.complete and set(found.status) == {"stuck"}
    t = np.linspace(0.0, 1e4, 11)
    late = fx.simulate(batch, t, wall_time=0.3, chunk=2, **keys)
    assert not late.complete and len(late.robots) < 6


@pytest.mark.parametrize("key", ["max_steps", "wall_time"])
@pytest.mark.parametrize("value", [0, -1, np.nan, "x", True])
def test_wrong_budgets_are_refused(key, value):
    with pytest.raises(fx.InputError, match=key):
        fx.simulate(FAST, T, **{key: value})


class Many:
    """As many times as no memory holds."""

    def __len__(self) -> int:
        return 10**13


def test_sizes_are_checked_before_memory_is_taken(monkeypatch):
    with pytest.raises(fx.InputError, match=r"fits into memory.* GB are there"):
        fx.simulate(FAST, Many())
    batch = fx.Batch.of(lambda k, random: two_link_arm(), count=10**9)
    for more in ({}, {"chunk": 10**9, "reduce": lambda t, channels: 1.0}):
        with pytest.raises(fx.InputError, match=r"fits into memory"):
            fx.simulate(batch, T, **more)


def test_a_run_with_a_number_that_is_not_finite_is_not_complete():
    values = {"tip/x": np.array([0.0, 1.0, np.nan]), "tip/y": np.array([0.0, np.inf, 1.0])}
    run = judged(Run(np.arange(3.0), values, dict.fromkeys(values, "m"), {"complete": True}))
    said = event(run, "not_finite")
    assert not run.complete and said["t"] == 1.0 and "tip/y is no finite number" in said["text"]


@pytest.mark.parametrize(
    ("error", "level", "complete"),
    [(9e-4, None, True), (2e-3, "INFO", True), (0.02, "WARN", True), (0.2, "ERROR", False)],
)
def test_a_balance_is_a_note_a_warning_or_the_end_of_trust(error, level, complete):
    run = judged(Run(np.arange(2.0), {}, {}, {"energy_error": error}))
    levels = [e["level"] for e in run.meta.get("events", [])]
    assert levels == ([level] if level else []) and run.complete is complete


def test_a_balance_that_is_no_number_ends_trust():
    run = judged(Run(np.arange(2.0), {}, {}, {"energy_error": np.nan}))
    assert not run.complete


@pytest.mark.parametrize(
    "fails",
    [
        lambda: np.linalg.cholesky(-np.eye(2)),
        lambda: scipy.linalg.eigvalsh(np.full((2, 2), np.nan)),
        lambda: np.exp(np.float64(1e4)),
    ],
    ids=["singular", "not finite", "overflow"],
)
def test_failures_of_libraries_become_one_error(fails):
    """They are raised in a library that a module of flexura calls."""
    inside = type(fails)(fails.__code__, {"__name__": "flexura.x", "np": np, "scipy": scipy})
    with np.errstate(all="raise"), pytest.raises(fx.NumericalError, match="a thing cannot be"):
        guarded("a thing")(inside)()


def test_the_callers_own_failure_stays_his():
    def broken(t):
        return 1 / (t - t)

    for drive in (broken, fx.Sampled(broken, 100.0)):
        with pytest.raises(ZeroDivisionError):
            fx.simulate(FAST, T, drive)
