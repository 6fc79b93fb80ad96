"""Signals against their formulas and against finite differences; drives against theirs; manoeuvre
files."""

import importlib
import json
import math
import sys
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

import flexura as fx
from flexura import signals
from flexura.signals import (
    Drive,
    JointDrive,
    bang_bang,
    constant,
    cycloid,
    from_spec,
    harmonic,
    load_manoeuvre,
    piecewise,
    polynomial,
    step,
    table,
    trapezoidal,
)
from flexura.signals.shaping import matched_cycloid, zv, zvd

level = st.floats(-10, 10)
instant = st.floats(0, 2)
duration = st.floats(0.2, 3)


def points(least):
    """Ascending instants and as many values."""
    pairs = st.lists(st.tuples(st.floats(0.2, 1), level), min_size=least, max_size=6)
    return st.builds(
        lambda start, rows: (start + np.cumsum([gap for gap, _ in rows]), [y for _, y in rows]),
        instant,
        pairs,
    )


PLAIN = st.one_of(
    st.builds(constant, level),
    st.builds(harmonic, level, st.floats(0, 2), st.floats(-4, 4), level),
    st.builds(cycloid, level, duration, level, instant),
    st.builds(polynomial, level, duration, level, instant),
    st.builds(
        lambda a, T, part, at: bang_bang(a, T, part * T, at),
        level,
        duration,
        st.floats(0.1, 0.25),
        instant,
    ),
    st.builds(
        lambda end, T, part, start, at: trapezoidal(end, T, part * T, start, at),
        level,
        duration,
        st.floats(0.1, 0.5),
        level,
        instant,
    ),
    st.builds(matched_cycloid, level, st.floats(0.5, 5), st.integers(2, 5), level, instant),
    st.builds(lambda points: table(*points), points(2)),
)
SMOOTH = PLAIN | st.builds(
    lambda shape, s, f, zeta: shape(s, f, zeta),
    st.sampled_from([zv, zvd]),
    PLAIN,
    st.floats(0.5, 5),
    st.floats(0, 0.5),
)
STEPPED = st.one_of(
    st.builds(step, level, instant),
    st.builds(lambda a, T, at: bang_bang(a, T, 0.0, at), level, duration, instant),
    st.builds(lambda points: piecewise(*points), points(1)),
    st.builds(zv, st.builds(step, level, instant), st.floats(0.5, 5)),
)
SIGNALS = st.one_of(SMOOTH, STEPPED)


@settings(max_examples=300, deadline=None)
@given(SIGNALS, st.floats(-1, 6))
def test_the_derivatives_are_those_of_the_values(s, t):
    """Central differences, away from the instants at which a signal isn't smooth."""
    h = 1e-4
    if np.abs(s.breaks - t).min() < 2 * h:
        return
    y, yd, ydd = s(t)
    before, after = s(t - h), s(t + h)
    size = max(
        1.0,
        np.abs(s.segments[:, 1:8]).max(),
        np.abs(s.segments[:, 7] * s.segments[:, 8] ** 4).max(),
    )
    assert yd == pytest.approx((after[0] - before[0]) / (2 * h), abs=1e-6 * size)
    assert ydd == pytest.approx((after[1] - before[1]) / (2 * h), abs=1e-5 * size)
    assert y == pytest.approx((after[0] + before[0]) / 2, abs=1e-6 * size)


@settings(max_examples=200, deadline=None)
@given(SMOOTH)
def test_a_smooth_signal_has_no_jumps(s):
    for t in s.breaks[1:]:
        before, after = s(np.nextafter(t, -np.inf)), s(t)
        assert before[0] == pytest.approx(after[0], abs=1e-9)


