"""Manoeuvre files: what is read, and what is refused with its key."""

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import flexura as fx
from flexura.signals import (
    cycloid,
    load_manoeuvre,
)

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
EACH = "expected a table [[joint]] for each joint"
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
    "a joint too few": (
        "[[joint]]\n" + F,
        "",
        f"joint = 1: {EACH}",
    ),
    "a joint too many": (
        "[[joint]]\n" + F,
        "[[joint]]\n[[joint]]\n",
        f"joint = 3: {EACH}",
    ),
    "no joints": (
        GOOD[GOOD.index("[[joint]]") :],
        "",
        "joint = 0: expected a table [[joint]] for each joint",
    ),
    "joints as a number": (
        GOOD[GOOD.index("[[joint]]") :],
        "joint = 2",
        f"joint = 2: {EACH}",
    ),
    "joints as numbers": (
        GOOD[GOOD.index("[[joint]]") :],
        "joint = [1, 2]",
        "joint[1] = 1: expected a table",
    ),
    "joints as one table": (
        GOOD[GOOD.index("[[joint]]") :],
        "[joint]\nkp = 1.0",
        EACH,
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
        "joint[2].kp = -6.0: expected a gain from 0 to 1e12",
    ),
    "a gain as text": (
        "kd = 0.25",
        'kd = "0.25"',
        "joint[2].kd = '0.25': expected a gain from 0 to 1e12",
    ),
    "a gain beyond all bounds": (
        "kd = 0.25",
        "kd = 1e300",
        "joint[2].kd = 1e+300: expected a gain from 0 to 1e12",
    ),
    "an endless gain": (
        "kd = 0.25",
        "kd = inf",
        "joint[2].kd = inf: expected a gain from 0 to 1e12",
    ),
    "gains without a motion": (
        M,
        "",
        "joint[2].motion: missing: gains kp and kd need a motion to follow",
    ),
    "a force as a text": (F, "force = '1'", "joint[1].force = '1': expected a number, or a table"),
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
