"""Drives against their formula, and as the core takes them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import flexura as fx
from flexura.signals import (
    Drive,
    JointDrive,
    bang_bang,
    constant,
    cycloid,
    harmonic,
    polynomial,
    step,
)
from signal_strategies import SIGNALS


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