@settings(max_examples=200, deadline=None)
@given(level, duration, level, instant, st.sampled_from([cycloid, polynomial]))
def test_a_rise_starts_and_ends_at_rest(end, T, start, at, rise):
    s = rise(end, T, start, at)
    size = max(1.0, abs(end - start) / T**2)
    assert s(at - 1) == (start, 0.0, 0.0)
    np.testing.assert_allclose(s(at), (start, 0, 0), atol=1e-12 * size)
    np.testing.assert_allclose(s(np.nextafter(at + T, 0)), (end, 0, 0), atol=1e-7 * size)
    assert s(at + T)[0] == end and s(at + T + 5) == (end, 0.0, 0.0)
    assert s(at + T / 2)[0] == pytest.approx((start + end) / 2, abs=1e-9)


def test_a_cycloid_equals_its_formula():
    u = np.linspace(0, 1, 50, endpoint=False)
    s = cycloid(3.0, 0.8, 1.0)
    expected = 1 + 2 * (u - np.sin(2 * np.pi * u) / (2 * np.pi))
    np.testing.assert_allclose([s(0.8 * x)[0] for x in u], expected, atol=1e-15, rtol=1e-14)


def test_a_polynomial_equals_its_formula():
    u = np.linspace(0, 1, 50, endpoint=False)
    s = polynomial(3.0, 0.8, 1.0)
    np.testing.assert_allclose(
        [s(0.8 * x)[0] for x in u], 1 + 2 * (10 * u**3 - 15 * u**4 + 6 * u**5), rtol=1e-14
    )


@settings(max_examples=100, deadline=None)
@given(level, st.floats(0, 5), st.floats(-4, 4), level, st.floats(0, 5))
def test_a_harmonic_is_a_cosine(amplitude, f, phase, offset, t):
    w = 2 * np.pi * f
    y, yd, ydd = harmonic(amplitude, f, phase, offset)(t)
    angle = w * t + phase
    assert y == pytest.approx(offset + amplitude * np.cos(angle), abs=1e-12)
    assert yd == pytest.approx(-w * amplitude * np.sin(angle), abs=1e-10)
    assert ydd == pytest.approx(-w * w * amplitude * np.cos(angle), abs=1e-8)


def integral(s, end, order):
    """The first or second integral of a signal from 0 to the end, exact for its polynomials:
    Gauss-Legendre on each piece."""
    places = np.unique(np.clip([0.0, *s.breaks, end], 0.0, end))
    x, w = np.polynomial.legendre.leggauss(6)
    total = 0.0
    for a, b in pairwise(places):
        t = a + (b - a) * (x + 1) / 2
        weight = 1.0 if order == 1 else end - t  # Cauchy's formula for repeated integration
        total += np.sum(w * weight * [s(time)[0] for time in t]) * (b - a) / 2
    return total


@settings(max_examples=100, deadline=None)
@given(st.floats(0.1, 10), duration, st.just(0.0) | st.floats(1e-3, 0.25), instant)
def test_bang_bang_ends_at_rest(a, T, part, at):
    """Its area is zero; a unit mass that it pushes has gone A (T - r)^2/4: rises, r, smooth a
    profile that much shorter."""
    s = bang_bang(a, T, part * T, at)
    assert integral(s, at + T + 1, 1) == pytest.approx(0, abs=1e-12 * a * T)
    assert integral(s, at + T + 1, 2) == pytest.approx(a * T**2 * (1 - part) ** 2 / 4, rel=1e-9)


def test_bang_bang_without_a_rise_goes_a_quarter_of_a_t_squared():
    assert integral(bang_bang(3.0, 0.8), 0.8, 2) == pytest.approx(3.0 * 0.8**2 / 4, rel=1e-14)
    s = bang_bang(3.0, 0.8, at_s=0.5)
    assert [s(t)[0] for t in (0, 0.49, 0.5, 0.89, 0.91, 1.29, 1.3, 9)] == [0, 0, 3, 3, -3, -3, 0, 0]


