"""The rig in two programs, and their review."""

import pytest

from flexlab.review import write_review
from reviews import (
    RIG,
    synthetic,
)


@pytest.fixture(scope="session")
def pair():
    return synthetic(RIG), synthetic(RIG, "twin", rate=150, late=0.08)


@pytest.fixture(scope="session")
def rrd(pair, tmp_path_factory):
    return write_review(tmp_path_factory.mktemp("review") / "rig.rrd", pair)
