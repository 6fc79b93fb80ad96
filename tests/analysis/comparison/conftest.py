"""Experiments of the Exudyn twin, and the comparison of one."""

import pytest

from flexlab.comparison import pages, report
from flexlab.comparison.measures import (
    compare,
)
from flexlab.comparison.replay.simulate_experiment import simulate_experiment
from twin_experiments import experiment


@pytest.fixture(scope="session")
def inverse():
    return experiment("inverse", seconds=1.2)


@pytest.fixture(scope="session")
def forward():
    return experiment("forward", seconds=1.6)


@pytest.fixture(scope="session")
def compared(forward):
    return compare(simulate_experiment(forward[0]), forward[0])


@pytest.fixture(scope="session")
def page(compared):
    return report.html(compared)


@pytest.fixture(scope="session")
def document(compared):
    return pages.pdf(compared)