@settings(max_examples=50, deadline=None)
@given(st.lists(st.floats(0.1, 1), min_size=2, max_size=8), st.data())
def test_a_table_goes_through_its_points_as_the_natural_spline(gaps, data):
    t = np.cumsum(gaps)
    y = data.draw(st.lists(level, min_size=len(t), max_size=len(t)))
    s, spline = table(t, y), CubicSpline(t, y, bc_type="natural")
    np.testing.assert_allclose([s(x)[0] for x in t], y, atol=1e-12)
    for x in np.linspace(t[0], t[-1], 30, endpoint=False):
        np.testing.assert_allclose(s(x), [spline(x, k) for k in range(3)], atol=1e-9)
    assert s(t[0] - 1) == (y[0], 0.0, 0.0) and s(t[-1] + 1) == (y[-1], 0.0, 0.0)


def test_piecewise_and_step_change_at_their_instants():
    s = piecewise([0.1, 0.2, 0.4], [5, -5, 0])
    assert [s(t)[0] for t in (-1, 0.1, 0.19, 0.2, 0.39, 0.4, 9)] == [5, 5, 5, -5, -5, 0, 0]
    assert [step(2.0, 0.5)(t)[0] for t in (-1, 0.0, 0.49, 0.5, 9)] == [0, 0, 0, 2, 2]
    assert step(2.0)(0.0)[0] == 2.0


@settings(max_examples=100, deadline=None)
@given(SIGNALS, st.floats(0.01, 10))
def test_before_its_start_a_signal_holds_its_first_value(s, before):
    first = s.breaks[0]
    if first > -1e9:
        assert s(first - before) == (s(first)[0], 0.0, 0.0)


@settings(max_examples=100, deadline=None)
@given(SIGNALS)
def test_a_signal_survives_its_table_and_json(s):
    again = from_spec(json.loads(json.dumps(s.spec)))
    assert np.array_equal(again.segments, s.segments) and again.spec == s.spec
    assert not s.segments.flags.writeable and np.all(np.diff(s.breaks) >= 0)


def test_a_signal_without_segments_is_zero():
    assert signals.Signal(np.zeros((0, signals.COLUMNS)))(1.0) == (0.0, 0.0, 0.0)


