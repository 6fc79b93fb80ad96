"""From reports to physical quantities: conversions by hand, gaps, uncertainty by Monte Carlo,
delays, the flex sensor's fit."""

import numpy as np
import pytest
from scipy.signal import savgol_filter

import flexura as fx
from experiments import BENCH, SETTINGS, board
from flexlab import rig
from flexlab.board.protocol import messages
from flexlab.board.protocol.declaration import Mode, State
from flexlab.board.protocol.player import drives, setpoints
from flexlab.board.protocol.session import Link
from flexlab.experiment.lead_in import quintic, with_lead_in
from flexlab.recordings import flex_calibration
from flexlab.recordings.delay_estimation import estimate_delay
from flexlab.recordings.unit_conversion import (
    Sensor,
    channels_of_reports,
    planned_setpoints,
    start_tick,
    ticks_of_reports,
    velocity,
)
from flexlab.rig.board_axes import board_axes
from flexlab.rig.sensors import Calibration
from flexura.signals import bang_bang, evaluate, harmonic, polynomial, table

CUBIC = Calibration(zero=0.61, c1_m=-1.85, c2_m=3.0, c3_m=-4.9)


def reports(count=100, first=1000, **columns):
    out = np.zeros(count, dtype=messages.TELEMETRY)
    out["tick"] = first + 2 * np.arange(count)
    out["state"], out["supply"], out["flex"] = State.running, 12000, 2500
    for name, values in columns.items():
        out[name] = values
    return out


def test_conversions_by_hand():
    """80 counts a millimetre, 2400 counts and 3200 microsteps a turn; 12 V told, 11.4 V there and
    half a conversion, which rounds down; 2500 of 4096 at the sensor."""
    places = {
        "position_1": 800,
        "position_2": 600,
        "steps": 800,
        "setpoint_1": 256 * 400,
        "setpoint_2": 256 * 1600,
    }
    seen = reports(**places, voltage=3000, supply=11400)
    ticks, found = channels_of_reports(seen, Mode.position, SETTINGS, Sensor(CUBIC, 0.61))
    x = 2500 / 4096 - 0.61
    expected = {
        "joint/1/position": 0.01,
        "joint/2/position": np.pi / 2,
        "joint/2/pulses": np.pi / 2,
        "joint/1/reference": 0.005,
        "joint/2/reference": np.pi,
        "joint/1/voltage": 6.0 * (11.4 + 4.9 * 5 / 1024 / 2) / 12,
        "link/2/flex_voltage": 5 * 2500 / 4096,
        "link/2/tip_deflection": -1.85 * x + 3.0 * x**2 - 4.9 * x**3,
    }
    for name, value in expected.items():
        np.testing.assert_allclose(found[name], value, rtol=1e-6, err_msg=name)
    np.testing.assert_array_equal(ticks, seen["tick"])


def test_what_did_not_arrive_is_nan_and_nothing_else_is():
    lost = [10, 11, 12, 50]
    seen, numbers = (
        np.delete(a, lost)
        for a in (reports(position_1=np.arange(100)), (65500 + np.arange(100)) % 65536)
    )
    ticks, found = channels_of_reports(seen, Mode.position, SETTINGS, Sensor(CUBIC, 0.61), numbers)
    np.testing.assert_array_equal(ticks, 1000 + 2 * np.arange(100))
    for name, values in found.items():
        if "velocity" not in name:
            np.testing.assert_array_equal(np.flatnonzero(np.isnan(values)), lost, err_msg=name)
    assert set(np.flatnonzero(np.isnan(found["joint/1/velocity"]))) == {
        *lost,
        *range(10),
    }  # 10 samples are no window


def test_reports_that_are_counted_anew_make_no_gap_of_60_000():
    numbers = np.concatenate([5000 + np.arange(50), np.arange(50)])
    ticks, place = ticks_of_reports(reports(), numbers)
    assert len(ticks) <= 101 and (np.diff(ticks) > 0).all() and len(place) == 100


