"""`flexura new`, `robots` and `migrate`, and what the command itself takes: --version, --quiet,
--verbose."""

import functools
import json
import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner

import flexura as fx
import processes
from flexlab.cli.app import app
from flexura.io import shipped_files

ROOT = Path(__file__).resolve().parents[3]
OLD = """\
# an arm on a rail
name = "start = 1"                   # limits = no key
[[link]]
length_m = 0.1
mass_kg = 1.0
inertia_kg_m2 = 1.0e-3
[link.joint]
type = "Pa"
start = 0.05                         # where it begins
limits=[-0.1, 0.2]
"rotor_inertia" = 0.1

[[link]]
length_m = 0.2
mass_kg = 0.5
inertia_kg_m2 = 1.0e-3
joint = { type = "R", start = 0.3, viscous_friction = 0.01 }    # start here
"""
NEW = """\
# an arm on a rail
name = "start = 1"                   # limits = no key
[[link]]
length_m = 0.1
mass_kg = 1.0
inertia_kg_m2 = 1.0e-3
[link.joint]
type = "Pa"
start_m = 0.05                       # where it begins
limits_m=[-0.1, 0.2]
"rotor_mass_kg" = 0.1

[[link]]
length_m = 0.2
mass_kg = 0.5
inertia_kg_m2 = 1.0e-3
joint = { type = "R", start_rad = 0.3, viscous_friction_N_m_s_rad = 0.01 } # start here
"""


flexura = functools.partial(processes.flexura, columns=80, timeout=120)


# --- migrate