KINDS = ", ".join(signals.KINDS)
nan, inf = math.nan, math.inf
WRONG_SIGNALS = {
    "a number": (3, "signal", 3, "a table with kind"),
    "a list": ([1.0], "signal", [1.0], "a table with kind"),
    "an empty table": ({}, "signal.kind", None, "missing: expected one of constant, step"),
    "an unknown kind": ({"kind": "sine"}, "signal.kind", "sine", f"one of {KINDS}"),
    "a kind that is a list": ({"kind": ["step"]}, "signal.kind", ["step"], "one of"),
    "a kind that is a table": ({"kind": {"a": 1}}, "signal.kind", {"a": 1}, "one of"),
    "an unknown key": (
        {"kind": "constant", "value": 1, "at_s": 1},
        "signal.at_s",
        1,
        "unknown key; known for constant: value",
    ),
    "a missing key": (
        {"kind": "cycloid", "end": 1},
        "signal.duration_s",
        None,
        "missing: expected a finite number",
    ),
    "a text": ({"kind": "constant", "value": "1"}, "signal.value", "1", "a finite number"),
    "a truth value": ({"kind": "constant", "value": True}, "signal.value", True, "a finite number"),
    "not a number": ({"kind": "constant", "value": nan}, "signal.value", nan, "a finite number"),
    "infinity": ({"kind": "step", "value": inf}, "signal.value", inf, "a finite number"),
    "a whole number beyond all": (
        {"kind": "step", "value": 10**400},
        "signal.value",
        10**400,
        "a finite number",
    ),
    "a list for a number": (
        {"kind": "constant", "value": [1, 2]},
        "signal.value",
        [1, 2],
        "a finite number",
    ),
    "a table for a number": (
        {"kind": "constant", "value": {"a": 1}},
        "signal.value",
        {"a": 1},
        "a finite number",
    ),
    "a number for a list": (
        {"kind": "table", "t_s": 1, "y": [1]},
        "signal.t_s",
        1,
        "a list of finite numbers",
    ),
    "a list with a text": (
        {"kind": "table", "t_s": [0, 1], "y": [1, "2"]},
        "signal.y",
        [1, "2"],
        "a list of finite numbers",
    ),
    "a table of one point": (
        {"kind": "table", "t_s": [0], "y": [1]},
        "signal.t_s",
        [0.0],
        "at least two ascending times",
    ),
    "times that go back": (
        {"kind": "table", "t_s": [0, 2, 1], "y": [1, 2, 3]},
        "signal.t_s",
        [0.0, 2.0, 1.0],
        "ascending",
    ),
    "times given twice": (
        {"kind": "table", "t_s": [0, 1, 1], "y": [1, 2, 3]},
        "signal.t_s",
        [0.0, 1.0, 1.0],
        "ascending",
    ),
    "too few values": (
        {"kind": "table", "t_s": [0, 1], "y": [1]},
        "signal.y",
        [1],
        "2 finite values, one a time",
    ),
    "no instants": (
        {"kind": "piecewise", "at_s": [], "value": []},
        "signal.at_s",
        [],
        "at least one",
    ),
    "instants that go back": (
        {"kind": "piecewise", "at_s": [1, 0], "value": [1, 2]},
        "signal.at_s",
        [1.0, 0.0],
        "ascending",
    ),
    "no duration": (
        {"kind": "cycloid", "end": 1, "duration_s": 0},
        "signal.duration_s",
        0,
        "above 0 in seconds",
    ),
    "a negative duration": (
        {"kind": "polynomial", "end": 1, "duration_s": -1},
        "signal.duration_s",
        -1,
        "above 0 in seconds",
    ),
    "a rise beyond a quarter": (
        {"kind": "bang_bang", "amplitude": 1, "duration_s": 1, "rise_s": 0.3},
        "signal.rise_s",
        0.3,
        "between 0 and a quarter",
    ),
    "a negative rise": (
        {"kind": "bang_bang", "amplitude": 1, "duration_s": 1, "rise_s": -0.1},
        "signal.rise_s",
        -0.1,
        "between 0 and a quarter",
    ),
    "a duration too short to differentiate": (
        {"kind": "polynomial", "end": 1, "duration_s": 1e-200},
        "signal.duration_s",
        1e-200,
        "leaves the derivatives finite",
    ),
    "a duration too long to cube": (
        {"kind": "polynomial", "end": 1, "duration_s": 1e200},
        "signal.duration_s",
        1e200,
        "between -1e12 and 1e12",
    ),
    "a rise beyond half": (
        {"kind": "trapezoidal", "end": 1, "duration_s": 1, "rise_s": 1},
        "signal.rise_s",
        1,
        "at most half",
    ),
    "a number for a signal": (
        {"kind": "zv", "signal": 1, "frequency_Hz": 1},
        "signal.signal",
        1,
        "a table of a signal",
    ),
    "half a period": (
        {"kind": "matched_cycloid", "end": 1, "frequency_Hz": 1, "periods": 2.5},
        "signal.periods",
        2.5,
        "a whole number",
    ),
    "a rise too steep": (
        {"kind": "cycloid", "end": 1e12, "duration_s": 1e-300},
        "signal.kind",
        "cycloid",
        "are finite",
    ),
    "points too far apart": (
        {"kind": "table", "t_s": [0, 1e-200, 1], "y": [0, 1e12, -1e12]},
        "signal.kind",
        "table",
        "derivatives are finite",
    ),
}


@pytest.mark.parametrize("spec, key, value, words", WRONG_SIGNALS.values(), ids=WRONG_SIGNALS)
def test_a_wrong_signal_is_named(spec, key, value, words):
    with pytest.raises(fx.InputError) as caught:
        from_spec(spec)
    assert (caught.value.key, repr(caught.value.value)) == (
        key,
        repr(value),
    ) and words in caught.value.expected
    assert str(caught.value).isprintable()