def test_set_points_are_none_where_the_board_tracks_nothing():
    state = np.where(np.arange(100) < 60, State.running, State.fault)
    _, found = channels_of_reports(
        reports(state=state), Mode.position, SETTINGS, Sensor(CUBIC, 0.61)
    )
    np.testing.assert_array_equal(np.isnan(found["joint/1/reference"]), state == State.fault)
    assert np.isnan(
        channels_of_reports(reports(), Mode.open_loop, SETTINGS, Sensor(CUBIC, 0.61))[1][
            "joint/2/reference"
        ]
    ).all()


def test_velocity_has_no_phase_lag():
    """Of a 5 Hz motion, quantised by the encoder: amplitude within 1 %, phase within 0.2 ms, noise
    some tenths of mm/s."""
    t = np.arange(0, 2, 0.002)
    counts = np.round(80e3 * 0.01 * np.sin(2 * np.pi * 5 * t)) / 80e3
    found = velocity(t, counts)
    true = 0.01 * 2 * np.pi * 5 * np.cos(2 * np.pi * 5 * t)
    inner = slice(50, -50)
    basis = np.stack([np.cos(2 * np.pi * 5 * t), np.sin(2 * np.pi * 5 * t)], axis=1)[inner]
    a, b = np.linalg.lstsq(basis, found[inner], rcond=None)[0]
    assert np.hypot(a, b) == pytest.approx(0.314159, rel=0.01)
    assert abs(np.arctan2(b, a)) / (2 * np.pi * 5) < 2e-4
    assert (found - true)[inner].std() < 0.01 * 0.3142


def test_velocity_is_savitzky_and_golays_and_bears_uneven_times():
    random = np.random.default_rng(2)
    t, y = 0.002 * np.arange(200), random.normal(size=200)
    np.testing.assert_allclose(
        velocity(t, y), savgol_filter(y, 21, 3, deriv=1, delta=0.002), rtol=1e-8, atol=1e-8
    )
    uneven = t + 0.001 * random.integers(0, 2, 200)
    cubic = lambda s: 1 + 2 * s - 3 * s**2 + 4 * s**3
    np.testing.assert_allclose(
        velocity(uneven, cubic(uneven)), 2 - 6 * uneven + 12 * uneven**2, rtol=1e-9
    )


def test_the_tip_deflections_uncertainty_is_what_monte_carlo_says():
    """Zero, coefficients, noise and resolution drawn at random; the spread of the results against
    the propagated one."""
    random = np.random.default_rng(1)
    root = np.array([[1e-3, 0, 0, 0], [0, 0.03, 0, 0], [0, -0.02, 0.2, 0], [0, 0.01, 0.1, 1.0]])
    fitted = CUBIC.model_copy(update={"covariance": (root @ root.T).tolist()})
    sensor = Sensor(fitted, 0.609, noise=4e-4, reports=4)
    r = np.array([0.56, 0.59, 0.609, 0.63, 0.66])
    draws = []
    for _ in range(4000):
        c = np.array([CUBIC.c1_m, CUBIC.c2_m, CUBIC.c3_m]) + (root @ random.normal(size=4))[1:]
        flat = lambda: random.uniform(-0.5, 0.5) / 1024
        zero = 0.609 + random.normal(0, 4e-4 / 2) + flat()
        x = r + random.normal(0, 4e-4, len(r)) + [flat() for _ in r] - zero
        draws.append(c[0] * x + c[1] * x**2 + c[2] * x**3)
    np.testing.assert_allclose(np.std(draws, axis=0), sensor.tip_std(r), rtol=0.06)


@pytest.mark.parametrize("late", [0.0, 0.0007, 0.0123, -0.004])
def test_a_known_delay_is_found_below_a_sample(late):
    t = np.arange(0, 3, 0.002)
    course = lambda at: np.sin(2 * np.pi * 1.1 * at) + 0.4 * np.sin(2 * np.pi * 3.7 * at)
    found = estimate_delay(t, course(t), 0.2 + 1.7 * course(t - late))
    assert found.seconds == pytest.approx(late, abs=2e-6) and found.correlation > 0.999999


