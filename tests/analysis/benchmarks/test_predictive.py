"""Processor time of a predictive controller's ticks, and what is left of the motion beside LQG."""

import numpy as np
import pytest

from flexlab.benchmarks.problems import predictive

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(("rate", "spread", "most_ms"), predictive.CASES)
def test_a_tick_is_done_in_its_period(rate, spread, most_ms):
    """99.9 % of the ticks. All runs are alike: of each tick the least time in six runs counts, so
    that other work on the machine does not."""
    times, run, failures = predictive.timed(rate, spread, 6)
    assert times.shape == (6, round(0.6 * rate) - 1) and failures == 0 and run.complete
    found = 1e3 * np.percentile(times.min(axis=0), 99.9)
    assert 0.01 < found < most_ms, found


def test_at_1_khz_the_residual_is_a_tenth_of_lqgs():
    """1.3 mm; the best of 24 LQG designs leaves more than ten times that."""
    plant = predictive.two_links()
    _, run, _ = predictive.timed(1000.0, 8, 1)
    lqg = predictive.best_lqg(plant, np.linspace(0, 0.6, 301))
    assert lqg < 0.1 and predictive.residual(run, plant) <= predictive.SHARE * lqg