KEYS = (
    "kind value at_s end duration_s start rise_s amplitude t_s y signal frequency_Hz periods "
    "damping_ratio"
).split()
scalars = st.one_of(st.floats(), st.integers(), st.booleans(), st.text(max_size=3), st.none())


@settings(max_examples=300, deadline=None)
@given(
    st.dictionaries(
        st.sampled_from(KEYS),
        scalars
        | st.lists(scalars, max_size=3)
        | st.sampled_from([1.0, 0.1, {"kind": "constant", "value": 1.0}]),
    ),
    st.sampled_from(sorted(signals.KINDS)),
)
def test_any_table_is_a_signal_or_refused(spec, kind):
    for tried in (spec, spec | {"kind": kind}):
        try:
            s = from_spec(tried)
        except fx.InputError as error:
            assert str(error).isprintable()
        else:
            assert np.isfinite(s.segments).all() and np.isfinite(s(0.0)[0])


# --- drives


def test_a_drive_is_its_formula():
    """tau = f(t) + kp (r - eta) + kd (dr/dt - d eta/dt)."""
    f, r = harmonic(2.0, 1.5, 0.3), polynomial(1.0, 0.7, 0.2)
    drive = Drive(
        (
            JointDrive(f, r, 30.0, 4.0),
            JointDrive(force=f),
            JointDrive(motion=r, kp=7.0),
            JointDrive(),
        )
    )
    eta, speed, t = np.array([0.1, 0.2, 0.3, 0.4]), np.array([1.0, 2.0, 3.0, 4.0]), 0.4
    expected = [
        f(t)[0] + 30 * (r(t)[0] - 0.1) + 4 * (r(t)[1] - 1.0),
        f(t)[0],
        7 * (r(t)[0] - 0.3),
        0.0,
    ]
    np.testing.assert_allclose(drive(t, eta, speed), expected, rtol=1e-15)
    assert not Drive.none(3)(t, eta, speed).any()
    np.testing.assert_array_equal(Drive.force(f, None)(t, eta, speed), [f(t)[0], 0.0])
    np.testing.assert_allclose(
        Drive.pd([r], [7.0], [0.5])(t, eta, speed), [7 * (r(t)[0] - 0.1) + 0.5 * (r(t)[1] - 1.0)]
    )


def test_the_breaks_of_a_drive_are_sorted_and_each_there_once():
    drive = Drive(
        (
            JointDrive(bang_bang(1.0, 1.0)),
            JointDrive(step(1.0, 0.3), cycloid(1.0, 0.7)),
            JointDrive(),
        )
    )
    assert drive.breaks.tolist() == [-1e300, 0.0, 0.3, 0.5, 0.7, 1.0]
    assert Drive.none(2).breaks.shape == (0,)


def test_gains_and_motions_come_in_equal_numbers():
    with pytest.raises(fx.InputError, match=r"^kp = \[1.0, 2.0\]"):
        Drive.pd([constant(1.0)], [1.0, 2.0], [1.0])


joint_drives = st.builds(
    JointDrive, st.none() | SIGNALS, st.none() | SIGNALS, st.floats(0, 100), st.floats(0, 100)
)


@pytest.fixture(scope="module")
def system():
    """Three joints with elastic unknowns between them: the joints' rows aren't 0, 1, 2."""
    link = {
        "length_m": 0.3,
        "elements": 1,
        "mass_per_length_kg_m": 0.1,
        "bending_stiffness_N_m2": 1.0,
        "joint": {"type": "R"},
    }
    return fx.assemble(fx.Robot.from_dict({"link": [link] * 3}))


def test_the_core_evaluates_a_packed_drive_alike(system):
    """The forces of a run of one instant are those of the drive called in Python."""
    rows = system.joint_rows
    assert rows.tolist() == [0, 3, 6]

    @settings(max_examples=100, deadline=None)
    @given(
        st.tuples(*[joint_drives.filter(lambda joint: not joint.has_unfollowed_motion)] * 3),
        st.floats(-1, 6),
        st.integers(0, 2**32 - 1),
    )
    def alike(joints, t, seed):
        drive = Drive(joints)
        q, v = np.random.default_rng(seed).normal(size=(2, system.n))
        run = fx.simulate(system, [t], drive, q, v)
        force = np.array([run[f"joint/{i}/drive"][0] for i in (1, 2, 3)])
        np.testing.assert_allclose(force, drive(t, q[rows], v[rows]), rtol=1e-12, atol=1e-10)

    alike()


