"""Slips of the first day: files in the wrong place, a word that is nearly right, a number alone."""

import shlex

import pytest

import flexura as fx
from commands import run

RR = """
[[link]]
length_m = 0.4
elements = 2
mass_per_length_kg_m = 0.2
bending_stiffness_N_m2 = 3.0
[link.joint]
type = "R"
hub_inertia_kg_m2 = 0.001
"""
PUSH = """
name = "push"
duration_s = 0.1
output_step_s = 0.01
[[joint]]
force = 0.01
"""


@pytest.fixture
def files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.toml").write_text(RR)
    (tmp_path / "push.toml").write_text(PUSH)
    return tmp_path


@pytest.mark.parametrize(
    "line, words",
    [
        ("simulate push.toml arm.toml", "push.toml: a manoeuvre file: expected a robot file"),
        ("simulate arm.toml arm.toml", "arm.toml: a robot file: expected a manoeuvre file"),
        ("tune arm.toml push.toml", "--controller: missing: expected ROBOT, MANOEUVRE and"),
        ("identify runs arm.toml --fit payload.mass_kg", "RUN = 'arm.toml': expected runs here"),
        ("frequencies ''", "flexura: frequencies: an empty argument: expected a file"),
        ("simulate arm.toml --out ''", "flexura: --out: an empty argument: expected a file"),
        (
            "tune arm.toml push.toml --controller rig --free kp_9=1:2",
            "free.kp_9 = 'kp_9': expected a setting of a gains file; did you mean kp_9_V_m or",
        ),
        ("frequencis arm.toml", "No such command 'frequencis'. Did you mean 'frequencies'?"),
    ],
)
def test_a_slip_is_answered_with_what_was_meant(files, line, words):
    before = sorted(path.name for path in files.iterdir())
    done = run(shlex.split(line))
    status, _, error = done
    assert status == 2 and words in " ".join(error.split())
    assert sorted(path.name for path in files.iterdir()) == before


def test_a_number_is_a_signal_in_a_file_as_it_is_in_python(files):
    asked = fx.load_manoeuvre("push.toml", 1)
    assert asked.drive.joints[0].force(0.05) == (0.01, 0.0, 0.0)
    assert asked.drive.spec() == [{"force": {"kind": "constant", "value": 0.01}}]


def test_a_rigid_motion_under_gravity_has_the_frequency_zero():
    """A carriage on a level rail, with an arm that hangs from it."""
    hanging = fx.Robot.from_dict(
        {
            "gravity_m_s2": [0.0, -9.81],
            "link": [
                {
                    "length_m": 0.1,
                    "elements": 0,
                    "mass_kg": 0.6,
                    "joint": {"type": "Pa"},
                },
                {
                    "length_m": 0.4,
                    "elements": 4,
                    "mass_per_length_kg_m": 0.4,
                    "bending_stiffness_N_m2": 3.0,
                    "joint": {"type": "R", "start_rad": -1.5708, "hub_inertia_kg_m2": 1e-5},
                },
            ],
        }
    )
    found = fx.frequencies(hanging, joints="free")
    assert found[0] == 0.0 and 0.5 < found[1] < 2.0


def test_a_rigid_robot_is_not_told_of_meshes(files):
    bare = RR.replace("elements = 2", "elements = 0").split("mass_per")[0] + "mass_kg = 0.1\n"
    (files / "bar.toml").write_text(bare + RR[RR.index("[link.joint]") :])
    said = {name: run(["frequencies", name]) for name in ("arm.toml", "bar.toml")}
    assert [said[name][0] for name in said] == [0, 0]
    assert "more elements" in said["arm.toml"][1] and "mesh" not in said["bar.toml"][1]
