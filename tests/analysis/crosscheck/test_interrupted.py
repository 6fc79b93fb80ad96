"""Ctrl-C while the twin runs: what is finished is kept, and no other step takes its place."""

import signal

import pytest

import flexura as fx
from flexlab.crosscheck.crosscheck import crosscheck
from flexura import twin

ASKED = fx.load_manoeuvre("rig-step", 2).prescribed()


def stopped(fraction: float):
    """A check that Ctrl-C reaches when that part of the twin's work is done."""
    sent = []

    def progress(name: str, done: float) -> None:
        if name == "twin" and done >= fraction and not sent:
            sent.append(done)
            signal.raise_signal(signal.SIGINT)

    return crosscheck(fx.load("rig"), ASKED, progress=progress)


def test_the_twins_run_is_interrupted():
    check = stopped(0.2)
    assert check.interrupted and check.twin.interrupted and not check.complete
    (event,) = check.twin.meta["events"]
    assert event["name"] == "interrupted" and 0 < event["t"] < ASKED.t[-1]
    assert not check.own_error and len(check.twin) < len(check.simulation)


@pytest.mark.parametrize("fraction", [0.65, 0.9])
def test_the_estimate_of_its_error_is_interrupted(fraction):
    """Once, a run with half the step took the place of the one that was interrupted."""
    check = stopped(fraction)
    assert check.interrupted and check.complete and not check.own_error
    whole = crosscheck(fx.load("rig"), ASKED)
    assert not whole.interrupted and whole.own_error
    assert check.twin.meta["step_s"] >= whole.twin.meta["step_s"]


def test_a_hub_that_is_extrapolated_is_interrupted():
    """Of the runs with hubs of two lengths the second one ends: there is no extrapolation."""
    robot = fx.load("type-3-rpb")
    sent = []

    def progress(done: float) -> None:
        if done >= 0.6 and not sent:
            sent.append(done)
            signal.raise_signal(signal.SIGINT)

    run = twin.simulate(robot, [0.0, 0.005, 0.01], progress=progress)
    assert sent and run.interrupted and not run.complete and "extrapolation" not in run.meta