@settings(max_examples=100, deadline=None)
@given(st.lists(joint_drives, min_size=1, max_size=4))
def test_a_packed_drive_holds_every_segment_once_and_says_where(joints):
    segments, ranges, gains = Drive(tuple(joints)).packed()
    assert (
        segments.flags.c_contiguous
        and ranges.shape == (len(joints), 4)
        and gains.shape == (len(joints), 2)
    )
    count = 0
    for joint, (f0, f1, r0, r1), (kp, kd) in zip(joints, ranges, gains):
        for s, first, last in ((joint.force, f0, f1), (joint.motion, r0, r1)):
            assert last - first == (0 if s is None else len(s.segments))
            assert s is None or np.array_equal(segments[first:last], s.segments)
            count += last - first
        assert (kp, kd) == ((joint.kp, joint.kd) if joint.motion is not None else (0.0, 0.0))
    assert count == len(segments)


# --- manoeuvre files

GOOD = """
name = "back and forth"
duration_s = 2.0
output_step_s = 0.01

[[joint]]
force = { kind = "bang_bang", amplitude = 1.0, duration_s = 1.0 }

[[joint]]
motion = { kind = "cycloid", end = 1.0, duration_s = 0.5 }
kp = 6.0
kd = 0.25
"""


def test_a_manoeuvre_is_read(tmp_path):
    path = tmp_path / "manoeuvre.toml"
    path.write_text(GOOD)
    manoeuvre = load_manoeuvre(path, 2)
    assert (manoeuvre.name, manoeuvre.duration_s, manoeuvre.output_step_s) == (
        "back and forth",
        2.0,
        0.01,
    )
    assert len(manoeuvre.t) == 201 and manoeuvre.t[0] == 0.0 and manoeuvre.t[-1] == 2.0
    assert manoeuvre.drive.joints[1].kp == 6.0 and manoeuvre.drive.joints[0].motion is None
    assert manoeuvre.drive.breaks.tolist() == [0.0, 0.5, 1.0]
    again = json.loads(json.dumps(manoeuvre.spec()))
    assert again["joint"][1]["motion"] == {
        "kind": "cycloid",
        "end": 1.0,
        "duration_s": 0.5,
        "start": 0.0,
        "at_s": 0.0,
    }
    assert again["joint"][0] == {"force": manoeuvre.drive.joints[0].force.spec}


def test_a_prescribed_joint_is_read_and_written(tmp_path):
    path = tmp_path / "manoeuvre.toml"
    path.write_text(GOOD.replace("kp = 6.0\nkd = 0.25", "prescribed = true"))
    drive = load_manoeuvre(path, 2).drive
    assert drive.follows.tolist() == [False, True] and drive.joints[1].spec() == {
        "motion": cycloid(1.0, 0.5).spec,
        "prescribed": True,
    }


def test_the_output_step_is_a_200th_of_the_duration_unless_given(tmp_path):
    path = tmp_path / "manoeuvre.toml"
    path.write_text("duration_s = 3\n[[joint]]\n")
    assert len(load_manoeuvre(path, 1).t) == 201 and load_manoeuvre(path, 1).name == ""