def test_a_delays_standard_deviation_is_that_of_many_trials():
    """White noise, and noise that hangs together over 20 samples: the same estimator must not be
    surer than it is."""
    t = np.arange(0, 3, 0.002)
    course = lambda at: np.sin(2 * np.pi * 1.1 * at) + 0.4 * np.sin(2 * np.pi * 3.7 * at)
    for width, least, most in ((1, 0.75, 1.33), (20, 0.6, 1.7)):
        random = np.random.default_rng(width)
        found = []
        for _ in range(60):
            noise = np.convolve(
                random.normal(size=len(t) + width - 1), np.ones(width) / np.sqrt(width), "valid"
            )
            response = course(t - 0.0123) + 0.1 * noise
            response[200:230] = np.nan
            found.append(estimate_delay(t, course(t), response))
        error = np.array([f.seconds for f in found]) - 0.0123
        told = np.sqrt(np.mean([f.std**2 for f in found]))
        assert least < told / error.std() < most
        assert abs(error.mean()) < 3 * error.std() / np.sqrt(60)


def test_no_delay_where_nothing_moves():
    t = np.arange(0, 1, 0.002)
    assert estimate_delay(t, np.zeros(500), np.sin(t)) is None
    assert estimate_delay(t, np.full(500, np.nan), np.sin(t)) is None


@pytest.mark.parametrize("lost", [0, 7])
def test_the_start_is_found_from_the_set_points_also_when_the_first_reports_are_lost(lost):
    carriage, joint = (harmonic(way / 2, 1.0, np.pi, way / 2) for way in (0.02, 0.8))
    knots = setpoints((carriage, joint), 1.0, [a.setpoints for a in board_axes(SETTINGS)])
    course = np.round(planned_setpoints(knots, SETTINGS))
    for start in (1041, 1042):
        ticks = 1000 + 2 * np.arange(200)
        k = ticks - start - 1
        seen = reports(200, 1000, state=np.where(k >= 0, State.running, State.armed))
        for name, column in zip(("setpoint_1", "setpoint_2"), course.T, strict=True):
            seen[name] = np.where(k >= 0, column[np.clip(k, 0, len(course) - 1)], 0)
        first = np.flatnonzero(k >= 0)[0]
        assert start_tick(np.delete(seen, np.arange(first, first + lost)), knots, SETTINGS) == (
            start,
            0.0,
        )


def test_drives_that_hold_for_a_period_leave_half_a_tick():
    knots = drives({"voltage": lambda t: 3.0 * (t > 0.1)}, 0.5)
    course = planned_setpoints(knots, SETTINGS)
    k = 1000 + 2 * np.arange(100) - 1041 - 1
    seen = reports(100, 1000, state=np.where(k >= 0, State.running, State.armed))
    seen["setpoint_1"] = np.where(k >= 0, course[np.clip(k, 0, None), 0], 0)
    found, unsure_s = start_tick(seen, knots, SETTINGS)
    assert abs(found - 1041) <= 0.5 and unsure_s == 0.0005


def test_a_known_calibration_is_recovered_and_its_covariance_is_honest():
    """The firmware's cubic from 15 deflections with noise, 300 times: the scatter is what the
    covariance says."""
    random = np.random.default_rng(3)
    r = np.linspace(0.45, 0.75, 15)
    true = np.array([0.61, -1.85, 3.0, -3.0])
    x = r - true[0]
    w = true[1] * x + true[2] * x**2 + true[3] * x**3
    found = [flex_calibration.fit(r, w + random.normal(0, 5e-4, len(r))) for _ in range(300)]
    values = np.array(
        [[getattr(f.calibration, n) for n in ("zero", "c1_m", "c2_m", "c3_m")] for f in found]
    )
    told = np.mean([np.diag(f.calibration.covariance) for f in found], axis=0)
    np.testing.assert_allclose(values.mean(axis=0), true, atol=4 * np.sqrt(told.max() / 300))
    np.testing.assert_allclose(values.std(axis=0), np.sqrt(told), rtol=0.15)
    assert np.mean([f.residual_m for f in found]) == pytest.approx(5e-4, rel=0.05)


def test_terms_that_the_readings_do_not_tell_are_left_out():
    random = np.random.default_rng(4)
    r = np.linspace(0.59, 0.63, 9)
    found = flex_calibration.fit(r, -1.8 * (r - 0.61) + random.normal(0, 5e-4, 9)).calibration
    assert (
        found.c3_m == 0.0
        and found.covariance[3] == [0.0] * 4
        and found.c1_m == pytest.approx(-1.8, abs=0.1)
    )


