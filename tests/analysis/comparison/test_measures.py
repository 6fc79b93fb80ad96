"""Deviations, response times and delays of two runs."""

import numpy as np
import pytest

import flexura as fx
from experiment_runs import run
from flexlab.comparison.measures import (
    PUBLISHED,
    RESPONSE_LEVEL,
    best_fit_delay,
    compare,
    response_time,
    simulation_first,
)
from flexlab.comparison.table import notes
from flexura.errors import InputError


def test_response_times_of_known_motions():
    t = np.arange(2001) / 1000
    assert response_time(t, 3 + 0.2 * np.sin(2 * np.pi * t)) == pytest.approx(
        np.arcsin(RESPONSE_LEVEL) / (2 * np.pi), abs=1e-5
    )
    first_order = 1 - np.exp(-t / 0.1)
    level = RESPONSE_LEVEL * first_order[-1]
    assert response_time(t, -first_order) == pytest.approx(-0.1 * np.log(1 - level), abs=1e-5)
    assert np.isnan(response_time(t, np.zeros(len(t)))) and np.isnan(response_time(t, t * np.nan))


def test_a_response_behind_a_dropout_is_not_known():
    t = np.linspace(0, 1, 101)
    y = t.copy()
    y[88:92] = np.nan  # 0.9 is reached at 0.9
    assert np.isnan(response_time(t, y))
    y = t.copy()
    y[50:60] = np.nan  # not where it is reached
    assert response_time(t, y) == pytest.approx(0.9)


@pytest.mark.parametrize("late", [-0.013, 0.0, 0.0317, 0.2])
def test_a_delay_is_found_to_a_part_of_a_sample(late):
    t = np.arange(401) / 200
    noise = np.random.default_rng(3).normal(0, 0.002, len(t))
    law = lambda s: np.sin(2 * np.pi * s) + 0.3 * np.sin(7 * s)
    first, second = (
        run(t, joint__1__position=law(t)),
        run(t, joint__1__position=law(t - late) + noise),
    )
    second["joint/1/position"][40:45] = np.nan
    assert best_fit_delay(first, second, "joint/1/position") == pytest.approx(late, abs=2e-4)


def test_the_table_is_of_what_deviates():
    """A sine with 3 % more amplitude deviates by 3 % of the peak, at the peak; half a degree of
    phase by its chord."""
    t = np.arange(1001) / 1000
    first = run(
        t, joint__1__position=0.01 * np.sin(2 * np.pi * t), link__2__tip_deflection=np.cos(t)
    )
    second = run(
        t,
        joint__1__position=0.0103 * np.sin(2 * np.pi * t),
        link__2__tip_deflection=1.1 * np.cos(t),
    )
    second.meta["experiment"] = "forward"
    found = compare(first, second)
    joint, tip = found.differences
    assert joint.max_relative == pytest.approx(0.03, rel=1e-9) and joint.at_s == pytest.approx(0.25)
    assert joint.peak == pytest.approx(0.01) and joint.rms_relative == pytest.approx(
        0.03 / np.sqrt(2), rel=1e-3
    )
    assert tip.max_relative == pytest.approx(0.1) and tip.at_s == 0.0
    assert joint.published_percent == 4.35 and tip.published_percent == 7.5
    assert found.worst_response == pytest.approx(0.0, abs=1e-9) and found.lost == 0


def test_dropouts_are_counted_and_left_out():
    t = np.arange(101) / 100
    first, second = run(t, joint__1__position=t), run(t, joint__1__position=t + 0.01)
    second["joint/1/position"][[3, 50]] = np.nan
    found = compare(first, second)
    assert found.lost == 2 and found.differences[0].max == pytest.approx(0.01)


def test_the_dissertations_figures():
    assert PUBLISHED["forward"] == {
        "joint/1/position": 4.35,
        "joint/2/position": 7.5,
        "link/2/tip_deflection": 7.5,
    }
    assert [
        PUBLISHED["inverse"][k]
        for k in ("joint/1/position", "joint/2/position", "response", "link/2/tip_deflection")
    ] == [
        8.3,
        1.15,
        17.8,
        11.5,
    ]


def test_the_experiment_comes_last(forward):
    measured, moved = forward
    for pair in ((measured, moved), (moved, measured)):
        assert simulation_first(*pair) == (moved, measured)
    assert simulation_first(moved, moved) == (moved, moved)


def test_runs_with_nothing_in_common_are_refused():
    with pytest.raises(InputError, match="the first has: tip/x; the second: tip/y"):
        compare(run([0, 1], tip__x=[0, 1]), run([0, 1], tip__y=[0, 1]))
    with pytest.raises(InputError, match="a channel of both runs; the second has: tip/y"):
        compare(run([0, 1], tip__x=[0, 1]), run([0, 1], tip__y=[0, 1]), ["tip/x"])


def test_a_tip_beside_other_channels_hides_none_of_them():
    one = run([0, 1], tip__x=[0, 1], sensor__strain=[0, 1])
    assert [d.channel for d in compare(one, one).differences] == ["tip/x", "sensor/strain"]


def test_runs_without_joint_positions_are_compared_by_what_both_have():
    """Logs have drives, motor positions and sensors; 2 % and 10 ms stay what they are."""
    t = np.arange(1001) / 1000
    law = lambda s: np.sin(2 * np.pi * s)
    units = {"sensor/strain": "1", "joint/1/motor_position": "rad", "joint/1/drive": "N m"}
    made = lambda factor, late, **more: fx.Run(
        t,
        {name: factor * law(t - late) for name in units} | more,
        units | dict.fromkeys(more, "V"),
        {"source": "experiment"},
    )
    found = compare(made(1.0, 0.0, alone=t), made(1.02, 0.0))
    assert [d.channel for d in found.differences] == list(units)
    assert [d.quantity for d in found.differences] == list(units)
    assert all(d.max_relative == pytest.approx(0.02) for d in found.differences)
    found = compare(made(1.0, 0.0), made(1.0, 0.01), ["joint/1/motor_position"])
    (response,) = found.responses
    assert response.delay_s == pytest.approx(0.01, abs=2e-4)
    assert len(found.differences) == 1


def test_a_rig_that_is_not_its_files_is_explained():
    t = np.arange(101) / 100
    first = run(t, joint__1__position=np.sin(t))
    first.meta["driven_by"] = "commanded"
    for factor, said in ((1.0, False), (1.25, True)):
        second = run(t, joint__1__position=np.sin(t))
        second.meta["truth"] = {"seed": 0, "factors": {"friction": factor}}
        assert (
            any("is not quite its files" in line for line in notes(compare(first, second))) is said
        )