def test_migrate_renames_keys_and_leaves_comments_and_layout(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text(OLD)
    before = fx.load(path)
    done = flexura("migrate", path, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert path.read_text() == NEW and fx.load(path) == before
    assert f"{path}: link[1].joint.start is now start_m\n" in done.stdout
    again = flexura("migrate", path, "--check", cwd=tmp_path)
    assert again.returncode == 0 and again.stdout == f"{path}: nothing to rename\n"
    assert path.read_text() == NEW and [p.name for p in tmp_path.iterdir()] == ["arm.toml"]


def test_migrate_with_check_writes_nothing_and_has_status_1(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text(OLD)
    done = flexura("migrate", path, "--check", "--json", cwd=tmp_path)
    assert done.returncode == 1 and path.read_text() == OLD
    told = json.loads(done.stdout)[str(path)]
    assert {"key": "link[2].joint.start", "new": "start_rad"} in told and len(told) == 5


def test_migrate_keeps_line_ends_and_a_mark_at_the_beginning(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_bytes(b"\xef\xbb\xbf" + OLD.replace("\n", "\r\n").encode())
    assert flexura("migrate", path, cwd=tmp_path).returncode == 0
    assert path.read_bytes() == b"\xef\xbb\xbf" + NEW.replace("\n", "\r\n").encode()


def test_migrate_keeps_links_and_permissions(tmp_path):
    path, link = tmp_path / "arm.toml", tmp_path / "link.toml"
    path.write_text(OLD)
    path.chmod(0o600)
    link.symlink_to(path)
    assert flexura("migrate", link, cwd=tmp_path).returncode == 0
    assert link.is_symlink() and path.read_text() == NEW
    assert path.stat().st_mode & 0o777 == 0o600


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (OLD.replace("start = 0.05", "start = 0.5"), "limits that contain the start"),
        (OLD.replace("start = 0.05", "start = 0.05\nstart_m = 0.0"), "an unknown key"),
        ("format = 99\n" + OLD, "a newer flexura wrote this file"),
        ("[[link", "not valid TOML"),
        (
            'link = [{ length_m = 0.1, mass_kg = 1.0, joint = { type = "R", start = 0.1 } }]',
            "rename by hand: link[1].joint.start to start_rad",
        ),
    ],
)
def test_migrate_writes_all_files_or_none(tmp_path, text, words):
    good, bad = tmp_path / "good.toml", tmp_path / "bad.toml"
    good.write_text(OLD)
    bad.write_text(text)
    done = flexura("migrate", good, bad, cwd=tmp_path)
    assert done.returncode == 2 and done.stderr.startswith(f"flexura: {bad}: ")
    assert words in done.stderr and done.stderr.count("\n") == 1
    assert (good.read_text(), bad.read_text()) == (OLD, text)


def test_migrate_takes_files_of_the_other_kinds(tmp_path):
    files = [
        ROOT / "firmware" / "rig.toml",
        ROOT / "model" / "manoeuvres" / "rig-step.toml",
        ROOT / "model" / "controllers" / "rig.toml",
    ]
    done = flexura("migrate", "--check", *files, cwd=tmp_path)
    assert done.returncode == 0 and done.stdout.count("nothing to rename") == 3


# --- new


def test_new_writes_a_robot_that_runs_and_refuses_to_overwrite(tmp_path):
    done = flexura("new", "my-arm.toml", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    path = tmp_path / "my-arm.toml"
    robot = fx.load(path)
    assert robot.name == "my-arm" and len(robot.links) == 2
    assert {link.flexible for link in robot.links} == {True, False}
    assert len(fx.frequencies(robot, joints="free")) > 2
    path.write_text("mine")
    refused = flexura("new", "my-arm.toml", cwd=tmp_path)
    assert refused.returncode == 2 and "--force" in refused.stderr and path.read_text() == "mine"
    forced = flexura("new", "my-arm.toml", "--force", "--json", cwd=tmp_path)
    assert json.loads(forced.stdout) == {"robot": "my-arm.toml"} and fx.load(path) == robot
    assert flexura("new", "my-arm", cwd=tmp_path).returncode == 2


def test_new_explains_every_common_key(tmp_path):
    text = (ROOT / "analysis" / "flexlab" / "cli" / "new_robot.toml").read_text()
    link, joint = fx.Robot.model_fields, fx.load("rig").links[0].joint
    keys = [*link, *type(fx.load("rig").links[0]).model_fields, *type(joint).model_fields]
    assert [key for key in keys if key not in text] == []


@pytest.mark.parametrize("stem", ["größe", 'a"b', "a\\b", "x" * 220])
def test_new_takes_any_name_of_a_file(tmp_path, stem):
    path = tmp_path / f"{stem}.toml"
    assert CliRunner().invoke(app, ["new", str(path)]).exit_code == 0
    assert fx.load(path).name == stem[:200]


# --- robots


def test_robots_lists_all_in_80_columns(tmp_path):
    done = flexura("robots", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert max(map(len, done.stdout.splitlines())) <= 80
    assert all(name in done.stdout for name in shipped_files("robots"))
    rows = {
        row["name"]: row for row in json.loads(flexura("robots", "--json", cwd=tmp_path).stdout)
    }
    assert set(rows) == set(shipped_files("robots"))
    rig = rows["rig"]
    assert (rig["structure"], rig["links"]) == ("PaR", 2)
    assert rig["unknowns"] == fx.assemble(fx.load("rig")).n
    assert rig["first_frequency_Hz"] == fx.frequencies(fx.load("rig"), joints="locked")[0]


# --- the command itself


def test_names_in_place_of_files(tmp_path):
    done = flexura(
        "simulate", "rig", "rig-step", "--controller", "rig", "--out", "out", "--json", cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    assert fx.Run.read(tmp_path / "out").meta["manoeuvre"] == fx.load_manoeuvre("rig-step", 2).name
    wrong = flexura("frequencies", "rigg", cwd=tmp_path)
    assert wrong.returncode == 2 and "did you mean rig" in wrong.stderr


def test_version(tmp_path):
    done = flexura("--version", cwd=tmp_path)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert (done.returncode, done.stdout) == (0, f"flexura {fx.__version__}\n")
    assert project["version"] == fx.__version__


def test_quiet_and_verbose(tmp_path):
    (tmp_path / "arm.toml").write_text(OLD)
    plain = flexura("simulate", "arm.toml", "--out", "a", cwd=tmp_path)
    assert "keys of 0.1" in plain.stderr and "stored" in plain.stdout
    quiet = flexura("--quiet", "simulate", "arm.toml", "--out", "b", cwd=tmp_path)
    assert (
        quiet.stderr == "" and "stored" not in quiet.stdout and "joint/1/position" in quiet.stdout
    )
    verbose = flexura("--verbose", "frequencies", "rig", cwd=tmp_path)
    assert "robot file" in verbose.stderr and "rig.toml" in verbose.stderr
    both = flexura("--quiet", "--verbose", "robots", cwd=tmp_path)
    assert both.returncode == 2 and "not both" in both.stderr
