"""The replayed pulses against what the emulated board gave: its own arithmetic, bit for bit."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from boards import BENCH
from experiments import SETTINGS, experiment
from flexlab.comparison.replay import pulses
from flexlab.experiment import plan


@pytest.fixture(scope="module", params=["inverse", "forward"])
def run(request, tmp_path_factory):
    done = experiment(
        getattr(plan, request.param)(BENCH, SETTINGS), tmp_path_factory.mktemp(request.param)
    )
    assert done.ended.complete
    return done.run


def test_every_report_counts_the_pulses_that_the_knots_give(run):
    at, angle = pulses.pulses_of_run(run)
    assert len(at) > 500 and np.all(np.diff(at) > 0)
    reported = run["joint/2/pulses"]
    given = angle[np.searchsorted(at, run.t, side="right") - 1]
    step = 1 / SETTINGS["stepper_steps_per_rad"]
    assert np.abs(given - reported).max() < 1.01 * step
    assert (
        np.abs(given - reported) > 0.01 * step
    ).mean() < 0.01  # where a pulse comes with the tick itself


def test_a_report_that_says_otherwise_is_believed(run):
    changed = run["joint/2/pulses"].copy()
    changed[len(changed) // 2] += 2 / SETTINGS["stepper_steps_per_rad"]
    assert (
        pulses.pulses_of_run(
            dataclasses.replace(run, channels=run.channels | {"joint/2/pulses": changed})
        )
        is None
    )


@pytest.mark.parametrize("name", ["feedback_2", "kg_2_rad_m"])
def test_a_controller_that_saw_more_than_its_pulses_is_not_replayed(run, name):
    settings = run.meta["settings"] | {name: 1.0}
    found = pulses.pulses_of_run(dataclasses.replace(run, meta=run.meta | {"settings": settings}))
    assert (found is None) == (run.meta["experiment"] == "inverse")
