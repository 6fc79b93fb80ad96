"""Runs whose channels cannot be those of the robot are refused, before anything is written."""

import numpy as np
import pytest

import flexura as fx
from commands import run as command
from flexlab.runs.of_robot import check_channels

T = np.arange(50) / 100
WRONG = [  # joint 1 of the rig is Pa, joint 2 is R
    ("single-r", "joint/1/position", "m", "joint 1 of the robot turns (R): expected rad"),
    ("single-r", "joint/1/velocity", "m/s", "joint 1 of the robot turns (R): expected rad/s"),
    ("single-r", "joint/1/drive", "N", "joint 1 of the robot turns (R): expected N m"),
    ("rig", "joint/1/position", "rad", "joint 1 of the robot slides (Pa): expected m"),
    ("rig", "joint/2/drive", "N", "joint 2 of the robot turns (R): expected N m"),
    ("single-r", "joint/2/position", "rad", "the robot has 1 joint"),
    ("single-r", "link/2/tip_deflection", "m", "the robot has 1 link"),
    ("rig", "joint/3/voltage", "V", "the robot has 2 joints"),
]


@pytest.mark.parametrize(("robot", "name", "unit", "said"), WRONG)
def test_channels_that_are_not_the_robots_are_refused(robot, name, unit, said, tmp_path):
    rows = "".join(f"{t},{t}\n" for t in T)
    (tmp_path / "log.csv").write_text(f"t [s],{name} [{unit}]\n{rows}")
    run = fx.Run(T, {name: T}, {name: unit}, {"robot": fx.load(robot).to_dict()})
    path = run.save(tmp_path / "run")
    before = sorted(tmp_path.rglob("*"))
    key = f"unit of {name} = {unit!r}" if "expected" in said else f"channel {name}"
    for words, file in (
        (["import", tmp_path / "log.csv", "--robot", robot, "--out", tmp_path / "x"], "log.csv"),
        (["import", tmp_path / "log.csv", "--robot", robot, "--look"], "log.csv"),
        (["identify", robot, path, "--fit", "payload.mass_kg"], path),
        (["identify", path], path),
        (["compare", path, "--robot", robot], path),
        (["compare", path, path, "--out", tmp_path / "x"], path),
        (["animate", path, "--out", tmp_path / "x.gif"], path),
        (["review", path, "--save", tmp_path / "x.rrd"], path),
    ):
        status, out, err = command(words)
        assert (status, out, err.count("\n")) == (2, "", 1), words
        assert f"{file}: {key}: {said}" in err, words
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("robot", ["single-r", "rig"])
def test_channels_of_its_simulation_are_the_robots(robot):
    run = fx.simulate(robot, T, internal_forces=True)
    check_channels(run, fx.load(robot))
