"""What `make bench` times is as accurate as it says: 1e-3 of the largest deflection, from its own converged model."""

import numpy as np
import pytest

from flexlab import baseline, bench, sidebyside, twolink

LEAST = 1e-3


@pytest.mark.parametrize("cases", [baseline.cases, twolink.cases])
def test_the_native_rows_keep_the_error_they_are_asked_for(cases):
    for case in cases()[1:]:
        assert sidebyside.error(case.run().deflections, case.converged()) <= LEAST, case.name


@pytest.mark.slow
@pytest.mark.parametrize("title", bench.WORKS)
def test_all_rows_keep_the_error_they_are_asked_for(title):
    for case in bench.WORKS[title]():
        assert sidebyside.error(case.run().deflections, case.converged()) <= LEAST, case.name


def test_a_row_has_its_ratio_to_the_first_and_what_is_asked():
    walls = iter([9.0, 9.0, 4.0, 2.0, 1.0, 8.0, 4.0, 2.0])
    exact = np.array([[0.0, 1.0]])

    def case(name, off, asked, repeats):
        return sidebyside.Case(name, lambda: sidebyside.Result(next(walls), exact + off), lambda: exact, asked, repeats)

    first, second = sidebyside.measure([case("slow", 0.0, None, 1), case("quick", 0.01, 3.0, 2)], rounds=2)
    assert (first["ratio"], first["asked"], first["error"]) == (1.0, None, 0.0)
    assert second["ratio"] == 4.0 and second["asked"] == 3.0 and second["error"] == pytest.approx(0.01)