def test_a_term_that_the_board_does_not_take_is_left_out():
    r = np.linspace(0.59, 0.63, 9)
    x = r - 0.61
    assert (
        flex_calibration.fit(
            r, -1.8 * x + 900 * x**3 + 1e-7 * np.cos(9 * np.arange(9))
        ).calibration.c3_m
        == 0.0
    )
    with pytest.raises(fx.InputError, match="c1_m = -18"):
        flex_calibration.fit(r, -18 * x)


def test_the_emulated_strip_is_held_and_its_sensor_is_read_through_the_board():
    """Firmware, ADC and fit against the divider's own derivative: c1 = dw/dr at the straight
    strip."""
    made = board()
    made.plant = flex_calibration.DeflectedPlant(made.plant, BENCH)
    found = flex_calibration.fit(
        *flex_calibration.measure(Link(made, sequence=1), flex_calibration.TIPS_M, made.plant.hold)
    )
    made.close()
    true = rig.calibration(BENCH)
    spread = np.sqrt(np.diag(found.calibration.covariance))
    assert abs(found.calibration.c1_m - true.c1_m) < 3 * spread[1] < 0.2
    assert found.residual_m < 1.85 / 1024 and found.calibration.zero == pytest.approx(
        true.zero, abs=1.5 / 1024
    )


@pytest.mark.parametrize("readings", [[0.6] * 9, list(np.linspace(0.5, 0.6, 4))])
def test_readings_that_tell_nothing_are_refused(readings):
    with pytest.raises(fx.InputError, match="deflections = "):
        flex_calibration.fit(np.array(readings), np.linspace(-0.01, 0.01, len(readings)))


def test_the_boards_cubic_and_the_hosts_are_one(tmp_path):
    """A calibration file goes through the rig's configuration and comes back; a wrong one is
    refused by key and value."""
    fitted = flex_calibration.fit(
        np.linspace(0.45, 0.75, 9), np.linspace(0.2, -0.2, 9) + 1e-4 * np.arange(9) ** 2 % 7e-4
    )
    flex_calibration.write(fitted, tmp_path / "calibration.toml")
    assert flex_calibration.read(tmp_path / "calibration.toml") == fitted.calibration
    (tmp_path / "wrong.toml").write_text("zero = 0.6\nc1_m = -1.8\ncovariance = [[1.0]]\n")
    with pytest.raises(fx.InputError, match=r"covariance.*four rows"):
        flex_calibration.read(tmp_path / "wrong.toml")
    assert rig.calibration(BENCH).covariance is None


def test_a_motion_is_led_in_and_out_without_a_jump_and_is_itself_in_between():
    """Position, velocity and acceleration at every join; at rest at both ends; quintics end where
    they were told to."""
    for motion in (
        harmonic(0.3, 1.0, -1.0),
        polynomial(0.1, 0.5, at_s=0.3),
        table([-1.0, 0.4, 2.0], [0.1, 0.3, -0.2]),
    ):
        found = with_lead_in(motion, 1.5, 1.0, 0.7)
        for t in np.linspace(0.0, 1.4999, 200):
            np.testing.assert_allclose(found(1.0 + t), motion(t), rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(found(0.0), 0.0, atol=1e-12)
        np.testing.assert_allclose(found(5.0), [motion(1.5)[0], 0, 0], atol=1e-12)
        for join in (1.0, 2.5):
            np.testing.assert_allclose(found(join - 1e-9), found(join + 1e-9), rtol=1e-6, atol=1e-6)
    row = quintic(2.0, 0.5, (1.0, 2.0, 3.0), (-4.0, 5.0, -6.0))[None]
    np.testing.assert_allclose(evaluate(row, 2.0), (1.0, 2.0, 3.0))
    np.testing.assert_allclose(evaluate(row, 2.5), (-4.0, 5.0, -6.0))
    same = with_lead_in(bang_bang(1.0, 1.0, 0.1), 1.0, 0.0, 0.0)
    assert all(same(t) == bang_bang(1.0, 1.0, 0.1)(t) for t in (0.0, 0.3, 0.5, 0.999))
