import numpy as np
import pytest

from flexlab.runs.deviation import Deviation, compared, deviation, deviations
from flexura.errors import InputError
from flexura.io import Run


def run(t, **channels):
    names = {
        name.replace("__", "/"): np.asarray(values, dtype=float)
        for name, values in channels.items()
    }
    units = {name: "rad" if name.startswith("joint") else "m" for name in names}
    return Run(np.asarray(t, dtype=float), names, units, {"source": "simulation"})


def test_a_run_does_not_deviate_from_itself():
    t = np.linspace(0, 1, 11)
    one = run(t, joint__1__position=np.sin(t), tip__x=t, tip__y=t**2)
    times, values = deviation(one, one, "joint/1/position")
    assert np.array_equal(times, t) and not values.any()
    assert [row.max for row in deviations(one, one)] == [0.0, 0.0, 0.0, 0.0]


def test_the_channels_of_a_run_are_said_in_short():
    t = np.linspace(0, 1, 3)
    along = {f"link__1__deflection__{k}": t for k in range(9)}
    one, other = run(t, tip__x=t, **along), run(t, tip__y=t)
    said = r"has: tip/x, link/1/deflection/0 to 8$"
    with pytest.raises(InputError, match=f"expected a channel of both runs; the second {said}"):
        deviation(other, one, "tip/y")
    many = run(t, **{f"joint__{k}__position": t for k in range(1, 31)})
    with pytest.raises(InputError, match=r"joint/12/position and 18 more$"):
        deviation(other, many, "tip/y")


def test_second_minus_first_on_the_times_of_the_first():
    """A straight line is interpolated exactly, whatever the grid."""
    t, s = np.linspace(0, 2, 21), np.sort(np.random.default_rng(1).uniform(-0.1, 2.1, 57))
    s[[0, -1]] = -0.1, 2.1
    times, values = deviation(run(t, tip__x=3 * t), run(s, tip__x=5 * s + 1), "tip/x")
    assert np.array_equal(times, t)
    np.testing.assert_allclose(values, 2 * t + 1, atol=1e-14)


def test_a_shifted_sine_deviates_by_its_chord():
    """sin(wt - phi) - sin(wt) has the amplitude 2 sin(phi/2), and over whole periods the RMS
    amplitude / sqrt 2."""
    t, phi = np.arange(1000) / 1000, 0.3
    first, second = (run(t, joint__1__position=4 * np.sin(2 * np.pi * t - p)) for p in (0.0, phi))
    (row,) = deviations(first, second)
    assert row.channel == "joint/1/position" and row.unit == "rad"
    assert row.peak == pytest.approx(4)
    assert row.max == pytest.approx(8 * np.sin(phi / 2), rel=1e-5)
    assert row.rms == pytest.approx(8 * np.sin(phi / 2) / np.sqrt(2), rel=1e-9)
    assert row.max_relative == pytest.approx(row.max / 4) and row.rms_relative == pytest.approx(
        row.rms / 4
    )


def test_interpolation_error_falls_with_the_square_of_the_step():
    t = np.linspace(0, 1, 173)
    first = run(t, tip__x=np.sin(5 * t))
    errors = []
    for n in (50, 100, 200):
        s = np.linspace(0, 1, n + 1)
        errors.append(np.abs(deviation(first, run(s, tip__x=np.sin(5 * s)), "tip/x")[1]).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.2)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(2, abs=0.2)


def test_only_the_common_range():
    a, b = run([0, 1, 2, 3], tip__x=[0, 0, 0, 0]), run([1, 1.5, 2.5], tip__x=[1, 2, 4])
    times, values = deviation(a, b, "tip/x")
    assert times.tolist() == [1, 2] and values.tolist() == [1, 3]
    apart = run([5, 6], tip__x=[1, 1])
    assert len(deviation(a, apart, "tip/x")[0]) == 0
    (row,) = deviations(a, apart)
    assert np.isnan(row.max) and np.isnan(row.rms) and row.peak == 0


def test_a_rounded_end_time_is_still_common():
    times, _ = deviation(run([0, 1], tip__x=[0, 0]), run([0, 1 - 1e-12], tip__x=[1, 1]), "tip/x")
    assert len(times) == 2


def test_a_gap_stays_a_gap_and_grows_no_further_than_its_neighbours():
    nan = np.nan
    t = np.arange(6.0)
    whole = run(t, tip__x=np.zeros(6))
    gap = run(t, tip__x=[1, 1, nan, 1, 1, 1])
    assert np.isnan(deviation(whole, gap, "tip/x")[1]).tolist() == [
        False,
        False,
        True,
        False,
        False,
        False,
    ]
    assert np.isnan(deviation(gap, whole, "tip/x")[1]).tolist() == [
        False,
        False,
        True,
        False,
        False,
        False,
    ]
    between = run(t + 0.5, tip__x=[1, 1, nan, 1, 1, 1])
    assert np.isnan(deviation(whole, between, "tip/x")[1]).tolist() == [
        False,
        True,
        True,
        False,
        False,
    ]
    (row,) = deviations(whole, gap)
    assert row.max == 1 and row.rms == 1


def test_the_distance_of_the_tips():
    a, b = run([0, 1], tip__x=[3, 3], tip__y=[4, 4]), run([0, 1], tip__x=[3, 6], tip__y=[4, 8])
    assert deviation(a, b, "tip_distance")[1].tolist() == [0, 5]
    row = deviations(a, b, ["tip_distance"])[0]
    assert (row.unit, row.max, row.peak, row.max_relative) == ("m", 5.0, 5.0, 1.0)


def test_a_channel_that_never_moves_has_no_relative_deviation():
    (row,) = deviations(run([0, 1], tip__x=[0, 0]), run([0, 1], tip__x=[1, 1]))
    assert row.max == 1 and row.peak == 0 and np.isnan(row.max_relative)


def test_what_is_compared():
    channels = {
        "joint__1__position": [0, 0],
        "link__2__tip_deflection": [0, 0],
        "link__2__x": [0, 0],
        "tip__x": [0, 0],
        "tip__y": [0, 0],
    }
    a, b = (
        run([0, 1], **channels),
        run([0, 1], **{k: v for k, v in channels.items() if k != "tip__y"}),
    )
    assert compared(a, a) == [
        "joint/1/position",
        "link/2/tip_deflection",
        "tip/x",
        "tip/y",
        "tip_distance",
    ]
    assert compared(a, b) == ["joint/1/position", "link/2/tip_deflection", "tip/x"]
    assert isinstance(deviations(a, b, ["link/2/x"])[0], Deviation)


def test_wrong_channels_are_named():
    a, b = (
        run([0, 1], tip__x=[0, 0]),
        Run(np.array([0.0, 1.0]), {"tip/x": np.zeros(2)}, {"tip/x": "rad"}),
    )
    with pytest.raises(InputError, match="no/such"):
        deviation(a, b, "no/such")
    with pytest.raises(InputError, match="not m and rad"):
        deviation(a, b, "tip/x")
    assert compared(a, b) == []