F = 'force = { kind = "bang_bang", amplitude = 1.0, duration_s = 1.0 }'
M = 'motion = { kind = "cycloid", end = 1.0, duration_s = 0.5 }'
WRONG_MANOEUVRES = {
    "no duration": (
        "duration_s = 2.0\n",
        "",
        "duration_s: missing: expected a duration above 0 in seconds",
    ),
    "a duration of 0": (
        "duration_s = 2.0",
        "duration_s = 0.0",
        "duration_s = 0.0: expected a duration above 0",
    ),
    "a negative duration": (
        "duration_s = 2.0",
        "duration_s = -2",
        "duration_s = -2: expected a duration above 0",
    ),
    "an endless duration": (
        "duration_s = 2.0",
        "duration_s = inf",
        "duration_s = inf: expected a duration above 0",
    ),
    "a duration that is no number": (
        "duration_s = 2.0",
        "duration_s = nan",
        "duration_s = nan: expected a duration above 0",
    ),
    "a duration as text": (
        "duration_s = 2.0",
        'duration_s = "2"',
        "duration_s = '2': expected a duration above 0",
    ),
    "a duration as a truth value": (
        "duration_s = 2.0",
        "duration_s = true",
        "duration_s = True: expected a duration above 0",
    ),
    "a duration as a list": (
        "duration_s = 2.0",
        "duration_s = [2]",
        "duration_s = [2]: expected a duration above 0",
    ),
    "a duration beyond all numbers": (
        "duration_s = 2.0",
        f"duration_s = {10**400}",
        "duration_s = 1000",
    ),
    "a step longer than the duration": (
        "output_step_s = 0.01",
        "output_step_s = 3.0",
        "= 3.0: expected at most the duration",
    ),
    "a step of 0": (
        "output_step_s = 0.01",
        "output_step_s = 0",
        "output_step_s = 0: expected a time above 0",
    ),
    "a step too short": (
        "output_step_s = 0.01",
        "output_step_s = 1e-9",
        "_s = 1e-09: expected at most 10 million",
    ),
    "an unknown key": (
        "name =",
        "title =",
        "title = 'back and forth': an unknown key; known here: name, duration_s",
    ),
    "a number as name": (
        'name = "back and forth"',
        "name = 5",
        "name = 5: expected one line of at most 200",
    ),
    "a joint too few": ("[[joint]]\n" + F, "", "joint = 1: expected 2 tables [[joint]]"),
    "a joint too many": (
        "[[joint]]\n" + F,
        "[[joint]]\n[[joint]]\n",
        "joint = 3: expected 2 tables [[joint]]",
    ),
    "no joints": (GOOD[GOOD.index("[[joint]]") :], "", "joint = 0: expected 2 tables [[joint]]"),
    "joints as a number": (
        GOOD[GOOD.index("[[joint]]") :],
        "joint = 2",
        "joint = 2: expected 2 tables [[joint]]",
    ),
    "joints as numbers": (
        GOOD[GOOD.index("[[joint]]") :],
        "joint = [1, 2]",
        "joint[1] = 1: expected a table",
    ),
    "joints as one table": (
        GOOD[GOOD.index("[[joint]]") :],
        "[joint]\nkp = 1.0",
        "expected 2 tables [[joint]]",
    ),
    "an unknown key of a joint": (
        "kd = 0.25",
        "ki = 0.25",
        "joint[2].ki = 0.25: an unknown key; known here: force, motion",
    ),
    "a gain where the motion is prescribed": (
        "kd = 0.25",
        "prescribed = true",
        "joint[2].kp = 6.0: expected none: a prescribed",
    ),
    "prescribed by a number": (
        "kp = 6.0\nkd = 0.25",
        "prescribed = 1",
        "joint[2].prescribed = 1: expected true or false",
    ),
    "prescribed without a motion": (
        M + "\nkp = 6.0\nkd = 0.25",
        "prescribed = true",
        "joint[2].motion: missing: a prescribed",
    ),
    "prescribed with a jump": (
        M + "\nkp = 6.0\nkd = 0.25",
        'prescribed = true\nmotion = { kind = "step", value = 1.0, at_s = 0.5 }',
        "jump",
    ),
    "a negative gain": (
        "kp = 6.0",
        "kp = -6.0",
        "joint[2].kp = -6.0: expected a gain of 0 or more",
    ),
    "a gain as text": (
        "kd = 0.25",
        'kd = "0.25"',
        "joint[2].kd = '0.25': expected a gain of 0 or more",
    ),
    "an endless gain": ("kd = 0.25", "kd = inf", "joint[2].kd = inf: expected a gain of 0 or more"),
    "gains without a motion": (
        M,
        "",
        "joint[2].motion: missing: gains kp and kd need a motion to follow",
    ),
    "a force as a number": (F, "force = 1.0", "joint[1].force = 1.0: expected a table with kind"),
    "a force without a kind": (
        F,
        "force = { value = 1.0 }",
        "joint[1].force.kind: missing: expected one of constant",
    ),
    "an unknown kind": (
        '"cycloid"',
        '"cyclode"',
        "joint[2].motion.kind = 'cyclode': expected one of constant",
    ),
    "an unknown key of a signal": (
        "end = 1.0",
        "to = 1.0",
        "joint[2].motion.to = 1.0: an unknown key; known for cycloid: end",
    ),
    "a key of a signal missing": (
        "end = 1.0, ",
        "",
        "joint[2].motion.end: missing: expected a finite number",
    ),
    "a signal's duration of 0": (
        "duration_s = 0.5",
        "duration_s = 0",
        "joint[2].motion.duration_s = 0: expected a duration",
    ),
    "a signal's number as text": (
        "amplitude = 1.0",
        'amplitude = "1"',
        "joint[1].force.amplitude = '1': expected a finite",
    ),
    "a signal's list for a number": (
        "amplitude = 1.0",
        "amplitude = [1]",
        "joint[1].force.amplitude = [1]: expected a finite",
    ),
    "no TOML": ("[[joint]]\n" + F, "[[joint", "not valid TOML"),
    "a date for a number": (
        "end = 1.0",
        "end = 1979-05-27",
        "joint[2].motion.end = datetime.date(1979, 5, 27): ",
    ),
}


