"""The format of files, and keys of 0.1 beside those with a unit."""

import copy
import json
import logging
import tomllib
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import tomli_w

import flexura as fx
from flexura.io import FORMAT
from flexura.robot import key_of, renamed

ROOT = Path(__file__).resolve().parents[3]
TURNING = {
    "start": ("start_rad", 0.3),
    "limits": ("limits_rad", [-1.0, 1.0]),
    "rotor_inertia": ("rotor_inertia_kg_m2", 1e-4),
    "viscous_friction": ("viscous_friction_N_m_s_rad", 0.2),
    "coulomb_friction": ("coulomb_friction_N_m", 0.1),
}
SLIDING = {
    "start": ("start_m", 0.03),
    "limits": ("limits_m", [-1.0, 1.0]),
    "rotor_inertia": ("rotor_mass_kg", 0.4),
    "viscous_friction": ("viscous_friction_N_s_m", 2.0),
    "coulomb_friction": ("coulomb_friction_N", 1.5),
}
KINDS = [("R", TURNING), ("Pa", SLIDING)]


def tables(type, joint):
    link = {"length_m": 0.1, "mass_kg": 1.0, "inertia_kg_m2": 1e-3, "joint": {"type": type}}
    link["joint"] |= joint
    return {"link": [link]}


@pytest.mark.parametrize(("type", "keys"), KINDS)
def test_keys_without_a_unit_are_read_as_those_with_one(type, keys):
    old = fx.Robot.from_dict(tables(type, {key: value for key, (_, value) in keys.items()}))
    new = fx.Robot.from_dict(tables(type, dict(keys.values())))
    assert old == new
    joint = new.links[0].joint
    for key, (name, value) in keys.items():
        assert key_of(key, type) == joint.key(key) == name
        assert np.all(np.array(getattr(joint, key)) == np.array(value))
        assert new.to_dict()["link"][0]["joint"][name] == value
    assert not set(keys) & set(old.to_dict()["link"][0]["joint"])


def test_a_Pb_slides():
    data = tables("Pb", {"start": 0.05})
    assert fx.Robot.from_dict(data).links[0].joint.start_m == 0.05


def test_an_old_key_is_said_once_a_file_and_can_be_silenced(tmp_path, caplog):
    path = tmp_path / "old.toml"
    path.write_text(tomli_w.dumps(tables("R", {"start": 0.3, "limits": [-1.0, 1.0]})))
    with caplog.at_level(logging.WARNING, logger="flexura"):
        fx.load(path)
    (record,) = caplog.records
    text = record.getMessage()
    assert record.name == "flexura" and "\n" not in text
    assert text.startswith(f"{path}: ") and "link[1].joint.start is start_rad" in text
    assert "limits is limits_rad" in text and f"flexura migrate {path}" in text
    caplog.clear()
    with caplog.at_level(logging.ERROR, logger="flexura"):
        fx.load(path)
    assert not caplog.records


def test_what_is_read_is_left_as_it_is():
    data = tables("R", {"start": 0.3})
    before = copy.deepcopy(data)
    fx.Robot.from_dict(data)
    assert data == before
    assert renamed(data)[0]["link"][0]["joint"] == {"type": "R", "start_rad": 0.3}


@pytest.mark.parametrize(("type", "keys"), KINDS)
def test_replacing_takes_either_name(type, keys, caplog):
    robot = fx.Robot.from_dict(tables(type, {}))
    for key, (name, value) in keys.items():
        by_old = robot.replace({f"link.1.joint.{key}": value})
        assert by_old == robot.replace({f"link.1.joint.{name}": value}) != robot
    assert not caplog.records


@pytest.mark.parametrize(
    ("type", "joint", "key", "words"),
    [
        ("R", {"start_m": 0.3}, "start_m", "none: a joint R has start_rad"),
        ("Pa", {"limits_rad": [0.0, 1.0]}, "limits_rad", "none: a joint Pa has limits_m"),
        ("R", {"start": 0.3, "start_rad": 0.3}, "start", "an unknown key"),
        ("R", {"limits": [1.0, -1.0]}, "limits_rad", "the lower limit first"),
        ("Pb", {"start": 0.2}, "start_m", "the free length at the start, between 0 and 0.1 m"),
        ("R", {"coulomb_friction": -1.0}, "coulomb_friction_N_m", "in N m, 0 or between"),
    ],
)
def test_a_wrong_key_of_a_joint_is_named(type, joint, key, words):
    with pytest.raises(fx.InputError) as caught:
        fx.Robot.from_dict(tables(type, joint), file="a.toml")
    assert caught.value.key == f"link[1].joint.{key}" and words in caught.value.expected


def test_shipped_robots_have_keys_with_units():
    for path in sorted((ROOT / "model" / "robots").glob("*.toml")):
        assert renamed(tomllib.loads(path.read_text(encoding="utf-8")))[1] == [], path.name


@pytest.mark.parametrize("value", [FORMAT + 1, 0, "1", True, 1.0])
def test_a_format_that_is_not_known_is_refused(tmp_path, value):
    data = {"format": value, "colour": "red"} | tables("R", {})
    with pytest.raises(fx.InputError) as caught:
        fx.Robot.from_dict(data, file="a.toml")
    assert caught.value.key == "format" and caught.value.value == value
    assert ("pip install --upgrade flexura" in str(caught.value)) is (value == FORMAT + 1)
    path = tmp_path / "law.toml"
    path.write_text(tomli_w.dumps({"format": value, "duration_s": 1.0, "joint": [{}]}))
    with pytest.raises(fx.InputError) as caught:
        fx.load_manoeuvre(path, 1)
    assert (caught.value.key, caught.value.file) == ("format", str(path))


def test_the_present_format_is_read_and_written(tmp_path):
    robot = fx.Robot.from_dict({"format": FORMAT} | tables("R", {}))
    assert robot == fx.Robot.from_dict(tables("R", {}))
    fx.save(robot, tmp_path / "a.toml")
    assert tomllib.loads((tmp_path / "a.toml").read_text())["format"] == FORMAT
    assert fx.load(tmp_path / "a.toml") == robot


def test_a_run_says_its_format_and_a_newer_one_is_refused(tmp_path):
    run = fx.Run(np.array([0.0, 1.0]), {}, {}, {"source": "simulation"})
    path = run.save(tmp_path)
    table = pq.read_table(path)
    assert table.schema.metadata[b"format"] == str(FORMAT).encode()
    assert fx.Run.read(tmp_path).meta == run.meta
    about = {"flexura": json.dumps(run.meta)}
    pq.write_table(table.replace_schema_metadata(about | {"format": str(FORMAT + 1)}), path)
    with pytest.raises(fx.InputError, match="a newer flexura wrote this file"):
        fx.Run.read(tmp_path)
    pq.write_table(table.replace_schema_metadata(about), path)  # of 0.1: no format
    assert fx.Run.read(tmp_path).meta == run.meta