@pytest.mark.parametrize("old, new, words", WRONG_MANOEUVRES.values(), ids=WRONG_MANOEUVRES)
def test_a_wrong_manoeuvre_is_named_with_its_key(tmp_path, old, new, words):
    assert old in GOOD
    path = tmp_path / "manoeuvre.toml"
    path.write_text(GOOD.replace(old, new, 1))
    with pytest.raises(fx.InputError) as caught:
        load_manoeuvre(path, 2)
    text = str(caught.value)
    assert text.isprintable() and text.startswith(f"{path}: ") and words in text


def test_a_manoeuvre_that_is_no_file_is_named(tmp_path):
    for place, words in ((tmp_path, "a directory"), (tmp_path / "absent.toml", "no such file")):
        with pytest.raises(fx.InputError, match=words) as caught:
            load_manoeuvre(place, 2)
        assert str(place) in str(caught.value)


@settings(max_examples=150, deadline=None)
@given(
    st.lists(
        st.tuples(st.integers(0, len(GOOD)), st.integers(0, 12), st.binary(max_size=4)),
        min_size=1,
        max_size=3,
    )
)
def test_bytes_changed_anywhere_never_raise_anything_else(tmp_path_factory, edits):
    raw = GOOD.encode()
    for place, length, new in edits:
        raw = raw[:place] + new + raw[place + length :]
    path = tmp_path_factory.getbasetemp() / "manoeuvre-bytes.toml"
    path.write_bytes(raw)
    try:
        load_manoeuvre(path, 2)
    except fx.InputError as error:
        assert str(error).isprintable() and str(path) in str(error)


@pytest.mark.parametrize(("old", "new"), [("signal", "signals"), ("shaping", "signals.shaping")])
def test_an_old_name_is_answered_with_the_new_one(old, new):
    sys.modules.pop(f"flexura.{old}", None)
    with pytest.warns(DeprecationWarning, match=f"flexura.{old} is now flexura.{new}"):
        module = importlib.import_module(f"flexura.{old}")
    assert module.zv is signals.zv if old == "shaping" else module.cycloid is signals.cycloid
